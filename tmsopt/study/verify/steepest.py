"""The algebra behind the steepest tilt of heavily damped bicycles with χ_H = 1: it is that of the EP4."""

from typing import Any

import flint

from tmsopt.study.verify.algebra import polynomials, positive, q, ring, substitute
from tmsopt.study.verify.upright import normal, tilt_of_EP4


def symmetric(count: int = 4) -> tuple[list[Any], list[Any]]:
    """Four variables and their elementary symmetric polynomials e1 … e4."""
    x = list(polynomials("x1 x2 x3 x4"))
    e = [x[0] * 0 + 1, *[x[0] * 0] * 4]
    for variable in x:
        e = [e[0]] + [e[k] + variable * e[k - 1] for k in range(1, 5)]
    return x, e[1:]


def newton_inequalities() -> bool:
    """For positive x with product 1: 3 e1² − 8 e2 and 3 e3² − 8 e2 e4 are sums of squares, e2 ≥ 6 likewise."""
    x, (e1, e2, e3, e4) = symmetric()
    pairs = [(i, j) for i in range(4) for j in range(i)]
    first = sum(((x[i] - x[j]) ** 2 for i, j in pairs), x[0] * 0)
    others = {(i, j): [k for k in range(4) if k not in (i, j)] for i, j in pairs}
    last = sum((((x[i] - x[j]) * x[k] * x[m]) ** 2 for (i, j), (k, m) in others.items()), x[0] * 0)
    # with x = y²: e2 − 6 √e4 as squares over the three pairings
    squared = sum((x[i] ** 2 * x[j] ** 2 for i, j in pairs), x[0] * 0)
    pairings = (((0, 1), (2, 3)), ((0, 2), (1, 3)), ((0, 3), (1, 2)))
    middle = sum(((x[a] * x[b] - x[c] * x[d]) ** 2 for (a, b), (c, d) in pairings), x[0] * 0)
    return bool(
        3 * e1**2 - 8 * e2 == first
        and 3 * e3**2 - 8 * e2 * e4 == last
        and squared - 6 * x[0] * x[1] * x[2] * x[3] == middle
    )


def tilt_of_roots() -> bool:
    """With e1, e2, e3 of the roots −x over |ω0|: h T (r e1 + e3)² = (r² − 1)(r e2 + r² + 1), for any Fr and χ_B."""
    Fr, chi_B, T, r, scale = ring("Fr chi_B T r q")
    b = normal(Fr, chi_B, T, r, scale)
    return bool(b[4] == 1 and scale**2 * T * (r * b[1] + b[3]) ** 2 == (r**2 - 1) * (r * b[2] + r**2 + 1))


def tilt_bound() -> bool:
    """No heavily damped bicycle has a steeper tilt than the EP4, and at that tilt only the EP4 is real-rooted.

    With m = e2/6 ≥ 1, (r e1 + e3)² ≥ 16 m (r + 1)², and (r² + 6 r + 1) m − (6 r m + r² + 1) = (r² + 1)(m − 1) ≥ 0.
    """
    r, m, h = ring("r m h")
    bound = (r**2 - 1) * (6 * r * m + r**2 + 1) / (16 * m * (r + 1) ** 2 * h)
    excess = tilt_of_EP4(r, h) - bound
    gap = (r**2 - 1) * (r**2 + 1) * (m - 1) / (16 * m * (r + 1) ** 2 * h)
    return newton_inequalities() and tilt_of_roots() and excess == gap


def triple_roots_are_slow() -> bool:
    """EP3 bicycles, heavily damped, have Fr ≤ Fr_EP4 for r > 1, with equality at the EP4 only.

    With f = q Fr, roots −a, −a, −a, −a⁻³ and r = 1 + ρ, f(EP4) − f(a) is (a − 1)² times a polynomial over positive
    terms; the discriminant of the polynomial has no zero for ρ > 0, and at ρ = 1 it has no real zero a.
    """
    a, rho = polynomials("a rho")
    r = 1 + rho
    speed = 3 * r * (a**5 + a) + (r**2 + 1) * a**3  # (r e2 + r² + 1) a³
    sums = r * (3 * a**4 + 1) + a**6 + 3 * a**2  # (r e1 + e3) a³
    excess = (r**2 + 6 * r + 1) * sums - 4 * (r + 1) * speed
    rest, remainder = divmod(excess, (a - 1) ** 2)
    factors = [factor for factor, _ in rest.discriminant("a").factor()[1]]
    at_1 = substitute(rest, {"rho": q(1)}).to_dict()
    quartic_at_1: Any = flint.fmpq_poly([at_1.get((k, 0), q(0)) for k in range(rest.degrees()[0] + 1)])
    real: Any = quartic_at_1.complex_roots()
    return (
        remainder == 0
        and all(positive(factor) for factor in factors)
        and not any(z.imag == 0 for z, _ in real)
        and at_1[(0, 0)] > 0
    )


def smooth_parts_have_no_maximum() -> bool:
    """On the part of the boundary with one double root −a, tan λ_s at fixed Fr is stationary only at a² = r.

    There the multiplier 1/(1 − f/√r) is negative for f > √r, so it is a minimum; f(EP4) > √r by (√r − 1)⁴.
    """
    root, f = ring("root f")
    r, a = root**2, root
    y = 1 / (1 - f / root)  # d(r e1 + e3) = y (a² de1 − a de2 + de3) + z (r de2 − f d(r e1 + e3))
    z = y * a / r
    stationary = r * (1 + z * f) == y * a**2 and z * r == y * a and 1 + z * f == y
    speed = (r**2 + 6 * r + 1) / (4 * (r + 1))
    return bool(stationary and speed - root == (root - 1) ** 4 / (4 * (r + 1)))


def one_pair_of_double_roots() -> bool:
    """At fixed f the 2EP2 have U = x + 1/x > 2 with r U² − 2 f (r + 1) U + (r + 1)² = 0: one for f > f(EP4)."""
    f, r, U = ring("f r U")
    e1, e2 = 2 * U, U**2 + 2
    relation = r * e2 + r**2 + 1 - f * (r * e1 + e1)
    at_2 = r * 4 - 4 * f * (r + 1) + (r + 1) ** 2
    speed = (r**2 + 6 * r + 1) / (4 * (r + 1))
    return bool(relation == r * U**2 - 2 * f * (r + 1) * U + (r + 1) ** 2 and at_2 == 4 * (r + 1) * (speed - f))
