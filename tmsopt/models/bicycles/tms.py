"""The two-mass-skate bicycle (Kirillov 2018; Kooijman et al. 2011), dimensionless and in SI."""

from pkgutil import resolve_name
from typing import Any

from tmsopt.algebra.kinds import sqrt, tan
from tmsopt.models.bicycles.bicycle import WORDS, time_quantities
from tmsopt.models.bicycles.feedback import FEEDBACK, NO_CONTROLLER, ControllableBicycle, native_name, si_scale
from tmsopt.models.bicycles.sketches import CONVENTIONS, TMS
from tmsopt.models.bicycles.tables import parameters, quantities
from tmsopt.models.bicycles.tms_equations import compact_copo, copo, matrices
from tmsopt.models.bicycles.tms_quantities import COMPUTED
from tmsopt.models.model import Matrices, Model, ParameterSet
from tmsopt.models.tables import read_table
from tmsopt.records import AnyNumbers

__all__ = ["GRAVITY", "copo", "from_si", "matrices", "tms", "to_si"]

_TABLES = read_table("bicycles/tms")

GRAVITY: float = _TABLES["parameters"]["SI"]["g"]["default"]
"""Default g in m/s²."""


def _without_tilt(p: AnyNumbers) -> dict[str, Any]:
    """The native parameters without the tilt."""
    return {name: p[name] for name in _NATIVE.names if name != "lambda_s"}


_NATIVE = ParameterSet("dimensionless", parameters(_TABLES["parameters"]["dimensionless"]), native=dict)


def from_si(p: AnyNumbers) -> dict[str, Any]:
    """Dimensionless parameters for SI values (m, m/s, m/s², rad, kg), which are numbers of any kind.

    Example:
        >>> own = dict(w=1.0, v=3.0, g=9.0, lambda_s=0.1, m_H=1.0, m_B=10.0, x_B=1.2, x_H=1.0, z_B=-0.4, z_H=-0.2)
        >>> print(tmsopt.models.from_si(own)["Fr"], tmsopt.models.from_si(own)["mu"])  # v/√(g w), m_H/m_B
        1.0 0.1

    More: docs/how_to/units.md
    """
    return {
        "Fr": p["v"] / sqrt(p["g"] * p["w"]),
        "mu": p["m_H"] / p["m_B"],
        "chi_B": p["x_B"] / p["w"],
        "chi_H": p["x_H"] / p["w"],
        "zeta_B": p["z_B"] / p["w"],
        "zeta_H": p["z_H"] / p["w"],
        "lambda_s": p["lambda_s"],
    }


def to_si(p: AnyNumbers, w: Any = 1.0, m_B: Any = 1.0, g: Any = GRAVITY) -> dict[str, Any]:
    """SI values for dimensionless parameters, with the wheelbase w (m), the rear frame mass m_B (kg) and g (m/s²).

    Gains of a controller are converted too.

    Example:
        >>> design = dict(Fr=1.0, mu=0.1, chi_B=1.2, chi_H=1.0, zeta_B=-0.4, zeta_H=-0.2, lambda_s=0.1)
        >>> print(tmsopt.models.to_si(design, w=4.0, g=9.0)["v"])  # Fr √(g w)
        6.0

    More: docs/how_to/units.md
    """
    si_values = {
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
    gains = {n: p[native_name(n)] * si_scale(n, si_values, _rate, _torque) for n in FEEDBACK if native_name(n) in p}
    return {**si_values, **gains}


def _pencil(p: AnyNumbers) -> Matrices:
    """M, V, P from tan λ_s only, because cos λ_s = 1/√(1 + tan² λ_s) for every allowed tilt."""
    T = tan(p["lambda_s"])
    cosine = 1 / sqrt(1 + T * T)
    return matrices(**_without_tilt(p), sine=T * cosine, cosine=cosine)


def _rate(p: AnyNumbers) -> Any:
    """The unit of rates in 1/s, √(g/w)."""
    return sqrt(p["g"] / p["w"])


def _torque(p: AnyNumbers) -> Any:
    """The unit of torques in N m."""
    return p["m_B"] * p["g"] * p["w"]


_SI_QUANTITIES = quantities(_TABLES["quantities"]["SI"])
_SI = ParameterSet(
    "SI",
    parameters(_TABLES["parameters"]["SI"]),
    native=from_si,
    quantities=(*_SI_QUANTITIES, *time_quantities(_rate, "sqrt(g/w)")),
    rate=_rate,
    root_unit="√(g/w)",
    torque=_torque,
)
_IN_SI = {q.name: q for q in (*_SI_QUANTITIES, *quantities(_TABLES["quantities"]["shown"]))}

_ABSENT_ADVICE = {
    "trail": "skates have no trail; the distance of the front mass from the steer axis is nu_H, or u_H in SI: write "
    "'nu_H >= 0.02' or 'u_H >= 0.02'; for wheels and a trail, c, choose model = \"whipple\"",
}

tms = Model(
    name="tms",
    title="two-mass-skate bicycle",
    degree=4,
    sets=(_NATIVE, _SI),
    algebraic=lambda p: {**_without_tilt(p), "T": tan(p["lambda_s"])},
    polynomial=copo,
    quantities=quantities(_TABLES["quantities"]["dimensionless"], COMPUTED, _IN_SI),
    compact=compact_copo,
    pencil=_pencil,
    natural=True,
    origin=(resolve_name, (f"{__name__}:tms",)),
    words=WORDS,
    omits="two point masses on skates, without wheels, rotational inertia or trail",
    conventions=CONVENTIONS,
    sketch=TMS,
    absent=_ABSENT_ADVICE | NO_CONTROLLER,
)
"""The two-mass-skate bicycle."""


def _scaled_matrices(p: AnyNumbers) -> Matrices:
    """M, V, P for a steer angle in units of 1/cos λ_s."""
    return matrices(**_without_tilt(p), sine=p["T"], cosine=1)


CONTROLLABLE = ControllableBicycle(tms, _scaled_matrices, unit=lambda p, h: (h, 1 + p["T"] * p["T"]), speed="Fr")
