"""Stability by coefficients agrees with stability by roots, on a million random designs."""

import numpy as np
import pytest
from helpers.designs import wide_designs
from helpers.oracles import routh_exact

from tmsopt.models import tms
from tmsopt.roots import is_stable, roots

DESIGNS = 1_000_000
CHUNK = 50_000
BOUNDARY = 1e-9
"""Distance of the abscissa from 0, in units of the mean size of the roots, below which a design is not judged."""


def _chunks():
    for seed in range(DESIGNS // CHUNK):
        yield np.stack(tms.coefficients(wide_designs(seed, CHUNK)), axis=-1)


@pytest.mark.slow
def test_both_verdicts_agree_on_a_million_designs():
    """|abscissa| has a density of order 1 at 0, so almost no design of a million falls below 1e-9."""
    count = 0
    for coefficients in _chunks():
        found = roots(coefficients)
        abscissa = found.real.max(axis=-1)
        judged = np.abs(abscissa) > BOUNDARY * np.abs(found).mean(axis=-1)
        different = judged & (is_stable(coefficients) != (abscissa < 0))
        assert not different.any(), coefficients[different]
        count += judged.sum()
    assert count >= DESIGNS - 20


def test_the_verdict_is_that_of_an_exact_routh_table():
    """Exact arithmetic on the coefficients as stored; as many stable designs as unstable ones."""
    coefficients = next(_chunks())
    verdict = is_stable(coefficients)
    chosen = [*np.flatnonzero(verdict)[:500], *np.flatnonzero(~verdict)[:500]]
    assert [routh_exact(coefficients[k]) for k in chosen] == [True] * 500 + [False] * 500
