"""Stability and discriminant from the coefficients, without computing a root."""

from collections.abc import Iterator
from typing import Any

import flint
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.algebra.rounding import Bounded
from tmsopt.records import Array
from tmsopt.roots.polynomial import Coefficients, determinant

_MAX_LIENARD_CHIPART_DEGREE = 4
"""Highest degree for which the Liénard–Chipart conditions are used; above it, Routh's scheme takes fewer operations."""


def hurwitz_minors(coefficients: Coefficients) -> list[Any]:
    """Leading principal minors Δ1 … Δn of the Hurwitz matrix of a polynomial of degree n, for numbers of any kind.

    Example:
        >>> tmsopt.roots.hurwitz_minors([1, 2, 3, 4])  # a1, a1 a2 - a0 a3, a3 (a1 a2 - a0 a3)
        [2, 2, 8]

    More: docs/explanation/factors.md
    """
    return [_hurwitz_minor(coefficients, m) for m in range(1, len(coefficients))]


def _hurwitz_minor(coefficients: Coefficients, m: int) -> Any:
    n = len(coefficients) - 1
    match m, list(coefficients):
        case 1, [_, a1, *_]:
            return a1
        case 2, [a0, a1, a2, *higher]:
            return a1 * a2 - higher[0] * a0 if higher else a1 * a2
        case 3, [a0, a1, a2, a3, *higher]:  # this case is frequent, so it has few products
            minor = a1 * (a2 * a3 - higher[0] * a1 if higher else a2 * a3) - a3 * (a0 * a3)
            return minor + higher[1] * (a0 * a1) if higher[1:] else minor

    def entry(i: int, j: int) -> list[Any]:
        k = 2 * (j + 1) - (i + 1)
        return [coefficients[k]] if 0 <= k <= n else [0]

    return determinant([[entry(i, j) for j in range(m)] for i in range(m)])[0]


def lienard_chipart(coefficients: Coefficients) -> list[Any]:
    """The n quantities that are all positive if and only if every root has Re s < 0, given a0 > 0.

    They are aₙ, aₙ₋₂, … and the Hurwitz minors Δₙ₋₁, Δₙ₋₃, … (Liénard–Chipart). If a0 < 0, negate the polynomial first.

    Example:
        >>> tmsopt.roots.lienard_chipart([1, 4, 6, 4, 1]), tmsopt.roots.lienard_chipart([1, 4, 6, 4, -1])
        ([1, 6, 64, 4], [-1, 6, 96, 4])

    More: docs/explanation/factors.md
    """
    n = len(coefficients) - 1
    return [coefficients[k] for k in range(n, 0, -2)] + [_hurwitz_minor(coefficients, m) for m in range(n - 1, 0, -2)]


def routh(coefficients: Coefficients) -> list[Any]:
    """First column of Routh's scheme after a0. If a0 > 0, all are positive exactly if every root has Re s < 0.

    The numbers must allow division: floats, arrays, fractions or balls (intervals with a midpoint and a radius).
    Routh's scheme takes fewer operations than `lienard_chipart`, which needs no division. Entries after an entry 0 have
    no meaning.

    Example:
        >>> tmsopt.roots.routh([1.0, 2.0, 3.0, 4.0])
        [2.0, 1.0, 4.0]

    More: docs/explanation/factors.md
    """
    return list(_iterate_routh(coefficients))


def _iterate_routh(coefficients: Coefficients) -> Iterator[Any]:
    """Yield the entries of `routh` one by one, so that the caller can stop before a division by 0."""
    row_above, row = list(coefficients[0::2]), list(coefficients[1::2])
    while row:
        yield row[0]
        ratio = row_above[0] / row[0]
        padded = [*row[1:], None]
        row_above, row = row, [a if b is None else a - ratio * b for a, b in zip(row_above[1:], padded, strict=False)]


def is_stable(coefficients: ArrayLike, exact: bool = True) -> NDArray[np.bool_]:
    """Whether all roots have Re s < 0: coefficients of shape (…, n + 1), descending; the result has shape (…).

    A polynomial with a leading coefficient 0 has a root at infinity and counts as unstable.

    Args:
        exact: use exact arithmetic if rounding errors could change a sign, which takes about 0.1 ms for a polynomial.
            The given doubles count as exact numbers. The argument has no effect up to degree 4, where the
            Liénard–Chipart conditions in doubles decide.

    Raises:
        ValueError: for fewer than two coefficients.

    Example:
        >>> tmsopt.roots.is_stable([[1, 4, 6, 4, 1], [1, 4, 6, 4, -1]])
        array([ True, False])

    More: docs/explanation/factors.md
    """
    c = np.asarray(coefficients, dtype=float)
    if c.ndim == 0 or c.shape[-1] < 2:
        raise ValueError(f"is_stable needs two or more coefficients, descending; found shape {c.shape}")
    sign = np.sign(c[..., 0])
    if c.shape[-1] - 1 > _MAX_LIENARD_CHIPART_DEGREE:
        return _is_stable_by_routh(sign[..., None] * c, exact)
    normalised = [sign * c[..., k] for k in range(c.shape[-1])]
    stable = sign != 0
    for quantity in lienard_chipart(normalised):
        stable = stable & (quantity > 0)
    return np.asarray(stable)


def _is_stable_by_routh(c: Array, exact: bool) -> NDArray[np.bool_]:
    flat = c.reshape(-1, c.shape[-1])
    stable = np.all(np.isfinite(flat) & (flat > 0), axis=1)
    rows = np.flatnonzero(stable)
    with np.errstate(all="ignore"):
        column = routh([Bounded(x, np.zeros(len(rows))) for x in flat[rows].T])
        value, error = (np.stack([getattr(x, field) for x in column], axis=1) for field in ("value", "error"))
    if not exact:
        error = np.zeros_like(value)
    # The first entry that is not surely positive decides; entries after it have no meaning.
    decisive_index = np.argmin(value > error, axis=1)[:, None]
    decisive_entry, bound = (np.take_along_axis(x, decisive_index, axis=1)[:, 0] for x in (value, error))
    stable[rows] = decisive_entry > bound
    for k in rows[~(np.abs(decisive_entry) > bound)] if exact else ():
        stable[k] = all(x > 0 for x in _iterate_routh([flint.fmpq(*a.as_integer_ratio()) for a in flat[k].tolist()]))
    return np.asarray(stable.reshape(c.shape[:-1]))


@np.errstate(over="ignore", invalid="ignore")
def discriminant(coefficients: Coefficients) -> Any:
    """Discriminant of a polynomial of degree 2 or more, zero if and only if two roots coincide; numbers of any kind.

    For a quartic it is (4 I³ − J²)/27 with the invariants I and J. Near a CEP2 it does not change sign; near a 2EP2 it
    has both signs. From degree 5 it is the Bézout determinant of p′ and n p − s p′, divided by n^(n−2). The determinant
    takes n 2ⁿ products and no division.

    Raises:
        ValueError: for degree 0 or 1.

    Example:
        >>> tmsopt.roots.discriminant([1, 5, 4]), tmsopt.roots.discriminant([1, 4, 4])  # b² - 4 a c
        (9, 0)

    More: docs/explanation/exceptional_points.md
    """
    match list(coefficients):
        case [a, b, c]:
            return b * b - 4 * a * c
        case [a, b, c, d]:
            return b * b * c * c - 4 * a * c * c * c - 4 * b * b * b * d - 27 * a * a * d * d + 18 * a * b * c * d
        case [a, b, c, d, e]:
            i = 12 * a * e - 3 * b * d + c * c
            j = 72 * a * c * e + 9 * b * c * d - 27 * a * d * d - 27 * e * b * b - 2 * c * c * c
            return (4 * i * i * i - j * j) / 27
    if len(coefficients) < 3:
        raise ValueError(f"discriminant needs a polynomial of degree 2 or more; found degree {len(coefficients) - 1}")
    return _bezout_discriminant(coefficients)


def _bezout_discriminant(c: Coefficients) -> Any:
    n = len(c) - 1
    derivative = [(n - k) * c[k] for k in range(n)][::-1]  # p′, ascending, as in Bézout's matrix
    reduced = [(k + 1) * c[k + 1] for k in range(n)][::-1]

    def entry(i: int, j: int) -> list[Any]:
        terms = [
            derivative[i + j + 1 - k] * reduced[k] - derivative[k] * reduced[i + j + 1 - k]
            for k in range(max(0, i + j + 2 - n), min(i, j) + 1)
        ]
        return [sum(terms[1:], terms[0])]

    indices = range(n - 1)
    value = determinant([[entry(i, j) for j in indices] for i in indices])[0] / n ** (n - 2)
    return value if n % 2 else -value
