"""Quantities of the Carvallo–Whipple bicycle that are not plain expressions; the others are in `whipple.toml`."""

import math
from collections.abc import Mapping
from inspect import signature
from typing import Any

from tmsopt.algebra.kinds import choose, less, logical_and, minimum, quotient_or_nan, quotient_or_zero, sqrt, tan
from tmsopt.models.bicycles.bicycle import omega0, omega0_equation, smaller_eigenvalue
from tmsopt.models.bicycles.whipple_equations import matrices, powers_of_speed, tangent_matrices
from tmsopt.models.model import Matrix
from tmsopt.records import AnyNumbers

_LARGE = 1e300  # means "no root"; it is greater than every v²/g that matters

IN_MATRICES = tuple(signature(matrices).parameters)[:-3]
"""Algebraic parameters except T, v and g: lengths, masses, inertias and spins."""


def spin(I_yy: Any, r: Any) -> Any:
    """Angular momentum I_yy/r of a rolling wheel at a speed of 1; 0 for a wheel without inertia, whatever its radius.

    I_yy ≤ m r², so the spin vanishes with the radius. A wheel with inertia but without radius would turn infinitely
    fast, so its spin is nan.

    Example:
        >>> print(tmsopt.models.spin(0.12, 0.3), tmsopt.models.spin(0.0, 0.0), tmsopt.models.spin(1.0, 0.0))
        0.4 0.0 nan

    More: docs/how_to/import.md
    """
    return quotient_or_zero(I_yy, r)


def algebraic(p: AnyNumbers) -> dict[str, Any]:
    """The numbers in which the coefficients are polynomials: T = tan λ_s and the spins instead of I_yy."""
    return {"v": p["v"], "g": p["g"], "T": tan(p["lambda_s"]), **_bodies(p)}


def _bodies(p: AnyNumbers) -> dict[str, Any]:
    spins = {"S_R": spin(p["I_Ryy"], p["r_R"]), "S_F": spin(p["I_Fyy"], p["r_F"])}
    return {name: p[name] for name in IN_MATRICES if name not in spins} | spins


def canonical(p: AnyNumbers) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """M, C1, K0 and K2 of Meijaard et al. for the native parameters (v and g have no effect), for numbers of any kind.

    Example:
        >>> M, C1, K0, K2 = tmsopt.models.canonical(tmsopt.load("problems/whipple_benchmark.toml").fixed)
        >>> [f"{x:.5f}" for row in M for x in row]  # Meijaard et al. (2007)
        ['80.81722', '2.31941', '2.31941', '0.29784']

    More: docs/how_to/import.md
    """
    sine, cosine = _sine_cosine(p)
    return matrices(**_bodies(p), sine=sine, cosine=cosine, turn=cosine / p["w"])


def _sine_cosine(p: AnyNumbers) -> tuple[Any, Any]:
    """Sine and cosine of λ_s from tan λ_s: cos λ_s = 1/√(1 + tan² λ_s) is positive, because |λ_s| < π/2."""
    T = tan(p["lambda_s"])
    cosine = 1 / sqrt(1 + T * T)
    return T * cosine, cosine


def _powers(v: AnyNumbers) -> tuple[Any, ...]:
    """b0 … b7 of `powers_of_speed`, for a steer angle in units of w/cos λ_s."""
    return powers_of_speed(*tangent_matrices(tan(v["lambda_s"]), **_bodies(v)))


def _v_capsize(v: AnyNumbers) -> Any:
    b = _powers(v)
    return sqrt(v["g"] * quotient_or_nan(-b[6], b[7]))


def _v_capsize_equation(v: AnyNumbers, x: Any) -> Any:
    b = _powers(v)
    return x * x * b[7] + v["g"] * b[6]


def _v_weave(v: AnyNumbers) -> Any:
    """√(g y) with the least y = v²/g > 0 that has a pair ± iω.

    The Hurwitz condition a1 a2 a3 = a0 a3² + a4 a1² divided by v² g² is quadratic in y. At a root the pair is
    imaginary if ω² = a3/a1 = g (b4 + y b5)/b1 is positive; otherwise it is ± a real number.
    """
    b = _powers(v)
    quadratic = b[5] * (b[1] * b[3] - b[0] * b[5])
    linear = b[1] * (b[2] * b[5] + b[3] * b[4]) - 2 * b[0] * b[4] * b[5] - b[7] * b[1] * b[1]
    constant = b[4] * (b[1] * b[2] - b[0] * b[4]) - b[6] * b[1] * b[1]
    return sqrt(v["g"] * _least_weave(*_quadratic_roots(quadratic, linear, constant), b))


def _quadratic_roots(a: Any, b: Any, c: Any) -> tuple[Any, Any]:
    """Roots of a y² + b y + c, without loss of digits; nan for a root that does not exist. For a = 0 there is one."""
    radical = sqrt(b * b - 4 * a * c)
    half_sum = -(b + choose(less(0, b), radical, -radical)) / 2
    return quotient_or_nan(half_sum, a), quotient_or_nan(c, half_sum)


def _least_weave(y1: Any, y2: Any, b: tuple[Any, ...]) -> Any:
    """The smaller of the roots y that are positive and give a positive ω²; nan if neither root does."""

    def large_unless_weave(y: Any) -> Any:
        return choose(logical_and(less(0, y), less(0, (b[4] + y * b[5]) * b[1])), y, _LARGE)

    smaller_root = minimum(large_unless_weave(y1), large_unless_weave(y2))
    return choose(less(smaller_root, _LARGE), smaller_root, math.nan)


def _fork_offset(v: AnyNumbers) -> Any:
    sine, cosine = _sine_cosine(v)
    return v["r_F"] * sine - v["c"] * cosine


def _u_H(v: AnyNumbers) -> Any:
    sine, cosine = _sine_cosine(v)
    return (v["x_H"] - v["w"] - v["c"]) * cosine - v["z_H"] * sine


def _mass_margin(v: AnyNumbers) -> Any:
    """The smaller eigenvalue of M."""
    (M11, M12), (_, M22) = canonical(v)[0]
    return smaller_eigenvalue(M11, M12, M22, M11 * M22 - M12 * M12)


COMPUTED: Mapping[str, dict[str, Any]] = {
    "omega0": {"value": omega0, "equation": omega0_equation},
    "v_weave": {"value": _v_weave},
    "v_capsize": {"value": _v_capsize, "equation": _v_capsize_equation},
    "mechanical_trail": {"value": lambda v: v["c"] * _sine_cosine(v)[1]},
    "fork_offset": {"value": _fork_offset},
    "u_H": {"value": _u_H},
    "u_A": {"value": lambda v: quotient_or_nan(v["m_H"] * v["u_H"] + v["m_F"] * v["fork_offset"], v["m_H"] + v["m_F"])},
    "S_R": {"value": lambda v: spin(v["I_Ryy"], v["r_R"])},
    "S_F": {"value": lambda v: spin(v["I_Fyy"], v["r_F"])},
    "mass_margin": {"value": _mass_margin},
}
"""Functions of the quantities in `whipple.toml`."""
