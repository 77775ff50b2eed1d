"""Designs known to be feasible must be admitted by every question whose limit they reach: traps for false proofs."""

import math
from dataclasses import replace

import pytest

from tmsopt import Problem, certify, solve
from tmsopt.algebra import UnsupportedOperation
from tmsopt.global_search import (
    INFEASIBLE,
    SCIP,
    Decision,
    Question,
    SolverPool,
    add_interlacing,
    make_task,
    squared_frequencies,
)
from tmsopt.models import tms

pytestmark = pytest.mark.skipif(not SCIP.is_available, reason="SCIP is not installed")

FIXED = {"Fr": 2.0, "mu": 0.5, "chi_B": 1.3, "chi_H": 1.0, "zeta_B": -0.6, "zeta_H": -0.3, "lambda_s": 0.5}
CAPSIZE = {**FIXED, "chi_H": 1.2, "mu": 5.0}  # a4 < 0 for tan λ_s < 5/3: one root s > 0, so ζ = −1
WEAVE = {**FIXED, "zeta_B": -0.1, "zeta_H": -0.1, "chi_B": 0.5}  # reversed rake: one root s > 2 at any speed below 3


def question(free, constraint, base=FIXED):
    fixed = {name: value for name, value in base.items() if name not in free}
    return Question(Problem(tms, fixed, free, {"c": constraint}, minimize=next(iter(free))).posed)


def verdicts(asked):
    return {SCIP.decide(make_task(asked.program(sign), 5.0)).verdict for sign in asked.possible_signs()}


@pytest.mark.parametrize(
    ("base", "free", "constraint"),
    [
        (FIXED, {"chi_B": (0.5, 2.2)}, "(chi_B - 2)**(-2) >= 99"),  # 1.9
        (FIXED, {"lambda_s": (-0.9, 1.1)}, "nu_H + tan(lambda_s)**2 <= 0.01"),  # 0
        (FIXED, {"mu": (0.0, 1.0)}, "mu**0.25 <= 0.001"),  # 0
        (FIXED, {"mu": (0.0, 1.0)}, "mu**1.5 <= 0"),  # 0
        (FIXED, {"mu": (0.0, 1.0)}, "log(mu) <= -25"),  # 1e-12
        (FIXED, {"mu": (0.0, 2.0)}, "mu**50 <= 1e-14"),  # 1/2
        (FIXED, {"mu": (0.0, 2.0)}, "abs(abs(mu - 1) - 0.5) >= 0.49"),  # 1
        (FIXED, {"mu": (0.0, 2.0)}, "max(mu, 1 - mu, 0.5) <= 0.51"),  # 1/2
        *(
            (CAPSIZE, {"Fr": (0.5, 3.0), "lambda_s": (0.1, 0.5)}, text)  # a root s > 0 has the damping ratio −1
            for text in ("damping_ratio <= 0.3", "damping_ratio >= -1", "abs(damping_ratio) >= 0.5")
        ),
        *(
            (WEAVE, {"Fr": (0.01, 3.0), "lambda_s": (-1.0, -0.9)}, text)  # linear in places, which is no line
            for text in ("min(abscissa, 1.5) <= 2", "1.5 - abs(abscissa - 1.5) <= 1")
        ),
    ],
)
def test_a_condition_that_some_design_meets_is_not_refuted(base, free, constraint):
    assert "found" in verdicts(question(free, constraint, base))


@pytest.mark.parametrize(
    "constraint", ["exp(60*mu) >= 1e10", "mu**20/1e21 >= 1e-9", "(mu - 2)**Fr >= 0.5", "1e-10*mu**6 >= 1e-4"]
)
def test_what_cannot_be_kept_in_numbers_is_refused(constraint):
    free = {"mu": (0.0, 12.0), "Fr": (1.0, 2.0)}
    with pytest.raises(UnsupportedOperation):
        verdicts(question(free, constraint))


def test_the_least_leading_coefficient_of_one_case_bounds_no_roots_of_another():
    fixed = {"mu": 0.5, "Fr": 2.0, "chi_B": 1.3}
    free = {"zeta_H": (-1.0, -0.1), "chi_H": (0.9, 1.1)}
    scenarios = {"lambda_s": (0.1, 1.0), "zeta_B": (-1.0, -0.1)}
    problem = Problem(tms, fixed, free, scenarios=scenarios, minimize="abscissa")
    asked = Question(problem.posed, problem.posed.cases, 50.0)
    loose, tight = (asked.program(1, least) for least in (0.0, 0.1))
    ends = {name: (a, b) for name, a, b in zip(loose.variables, loose.upper, tight.upper, strict=True)}
    assert ends["x1.1"][0] == float("inf")
    assert ends["x1.1"][1] < float("inf")
    assert ends["x1.4"][0] == ends["x1.4"][1]


@pytest.mark.parametrize("degree", [3, 4, 5, 6])
def test_squared_frequencies_of_equal_roots_are_within_their_range(degree):
    """(t + 1)ⁿ has its roots at −R, R = 1, and F and S alternate up to the frequency cot(π/n)."""
    upper = []

    class Rows:
        def add_variable(self, name, lower, most):
            upper.append(most)
            return 0.0

        def add_row(self, *_): ...

    coefficients = [float(math.comb(degree, k)) for k in range(degree + 1)]
    add_interlacing(Rows(), 0, coefficients, 1.0, False)
    assert all(most >= max(squared_frequencies(coefficients)) * (1 - 1e-12) for most in upper)


def test_a_search_that_finds_nothing_anywhere_is_not_believed(monkeypatch):
    """SCIP that says no to every question says no to the one that the known design answers: then no bound, no proof."""
    monkeypatch.setattr(
        SolverPool, "race", lambda self, tasks, tick=None: [Decision(INFEASIBLE, bound=1.0) for _ in tasks]
    )
    asked = Problem(
        model=tms,
        fixed={"chi_H": 1.05, "zeta_H": -0.3, "zeta_B": -0.6, "mu": 0.5, "chi_B": 1.3},
        free={"Fr": (0.5, 4), "lambda_s": (0.05, 1.0)},
        constraints={"distance": "nu_H >= 0.05"},
        minimize="abscissa",
    )
    design = solve(asked)
    assert not certify(design, seconds=2).bound.proven
    lost = replace(design, status="not_converged")
    assert not certify(lost, seconds=2).bound.proven
    assert certify(lost, seconds=2).status == "not_converged"
