"""When a search ends: by the optima that are expected still, from how many starts ended in how many different ones."""

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.problem import expected_unseen, expects_few_better
from tmsopt.search import SearchState, make_failed_end

x = ca.SX.sym("x")
PLAIN = tmsopt.Problem(from_coefficients([1, 2 + x]), free={"x": (0.0, 1.0)}, minimize="x").posed


def settled(ends, share, far_off=False, left=0):
    """Of starts that ended at these objectives, None where at nothing feasible; so many refined designs are left."""
    nlp, start = SimpleNamespace(size=1.0, variables=()), tmsopt.Start({})
    ended = [
        make_failed_end(start, nlp) if e is None else replace(make_failed_end(start, nlp), objective=e, feasible=True)
        for e in ends
    ]
    refined = import_module("tmsopt.search.sample").DesignBatch(np.zeros((left, 1)), np.zeros(left), np.zeros(left))
    box = SimpleNamespace(narrow=share < tmsopt.TUNING.narrow)
    sample = SimpleNamespace(box=box, far_off=far_off, refined=refined, leaders=refined)
    state = SearchState(PLAIN, PLAIN, nlp, sample=sample, ends=tuple(ended))
    return bool(tmsopt.POLICY.enough(state))


@pytest.mark.parametrize(
    ("share", "ends", "enough"),
    [
        (0.5, [1.0], 8),  # w/(n − w − 2) is 1/5 where eight starts ended in one optimum
        (0.5, [1.0, 2.0], 14),
        (0.5, [1.0, 2.0, 3.0], 20),
        (0.01, [1.0], 8),
        (0.5, [None], 8),  # nothing feasible
        (0.5, [1.0, 2.0, *[None] * 20], 18),  # sixteen failed, beside two others
    ],
)
def test_a_search_ends_with_so_many_starts_and_not_before(share, ends, enough):
    tried = (ends * enough)[:enough]
    assert settled(tried, share)
    assert not settled(tried[:-1], share)


def test_designs_left_count_as_optima_of_their_own():
    """Ten starts in one optimum and three designs left: w = 4, n = 13, and 4/7 are expected."""
    assert settled([1.0] * 10, 0.5)
    assert not settled([1.0] * 10, 0.5, left=3)
    assert settled([1.0] * 23, 0.5, left=3)


def test_three_starts_are_enough_where_no_design_of_the_sample_comes_near_the_limits():
    assert settled([None] * 3, 0.0, far_off=True)
    assert not settled([None] * 2, 0.0, far_off=True)


def test_the_estimate_is_that_of_boender_and_rinnooy_kan():
    """Optima in equal basins: the mean number not met is what is estimated from those that were, within its noise.

    The estimate is w (w + 1)/(n − w − 2), the posterior mean for a uniform prior over numbers and shares of basins.
    """
    rng = np.random.default_rng(1)
    truth, estimate = [], []
    for _ in range(4000):
        count = int(rng.integers(1, 30))
        shares = rng.dirichlet(np.ones(count))
        seen = len(np.unique(rng.choice(count, 60, p=shares)))
        truth.append(count - seen)
        estimate.append(expected_unseen(60, seen))
    small = np.array(estimate) < 8  # the prior of the estimate has no end, this one ends at 29
    assert np.mean(np.array(truth)[small]) == pytest.approx(np.mean(np.array(estimate)[small]), rel=0.25)


def test_the_words_follow_from_the_numbers():
    def words(tried, at_best, optima):
        return ", ".join(tmsopt.Starts(tried, tried, at_best, optima=optima, runs=tried).sureness)

    assert words(64, 1, 30) == "found from 1 of 64 starts, a better design is likely"
    assert words(64, 40, 3) == "found from 40 of 64 starts"
    assert words(3, 3, 1) == "found from 3 of 3 starts, a better design is possible"
    assert words(0, 0, 0) == ""
    one_run = tmsopt.Starts(39, 39, 39, optima=1, runs=1)  # the others were only seen to lead there
    assert one_run.sureness == ("found from 39 of 39 starts", "a better design is possible")
    assert not expects_few_better(4, 1)
    assert tmsopt.Starts(3, 3, 3, optima=1).expected_unseen == float("inf")
