"""Quantities of the two-mass-skate bicycle that are not plain expressions; the others are in `tms.toml`."""

from collections.abc import Mapping
from typing import Any

from tmsopt.algebra.kinds import absolute, choose, negligible, quotient_or_nan, sqrt, tan
from tmsopt.models.bicycles.bicycle import omega0, omega0_equation, smaller_eigenvalue
from tmsopt.models.bicycles.tms_equations import matrices
from tmsopt.records import AnyNumbers


def _weave_condition(v: AnyNumbers) -> tuple[list[Any], Any]:
    """Terms of the numerator of Fr_c², and its denominator.

    The Hurwitz condition a1 a2 a3 = a0 a3² + a4 a1² is linear in Fr² and has the factor ζ_B − ζ_H. The terms are
    without this factor, because for ζ_B = ζ_H the full condition holds at any speed.
    """
    mu, chi_B, chi_H, zeta_B, zeta_H = (v[name] for name in ("mu", "chi_B", "chi_H", "zeta_B", "zeta_H"))
    lever, moment, k = chi_B - chi_H, zeta_B * chi_H - zeta_H * chi_B, chi_H - 1
    numerator = [
        zeta_B * (zeta_B - zeta_H) * chi_B * chi_H * tan(v["lambda_s"]),
        k * chi_H * mu * moment,
        -k * chi_B * zeta_B * lever,
    ]
    return numerator, lever * moment * zeta_B


def _Fr_c(v: AnyNumbers) -> Any:
    terms, denominator = _weave_condition(v)
    numerator, size = sum(terms), sum(map(absolute, terms))
    is_same_place = negligible(v["chi_B"] - v["chi_H"], absolute(v["chi_B"]) + absolute(v["chi_H"]))
    square = quotient_or_nan(choose(negligible(numerator, size), 0, numerator), choose(is_same_place, 0, denominator))
    return absolute(sqrt(square))  # turns −0 into 0


def _Fr_c_equation(v: AnyNumbers, x: Any) -> Any:
    terms, denominator = _weave_condition(v)
    return x * x * denominator - (terms[0] + terms[1] + terms[2])


def _mass_margin(v: AnyNumbers) -> Any:
    """Smaller eigenvalue of M, from det M = μ ν_H² ζ_B², a product that loses no digits."""
    T = tan(v["lambda_s"])
    h = sqrt(1 + T * T)
    native = {name: v[name] for name in ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H")}
    (M11, M12), (_, M22) = matrices(**native, sine=T / h, cosine=1 / h)[0]
    determinant = v["mu"] * v["nu_H"] * v["nu_H"] * v["zeta_B"] * v["zeta_B"]
    return smaller_eigenvalue(M11, M12, M22, determinant)


COMPUTED: Mapping[str, dict[str, Any]] = {
    "omega0": {"value": omega0, "equation": omega0_equation},
    "Fr_c": {"value": _Fr_c, "equation": _Fr_c_equation},
    "mass_margin": {"value": _mass_margin},
}
"""Functions of the quantities in `tms.toml`."""
