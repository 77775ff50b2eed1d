"""Counts the real roots of arrays of polynomials, by discs around numeric roots."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.records import Array, Complex, Truth
from tmsopt.roots.discs import Discs
from tmsopt.roots.exact import exact_roots
from tmsopt.roots.numeric import roots, validate_coefficients

Counts = NDArray[np.int_]

_MARGIN = 1.002
"""The computed radii are multiplied by this factor, because they are rounded."""


def real_roots(coefficients: ArrayLike, exact: bool = True) -> tuple[Counts, Counts]:
    """Count the negative and the positive real roots, each multiple root once.

    The coefficients have shape (…, n + 1) and are descending; the leading one is not 0. Both results have shape (…).
    If the discs around numeric roots touch, for example near an exceptional point, exact arithmetic counts the real
    roots of the polynomial whose coefficients are exactly the given doubles.

    Args:
        exact: if False, the numeric roots are counted even if the discs touch, which is a hundred times faster.

    Raises:
        ValueError: for a leading coefficient 0 or coefficients that are not finite.

    Example:
        >>> negative, positive = tmsopt.roots.real_roots([1, 1, -5, 3])  # (s - 1)² (s + 3)
        >>> int(negative), int(positive)
        (1, 1)

    More: docs/how_to/charts.md
    """
    c = validate_coefficients(coefficients, "real_roots")
    rows = c.reshape(-1, c.shape[-1])
    z, doubtful_rows = _enclose(rows)
    is_real = z.imag == 0
    negative, positive = np.sum(is_real & (z.real < 0), axis=1), np.sum(is_real & (z.real > 0), axis=1)
    for k in np.flatnonzero(doubtful_rows) if exact else ():
        real_parts = [r.re for r in exact_roots(rows[k].tolist()) if r.im == 0]
        negative[k], positive[k] = sum(r < 0 for r in real_parts), sum(r > 0 for r in real_parts)
    return negative.reshape(c.shape[:-1]), positive.reshape(c.shape[:-1])


def _enclose(c: Array) -> tuple[Complex, Truth]:
    """Numeric roots of each row of coefficients, and whether the discs of a row are too wide to count real roots."""
    z = roots(c)
    with np.errstate(all="ignore"):
        discs = Discs(c.T, np.zeros(c.T.shape), z.T)
        radius = _MARGIN * discs.radius
        is_decided = np.abs(np.where(z.imag == 0, z.real, z.imag)) > radius.T
    return z, ~(np.all(is_decided, axis=1) & discs.are_disjoint(radius))
