"""The two-mass-skate bicycle (Kirillov 2018; Kooijman et al. 2011), dimensionless and in SI."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tmsopt.models.model import Model, Parameter, ParameterSet, Quantity, Range
from tmsopt.roots.elementary import sqrt, tan

GRAVITY = 9.81
"""Default g in m/s²."""

_POSITIVE = Range(lower=0.0, closed=False)
_NOT_NEGATIVE = Range(lower=0.0)
_NOT_POSITIVE = Range(upper=0.0)
_TILT = Range(-np.pi / 2, np.pi / 2, closed=False)

_LAMBDA_S = Parameter(
    "lambda_s", "rad", "steer axis tilt", r"\lambda_s", _TILT, tangent=True, sides=("backward tilt", "forward tilt")
)


def copo(Fr: Any, mu: Any, chi_B: Any, chi_H: Any, zeta_B: Any, zeta_H: Any, T: Any) -> list[Any]:
    """Coefficients a0 … a4 of the characteristic polynomial, with T = tan λ_s (equation copo).

    This is det(M s² + V s + P) / (μ ν_H cos λ_s), by plain arithmetic on any numbers.
    """
    return [
        (chi_H - 1 - zeta_H * T) * zeta_B * zeta_B,
        Fr * (zeta_B * chi_H - zeta_H * chi_B) * zeta_B,
        Fr * Fr * (zeta_B - zeta_H) * zeta_B - zeta_B * (zeta_B + zeta_H) * T - (chi_H - 1) * (mu * zeta_H - zeta_B),
        Fr * (chi_H - chi_B) * zeta_B,
        -zeta_B * T - mu * (chi_H - 1),
    ]


def matrices(
    Fr: Any, mu: Any, chi_B: Any, chi_H: Any, zeta_B: Any, zeta_H: Any, sine: Any, cosine: Any
) -> tuple[list[list[Any]], list[list[Any]], list[list[Any]]]:
    """M, V and P of M q″ + V q′ + P q = 0, q = (lean, steer), from the sine and cosine of the steer axis tilt.

    Equation matrices of the paper; nested lists, any numbers.
    """
    nu_H = (chi_H - 1) * cosine - zeta_H * sine
    lean = mu * zeta_H + zeta_B
    M = [
        [mu * zeta_H * zeta_H + zeta_B * zeta_B, -mu * zeta_H * nu_H],
        [-mu * zeta_H * nu_H, mu * nu_H * nu_H],
    ]
    V = [
        [0 * Fr, -(mu * chi_H * zeta_H + chi_B * zeta_B) * Fr * cosine],
        [0 * Fr, mu * chi_H * nu_H * Fr * cosine],
    ]
    P = [
        [lean, -Fr * Fr * cosine * lean - mu * nu_H],
        [-mu * nu_H, mu * (Fr * Fr * cosine - sine) * nu_H],
    ]
    return M, V, P


def _algebraic(p: Mapping[str, Any]) -> dict[str, Any]:
    return {name: p[name] for name in _NATIVE.names if name != "lambda_s"} | {"T": tan(p["lambda_s"])}


def _nu_H(v: Mapping[str, Any]) -> Any:
    """ν_H by tan alone: cos λ_s = 1/√(1 + tan² λ_s) on the open interval of tilts."""
    T = tan(v["lambda_s"])
    return (v["chi_H"] - 1 - v["zeta_H"] * T) / sqrt(1 + T * T)


def _omega0(v: Mapping[str, Any]) -> Any:
    return -sqrt(sqrt(_quotient(v["a4"], v["a0"])))


def _quotient(a: Any, b: Any) -> Any:
    """a / b, nan where b is 0: a quantity that does not exist, not an infinite one."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.equal(b, 0), np.nan, np.divide(a, b))[()]


def _omega0_equation(v: Mapping[str, Any], x: Any) -> Any:
    return x * x * x * x * v["a0"] - v["a4"]


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
    numerator = sum(terms)
    rounding = 4 * np.finfo(float).eps * sum(np.abs(t) for t in terms)
    return sqrt(_quotient(np.where(np.abs(numerator) <= rounding, 0.0, numerator), denominator))


def _Fr_c_equation(v: Mapping[str, Any], x: Any) -> Any:
    terms, denominator = _weave_condition(v)
    return x * x * denominator - (terms[0] + terms[1] + terms[2])


def _v_c(v: Mapping[str, Any]) -> Any:
    return v["Fr_c"] * sqrt(v["g"] * v["w"])


def _u_H(v: Mapping[str, Any]) -> Any:
    return v["nu_H"] * v["w"]


_NATIVE = ParameterSet(
    "dimensionless",
    (
        Parameter("Fr", "1", "Froude number v/√(g w)", r"\mathrm{Fr}", _NOT_NEGATIVE),
        Parameter("mu", "1", "mass ratio m_H/m_B", r"\mu", _NOT_NEGATIVE, multiple_of="kg"),
        Parameter("chi_B", "1", "rear frame centre of mass, forward of the rear contact", r"\chi_B", multiple_of="m"),
        Parameter(
            "chi_H", "1", "front assembly centre of mass, forward of the rear contact", r"\chi_H", multiple_of="m"
        ),
        Parameter("zeta_B", "1", "rear frame centre of mass, downward", r"\zeta_B", _NOT_POSITIVE, multiple_of="m"),
        Parameter("zeta_H", "1", "front assembly centre of mass, downward", r"\zeta_H", _NOT_POSITIVE, multiple_of="m"),
        _LAMBDA_S,
    ),
    native=dict,
)


def from_si(p: Mapping[str, Any]) -> dict[str, Any]:
    """Dimensionless parameters for SI values (m, m/s, m/s², rad, kg), any numbers."""
    return {
        "Fr": p["v"] / sqrt(p["g"] * p["w"]),
        "mu": p["m_H"] / p["m_B"],
        "chi_B": p["x_B"] / p["w"],
        "chi_H": p["x_H"] / p["w"],
        "zeta_B": p["z_B"] / p["w"],
        "zeta_H": p["z_H"] / p["w"],
        "lambda_s": p["lambda_s"],
    }


def to_si(p: Mapping[str, Any], w: Any = 1.0, m_B: Any = 1.0, g: Any = GRAVITY) -> dict[str, Any]:
    """SI values for dimensionless parameters, given wheelbase w (m), rear frame mass m_B (kg) and g (m/s²)."""
    return {
        "w": w,
        "v": p["Fr"] * sqrt(g * w),
        "g": g,
        "lambda_s": p["lambda_s"],
        "m_B": m_B,
        "x_B": p["chi_B"] * w,
        "z_B": p["zeta_B"] * w,
        "m_H": p["mu"] * m_B,
        "x_H": p["chi_H"] * w,
        "z_H": p["zeta_H"] * w,
    }


_SI = ParameterSet(
    "SI",
    (
        Parameter("w", "m", "wheelbase", "w", _POSITIVE),
        Parameter("v", "m/s", "forward speed", "v", _NOT_NEGATIVE),
        Parameter("g", "m/s^2", "gravity", "g", _POSITIVE, default=GRAVITY),
        _LAMBDA_S,
        Parameter("m_B", "kg", "mass of the rear frame", "m_B", _POSITIVE),
        Parameter("x_B", "m", "rear frame centre of mass, forward of the rear contact", "x_B"),
        Parameter("z_B", "m", "rear frame centre of mass, downward", "z_B", _NOT_POSITIVE),
        Parameter("m_H", "kg", "mass of the front assembly", "m_H", _NOT_NEGATIVE),
        Parameter("x_H", "m", "front assembly centre of mass, forward of the rear contact", "x_H"),
        Parameter("z_H", "m", "front assembly centre of mass, downward", "z_H", _NOT_POSITIVE),
    ),
    native=from_si,
    quantities=(
        Quantity(
            "v_c", "m/s", "speed at the weave boundary", "v_c", _v_c
        ),
        Quantity(
            "u_H", "m", "distance of the front centre of mass from the steer axis", "u_H",
            _u_H,
        ),
    ),
)  # fmt: skip

tms = Model(
    name="tms",
    title="two-mass-skate bicycle",
    degree=4,
    sets=(_NATIVE, _SI),
    algebraic=_algebraic,
    polynomial=copo,
    quantities=(
        Quantity("nu_H", "1", "distance of the front centre of mass from the steer axis", r"\nu_H", _nu_H),
        Quantity(
            "omega0", "1", "−(a4/a0)^(1/4), the mean decay of the roots (equation w0)", r"\omega_0", _omega0,
            equation=_omega0_equation,
            range=_NOT_POSITIVE,
        ),
        Quantity(
            "Fr_c", "1", "Froude number at the weave boundary (equation flus)", r"\mathrm{Fr}_c", _Fr_c,
            equation=_Fr_c_equation,
            range=_NOT_NEGATIVE,
        ),
        Quantity(
            "chi_T", "1", "centre of mass of the whole bicycle, forward of the rear contact", r"\chi_T",
            _chi_T,
        ),
    ),
)  # fmt: skip
"""The two-mass-skate bicycle."""
