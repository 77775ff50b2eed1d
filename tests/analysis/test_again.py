"""Limits moved one by one from what all of them share, beside searches of each moved problem for itself."""

import pytest

import tmsopt
from tmsopt import Problem, models
from tmsopt.analysis import move_limit

OSCILLATOR = models.from_coefficients(["1", "2 + x/1000", "2 + y/1000"], name="oscillator")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["realistic", "heavily_damped"])
def test_gains_are_those_of_a_search_of_each_moved_problem(name):
    solution = tmsopt.solve(f"problems/{name}.toml")
    levers = [lever for lever in tmsopt.explain(solution).levers if lever.step]
    assert levers
    for lever in levers:
        again = tmsopt.solve(move_limit(solution.problem.posed, lever.name, lever.step), starts=8)
        assert lever.resolved == pytest.approx(abs(again.value - solution.value), abs=1e-8)
        assert lever.structure == again.structure


def test_what_a_move_lets_in_elsewhere_is_found():
    """At x = 0.7 the limit asks for 0.301 <= 0.3; with 0.002 more of it a far better design may be had there."""
    problem = Problem(
        OSCILLATOR,
        free={"x": (0.0, 1.0), "y": (0.0, 1.0)},
        minimize="y - 3*max(0, 0.1 - abs(x - 0.7)) - 0.1*x",
        constraints={"low": "min(x, 0.6*abs(x - 0.7) + 0.301) <= 0.3"},
    )
    solution = tmsopt.solve(problem)
    assert solution.value == pytest.approx(-0.03, abs=1e-8)
    (lever,) = (lever for lever in tmsopt.explain(solution).levers if lever.name == "low")
    assert lever.step == pytest.approx(0.002, rel=1e-12)
    assert lever.resolved == pytest.approx(0.34, abs=1e-8)  # 0.37 at x = 0.7, y = 0, and 0.03 before
