"""Number of real roots from the coefficients alone, for arrays of polynomials: by discs about numeric roots."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.records import Array, Truth
from tmsopt.roots.exact import exact_roots
from tmsopt.roots.numeric import roots

Counts = NDArray[np.int_]

_ROOM = 1.001
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
    c = np.asarray(coefficients, dtype=float)
    if c.ndim == 0 or c.shape[-1] < 2 or not np.all(np.isfinite(c)) or np.any(c[..., 0] == 0):
        raise ValueError("real_roots takes finite coefficients, two or more, with a leading one other than 0")
    rows = c.reshape(-1, c.shape[-1])
    z, doubtful = _enclose(rows)
    real = z.imag == 0
    negative, positive = np.sum(real & (z.real < 0), axis=1), np.sum(real & (z.real > 0), axis=1)
    for k in np.flatnonzero(doubtful) if exact else ():
        found = [r.re for r in exact_roots(rows[k].tolist()) if r.im == 0]
        negative[k], positive[k] = sum(r < 0 for r in found), sum(r > 0 for r in found)
    return negative.reshape(c.shape[:-1]), positive.reshape(c.shape[:-1])


def _enclose(c: Array) -> tuple[NDArray[np.complex128], Truth]:
    """Numeric roots of the rows, and where discs that hold the true ones touch one another, 0 or both sides."""
    n = c.shape[1] - 1
    z = roots(c)
    itself = np.eye(n, dtype=bool)
    with np.errstate(all="ignore"):
        value, size = np.zeros_like(z), np.zeros(z.shape)
        for column in c.T:
            value = value * z + column[:, None]
            size = size * np.abs(z) + np.abs(column)[:, None]
        apart = np.abs(z[:, :, None] - z[:, None, :])
        others = np.prod(np.where(itself, np.abs(c[:, :1, None]), apart), axis=2)
        rounding = 8 * n * np.finfo(float).eps * size  # of Horner's rule in complex numbers, with room
        radius = _ROOM * n * (np.abs(value) + rounding) / others
        isolated = np.all(itself | (apart > _ROOM * (radius[:, :, None] + radius[:, None, :])), axis=2)
        decided = np.abs(np.where(z.imag == 0, z.real, z.imag)) > _ROOM * radius
    return z, ~np.all(isolated & decided, axis=1)
