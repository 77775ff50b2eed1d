"""Quantities derived from the parameters of the two-mass-skate bicycle, dimensionless and in SI."""

from collections.abc import Mapping
from typing import Any

from tmsopt.algebra.kinds import absolute, choose, negligible, positive_part, quotient, sqrt, tan
from tmsopt.models.bicycles.bicycle import nothing, omega0, omega0_equation, smaller_eigenvalue
from tmsopt.models.bicycles.tms_equations import matrices
from tmsopt.models.model import Quantity, Range

_NOT_NEGATIVE = Range(lower=0.0)
_NOT_POSITIVE = Range(upper=0.0)


def _nu_H(v: Mapping[str, Any]) -> Any:
    """ν_H by tan alone: cos λ_s = 1/√(1 + tan² λ_s) on the open interval of tilts."""
    T = tan(v["lambda_s"])
    return (v["chi_H"] - 1 - v["zeta_H"] * T) / sqrt(1 + T * T)


def _chi_T(v: Mapping[str, Any]) -> Any:
    return (v["chi_B"] + v["mu"] * v["chi_H"]) / (1 + v["mu"])


def _weave_condition(v: Mapping[str, Any]) -> tuple[list[Any], Any]:
    """Terms of the numerator of Fr_c², and its denominator.

    The Hurwitz condition a1 a2 a3 = a0 a3² + a4 a1² is linear in Fr², and ζ_B − ζ_H divides all of it. Divided
    out, it stays regular at ζ_B = ζ_H, where the undivided one holds for any speed.
    """
    mu, chi_B, chi_H, zeta_B, zeta_H = (v[name] for name in ("mu", "chi_B", "chi_H", "zeta_B", "zeta_H"))
    lever, moment, k = chi_B - chi_H, zeta_B * chi_H - zeta_H * chi_B, chi_H - 1
    numerator = [
        zeta_B * (zeta_B - zeta_H) * chi_B * chi_H * tan(v["lambda_s"]),
        k * chi_H * mu * moment,
        -k * chi_B * zeta_B * lever,
    ]
    return numerator, lever * moment * zeta_B


def _Fr_c(v: Mapping[str, Any]) -> Any:
    terms, denominator = _weave_condition(v)
    numerator, size = sum(terms), sum(map(absolute, terms))
    level = negligible(v["chi_B"] - v["chi_H"], absolute(v["chi_B"]) + absolute(v["chi_H"]))
    squared = quotient(choose(negligible(numerator, size), 0, numerator), choose(level, 0, denominator))
    return absolute(sqrt(squared))  # without the sign of −0


def _Fr_c_equation(v: Mapping[str, Any], x: Any) -> Any:
    terms, denominator = _weave_condition(v)
    return x * x * denominator - (terms[0] + terms[1] + terms[2])


def _load_rear(v: Mapping[str, Any]) -> Any:
    """1 − χ_T with the subtraction inside the moments, so that a small load keeps its digits."""
    return (1 - v["chi_B"] + v["mu"] * (1 - v["chi_H"])) / (1 + v["mu"])


def _rear_lift(v: Mapping[str, Any]) -> Any:
    """What the rear wheel lacks, as a mass per mass of the rear frame."""
    return -v["load_rear"] * (1 + v["mu"])


def _front_lift(v: Mapping[str, Any]) -> Any:
    return -v["load_front"] * (1 + v["mu"])


def _mass_margin(v: Mapping[str, Any]) -> Any:
    """Smaller eigenvalue of M, with det M = μ ν_H² ζ_B², in which nothing cancels."""
    T = tan(v["lambda_s"])
    h = sqrt(1 + T * T)
    native = {name: v[name] for name in ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H")}
    (first, mixed), (_, second) = matrices(**native, sine=T / h, cosine=1 / h)[0]
    determinant = v["mu"] * v["nu_H"] * v["nu_H"] * v["zeta_B"] * v["zeta_B"]
    return smaller_eigenvalue(first, mixed, second, determinant)


def _weight(v: Mapping[str, Any]) -> Any:
    return (v["m_B"] + v["m_H"]) * v["g"]


SI_QUANTITIES = (
    Quantity("v_c", "m/s", "speed at the weave boundary", "v_c", lambda v: v["Fr_c"] * sqrt(v["g"] * v["w"])),
    Quantity(
        "u_H",
        "m",
        "distance of the front centre of mass from the steer axis, positive ahead of it",
        "u_H",
        lambda v: v["nu_H"] * v["w"],
    ),
    Quantity(
        "N_F",
        "N",
        "load on the front wheel at rest, negative where it lifts",
        "N_F",
        lambda v: v["load_front"] * _weight(v),
    ),
    Quantity(
        "N_R",
        "N",
        "load on the rear wheel at rest, negative where it lifts",
        "N_R",
        lambda v: v["load_rear"] * _weight(v),
    ),
    Quantity(
        "m_ballast_rear",
        "kg",
        "mass at the rear contact that keeps the rear wheel down",
        "m_R",
        lambda v: v["ballast_rear"] * v["m_B"],
        range=_NOT_NEGATIVE,
        aside=True,
    ),
    Quantity(
        "m_ballast_front",
        "kg",
        "mass at the front contact that keeps the front wheel down",
        "m_F",
        lambda v: v["ballast_front"] * v["m_B"],
        range=_NOT_NEGATIVE,
        aside=True,
    ),
)
"""Quantities that need lengths, masses and gravity."""

_SI = {q.name: q for q in SI_QUANTITIES}

NATIVE_QUANTITIES = (
    Quantity(
        "nu_H",
        "1",
        "distance of the front centre of mass from the steer axis, positive ahead of it",
        r"\nu_H",
        _nu_H,
        counterpart=_SI["u_H"],
    ),
    Quantity(
        "omega0",
        "1",
        "−(a4/a0)^(1/4), the mean decay of the roots (equation w0)",
        r"\omega_0",
        omega0,
        equation=omega0_equation,
        range=_NOT_POSITIVE,
        aside=True,
    ),
    Quantity(
        "Fr_c",
        "1",
        "Froude number at the weave boundary (equation flus)",
        r"\mathrm{Fr}_c",
        _Fr_c,
        equation=_Fr_c_equation,
        range=_NOT_NEGATIVE,
        counterpart=_SI["v_c"],
    ),
    Quantity(
        "chi_T",
        "1",
        "centre of mass of the whole bicycle, forward of the rear contact",
        r"\chi_T",
        _chi_T,
        counterpart=Quantity("x_T", "m", "centre of mass of the whole bicycle", "x_T", lambda v: v["chi_T"] * v["w"]),
    ),
    Quantity(
        "load_front",
        "1",
        "share of the weight on the front wheel, negative where it lifts",
        r"N_F/(N_F + N_R)",
        _chi_T,
        counterpart=_SI["N_F"],
        share=True,
    ),
    Quantity(
        "load_rear",
        "1",
        "share of the weight on the rear wheel, negative where it lifts",
        r"N_R/(N_F + N_R)",
        _load_rear,
        counterpart=_SI["N_R"],
        share=True,
    ),
    Quantity(
        "ballast_rear",
        "1",
        "mass at the rear contact that keeps the rear wheel down, per mass of the rear frame",
        r"m_R/m_B",
        lambda v: positive_part(_rear_lift(v)),
        range=_NOT_NEGATIVE,
        pieces=(nothing, _rear_lift),
        counterpart=_SI["m_ballast_rear"],
        aside=True,
    ),
    Quantity(
        "ballast_front",
        "1",
        "mass at the front contact that keeps the front wheel down, per mass of the rear frame",
        r"m_F/m_B",
        lambda v: positive_part(_front_lift(v)),
        range=_NOT_NEGATIVE,
        pieces=(nothing, _front_lift),
        counterpart=_SI["m_ballast_front"],
        aside=True,
    ),
    Quantity(
        "mass_margin",
        "1",
        "smallest eigenvalue of the mass matrix, 0 where it is singular (equation matrices)",
        r"\min\sigma(M)",
        _mass_margin,
        range=_NOT_NEGATIVE,
    ),
)
"""Quantities of a dimensionless design. A mass at a wheel contact has no part in the lateral motion."""
