"""Discs around numeric roots contain the true roots, isolated in ball arithmetic, also near multiple roots."""

from importlib import import_module

import flint
import numpy as np
import pytest

from tmsopt.algebra import Bounded
from tmsopt.roots import exact_roots

enclose_motions = import_module("tmsopt.roots.discs").enclose_motions


def polynomials(degree):
    """Random polynomials, some near an n-fold root, some with roots of very different size."""
    rng = np.random.default_rng(degree)
    near = np.stack([np.poly(-1 - e * rng.uniform(-1, 1, degree)) for e in np.geomspace(1e-3, 1, 60)])
    wide = np.stack([np.poly(-(10.0 ** rng.uniform(-4, 4, degree))) for _ in range(60)])
    return np.concatenate([rng.uniform(-3, 3, (60, degree + 1)), near, wide])


@pytest.mark.parametrize("degree", [2, 3, 4, 5, 8])
@pytest.mark.parametrize("share", [0.0, 1e-13])
def test_the_true_values_are_within_the_errors(degree, share):
    a = polynomials(degree)
    moved = a * (1 + share * np.random.default_rng(0).uniform(-1, 1, a.shape))
    found = enclose_motions([Bounded(c, share * np.abs(c)) for c in a.T], 1e-12)
    for k in np.flatnonzero(found.are_simple).tolist():
        true = exact_roots([flint.fmpq(*float(c).as_integer_ratio()) for c in moved[k]])
        abscissa = max(root.re for root in true)
        ratio = min(-root.re / abs(complex(root.re, root.im)) for root in true)
        assert abs(found.abscissa.value[k] - abscissa) <= found.abscissa.error[k] + 1e-16 * abs(abscissa)
        assert abs(found.damping_ratio.value[k] - ratio) <= found.damping_ratio.error[k] + 1e-15
        assert abs(found.frequency[k] - max(abs(root.im) for root in true)) <= found.scatter[k] * (1 + 1e-12) + 1e-15
    assert found.are_simple[:60].mean() > 0.9


def test_a_multiple_root_is_never_certain():
    for roots in ([-1, -1, -2, -3], [-1, -1, -1, -1], [1j, -1j, 1j, -1j], [0, 0, -1, -2]):
        a = np.poly(roots).real
        assert not enclose_motions([Bounded(np.full(1, c), np.zeros(1)) for c in a], 1e-12).are_simple.any()


@pytest.mark.parametrize("apart", [1e-13, -1e-13])
def test_a_second_root_on_the_rightmost_line_is_never_certain(apart):
    """Rounding decides whether a pair or a real root is rightmost."""
    a = np.poly([-1 + apart, -1 + 2j, -1 - 2j, -3]).real
    assert not enclose_motions([Bounded(np.full(1, c), np.zeros(1)) for c in a], 1e-12).are_simple.any()
    clear = np.poly([-1.1, -1 + 2j, -1 - 2j, -3]).real
    assert enclose_motions([Bounded(np.full(1, c), np.zeros(1)) for c in clear], 1e-12).are_simple.all()
