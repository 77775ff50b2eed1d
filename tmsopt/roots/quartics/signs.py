"""Signs that decide the class of a quartic, as elementwise formulas."""

from typing import Any

import numpy as np

from tmsopt.roots.quartics.factors import Real, where

_BOUND = 1e-14
"""Relative to the sum of |terms|: 45 roundings, where no term below passes through more than 32."""
_LEAST, _MOST = 1e-20, 1e20
"""Coefficients between them give no term that overflows or underflows: none is a product of more than 12."""


def one(condition: Any) -> Any:
    """1 where a condition holds, else 0."""
    return condition.view(np.int8)


def stable(a0: Real, a1: Real, a2: Real, a3: Real, a4: Real) -> Any:
    """Whether all roots of a0 s⁴ + … + a4 have Re s < 0 (Liénard–Chipart).

    In the order of operations of `is_stable`, so that both round alike; the last term keeps what overflows undecided.
    """
    minor = a1 * (a2 * a3 - a4 * a1) - a3 * (a0 * a3 - a4 * 0.0) + 0.0 * (a0 * a1 - a2 * 0.0)
    up = (a0 > 0.0) & (a1 > 0.0) & (a2 > 0.0) & (a4 > 0.0) & (minor > 0.0)
    down = (a0 < 0.0) & (a1 < 0.0) & (a2 < 0.0) & (a4 < 0.0) & (minor < 0.0)
    return up | down


def classes(a0: Real, a1: Real, a2: Real, a3: Real, a4: Real) -> tuple[Any, Any, Any]:
    """Class code, number of different real roots, and whether rounding leaves a sign in doubt.

    By the chain of Sturm without divisions: p, p' and, but for positive factors, −(p mod p') = A s² + B s + C,
    L s + M and N. An error is bounded by that of the same expression in absolute values.
    """
    sign = where(a0 < 0.0, -1.0, 1.0)
    a, b, c, d, e = sign * a0, sign * a1, sign * a2, sign * a3, sign * a4
    A = 3.0 * (b * b) - 8.0 * (a * c)
    B = 2.0 * (b * c) - 12.0 * (a * d)
    C = b * d - 16.0 * (a * e)
    k = 3.0 * (b * A) - 4.0 * (a * B)
    L = k * B - 2.0 * (c * A * A) + 4.0 * (a * A * C)
    M = k * C - d * A * A
    N = B * L * M - A * M * M - C * L * L
    b_, c_, d_, e_ = np.abs(b), np.abs(c), np.abs(d), np.abs(e)
    A_ = 3.0 * (b * b) + 8.0 * (a * c_)
    B_ = 2.0 * (b_ * c_) + 12.0 * (a * d_)
    C_ = b_ * d_ + 16.0 * (a * e_)
    k_ = 3.0 * (b_ * A_) + 4.0 * (a * B_)
    L_ = k_ * B_ + 2.0 * (c_ * A_ * A_) + 4.0 * (a * A_ * C_)
    M_ = k_ * C_ + d_ * A_ * A_
    N_ = B_ * L_ * M_ + A_ * M_ * M_ + C_ * L_ * L_
    certain = (np.abs(A) > _BOUND * A_) & (np.abs(C) > _BOUND * C_) & (np.abs(L) > _BOUND * L_)
    certain = certain & (np.abs(M) > _BOUND * M_) & (np.abs(N) > _BOUND * N_)
    certain = certain & (a >= _LEAST) & (a <= _MOST) & (d_ >= _LEAST) & (d_ <= _MOST) & (e_ >= _LEAST) & (e_ <= _MOST)
    certain = certain & (b_ <= _MOST) & (c_ <= _MOST)
    certain = certain & ((b_ >= _LEAST) | (b_ == 0.0)) & ((c_ >= _LEAST) | (c_ == 0.0))
    A0, C0, d0, e0, L0, M0, N0 = A > 0.0, C > 0.0, d > 0.0, e > 0.0, L > 0.0, M > 0.0, N > 0.0
    # Sign changes at −∞ of (+, −, A, −L, N), at 0 of (e, d, C, M, N), at ∞ of (+, +, A, L, N).
    left = 1 + one(A0) + one(A0 == L0) + one(L0 == N0)
    middle = one(e0 != d0) + one(d0 != C0) + one(C0 != M0) + one(M0 != N0)
    right = 1 - one(A0) + one(A0 != L0) + one(L0 != N0)
    negative, count = left - middle, left - right
    held = stable(a0, a1, a2, a3, a4)
    # with all real parts negative no real root is ≥ 0, so that the codes of stable ones need the count alone
    kind = where(held, 3 + one(negative == 4), 2 - one(count > negative))
    return kind, count, ~certain
