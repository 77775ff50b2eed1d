"""Where roots of a polynomial of any degree meet, or two add up to 0: functions that change sign there, scale-free.

Above degree 4 they come from numeric roots. Their sign is that of the discriminant ∏ (zⱼ − zₖ)², or of Orlando's
product ∏ (zⱼ + zₖ); their size is that of its least factor, for the product of many factors says nothing by its size.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Array
from tmsopt.roots.numeric import roots
from tmsopt.roots.polynomial import Coefficients
from tmsopt.roots.stability import discriminant, hurwitz_minors

CLOSED = 4
"""Degree up to which closed forms are used."""


def double_root_test(coefficients: Coefficients) -> Any:
    """A function that changes sign where two real roots meet, and is 0 where any two do; of arrays, degree 2 or more.

    Up to degree 4 it is the discriminant.
    """
    if len(coefficients) - 1 <= CLOSED:
        return discriminant(coefficients)
    return _least(coefficients, sums=False)[0]


def opposite_roots_test(coefficients: Coefficients) -> Any:
    """A function that changes sign where two roots add up to 0, imaginary or opposite; of arrays, degree 2 or more.

    Up to degree 4 it is the Hurwitz determinant Δₙ₋₁, and has no meaning where all of a0, a1, a3 … vanish.
    """
    if len(coefficients) - 1 <= CLOSED:
        return hurwitz_minors(coefficients)[-2]
    return _least(coefficients, sums=True)[0]


def weave_test(coefficients: Coefficients) -> Any:
    """`balance`, and nan where it is two opposite real roots that add up to 0, and not an imaginary pair."""
    n = len(coefficients) - 1
    if n > CLOSED:
        value, real = _least(coefficients, sums=True)
        return np.where(real, np.nan, value)
    minors = [1, *hurwitz_minors(coefficients)]
    # where Δₙ₋₁ = 0 the pair is s² + W, W = aₙ Δₙ₋₃ / Δₙ₋₂ by Routh's array
    below = minors[n - 3] if n > 2 else coefficients[0]
    return np.where(coefficients[-1] * minors[n - 2] * below > 0, minors[n - 1], np.nan)


def nearest_pair_mean(coefficients: Coefficients) -> Array:
    """Mean of the real parts of the two roots nearest to each other: of a double root as exact as its coefficients."""
    if len(coefficients) == 3:
        return np.asarray(-coefficients[1] / 2 / coefficients[0], dtype=float)
    z = roots(np.stack(np.broadcast_arrays(*coefficients), axis=-1))
    pairs = list(combinations(range(z.shape[-1]), 2))
    apart = np.stack([np.abs(z[..., j] - z[..., k]) for j, k in pairs], axis=-1)
    means = np.stack([(z[..., j] + z[..., k]).real / 2 for j, k in pairs], axis=-1)
    return np.asarray(np.take_along_axis(means, apart.argmin(axis=-1)[..., None], axis=-1)[..., 0])


def _least(coefficients: Sequence[Any], sums: bool) -> tuple[Array, NDArray[np.bool_]]:
    """Sign of the product and size of its least factor, and whether that is of two real roots; nan without roots."""
    c = np.stack(np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in coefficients)), axis=-1)
    regular = np.all(np.isfinite(c), axis=-1) & (c[..., 0] != 0)
    z = roots(np.where(regular[..., None], c, np.eye(1, c.shape[-1])[0]))
    size = np.abs(z)
    sign, least, real = np.ones(z.shape[:-1]), np.full(z.shape[:-1], np.inf), np.zeros(z.shape[:-1], dtype=bool)
    for j, k in combinations(range(z.shape[-1]), 2):
        first, second = z[..., j], z[..., k]
        opposite = first.imag == -second.imag  # conjugate or real: else another factor is the conjugate of this one
        value = (first + second).real if sums else ((first - second) ** 2).real
        sign = sign * np.where(opposite, np.sign(value), 1.0)
        scale = (size[..., j] + size[..., k] + 1e-300) ** (1 if sums else 2)
        factor = np.abs(first + second) / scale if sums else np.abs(first - second) ** 2 / scale
        closer = factor < least
        least = np.where(closer, factor, least)
        real = np.where(closer, (first.imag == 0) & (second.imag == 0), real)
    return np.where(regular, sign * least, np.nan), real
