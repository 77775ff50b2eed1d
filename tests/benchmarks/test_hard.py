"""The suite of hard problems: its judge and its searches find what closed forms say, and its verdicts what is wrong."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from benchmarks.judges import Designs, exactly
from benchmarks.reports.designs.hard_designs import INFEASIBLE, OPTIMAL, RIGHT, confirmed_value, judged
from benchmarks.rivals import best_known
from benchmarks.suites import HARD_COUNT, Target, hard_family, hard_problem
from tmsopt import Problem, solve
from tmsopt.models import from_coefficients

x = ca.SX.sym("x")

DAMPED = Problem(model=from_coefficients([1, x, 1], name="one damper"), free={"x": (0, 5)}, minimize="abscissa")
"""s² + x s + 1: abscissa −x/2 and damping ratio x/2 up to x = 2, where both roots are −1."""


@pytest.mark.parametrize("index", [0, 1, 16, 20, 24])
def test_a_hard_problem_is_the_same_every_time(index):
    one, other = hard_problem(index), hard_problem(index)
    assert (one.fixed, one.free, one.constraints) == (other.fixed, other.free, other.constraints)
    assert one.model.statement == other.model.statement


def test_a_third_are_machines_half_of_them_without_a_limit_of_the_arm():
    families = [hard_family(i) for i in range(HARD_COUNT)]
    free, limited = (sum(f.endswith(end) for f in families) for end in ("arm free", "arm limited"))
    assert free == limited == 50


def test_the_judge_agrees_with_the_closed_form_beside_and_at_the_double_root():
    at = Designs(DAMPED)
    # simple roots: eigenvalues are good to rounding
    assert at(np.array([[0.5, 1.0, 1.5]])).value == pytest.approx([-0.25, -0.5, -0.75], abs=1e-14)
    assert [e.value for e in exactly(DAMPED, {"x": 2.0})] == [-1.0]
    # 1e-14 beside it the stored design has roots 1e-7 apart, and rounds the double one
    values = [e.value for e in exactly(DAMPED, {"x": 2 + 1e-14})]
    assert values[0] > -1 + 5e-8
    assert values[1] == pytest.approx(-1, abs=1e-13)


def test_the_judge_of_a_stored_design_knows_a_small_value_that_doubles_lose():
    """√((x + 1)² − 1 − 2x) = |x|, and its inverse tangent: 0 in doubles at x = 2e-9."""
    cancelled = "sqrt((x + 1)**2 - 1 - 2*x)"
    problem = replace(DAMPED, minimize=f"atan({cancelled})", constraints={"c": f"{cancelled} <= 1e-9"})
    (found,) = exactly(problem, {"x": 2e-9})
    assert (found.value, found.violation) == pytest.approx((2e-9, 1e-9), rel=1e-9)


@pytest.mark.parametrize(
    ("problem", "best"),
    [
        (DAMPED, -1.0),
        (replace(DAMPED, constraints={"c": "x**2 == 2"}), -math.sqrt(0.5)),
        (replace(DAMPED, minimize="abs(abscissa + 0.3)"), 0.0),
        (replace(DAMPED, constraints={"c": "abs(x - 1.2) <= 1e-5"}), -0.600005),
        (replace(DAMPED, minimize=None, maximize="damping_ratio", constraints={"c": "abscissa >= -0.4"}), 1.0),
    ],
)
def test_the_search_finds_the_optimum_of_a_closed_form(problem, best):
    found = best_known(problem)
    assert found.violation <= 1e-9
    assert found.value == pytest.approx(best, abs=2e-9)  # limits are met to 1e-9


def test_the_search_knows_when_nothing_is_feasible():
    assert not best_known(replace(DAMPED, constraints={"c": "abscissa <= -1.01"})).feasible


@pytest.mark.slow
def test_verdicts_say_what_is_wrong():
    index = next(i for i in range(HARD_COUNT) if hard_family(i) == "unstable")
    known = Target(index, "unstable", math.nan, 1.0, {}, "nobody", 0.0)
    first = judged(index, 1, known)
    assert (first.label, first.better) == (RIGHT, True)
    assert judged(index, 1, replace(known, value=first.value)).label == RIGHT
    sign = hard_problem(index).posed.sign
    assert judged(index, 1, replace(known, value=first.value - sign * 1e-3)).label == OPTIMAL
    assert confirmed_value(DAMPED, {"x": 1.0}, -0.5) == ""
    assert confirmed_value(DAMPED, {"x": 1.0}, -0.6) == "claims -0.6, is -0.5"
    assert confirmed_value(replace(DAMPED, constraints={"c": "x <= 0.5"}), {"x": 1.0}, -0.5).startswith("violates")


@pytest.mark.long
def test_infeasible_is_wrong_where_a_design_is_known():
    index = next(
        i for i in range(HARD_COUNT) if "damping_ratio >= 1.0" in " ".join(hard_problem(i).constraints.values())
    )
    known = Target(index, "infeasible", 0.0, 0.0, {}, "a guess", 0.0)
    assert judged(index, 1, known).label == INFEASIBLE
    assert judged(index, 1, replace(known, value=math.nan)).label == RIGHT


@pytest.mark.slow
def test_ends_of_several_formulations_are_told_apart():
    """Beside a pole a search goes on with a0 as a variable; evolution on eigenvalues found -1.168982558."""
    problem = hard_problem(158, 3)
    design = solve(problem)
    assert design.status == "optimal"
    assert design.value <= -1.168982558
    assert confirmed_value(problem, design.parameters, design.value) == ""
