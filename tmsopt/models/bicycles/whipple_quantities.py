"""Quantities derived from the parameters of the Carvallo–Whipple bicycle: speeds, loads, trail, spins."""

import math
from collections.abc import Mapping
from inspect import signature
from typing import Any

from tmsopt.algebra.kinds import both, choose, least, less, positive_part, quotient, ratio, sqrt, tan
from tmsopt.models.bicycles.bicycle import nothing, omega0, omega0_equation, smaller_eigenvalue
from tmsopt.models.bicycles.whipple_equations import matrices, powers_of_speed, tangent_matrices
from tmsopt.models.model import Matrix, Quantity, Range

Design = Mapping[str, Any]

_NOT_NEGATIVE = Range(lower=0.0)
_NOT_POSITIVE = Range(upper=0.0)

_ABOVE = 1e300  # any square of a speed that counts is less

IN_MATRICES = tuple(signature(matrices).parameters)[:-3]
"""Algebraic parameters beside T, v and g: lengths, masses, inertias and spins."""


def spin(I_yy: Any, r: Any) -> Any:
    """Angular momentum I_yy/r of a rolling wheel at a speed of 1; 0 for a wheel without inertia, whatever its radius.

    A wheel of a given kind has I_yy ≤ m r², so its spin vanishes with its radius. One without radius that has inertia
    would turn infinitely fast: its spin is nan.

    Example:
        >>> print(tmsopt.models.spin(0.12, 0.3), tmsopt.models.spin(0.0, 0.0), tmsopt.models.spin(1.0, 0.0))
        0.4 0.0 nan

    More: docs/how_to/import.md
    """
    return ratio(I_yy, r)


def algebraic(p: Design) -> dict[str, Any]:
    """The numbers in which the coefficients are polynomials: T = tan λ_s and the spins instead of I_yy."""
    return {"v": p["v"], "g": p["g"], "T": tan(p["lambda_s"]), **_bodies(p)}


def _bodies(p: Design) -> dict[str, Any]:
    spins = {"S_R": spin(p["I_Ryy"], p["r_R"]), "S_F": spin(p["I_Fyy"], p["r_F"])}
    return {name: p[name] for name in IN_MATRICES if name not in spins} | spins


def canonical(p: Design) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """M, C1, K0 and K2 of Meijaard et al. for the native parameters (v and g have no part in them), any numbers.

    Example:
        >>> M, C1, K0, K2 = tmsopt.models.canonical(tmsopt.load("problems/whipple_benchmark.toml").fixed)
        >>> [f"{x:.5f}" for row in M for x in row]  # Meijaard et al. (2007)
        ['80.81722', '2.31941', '2.31941', '0.29784']

    More: docs/how_to/import.md
    """
    sine, cosine = _sine_cosine(p)
    return matrices(**_bodies(p), sine=sine, cosine=cosine, turn=cosine / p["w"])


def _sine_cosine(p: Design) -> tuple[Any, Any]:
    """By tan alone: cos λ_s = 1/√(1 + tan² λ_s) on the open interval of tilts."""
    T = tan(p["lambda_s"])
    cosine = 1 / sqrt(1 + T * T)
    return T * cosine, cosine


def _powers(v: Design) -> tuple[Any, ...]:
    """b0 … b7 of `powers_of_speed`, for a steer angle in units of w/cos λ_s."""
    return powers_of_speed(*tangent_matrices(tan(v["lambda_s"]), **_bodies(v)))


def _v_capsize(v: Design) -> Any:
    b = _powers(v)
    return sqrt(v["g"] * quotient(-b[6], b[7]))


def _v_capsize_equation(v: Design, x: Any) -> Any:
    b = _powers(v)
    return x * x * b[7] + v["g"] * b[6]


def _v_weave(v: Design) -> Any:
    """√(g y) with the least y = v²/g > 0 that has a pair ± iω.

    The Hurwitz condition a1 a2 a3 = a0 a3² + a4 a1² is quadratic in y once v² g² is divided out. The pair of a root of
    it is imaginary where ω² = a3/a1 = g (b4 + y b5)/b1 is positive; otherwise it is ± a real number.
    """
    b = _powers(v)
    second = b[5] * (b[1] * b[3] - b[0] * b[5])
    first = b[1] * (b[2] * b[5] + b[3] * b[4]) - 2 * b[0] * b[4] * b[5] - b[7] * b[1] * b[1]
    last = b[4] * (b[1] * b[2] - b[0] * b[4]) - b[6] * b[1] * b[1]
    return sqrt(v["g"] * _least(*_both(second, first, last), b))


def _both(a: Any, b: Any, c: Any) -> tuple[Any, Any]:
    """Roots of a y² + b y + c without cancellation, each nan where it does not exist; one of them for a = 0."""
    radical = sqrt(b * b - 4 * a * c)
    far = -(b + choose(less(0, b), radical, -radical)) / 2
    return quotient(far, a), quotient(c, far)


def _least(one: Any, other: Any, b: tuple[Any, ...]) -> Any:
    """The lesser of those y that are positive and have a positive ω²; nan without any."""
    one, other = (choose(both(less(0, y), less(0, (b[4] + y * b[5]) * b[1])), y, _ABOVE) for y in (one, other))
    found = least(one, other)
    return choose(less(found, _ABOVE), found, math.nan)


def _z_T(v: Design) -> Any:
    moment = v["m_B"] * v["z_B"] + v["m_H"] * v["z_H"] - v["m_R"] * v["r_R"] - v["m_F"] * v["r_F"]
    return moment / v["m_T"]


def _load_rear(v: Design) -> Any:
    """1 − x_T/w with the subtraction inside the moments, so that a small load keeps its digits."""
    w = v["w"]
    return (v["m_R"] * w + v["m_B"] * (w - v["x_B"]) + v["m_H"] * (w - v["x_H"])) / (v["m_T"] * w)


def _rear_lift(v: Design) -> Any:
    return -v["load_rear"] * v["m_T"]


def _fork_offset(v: Design) -> Any:
    sine, cosine = _sine_cosine(v)
    return v["r_F"] * sine - v["c"] * cosine


def _u_H(v: Design) -> Any:
    sine, cosine = _sine_cosine(v)
    return (v["x_H"] - v["w"] - v["c"]) * cosine - v["z_H"] * sine


def _mass_margin(v: Design) -> Any:
    """Smaller eigenvalue of M."""
    (first, mixed), (_, second) = canonical(v)[0]
    return smaller_eigenvalue(first, mixed, second, first * second - mixed * mixed)


QUANTITIES = (
    Quantity(
        "omega0",
        "1/s",
        "−(a4/a0)^(1/4), the mean decay of the roots",
        r"\omega_0",
        omega0,
        equation=omega0_equation,
        range=_NOT_POSITIVE,
    ),
    Quantity("v_weave", "m/s", "least speed at which a pair of roots is imaginary", r"v_\mathrm{w}", _v_weave),
    Quantity(
        "v_capsize",
        "m/s",
        "speed at which a root is 0",
        r"v_\mathrm{c}",
        _v_capsize,
        equation=_v_capsize_equation,
        range=_NOT_NEGATIVE,
    ),
    Quantity(
        "mechanical_trail",
        "m",
        "distance of the front contact from the steer axis",
        r"c_m",
        lambda v: v["c"] * _sine_cosine(v)[1],
    ),
    Quantity("fork_offset", "m", "distance of the front wheel centre from the steer axis", r"o_F", _fork_offset),
    Quantity(
        "u_H", "m", "distance of the handlebar's centre of mass from the steer axis, positive ahead of it", "u_H", _u_H
    ),
    Quantity(
        "u_A",
        "m",
        "distance of the centre of mass of the front assembly from the steer axis",
        "u_A",
        lambda v: quotient(v["m_H"] * v["u_H"] + v["m_F"] * v["fork_offset"], v["m_H"] + v["m_F"]),
    ),
    Quantity("m_T", "kg", "mass of the whole bicycle", "m_T", lambda v: v["m_R"] + v["m_B"] + v["m_H"] + v["m_F"]),
    Quantity(
        "x_T",
        "m",
        "centre of mass of the whole bicycle, forward of the rear contact",
        "x_T",
        lambda v: (v["m_B"] * v["x_B"] + v["m_H"] * v["x_H"] + v["m_F"] * v["w"]) / v["m_T"],
    ),
    Quantity("z_T", "m", "centre of mass of the whole bicycle, downward", "z_T", _z_T),
    Quantity(
        "load_front",
        "1",
        "share of the weight on the front wheel, negative where it lifts",
        r"N_F/(N_F + N_R)",
        lambda v: v["x_T"] / v["w"],
        share=True,
    ),
    Quantity(
        "load_rear",
        "1",
        "share of the weight on the rear wheel, negative where it lifts",
        r"N_R/(N_F + N_R)",
        _load_rear,
        share=True,
    ),
    Quantity(
        "N_F",
        "N",
        "load on the front wheel at rest, negative where it lifts",
        "N_F",
        lambda v: v["load_front"] * v["m_T"] * v["g"],
    ),
    Quantity(
        "N_R",
        "N",
        "load on the rear wheel at rest, negative where it lifts",
        "N_R",
        lambda v: v["load_rear"] * v["m_T"] * v["g"],
    ),
    Quantity(
        "m_ballast_rear",
        "kg",
        "mass at the rear contact that keeps the rear wheel down",
        r"m_\mathrm{ballast}",
        lambda v: positive_part(_rear_lift(v)),
        range=_NOT_NEGATIVE,
        pieces=(nothing, _rear_lift),
    ),
    Quantity("S_R", "kg m", "spin of the rear wheel, I_Ryy/r_R", "S_R", lambda v: spin(v["I_Ryy"], v["r_R"])),
    Quantity("S_F", "kg m", "spin of the front wheel, I_Fyy/r_F", "S_F", lambda v: spin(v["I_Fyy"], v["r_F"])),
    Quantity(
        "mass_margin",
        "kg m^2",
        "smallest eigenvalue of the mass matrix, 0 where it is singular",
        r"\min\sigma(M)",
        _mass_margin,
        range=_NOT_NEGATIVE,
    ),
)
"""Quantities of a design. A mass at the rear contact has no part in the lateral motion."""
