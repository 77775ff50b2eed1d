"""Elementwise formulas for the signs that decide the class of a quartic."""

from typing import Any

import numpy as np

from tmsopt.roots.quartics.factors import Real, where

_BOUND = 1e-14
"""Upper bound of the rounding error, relative to the sum of |terms|. It covers 45 roundings; no term below has more
than 32."""

_MIN_SIZE = 1e-20
"""For coefficients of at least this size no term underflows; no term is a product of more than 12 coefficients."""

_MAX_SIZE = 1e20
"""For coefficients up to this size no term overflows."""


def as_integer(condition: Any) -> Any:
    """1 where a condition holds, else 0."""
    return condition.view(np.int8)


def is_stable_by_signs(a0: Real, a1: Real, a2: Real, a3: Real, a4: Real) -> Any:
    """Whether all roots of a0 s⁴ + … + a4 have Re s < 0 (Liénard–Chipart).

    The order of operations is the same as in `is_stable`, so that both round in the same way. The terms with a factor
    0.0 turn an overflow into nan.
    """
    minor = a1 * (a2 * a3 - a4 * a1) - a3 * (a0 * a3 - a4 * 0.0) + 0.0 * (a0 * a1 - a2 * 0.0)
    stable_for_positive_a0 = (a0 > 0.0) & (a1 > 0.0) & (a2 > 0.0) & (a4 > 0.0) & (minor > 0.0)
    stable_for_negative_a0 = (a0 < 0.0) & (a1 < 0.0) & (a2 < 0.0) & (a4 < 0.0) & (minor < 0.0)
    return stable_for_positive_a0 | stable_for_negative_a0


def sturm_chain(a: Real, b: Real, c: Real, d: Real, e: Real, minus: float) -> tuple[Real, Real, Real, Real, Real]:
    """A, C, L, M and N of Sturm's chain, which `classes` defines, or the sums of the |terms| in them.

    Args:
        minus: −1; for the sums of |terms|, 1, with the absolute values of the coefficients.
    """
    A = 3.0 * (b * b) + minus * 8.0 * (a * c)
    B = 2.0 * (b * c) + minus * 12.0 * (a * d)
    C = b * d + minus * 16.0 * (a * e)
    k = 3.0 * (b * A) + minus * 4.0 * (a * B)
    L = k * B + minus * 2.0 * (c * A * A) + 4.0 * (a * A * C)
    M = k * C + minus * d * A * A
    return A, C, L, M, B * L * M + minus * A * M * M + minus * C * L * L


def classes(a0: Real, a1: Real, a2: Real, a3: Real, a4: Real) -> tuple[Any, Any, Any]:
    """Class code, number of distinct real roots, and whether rounding could change a sign.

    Sturm's chain without divisions is p, p′ and, up to positive factors, −(p mod p′) = A s² + B s + C, L s + M and N.
    The same expressions in absolute values bound the errors.
    """
    sign = where(a0 < 0.0, -1.0, 1.0)
    a, b, c, d, e = sign * a0, sign * a1, sign * a2, sign * a3, sign * a4
    b_, c_, d_, e_ = np.abs(b), np.abs(c), np.abs(d), np.abs(e)
    entries = sturm_chain(a, b, c, d, e, -1.0)
    A0, C0, L0, M0, N0, d0, e0 = (x > 0.0 for x in (*entries, d, e))
    is_certain = (
        (a >= _MIN_SIZE)
        & (a <= _MAX_SIZE)
        & (d_ >= _MIN_SIZE)
        & (d_ <= _MAX_SIZE)
        & (e_ >= _MIN_SIZE)
        & (e_ <= _MAX_SIZE)
    )
    is_certain = is_certain & (b_ <= _MAX_SIZE) & (c_ <= _MAX_SIZE)
    is_certain = is_certain & ((b_ >= _MIN_SIZE) | (b_ == 0.0)) & ((c_ >= _MIN_SIZE) | (c_ == 0.0))
    for x, terms in zip(entries, sturm_chain(a, b_, c_, d_, e_, 1.0), strict=True):
        is_certain = is_certain & (np.abs(x) > _BOUND * terms)
    # Sign changes at −∞ of (+, −, A, −L, N), at 0 of (e, d, C, M, N), at ∞ of (+, +, A, L, N).
    changes_at_minus_infinity = 1 + as_integer(A0) + as_integer(A0 == L0) + as_integer(L0 == N0)
    changes_at_zero = as_integer(e0 != d0) + as_integer(d0 != C0) + as_integer(C0 != M0) + as_integer(M0 != N0)
    changes_at_infinity = 1 - as_integer(A0) + as_integer(A0 != L0) + as_integer(L0 != N0)
    negative, count = changes_at_minus_infinity - changes_at_zero, changes_at_minus_infinity - changes_at_infinity
    is_stable = is_stable_by_signs(a0, a1, a2, a3, a4)
    # A stable quartic has no real root ≥ 0, so its code depends only on the number of real roots.
    kind = where(is_stable, 3 + as_integer(negative == 4), 2 - as_integer(count > negative))
    return kind, count, ~is_certain
