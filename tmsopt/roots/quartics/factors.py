"""The two real quadratic factors of a quartic (s² + p1 s + q1)(s² + p2 s + q2), as elementwise formulas.

They use only arithmetic, `where` and NumPy functions of numbers, so that the explorer can translate them to JavaScript.
Divisions by 0 are intended: a result that is not finite has an error that is not finite, and is not accepted.
"""

from typing import Any

import numpy as np

where: Any = np.where

Real = Any
"""An array of numbers."""

FourArrays = tuple[Real, Real, Real, Real]
"""Four arrays: p1, q1, p2, q2 or b1, b2, b3, b4."""


def monic(a0: Real, a1: Real, a2: Real, a3: Real, a4: Real) -> FourArrays:
    """The coefficients b1 … b4 of the monic quartic; if one of a0 … a4 is not finite, b4 is not finite."""
    return a1 / a0, a2 / a0, a3 / a0, a4 / a0 + 0.0 * a0


def closed_form_factors(b1: Real, b2: Real, b3: Real, b4: Real) -> FourArrays:
    """Factors of s⁴ + b1 s³ + b2 s² + b3 s + b4 in closed form.

    With t = s + b1/4 the quartic is t⁴ + B t² + C t + D = (t² + u t + v)(t² − u t + w), and U = u² is the largest
    root of U³ + 2B U² + (B² − 4D) U − C², which is never negative. A root of this cubic with a small residual gives
    factors with a small residual, even near an exceptional point, where the root itself is uncertain. The shift by b1/4
    loses digits if one root is far larger than the others.
    """
    h = 0.25 * b1
    h2 = h * h
    B = b2 - 6.0 * h2
    C = b3 - 2.0 * h * (b2 - 4.0 * h2)
    D = b4 - h * (b3 - h * (b2 - 3.0 * h2))
    B2, D4, C2 = B * B, 4.0 * D, C * C
    E = B2 - D4
    U = largest_root((B2 + 3.0 * D4) * (1 / 9), B * (B2 - 9.0 * D4) * (1 / 27) + 0.5 * C2) - B * (2 / 3)
    # For small U, the subtraction above loses most digits, but the cubic is nearly quadratic.
    width = np.sqrt(np.maximum(E * E + 8.0 * B * C2, 0.0))
    small_U = where(E < 0.0, (width - E) / (4.0 * B), where(C2 > 0.0, 2.0 * C2 / (E + width), 0.0))
    U = where(U < 2e-4 * B, small_U, np.maximum(U, 0.0))
    residual = ((U + 2.0 * B) * U + E) * U - C2
    for _ in range(2):
        trial = np.maximum(U - residual / ((3.0 * U + 4.0 * B) * U + E), 0.0)
        trial_residual = ((trial + 2.0 * B) * trial + E) * trial - C2
        is_better = np.abs(trial_residual) < np.abs(residual)
        U, residual = where(is_better, trial, U), where(is_better, trial_residual, residual)
    u = np.sqrt(U)
    sum_, difference = B + U, where(u > 0.0, C / u, np.sqrt(np.maximum(E, 0.0)))
    v, w = correct_smaller(0.5 * (sum_ - difference), 0.5 * (sum_ + difference), D)
    q1, q2 = correct_smaller(h * (h + u) + v, h * (h - u) + w, b4)
    return 2.0 * h + u, q1, 2.0 * h - u, q2


def correct_smaller(first: Real, second: Real, product: Real) -> tuple[Real, Real]:
    """Two numbers with a known product; the smaller one is recomputed from the product and the larger one."""
    first_is_larger = np.abs(first) > np.abs(second)
    larger = where(first_is_larger, first, second)
    smaller = where(larger == 0.0, 0.0, product / larger)
    return where(first_is_larger, larger, smaller), where(first_is_larger, smaller, larger)


def largest_root(Q: Real, R: Real) -> Real:
    """Largest real root of x³ − 3 Q x − 2 R, to 7 digits relative to the spread of the roots.

    For three real roots, x = 2 √Q cos(arccos(w)/3) with w = R/Q^(3/2). The cosine is an analytic function of √(1 + w).
    It is replaced by an interpolation polynomial in Chebyshev points with an error of 1e-7. The constant ½ of this
    polynomial is exact, so that a double root stays double.
    """
    Q3 = Q * Q * Q
    S = R * R - Q3
    s = np.sqrt(np.maximum(1.0 + R / where(Q3 > 0.0, np.sqrt(np.abs(Q3)), 1.0), 0.0))
    slope = 0.0031525314003429455 + s * (-0.0009294506538574776 + s * 0.0001346562186950807)
    slope = 0.4082481899731565 + s * (
        -0.05554853544711957 + s * (0.01881765411563031 + s * (-0.007849651607672 + s * slope))
    )
    A = np.cbrt(np.abs(R) + np.sqrt(np.maximum(S, 0.0)))
    A = where(R < 0.0, -A, A)
    return where(S > 0.0, A + Q / A, np.sqrt(np.maximum(Q, 0.0)) * (1.0 + 2.0 * s * slope))


def error(b1: Real, b2: Real, b3: Real, b4: Real, p1: Real, q1: Real, p2: Real, q2: Real) -> Real:
    """Backward error of factors, between 1 and 2 times `tmsopt.roots.backward_error`; nan if they are not finite.

    max(|p|, 2 √|q|) replaces the sum of |roots| of a factor; it is exact or too small by a factor of at most √2.
    """
    Q1, Q2 = np.abs(q1), np.abs(q2)
    P1, P2 = np.maximum(np.abs(p1), 2.0 * np.sqrt(Q1)), np.maximum(np.abs(p2), 2.0 * np.sqrt(Q2))
    r1, r2 = np.abs(b1 - (p1 + p2)), np.abs(b2 - (q1 + q2 + p1 * p2))
    r3, r4 = np.abs(b3 - (p1 * q2 + p2 * q1)), np.abs(b4 - q1 * q2)
    e1 = where(r1 == 0.0, 0.0, r1 / (P1 + P2))
    e2 = where(r2 == 0.0, 0.0, r2 / (Q1 + Q2 + P1 * P2))
    e3 = where(r3 == 0.0, 0.0, r3 / (P1 * Q2 + P2 * Q1))
    e4 = where(r4 == 0.0, 0.0, r4 / (Q1 * Q2))
    return np.maximum(np.maximum(e1, e2), np.maximum(e3, e4))


def newton_step(b1: Real, b2: Real, b3: Real, b4: Real, p1: Real, q1: Real, p2: Real, q2: Real) -> FourArrays:
    """One step of Newton's method on both factors; the result is not finite if they share both roots.

    The changes solve δf1 f2 ≡ r mod f1 and δf2 f1 ≡ r mod f2 with the residual r. Each factor has its own unit, so that
    the roots of one factor may be much larger than the roots of the other.
    """
    r1, r2, r3, r4 = b1 - (p1 + p2), b2 - (q1 + q2 + p1 * p2), b3 - (p1 * q2 + p2 * q1), b4 - q1 * q2
    u, v = p2 - p1, q2 - q1
    resultant = v * v - u * (v * p1 - u * q1)
    c1, c0 = r3 - r2 * p1 + r1 * (p1 * p1 - q1), r4 - r2 * q1 + r1 * p1 * q1
    d1, d0 = r3 - r2 * p2 + r1 * (p2 * p2 - q2), r4 - r2 * q2 + r1 * p2 * q2
    return (
        p1 + (v * c1 - u * c0) / resultant,
        q1 + ((v - u * p1) * c0 + u * q1 * c1) / resultant,
        p2 - (v * d1 - u * d0) / resultant,
        q2 - ((v - u * p2) * d0 + u * q2 * d1) / resultant,
    )


def abscissa(p: Real, q: Real) -> Real:
    """Largest real part of the roots of s² + p s + q, without cancellation."""
    half = -0.5 * p
    square = half * half - q
    width = where(q == 0.0, np.abs(half), np.sqrt(np.maximum(square, 0.0)))  # the square of a tiny half may underflow
    low = half - width
    return where(half > 0.0, half + width, where((width > 0.0) & (low < 0.0), q / low, half))


def damping_ratio(p: Real, q: Real) -> Real:
    """Least −Re s/|s| over the roots of s² + p s + q, where the ratio of a root 0 is 0."""
    ratio_if_real = where((q < 0.0) | (p < 0.0), -1.0, where(q == 0.0, 0.0, 1.0))
    return where(0.25 * p * p < q, 0.5 * p / np.sqrt(np.abs(q)), ratio_if_real)


def root_pair(p: Real, q: Real) -> FourArrays:
    """Real and imaginary parts of both roots of s² + p s + q, with exact conjugates."""
    half = -0.5 * p
    square = half * half - q
    width = np.sqrt(np.abs(square))
    larger_root = half + where(half < 0.0, -1.0, 1.0) * where(q == 0.0, np.abs(half), width)
    smaller_root = where(larger_root == 0.0, 0.0, q / larger_root)
    is_pair = square < 0.0
    return (
        where(is_pair, half, larger_root),
        where(is_pair, width, 0.0),
        where(is_pair, half, smaller_root),
        where(is_pair, -width, 0.0),
    )
