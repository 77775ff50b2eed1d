"""Stability and discriminant from the coefficients alone, with no root computed."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.roots.polynomial import Coefficients, determinant


def hurwitz_minors(coefficients: Coefficients) -> list[Any]:
    """Leading principal minors Δ1 … Δn of the Hurwitz matrix of a polynomial of degree n, any numbers."""
    return [_hurwitz_minor(coefficients, m) for m in range(1, len(coefficients))]


def _hurwitz_minor(coefficients: Coefficients, m: int) -> Any:
    n = len(coefficients) - 1

    def entry(i: int, j: int) -> list[Any]:
        k = 2 * (j + 1) - (i + 1)
        return [coefficients[k]] if 0 <= k <= n else [0]

    return determinant([[entry(i, j) for j in range(m)] for i in range(m)])[0]


def lienard_chipart(coefficients: Coefficients) -> list[Any]:
    """The n quantities that are all positive exactly when every root has Re s < 0, given a0 > 0.

    aₙ, aₙ₋₂, … and the Hurwitz minors Δₙ₋₁, Δₙ₋₃, … (Liénard–Chipart). Multiply the polynomial by the sign
    of a0 first.
    """
    n = len(coefficients) - 1
    return [coefficients[k] for k in range(n, 0, -2)] + [_hurwitz_minor(coefficients, m) for m in range(n - 1, 0, -2)]


def is_stable(coefficients: ArrayLike) -> NDArray[np.bool_]:
    """Whether all roots have Re s < 0: coefficients of shape (…, n + 1), descending; the answer has shape (…).

    Up to degree 4 by the conditions of Liénard and Chipart, above by the scheme of Routh: for a stable polynomial all
    its numbers are positive and elimination is accurate in each entry (de Boor and Pinkus, 1977, of totally positive
    matrices), and numbers that are all positive are those of a stable polynomial within rounding of each coefficient.
    """
    c = np.asarray(coefficients, dtype=float)
    sign = np.sign(c[..., 0])
    stable = sign != 0
    if c.shape[-1] > _LARGEST + 1:
        return np.asarray(stable & _routh(sign[..., None] * c))
    for quantity in lienard_chipart([sign * c[..., k] for k in range(c.shape[-1])]):
        stable = stable & (quantity > 0)
    return np.asarray(stable)


_LARGEST = 4  # degree up to which minors are as cheap as elimination


def _routh(c: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether the first column of Routh's scheme is positive, with the coefficients themselves."""
    stable = np.asarray(np.all(c > 0, axis=-1))
    above, row = c[..., 0::2], c[..., 1::2]
    with np.errstate(all="ignore"):
        while row.shape[-1]:
            stable = stable & (row[..., 0] > 0)
            ratio = above[..., :1] / row[..., :1]
            width = above.shape[-1] - 1
            longer = np.concatenate([row, np.zeros_like(above[..., :1])], axis=-1)[..., 1 : width + 1]
            above, row = row, above[..., 1:] - ratio * longer
    return stable


def discriminant(coefficients: Coefficients) -> Any:
    """Discriminant of a polynomial of degree 2 or more, any numbers: zero exactly where two roots coincide.

    Of a quartic by its invariants I and J, Δ = (4 I³ − J²)/27; it keeps its sign across the sets 2EP2 and CEP2, where
    a squared factor vanishes. From degree 5 on by the Bézout determinant of p′ and n p − s p′, divided by n^(n−2): no
    division but that, and n 2ⁿ products.

    Raises:
        ValueError: for degree 0 or 1.
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
        case [_, _, _, *_]:
            return _bezout_discriminant(list(coefficients))
        case other:
            raise ValueError(f"discriminant takes a polynomial of degree 2 or more, not {len(other) - 1}")


def _bezout_discriminant(c: list[Any]) -> Any:
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
