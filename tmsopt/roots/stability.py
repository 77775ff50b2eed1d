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
    """Whether all roots have Re s < 0: coefficients of shape (…, n + 1), descending; the answer has shape (…)."""
    c = np.asarray(coefficients, dtype=float)
    sign = np.sign(c[..., 0])
    normalised = [sign * c[..., k] for k in range(c.shape[-1])]
    stable = sign != 0
    for quantity in lienard_chipart(normalised):
        stable = stable & (quantity > 0)
    return np.asarray(stable)


def discriminant(coefficients: Coefficients) -> Any:
    """Discriminant of a polynomial of degree 2, 3 or 4: zero exactly where two roots coincide.

    By the invariants I and J of the quartic, Δ = (4 I³ − J²)/27. It keeps its sign across the sets 2EP2 and
    CEP2, where a squared factor vanishes.

    Raises:
        ValueError: for another degree.
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
        case other:
            raise ValueError(f"discriminant takes a polynomial of degree 2, 3 or 4, not {len(other) - 1}")
