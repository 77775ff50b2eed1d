"""Counts the real roots of arrays of polynomials, by discs around numeric roots."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.records import Array, Complex, Truth
from tmsopt.roots.discs import Discs
from tmsopt.roots.exact import exact_roots
from tmsopt.roots.numeric import roots, validate_coefficients

Counts = NDArray[np.int_]

_MARGIN = 1.002
"""Factor that covers the rounding of the radii."""


def real_roots(coefficients: ArrayLike, exact: bool = True) -> tuple[Counts, Counts]:
    """Count the negative and the positive real roots, each multiple root once.

    Coefficients have shape (…, n + 1), descending, with a leading one other than 0; both results have shape (…).
    Where the discs around numeric roots touch, as near an exceptional point, exact arithmetic decides from the
    coefficients as stored.

    Args:
        exact: if False, the numeric roots are counted in those rows too, a hundred times faster.

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
    z, doubtful = _enclose(rows)
    real = z.imag == 0
    negative, positive = np.sum(real & (z.real < 0), axis=1), np.sum(real & (z.real > 0), axis=1)
    for k in np.flatnonzero(doubtful) if exact else ():
        real_parts = [r.re for r in exact_roots(rows[k].tolist()) if r.im == 0]
        negative[k], positive[k] = sum(r < 0 for r in real_parts), sum(r > 0 for r in real_parts)
    return negative.reshape(c.shape[:-1]), positive.reshape(c.shape[:-1])


def _enclose(c: Array) -> tuple[Complex, Truth]:
    """Numeric roots of the rows, and the rows whose discs are too wide to count real roots."""
    z = roots(c)
    with np.errstate(all="ignore"):
        discs = Discs(c.T, np.zeros(c.T.shape), z.T)
        radius = _MARGIN * discs.radius
        decided = np.abs(np.where(z.imag == 0, z.real, z.imag)) > radius.T
    return z, ~(np.all(decided, axis=1) & discs.are_disjoint(radius))
