"""All solutions of a box: those on its ends, and how far a statement of coverage may be trusted."""

import casadi as ca
import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.search import estimate_coverage

x = ca.SX.sym("x")


@pytest.mark.parametrize("seconds", [0, 60], ids=["search", "proof"])
@pytest.mark.parametrize("ends", [(-2.0, 2.0), (-2.0, 5.0), (-5.0, 2.0), (-1.999, 5.0), (-5.0, 1.999)])
def test_a_box_has_the_solutions_on_its_ends_and_none_beyond(ends, seconds):
    """s² + x s + 1 has double roots at x = ±2."""
    problem = tmsopt.Problem(model=from_coefficients([1, x, 1]), free={"x": ends}, locate="EP2")
    found = sorted(s.parameters["x"] for s in tmsopt.solve_all(problem, seconds=seconds).solutions)
    assert found == pytest.approx([at for at in (-2, 2) if ends[0] <= at <= ends[1]], abs=1e-12)


@pytest.mark.parametrize(
    "shares",
    [np.ones(20), np.ones(400), 0.8 ** np.arange(60), 1 / np.arange(1, 400) ** 1.5, np.array([1.0, 0.02, 0.02, 0.02])],
    ids=["20 alike", "400 alike", "each a fifth rarer", "a long tail", "three rare ones"],
)
def test_the_chance_of_another_solution_is_claimed_with_95_percent_confidence(shares):
    """Starts drawn at random, each led to one solution with a known chance: that of those not met is known too."""
    shares = shares / shares.sum()
    rng = np.random.default_rng(0)
    for starts in (50, 100, 200):
        drawn = rng.multinomial(starts, shares, size=2000)
        kept = sum(
            shares[row == 0].sum() <= estimate_coverage(starts, [int(h) for h in row if h], 0).chance for row in drawn
        )
        assert kept >= 0.95 * 2000


@pytest.mark.parametrize("rate", [1e-9, 1e6, 1e12])
def test_all_EP2_of_a_dimer_in_any_unit(rate):
    """k = |g1 − g2|/2 and d = 0 alone: the discriminant (d − i (g1 − g2))² + 4 k² is 0 nowhere else with k > 0."""
    dimer = tmsopt.models.from_hamiltonian([["d - 1j*g1", "k"], ["k", "-1j*g2"]])
    free = {"d": (-5 * rate, 5 * rate), "k": (rate / 10, 5 * rate)}
    every = tmsopt.solve_all(tmsopt.Problem(dimer, fixed={"g1": 3 * rate, "g2": rate}, free=free, locate="EP2"))
    assert every.complete
    assert [s.parameters["k"] / rate for s in every.solutions] == [pytest.approx(1, rel=1e-12)]
