"""The suite of random systems and its judges, and what its failures taught the solver."""

import math

import casadi as ca
import numpy as np
import pytest

from benchmarks.command import SECTIONS
from benchmarks.judges import System, confirmed_system, exact_polynomial, ideals, started_at, values_of
from benchmarks.reports import Asked
from benchmarks.rivals import evolve_system
from benchmarks.suites import known, random_systems
from tmsopt import Problem, models, solve

SUITE = list(random_systems())
KNOWN = known()
SOME = (0, 23, 49, 72, 86)

DAMPED = System(
    index=0,
    kind="one mass",
    matrices={"M": [["m"]], "D": [["d"]], "K": [["k"]]},
    fixed={"m": 1.0, "k": 2.0},
    free={"d": (0.0, 9.0)},
    goal={"minimize": "abscissa"},
)
"""Critically damped at d = 2 √2, with a double root at −√2."""


# The suite


@pytest.mark.parametrize("index", SOME)
def test_judges_and_model_agree_on_the_polynomial(index):
    """Eigenvalues of the state matrix, the exact polynomial of the text, and the model's own coefficients."""
    system = SUITE[index]
    design = {n: 0.4 * lo + 0.6 * hi for n, (lo, hi) in system.free.items()}
    coefficients = np.array([float(c) for c in system.problem.posed.values({**system.fixed, **design}).coefficients])
    polynomial = exact_polynomial(system, design)
    leading = polynomial[polynomial.degree()]
    exact = [polynomial[k] / leading for k in range(system.degree, -1, -1)]
    size = np.abs(np.poly(-np.abs(np.roots(coefficients))))
    assert np.abs(coefficients / coefficients[0] - [int(c.p) / int(c.q) for c in exact]) == pytest.approx(
        0, abs=1e-11 * size.max()
    )
    found, _ = system.judged({n: np.array([x]) for n, x in design.items()})
    assert found["abscissa"][0] == pytest.approx(values_of(next(ideals(system, design)))["abscissa"], abs=1e-9)


@pytest.mark.parametrize("index", range(70, 75))
def test_an_unfolding_has_its_exceptional_point_where_it_was_put(index):
    system = SUITE[index]
    cost = eval(system.goal["minimize"], {}, dict(system.known))
    assert confirmed_system(system, system.known, cost)
    assert KNOWN[index].value <= cost  # the cheapest one costs no more than the one that is known
    moved = {**system.known, "x1": system.known["x1"] + 0.01}
    assert not confirmed_system(system, moved, eval(system.goal["minimize"], {}, moved))


def test_only_the_value_of_the_multiple_root_is_confirmed_system():
    d, best = 2 * math.sqrt(2), -math.sqrt(2)
    told = ((d, best), (d, best - 1e-6), (d * (1 + 1e-6), best), (2.0, -1.0))
    assert [confirmed_system(DAMPED, {"d": at}, value) for at, value in told] == [True, False, False, True]


def test_evolution_finds_the_critical_damping():
    """To the square root of the rounding unit, as eigenvalues of a double root do."""
    found = evolve_system(DAMPED)
    assert found.parameters["d"] == pytest.approx(2 * math.sqrt(2), rel=1e-6)
    assert found.reached(-math.sqrt(2) * (1 - 1e-3)) <= found.seconds
    assert found.reached(-2.0) == math.inf


@pytest.mark.parametrize("index", SOME)
def test_a_kept_value_is_that_of_its_design(index):
    system, one = SUITE[index], KNOWN[index]
    assert confirmed_system(system, one.parameters, one.value)
    assert all(lo <= one.parameters[n] <= hi for n, (lo, hi) in system.free.items())


def test_the_section_runs():
    report = next(s for s in SECTIONS if s.name == "random").report()(Asked("random", quick=True))
    assert "| systems | 3 |" in report
    assert "### By degree" in report
    assert "of 3 (100.0 %)" in report


# Rounding and structures


def steep(slope):
    """s² + 2 d s + 1e-4 with d = slope · x − slope/3 + 0.01: a double root at −0.01, and a coefficient that cancels."""
    x, k = ca.SX.sym("x"), ca.SX.sym("k")
    model = models.from_coefficients([1, 2 * (slope * x - (slope / 3 - 0.01)), k], name="steep")
    return Problem(model, fixed={"k": 1e-4}, free={"x": (0.3, 0.4)}, minimize="abscissa")


def test_a_structure_holds_within_the_last_places_of_the_parameters():
    """One unit in the last place of x moves d by 5e-17 · 1e6, 5e-9 of it: no double of x gives the double root."""
    found = solve(steep(1e6))
    assert found.structure == "EP2"
    assert found.abscissa == pytest.approx(-0.01, rel=1e-8)
    off = found.problem.posed.values(found.parameters).roundings()
    assert off[1] == pytest.approx(2e6 * 2**-53 / 3, rel=0.2)  # of 2 d, x being near 1/3: 5e-9 of it


def test_without_cancellation_rounding_explains_nothing():
    """s² + 2 s + 1 + 1e-9: as far from a double root as it says, whatever the parameters round."""
    d = ca.SX.sym("d")
    problem = Problem(models.from_coefficients([1, d, 1 + 1e-9], name="plain"), fixed={"d": 2.0}, free={})
    values = problem.posed.values(problem.fixed)
    assert values.roundings() == pytest.approx([0.0, 2 * 2**-53, 0.0], abs=1e-20)
    assert values["structure"].name == "pair"


# Starts


def test_a_start_better_than_its_basin_is_not_lost():
    """A lightly damped chain whose best design is in a corner that IPOPT leaves from afar.

    Differential evolution on the eigenvalues finds it too.
    """
    system, one = SUITE[4], KNOWN[4]
    found = solve(started_at(system.problem, one.parameters), starts=1)
    assert found.value == pytest.approx(one.known["evolution"], rel=1e-7)
    assert found.value == pytest.approx(one.value, rel=1e-7)


def test_a_limit_on_the_damping_ratio_below_minus_one_forbids_nothing():
    """s² − 2 a s + a² − 0.04 + c, a = 1 + 10 c: the roots a ± √(0.04 − c) are least at c = 0, where they are real.

    No factor s² + p s + w² with p ≥ −2 w has two different positive roots.
    """
    c = ca.SX.sym("c")
    a = 1 + 10 * c
    model = models.from_coefficients([1, -2 * a, a * a - 0.04 + c], name="unstable")
    for limits in ({}, {"z": "damping_ratio >= -1.1"}):
        problem = Problem(model, free={"c": (0.0, 1.0)}, constraints=limits, minimize="abscissa")
        assert solve(problem).value == pytest.approx(1.2, rel=1e-12)
