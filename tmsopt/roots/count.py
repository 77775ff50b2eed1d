"""Number of real roots from the coefficients alone, by Sturm's theorem, for arrays of polynomials."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.algebra.rounding import Bounded, beside, rounded
from tmsopt.records import Array
from tmsopt.roots.exact import exact_roots
from tmsopt.roots.numeric import roots

_ROOM = 1.001
"""For the rounding of the radii themselves."""


Counts = NDArray[np.int_]

_SMALLEST = 1e-290  # scaled coefficients below may have lost digits


def real_roots(coefficients: ArrayLike, exact: bool = True) -> tuple[Counts, Counts]:
    """Numbers of negative and of positive real roots, each multiple root counted once.

    Coefficients of shape (…, n + 1), descending, with a leading one other than 0; both answers have shape (…).
    The rows in which rounding could change a sign of the sequence are decided by discs around numeric roots, and those
    in which discs touch, as beside an exceptional point, in exact arithmetic from the coefficients as stored.

    Args:
        exact: else numeric roots are counted in those, at a hundredth of the time.

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
    scaled = _scaled(rows)
    negative, positive, doubtful = _sturm(scaled)
    left = np.flatnonzero(doubtful & np.all(scaled.error == 0, axis=1))
    if left.size:
        negative[left], positive[left], doubtful[left] = real_counts(scaled.value[left])
    for k in np.flatnonzero(doubtful) if exact else ():
        real = [r.re for r in exact_roots(rows[k].tolist()) if r.im == 0]
        negative[k], positive[k] = sum(r < 0 for r in real), sum(r > 0 for r in real)
    return negative.reshape(c.shape[:-1]), positive.reshape(c.shape[:-1])


def may_be_real(coefficients: Array) -> NDArray[np.bool_]:
    """Where all roots may be real: a sequence of Sturm's that surely turns its sign shows that some are not.

    Args:
        coefficients: shape (rows, n + 1), finite, with leading ones other than 0.

    Example:
        >>> import numpy as np
        >>> tmsopt.roots.may_be_real(np.array([[1.0, 3.0, 2.0], [1.0, 0.0, 1.0]]))  # (s + 1)(s + 2), s² + 1
        array([ True, False])

    More: docs/how_to/charts.md
    """
    c = _scaled(coefficients)
    n = c.value.shape[1] - 1
    power = np.arange(n, 0, -1.0)
    before, here = c, rounded(c.value[:, :-1] * power, c.error[:, :-1] * power)
    sign, left = np.sign(c.value[:, 0]), np.arange(len(c.value))
    with np.errstate(all="ignore"):
        for _ in range(n - 1):
            before, here = here, _next(before, here)
            kept = ~(here.value[:, 0] * sign[left] < -here.error[:, 0])
            before, here, left = before[kept], here[kept], left[kept]
    possible = np.zeros(len(c.value), dtype=bool)
    possible[left] = True
    return possible


def _scaled(c: Array) -> Bounded:
    """In units near the largest term of the Fujiwara bound, a leading one near 1: powers of 2, so without rounding."""
    n = np.arange(c.shape[1])
    _, exponent = np.frexp(c)
    above = np.where(c[:, 1:] != 0, (exponent[:, 1:] - exponent[:, :1]) / n[1:], -np.inf).max(axis=1)
    unit = np.where(np.isfinite(above), np.ceil(above), 0).astype(int)
    value = np.ldexp(c, -exponent[:, :1] - unit[:, None] * n)
    lost = (np.abs(value) < _SMALLEST) & (c != 0)
    return Bounded(value, np.where(lost, np.inf, 0.0))


def _sturm(c: Bounded) -> tuple[Counts, Counts, NDArray[np.bool_]]:
    """Counts by sign changes at −∞, 0 and ∞, and where a sign that they rest on is in doubt."""
    n = c.value.shape[1] - 1
    power = np.arange(n, 0, -1.0)
    chain = [c, rounded(c.value[:, :-1] * power, c.error[:, :-1] * power)]
    with np.errstate(all="ignore"):
        for _ in range(n - 1):
            chain.append(_next(chain[-2], chain[-1]))
    ends = [beside([p[:, end] for p in chain]) for end in (slice(0, 1), slice(-1, None))]
    certain = [np.all(np.abs(end.value) > end.error, axis=1) for end in ends]
    lead, constant = (np.sign(end.value) for end in ends)
    at_minus = lead * (-1.0) ** np.arange(n, -1, -1)
    left, middle, right = (_variations(signs) for signs in (at_minus, constant, lead))
    return left - middle, middle - right, ~(certain[0] & certain[1])


def _next(p: Bounded, q: Bounded) -> Bounded:
    """−(p mod q) for degrees one apart, in units of its largest coefficient."""
    lead = q[:, :1]
    first = p[:, :1] / lead
    rest = p[:, 1:-1] - first * q[:, 1:]
    second = rest[:, :1] / lead
    tail = beside([rest[:, 1:], p[:, -1:]])
    remainder = second * q[:, 1:] - tail
    largest = np.abs(remainder.value).max(axis=1, keepdims=True)
    _, exponent = np.frexp(np.where(np.isfinite(largest) & (largest > 0), largest, 1.0))
    return Bounded(np.ldexp(remainder.value, -exponent), np.ldexp(remainder.error, -exponent))


def _variations(signs: Array) -> Counts:
    """Sign changes along each row, none of which is 0."""
    return np.asarray(np.sum(signs[:, 1:] * signs[:, :-1] < 0, axis=1), dtype=int)


def real_counts(c: Array) -> tuple[NDArray[np.int_], NDArray[np.int_], NDArray[np.bool_]]:
    """Numbers of negative and of positive real roots of the rows, and where discs touch one another, 0 or both sides.

    Rows must have a leading coefficient other than 0 and be finite; a real root counts once where it is in no doubt.
    """
    n = c.shape[1] - 1
    z = roots(c)
    with np.errstate(all="ignore"):
        value, size = np.zeros_like(z), np.zeros(z.shape)
        for column in c.T:
            value = value * z + column[:, None]
            size = size * np.abs(z) + np.abs(column)[:, None]
        apart = z[:, :, None] - z[:, None, :]
        others = np.abs(np.prod(np.where(np.eye(n, dtype=bool), c[:, :1, None], apart), axis=2))
        rounding = 8 * n * np.finfo(float).eps * size  # of Horner's rule in complex numbers, with room
        radius = _ROOM * n * (np.abs(value) + rounding) / others
        distance = np.where(np.eye(n, dtype=bool), np.inf, np.abs(apart))
        isolated = np.all(distance > _ROOM * (radius[:, :, None] + radius[:, None, :]), axis=2)
        real = z.imag == 0
        decided = np.where(real, np.abs(z.real) > _ROOM * radius, np.abs(z.imag) > _ROOM * radius)
        doubtful = ~np.all(isolated & decided, axis=1)
    negative, positive = np.sum(real & (z.real < 0), axis=1), np.sum(real & (z.real > 0), axis=1)
    return np.asarray(negative), np.asarray(positive), doubtful
