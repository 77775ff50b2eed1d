"""Stability and discriminant from the coefficients alone, with no root computed."""

from collections.abc import Iterator
from typing import Any

import flint
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.algebra.rounding import Bounded
from tmsopt.records import Array
from tmsopt.roots.polynomial import Coefficients, determinant

_SMALL = 4
"""Up to this degree the Liénard–Chipart conditions have few terms; above, Routh's scheme takes fewer operations."""


def hurwitz_minors(coefficients: Coefficients) -> list[Any]:
    """Leading principal minors Δ1 … Δn of the Hurwitz matrix of a polynomial of degree n, any numbers.

    Example:
        >>> tmsopt.roots.hurwitz_minors([1, 2, 3, 4])  # a1, a1 a2 - a0 a3, a3 times that
        [2, 2, 8]

    More: docs/explanation/factors.md
    """
    return [_hurwitz_minor(coefficients, m) for m in range(1, len(coefficients))]


def _hurwitz_minor(coefficients: Coefficients, m: int) -> Any:
    n = len(coefficients) - 1
    match m, list(coefficients):
        case 1, [_, a1, *_]:
            return a1
        case 2, [a0, a1, a2, *more]:
            return a1 * a2 - more[0] * a0 if more else a1 * a2
        case 3, [a0, a1, a2, a3, *more]:  # many are asked for, and each product counts
            minor = a1 * (a2 * a3 - more[0] * a1 if more else a2 * a3) - a3 * (a0 * a3)
            return minor + more[1] * (a0 * a1) if more[1:] else minor

    def entry(i: int, j: int) -> list[Any]:
        k = 2 * (j + 1) - (i + 1)
        return [coefficients[k]] if 0 <= k <= n else [0]

    return determinant([[entry(i, j) for j in range(m)] for i in range(m)])[0]


def lienard_chipart(coefficients: Coefficients) -> list[Any]:
    """The n quantities that are all positive exactly when every root has Re s < 0, given a0 > 0.

    aₙ, aₙ₋₂, … and the Hurwitz minors Δₙ₋₁, Δₙ₋₃, … (Liénard–Chipart). Multiply the polynomial by the sign
    of a0 first.

    Example:
        >>> tmsopt.roots.lienard_chipart([1, 4, 6, 4, 1]), tmsopt.roots.lienard_chipart([1, 4, 6, 4, -1])
        ([1, 6, 64, 4], [-1, 6, 96, 4])

    More: docs/explanation/factors.md
    """
    n = len(coefficients) - 1
    return [coefficients[k] for k in range(n, 0, -2)] + [_hurwitz_minor(coefficients, m) for m in range(n - 1, 0, -2)]


def routh(coefficients: Coefficients) -> list[Any]:
    """First column of Routh's scheme after a0: all positive exactly when every root has Re s < 0, given a0 > 0.

    Numbers that can be divided: floats, arrays, fractions, balls. In fewer operations than `lienard_chipart`, which
    does without division; what follows an entry that is 0 means nothing.

    Example:
        >>> tmsopt.roots.routh([1.0, 2.0, 3.0, 4.0])
        [2.0, 1.0, 4.0]

    More: docs/explanation/factors.md
    """
    return list(_column(coefficients))


def _column(coefficients: Coefficients) -> Iterator[Any]:
    """The same, each entry before anything is divided by it."""
    above, row = list(coefficients[0::2]), list(coefficients[1::2])
    while row:
        yield row[0]
        ratio = above[0] / row[0]
        padded = [*row[1:], None]
        above, row = row, [a if b is None else a - ratio * b for a, b in zip(above[1:], padded, strict=False)]


def is_stable(coefficients: ArrayLike, exact: bool = True) -> NDArray[np.bool_]:
    """Whether all roots have Re s < 0: coefficients of shape (…, n + 1), descending; the answer has shape (…).

    A polynomial with a leading coefficient 0 is not: a root is at infinity.

    Args:
        exact: above degree 4, let exact arithmetic answer, from the coefficients as stored, where rounding could change
            a sign: some 0.1 ms each. Up to degree 4 the signs of the few rounded conditions count.

    Raises:
        ValueError: for fewer than two coefficients.

    Example:
        >>> tmsopt.roots.is_stable([[1, 4, 6, 4, 1], [1, 4, 6, 4, -1]])
        array([ True, False])

    More: docs/explanation/factors.md
    """
    c = np.asarray(coefficients, dtype=float)
    if c.ndim == 0 or c.shape[-1] < 2:
        raise ValueError("is_stable takes two coefficients or more, descending")
    sign = np.sign(c[..., 0])
    if c.shape[-1] - 1 > _SMALL:
        return _by_routh(sign[..., None] * c, exact)
    normalised = [sign * c[..., k] for k in range(c.shape[-1])]
    stable = sign != 0
    for quantity in lienard_chipart(normalised):
        stable = stable & (quantity > 0)
    return np.asarray(stable)


def _by_routh(c: Array, exact: bool) -> NDArray[np.bool_]:
    flat = c.reshape(-1, c.shape[-1])
    stable = np.all(np.isfinite(flat) & (flat > 0), axis=1)
    rows = np.flatnonzero(stable)
    with np.errstate(all="ignore"):
        column = routh([Bounded(x, np.zeros(len(rows))) for x in flat[rows].T])
        value, error = (np.stack([getattr(x, part) for x in column], axis=1) for part in ("value", "error"))
    if not exact:
        error = np.zeros_like(value)
    # An entry after one that is not positive decides nothing, so the first that is not tells.
    first = np.argmin(value > error, axis=1)[:, None]  # or any, where all are
    least, off = (np.take_along_axis(x, first, axis=1)[:, 0] for x in (value, error))
    stable[rows] = least > off
    for k in rows[~(np.abs(least) > off)] if exact else ():
        stable[k] = all(x > 0 for x in _column([flint.fmpq(*a.as_integer_ratio()) for a in flat[k].tolist()]))
    return np.asarray(stable.reshape(c.shape[:-1]))


@np.errstate(over="ignore", invalid="ignore")
def discriminant(coefficients: Coefficients) -> Any:
    """Discriminant of a polynomial of degree 2 or more, any numbers: zero exactly where two roots coincide.

    Of a quartic by its invariants I and J, Δ = (4 I³ − J²)/27; it keeps its sign across the sets 2EP2 and CEP2, where
    a squared factor vanishes. From degree 5 on by the Bézout determinant of p′ and n p − s p′, divided by n^(n−2): no
    division but that, and n 2ⁿ products.

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
        raise ValueError(f"discriminant takes a polynomial of degree 2 or more, not {len(coefficients) - 1}")
    return _bezout_discriminant(coefficients)


def _bezout_discriminant(c: Coefficients) -> Any:
    n = len(c) - 1
    slope = [(n - k) * c[k] for k in range(n)][::-1]  # ascending, as Bézout's matrix has it
    other = [(k + 1) * c[k + 1] for k in range(n)][::-1]

    def entry(i: int, j: int) -> list[Any]:
        terms = [
            slope[i + j + 1 - k] * other[k] - slope[k] * other[i + j + 1 - k]
            for k in range(max(0, i + j + 2 - n), min(i, j) + 1)
        ]
        return [sum(terms[1:], terms[0])]

    size = range(n - 1)
    value = determinant([[entry(i, j) for j in size] for i in size])[0] / n ** (n - 2)
    return value if n % 2 else -value
