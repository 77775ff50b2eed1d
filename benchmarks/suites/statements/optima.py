"""Optima that are beaten, and how sure their starts say they are: narrow basins of three kinds, and closed forms."""

from functools import partial

from benchmarks.suites.narrow_optima import hidden, references
from benchmarks.suites.statements.case import Answer, Case

BEATEN = 1e-6  # relative

_NARROW = (2, 7, 16, 48, 60, 69, 73, 84, 87, 97, 106, 111, 123, 135, 147, 155)
"""Of the suite: gains with a triple root beside zero, plateaus of the damping ratio, wells of exponentials."""

_CLOSED = {  # coefficients, range of x, goal, best value
    "well 0.01 wide beside zero": ('["1", "2 + x*x/4000 + 3*exp(-x*x*10000)", "9"]', (-60.0, 40.0), "abscissa", -2.5),
    "well 0.02 wide off centre": (
        '["1", "1 - x/200 + 4*exp(-2500*(x - 0.31)**2)"]',
        (-40.0, 40.0),
        "abscissa",
        -4.99845,
    ),
    "plateau but for 1 %": ('["1", "2", "1 - 2500*(x - 0.77)**2"]', (-3.0, 3.0), "damping_ratio", 1.0),
    "constant on a plateau": ('["1", "2 + x*x", "-1 - x*x"]', (-3.0, 3.0), "damping_ratio", -1.0),
}
"""s + c is left of the axis by c, s² + b s + 9 by b/2 as long as b < 6, and its damping ratio is 1 where b² = 4c."""


def _judge(answer: Answer, best: float, sign: float) -> str:
    data = answer.data
    value = data["objective"]["value"]
    if data["status"] != "optimal":
        return f"{data['status']}, {value!r}, where {best:.9g} is the best known"
    if sign * (value - best) > BEATEN * max(1e-3, abs(best)):
        return f"optimal at {value:.9g}, beaten by {best:.9g}"
    return ""


def _narrow(index: int) -> Case:
    problem, best = hidden(index), references()[index].value
    judge = partial(_judge, best=best, sign=problem.sign)
    truth = "differential evolution and Nelder-Mead on NumPy's eigenvalues"
    return Case(problem.name, {"problem.toml": problem.text}, ("solve", "problem.toml", "--json"), judge, truth)


def _closed(name: str) -> Case:
    coefficients, (low, high), goal, best = _CLOSED[name]
    sense, sign = ("minimize", 1.0) if goal == "abscissa" else ("maximize", -1.0)
    text = f"""[model]
coefficients = {coefficients}
[parameters]
x = {{ min = {low}, max = {high} }}
[objective]
{sense} = "{goal}"
"""
    judge = partial(_judge, best=best, sign=sign)
    return Case(name, {"problem.toml": text}, ("solve", "problem.toml", "--json"), judge, "closed form")


CASES: tuple[Case, ...] = (*map(_narrow, _NARROW), *map(_closed, _CLOSED))
