"""Number of real roots from the coefficients alone, for arrays of polynomials: by discs about numeric roots."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.records import Array, Complex, Truth
from tmsopt.roots.discs import Discs
from tmsopt.roots.exact import exact_roots
from tmsopt.roots.numeric import regular, roots

Counts = NDArray[np.int_]

_ROOM = 1.002
"""For the rounding of the radii themselves."""


def real_roots(coefficients: ArrayLike, exact: bool = True) -> tuple[Counts, Counts]:
    """Numbers of negative and of positive real roots, each multiple root counted once.

    Coefficients of shape (…, n + 1), descending, with a leading one other than 0; both answers have shape (…).
    Rows in which discs about numeric roots touch, as next to an exceptional point, are decided in exact arithmetic
    from the coefficients as stored.

    Args:
        exact: else the numeric roots of those rows are counted, at a hundredth of the time.

    Raises:
        ValueError: for a leading coefficient 0 or coefficients that are not finite.

    Example:
        >>> negative, positive = tmsopt.roots.real_roots([1, 1, -5, 3])  # (s - 1)² (s + 3)
        >>> int(negative), int(positive)
        (1, 1)

    More: docs/how_to/charts.md
    """
    c = regular(coefficients, "real_roots")
    rows = c.reshape(-1, c.shape[-1])
    z, doubtful = _enclose(rows)
    real = z.imag == 0
    negative, positive = np.sum(real & (z.real < 0), axis=1), np.sum(real & (z.real > 0), axis=1)
    for k in np.flatnonzero(doubtful) if exact else ():
        found = [r.re for r in exact_roots(rows[k].tolist()) if r.im == 0]
        negative[k], positive[k] = sum(r < 0 for r in found), sum(r > 0 for r in found)
    return negative.reshape(c.shape[:-1]), positive.reshape(c.shape[:-1])


def _enclose(c: Array) -> tuple[Complex, Truth]:
    """Numeric roots of the rows, and where discs that hold the true ones touch one another, 0 or both sides."""
    z = roots(c)
    with np.errstate(all="ignore"):
        discs = Discs(c.T, np.zeros(c.T.shape), z.T)
        radius = _ROOM * discs.radius
        decided = np.abs(np.where(z.imag == 0, z.real, z.imag)) > radius.T
    return z, ~(np.all(decided, axis=1) & discs.disjoint(radius))
