"""A problem with one limit moved, and solved again from the optimum."""

from dataclasses import replace

from tmsopt.problem.expression import written_sides
from tmsopt.problem.limit import limit_of, with_limit
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.program.options import DEFAULTS
from tmsopt.search.solve import solve_any_status


def solve_again(solution: Solution, asked: Posed, starts: int, look: bool = True) -> Solution:
    """The solution of a problem with a limit moved, from an optimum of the unmoved one.

    Args:
        look: whether to look at the whole box for designs that are better; else at this optimum alone.
    """
    options = replace(DEFAULTS, starts=starts, near={n: solution.parameters[n] for n in asked.free})
    return solve_any_status(asked, options, without_sample=not look, bound=False)


def moved(problem: Posed, name: str, step: float) -> Posed:
    """The problem with one limit changed by a step: a bound, or the right-hand side of a constraint."""
    if name in problem.constraints:
        text = problem.constraints[name]
        left, sign, right = written_sides(text)
        number = _number(text)
        if number is None:
            text = f"({left}) {sign} ({right}) {'+' if step > 0 else '-'} {abs(step)!r}"
        else:
            text = with_limit(text, number + step)
        return replace(problem.problem, constraints={**problem.constraints, name: text}).posed
    parameter, end = name.rsplit(".", 1)
    lower, upper = problem.free[parameter]
    ends = (lower, upper + step) if end == "max" else (lower + step, upper)
    return replace(problem.problem, free={**problem.free, parameter: ends}).posed


def _number(text: str) -> float | None:
    """The number that is the right-hand side of a constraint, if one is, and none stands left."""
    left, sign, right = written_sides(text)
    return limit_of(f"{right} {sign} x") if limit_of(f"{left} {sign} x") is None else None
