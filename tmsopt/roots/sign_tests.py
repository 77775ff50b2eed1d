"""Computes functions of the coefficients that change sign where two roots coincide, or where two roots add up to 0.

Above degree 4 these functions are computed from numeric roots, and do not depend on the unit of the roots. Their sign
is the sign of the discriminant ∏ (zⱼ − zₖ)² or of Orlando's product ∏ (zⱼ + zₖ). Their absolute value is the relative
size of the smallest factor, because the size of a product of many factors has no meaning.
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

MAX_CLOSED_FORM_DEGREE = 4
"""Highest degree for which closed forms are used."""


def double_root_test(coefficients: Coefficients) -> Any:
    """A function that changes sign where two real roots coincide, and is 0 where any two roots coincide.

    It is for arrays, and for degree 2 or more. Up to degree 4 it is the discriminant.
    """
    if len(coefficients) - 1 <= MAX_CLOSED_FORM_DEGREE:
        return discriminant(coefficients)
    value, _ = _smallest_factor(coefficients, is_sum=False)
    return value


def opposite_roots_test(coefficients: Coefficients) -> Any:
    """A function that changes sign where two roots add up to 0: an imaginary pair, or opposite real roots.

    It is for arrays, and for degree 2 or more. Up to degree 4 it is the Hurwitz determinant Δₙ₋₁, which has no meaning
    where all of a0, a1, a3 … are 0.
    """
    if len(coefficients) - 1 <= MAX_CLOSED_FORM_DEGREE:
        return hurwitz_minors(coefficients)[-2]
    value, _ = _smallest_factor(coefficients, is_sum=True)
    return value


def weave_test(coefficients: Coefficients) -> Any:
    """`opposite_roots_test` for imaginary pairs only; nan where the two roots whose sum is nearest to 0 are real."""
    n = len(coefficients) - 1
    if n > MAX_CLOSED_FORM_DEGREE:
        value, are_real = _smallest_factor(coefficients, is_sum=True)
        return np.where(are_real, np.nan, value)
    minors = [1, *hurwitz_minors(coefficients)]
    # Where Δₙ₋₁ = 0 the pair is s² + W with W = aₙ Δₙ₋₃ / Δₙ₋₂, by Routh's array.
    third_minor = minors[n - 3] if n > 2 else coefficients[0]
    return np.where(coefficients[-1] * minors[n - 2] * third_minor > 0, minors[n - 1], np.nan)


def nearest_pair_mean(coefficients: Coefficients) -> Array:
    """Mean real part of the two roots nearest to each other. At a double root it is as accurate as the coefficients."""
    if len(coefficients) == 3:
        return np.asarray(-coefficients[1] / 2 / coefficients[0], dtype=float)
    z = roots(np.stack(np.broadcast_arrays(*coefficients), axis=-1))
    pairs = list(combinations(range(z.shape[-1]), 2))
    distances = np.stack([np.abs(z[..., j] - z[..., k]) for j, k in pairs], axis=-1)
    means = np.stack([(z[..., j] + z[..., k]).real / 2 for j, k in pairs], axis=-1)
    return np.asarray(np.take_along_axis(means, distances.argmin(axis=-1)[..., None], axis=-1)[..., 0])


def _smallest_factor(coefficients: Sequence[Any], is_sum: bool) -> tuple[Array, NDArray[np.bool_]]:
    """The relative size of the smallest factor, with the sign of the product, and whether its two roots are real.

    The size is nan if a coefficient is not finite or the leading coefficient is 0.

    Args:
        is_sum: whether the factors are zⱼ + zₖ; else they are (zⱼ − zₖ)².
    """
    c = np.stack(np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in coefficients)), axis=-1)
    is_regular = np.all(np.isfinite(c), axis=-1) & (c[..., 0] != 0)
    z = roots(np.where(is_regular[..., None], c, np.eye(1, c.shape[-1])[0]))
    size = np.abs(z)
    sign, min_factor = np.ones(z.shape[:-1]), np.full(z.shape[:-1], np.inf)
    are_real = np.zeros(z.shape[:-1], dtype=bool)
    for j, k in combinations(range(z.shape[-1]), 2):
        first, second = z[..., j], z[..., k]
        is_real_factor = first.imag == -second.imag  # other factors are in conjugate pairs with a positive product
        value = (first + second).real if is_sum else ((first - second) ** 2).real
        sign = sign * np.where(is_real_factor, np.sign(value), 1.0)
        scale = (size[..., j] + size[..., k] + 1e-300) ** (1 if is_sum else 2)
        factor = np.abs(first + second) / scale if is_sum else np.abs(first - second) ** 2 / scale
        is_smaller = factor < min_factor
        min_factor = np.where(is_smaller, factor, min_factor)
        are_real = np.where(is_smaller, (first.imag == 0) & (second.imag == 0), are_real)
    return np.where(is_regular, sign * min_factor, np.nan), are_real
