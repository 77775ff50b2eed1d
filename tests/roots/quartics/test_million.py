"""Stability by coefficients agrees with stability by roots, on a million random designs."""

from collections.abc import Iterator

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


def _chunks() -> Iterator[tuple[dict[str, np.ndarray], np.ndarray]]:
    for seed in range(DESIGNS // CHUNK):
        design = wide_designs(seed, CHUNK)
        yield design, np.stack(tms.coefficients(design), axis=-1)


@pytest.fixture(scope="module")
def verdicts() -> dict[str, np.ndarray]:
    """Per design: both verdicts, the abscissa relative to the mean |root|, the tilt and a0."""
    parts: dict[str, list[np.ndarray]] = {"coefficients": [], "roots": [], "relative": [], "tilt": [], "a0": []}
    for design, coefficients in _chunks():
        found = roots(coefficients)
        abscissa = found.real.max(axis=-1)
        parts["coefficients"].append(is_stable(coefficients))
        parts["roots"].append(abscissa < 0)
        parts["relative"].append(np.abs(abscissa) / np.abs(found).mean(axis=-1))
        parts["tilt"].append(design["lambda_s"])
        parts["a0"].append(coefficients[:, 0])
    return {name: np.concatenate(values) for name, values in parts.items()}


@pytest.mark.slow
def test_both_verdicts_agree_on_a_million_designs(verdicts: dict[str, np.ndarray]) -> None:
    judged = verdicts["relative"] > BOUNDARY
    # |abscissa| has a density of order 1 at 0, so of a million about 1e-3 fall below 1e-9: next to none is left out
    assert judged.sum() >= DESIGNS - 20
    different = judged & (verdicts["coefficients"] != verdicts["roots"])
    assert not different.any(), f"{different.sum()} designs differ, first at {np.flatnonzero(different)[:5]}"


@pytest.mark.slow
def test_every_kind_of_design_is_well_represented(verdicts: dict[str, np.ndarray]) -> None:
    stable, normal = verdicts["roots"], verdicts["tilt"] > 0
    for tilt in (normal, ~normal):
        assert (stable & tilt).sum() > 1000
        assert (~stable & tilt).sum() > 100_000
    # the sign trap: a0 < 0 must be divided out, and stable designs have either sign of it
    assert (stable & (verdicts["a0"] < 0)).sum() > 1000
    assert (stable & (verdicts["a0"] > 0)).sum() > 1000


def test_the_verdict_is_that_of_an_exact_routh_table() -> None:
    """Exact arithmetic on the very doubles; as many stable designs as unstable ones."""
    _, coefficients = next(_chunks())
    verdict = is_stable(coefficients)
    chosen = [*np.flatnonzero(verdict)[:500], *np.flatnonzero(~verdict)[:500]]
    assert [routh_exact(coefficients[k]) for k in chosen] == [True] * 500 + [False] * 500
