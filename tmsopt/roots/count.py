"""Number of real roots from the coefficients alone, by Sturm's theorem, for arrays of polynomials."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.roots.exact import exact_roots

Array = NDArray[np.float64]
Counts = NDArray[np.int_]

_CANCELLED = 1e-9
"""A leading coefficient of a remainder this small, relative to its terms, may be 0: then exact arithmetic decides."""


def real_roots(coefficients: ArrayLike) -> tuple[Counts, Counts]:
    """Numbers of negative and of positive real roots, each multiple root counted once.

    Coefficients of shape (…, n + 1), descending, with a leading one other than 0; both answers have shape (…).
    The rows where the sequence comes near a degenerate one, as beside an exceptional point, are decided in exact
    arithmetic from the coefficients as stored.

    Raises:
        ValueError: for a leading coefficient 0 or coefficients that are not finite.
    """
    c = np.asarray(coefficients, dtype=float)
    if c.ndim == 0 or c.shape[-1] < 2 or not np.all(np.isfinite(c)) or np.any(c[..., 0] == 0):
        raise ValueError("real_roots takes finite coefficients, two or more, with a leading one other than 0")
    rows = c.reshape(-1, c.shape[-1])
    negative, positive, doubtful = _sturm(_scaled(rows))
    for k in np.flatnonzero(doubtful):
        real = [r.re for r in exact_roots(rows[k].tolist()) if r.im == 0]
        negative[k], positive[k] = sum(r < 0 for r in real), sum(r > 0 for r in real)
    return negative.reshape(c.shape[:-1]), positive.reshape(c.shape[:-1])


def _scaled(c: Array) -> Array:
    """Monic, in units of the largest term of the Fujiwara bound, so that no coefficient exceeds 1 by much."""
    monic = c / c[:, :1]
    n = c.shape[1] - 1
    radius = np.max(np.abs(monic[:, 1:]) ** (1 / np.arange(1, n + 1)), axis=1)
    return np.asarray(monic / np.where(radius > 0, radius, 1.0)[:, None] ** np.arange(n + 1))


def _sturm(c: Array) -> tuple[Counts, Counts, NDArray[np.bool_]]:
    """Counts by sign changes at −∞, 0 and ∞, and where they may be wrong: degrees must fall one by one."""
    n = c.shape[1] - 1
    chain = [c, c[:, :-1] * np.arange(n, 0, -1)]
    doubtful = np.zeros(len(c), dtype=bool)
    with np.errstate(all="ignore"):
        for _ in range(n - 1):
            remainder, size = _remainder(chain[-2], chain[-1])
            doubtful |= ~(np.abs(remainder[:, 0]) > _CANCELLED * size)
            unit = np.abs(remainder).max(axis=1, keepdims=True)
            chain.append(-remainder / np.where(unit > 0, unit, 1.0))
    lead = np.sign(np.stack([p[:, 0] for p in chain], axis=1))
    constant = np.sign(np.stack([p[:, -1] for p in chain], axis=1))
    at_minus = lead * (-1.0) ** np.arange(n, -1, -1)
    left, middle, right = (_variations(signs) for signs in (at_minus, constant, lead))
    return left - middle, middle - right, doubtful | (c[:, -1] == 0)


def _remainder(p: Array, q: Array) -> tuple[Array, Array]:
    """p mod q for degrees one apart, and the size of the terms that its leading coefficient is summed from."""
    lead = q[:, :1]
    first = p[:, :1] / lead
    rest = p[:, 1:].copy()
    rest[:, :-1] -= first * q[:, 1:]
    second = rest[:, :1] / lead
    terms = np.abs(p[:, 2:3]) + np.abs(second * q[:, 1:2])
    if q.shape[1] > 2:
        terms = terms + np.abs(first * q[:, 2:3])
    return rest[:, 1:] - second * q[:, 1:], terms[:, 0]


def _variations(signs: Array) -> Counts:
    """Sign changes along each row, zeros skipped."""
    filled = signs.copy()
    for k in range(1, filled.shape[1]):
        filled[:, k] = np.where(filled[:, k] == 0, filled[:, k - 1], filled[:, k])
    return np.asarray(np.sum(filled[:, 1:] * filled[:, :-1] < 0, axis=1), dtype=int)
