"""Whether any design in a box is stable, where that is known by hand: s² + (x − 2) s + 1 is, exactly where x > 2."""

import time
from dataclasses import replace
from importlib import import_module

import casadi as ca
import pytest

from tmsopt import Problem
from tmsopt.global_search import INFEASIBLE, SCIP, Decision, SolverPool, Stability, find_stable_design
from tmsopt.models import from_coefficients

asking = import_module("tmsopt.global_search.stability")

scip = pytest.mark.skipif(not SCIP.is_available, reason="SCIP is not installed")

SECONDS = 10.0  # twenty times what any of these needs
X, Y = ca.SX.sym("x"), ca.SX.sym("y")
DAMPED = (1, X - 2, 1)


def problem(coefficients, free, **asked):
    return Problem(from_coefficients(list(coefficients)), free=free, **{"minimize": "abscissa", **asked}).posed


def find_damped(most, known=None, **asked):
    """A stable design of s² + (x − 2) s + 1 with x up to `most`."""
    return find_stable_design(problem(DAMPED, {"x": (0, most)}, **asked), SECONDS, known_design=known)


@scip
@pytest.mark.parametrize(
    ("coefficients", "free", "asked"),
    [
        (DAMPED, {"x": (0, 1)}, {}),
        (DAMPED, {"x": (0, 3)}, {"constraints": {"most": "x <= 1.9"}}),
        (DAMPED, {"x": (0, 1)}, {"constraints": {"decay": "abscissa <= -0.1"}, "minimize": "x"}),
        ((1, X - Y, 1), {"x": (0, 1.5)}, {"scenarios": {"y": (1.0, 2.0)}}),  # stable at y = 1 alone
        ((1, X, Y, 1), {"x": (0, 2), "y": (0, 2)}, {"constraints": {"hyperbola": "x*y <= 0.9"}}),  # x y > 1
        ((1, X - 2, Y), {"x": (0, 3), "y": (0, 3)}, {"constraints": {"curve": "x**2 + y == 2"}}),  # x ≤ √2
    ],
)
@pytest.mark.slow
def test_boxes_without_a_stable_design(coefficients, free, asked):
    stated = problem(coefficients, free, **asked)
    for known in (None, stated.ordered({n: hi for n, (_, hi) in free.items()})):
        assert find_stable_design(stated, SECONDS, known_design=known).exists is False


@scip
@pytest.mark.parametrize("most", [3.0, 2.001])
def test_a_stable_design_is_found(most):
    """Be it one in a thousand."""
    found = find_damped(most)
    assert found.exists is True
    assert 2 < found.design["x"] <= most


@scip
def test_limits_hold_for_what_is_found():
    found = find_damped(9, constraints={"most": "x**2 <= 5", "rest": "abscissa >= 1"})
    assert found.exists is True
    assert 4 < found.design["x"] ** 2 <= 5 * (1 + 1e-9)  # the recheck's own tolerance


@scip
@pytest.mark.parametrize(
    ("coefficients", "most"),
    [
        ((1, X, 1, 0), 3.0),  # a root at 0 whatever x is
        ((1, 0, X, 0, 1), 3.0),  # p(s) = p(−s)
        (DAMPED, 2.0),  # a pair at ± i at the end of the range
    ],
)
def test_of_designs_on_the_axis_nothing_is_said(coefficients, most):
    """What is refuted is that roots may lie left of the axis or on it, and here they may."""
    began = time.perf_counter()
    assert find_stable_design(problem(coefficients, {"x": (0, most)}), 60.0).exists is None
    assert time.perf_counter() - began < 10  # and no time is spent on it


@scip
def test_a_solver_that_says_no_to_everything_is_not_believed(monkeypatch):
    monkeypatch.setattr(
        SolverPool, "race", lambda self, tasks, tick=None: [Decision(INFEASIBLE, bound=1.0) for _ in tasks]
    )
    assert find_damped(3, {"x": 1.0}) == Stability()


@scip
@pytest.mark.parametrize("when", ["asked", "proved"])
def test_an_interrupt_goes_on(when, monkeypatch):
    """While the question is asked, or while its answer is looked at: the tasks within limits do that."""

    def stop(self, tasks, tick=None):
        if when == "asked" or tasks[0].box:
            raise KeyboardInterrupt
        return [Decision(INFEASIBLE)]

    monkeypatch.setattr(asking, "has_no_stable_design", lambda problem: False)
    monkeypatch.setattr(SolverPool, "race", stop)
    with pytest.raises(KeyboardInterrupt):
        find_damped(1, {"x": 1.0})


@scip
def test_what_scip_cannot_take_is_left_undecided():
    assert find_damped(3, constraints={"huge": "exp(60*x) >= 1e10"}) == Stability()


def test_without_a_global_solver_nothing_is_asked(monkeypatch):
    monkeypatch.setattr(asking, "SOLVER", replace(SCIP, module="no_such_module"))
    monkeypatch.setattr(asking, "SolverPool", None)
    monkeypatch.setattr(asking, "has_no_stable_design", lambda problem: False)
    assert find_stable_design(problem(DAMPED, {"x": (0, 1)}), SECONDS) == Stability()
