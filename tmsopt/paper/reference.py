"""The bicycles of the paper as data, in closed form where it gives one."""

import math
from dataclasses import dataclass

from tmsopt import laws
from tmsopt.models import GRAVITY, from_si
from tmsopt.records import Table

ZETA_B, ZETA_H = laws.bench["z_B"] / laws.bench["w"], laws.bench["z_H"] / laws.bench["w"]
"""Heights of the benchmark, over the wheelbase, that the paper keeps in all its examples."""

MU = laws.bench["m_H"] / laws.bench["m_B"]
"""Mass ratio of the benchmark; at χ_H = 1 any other gives the same polynomial."""

TILT_OFFSETS = Table({"EP4": 0.0, "2EP2": -0.05, "CEP2": 0.8})
"""Steer axis tilts of Table 1 in rad, from that of EP4."""


@dataclass(frozen=True)
class ReferenceBicycle:
    """A bicycle of the paper.

    Attributes:
        name: as in figures.
        parameters: native parameters (dimensionless, rad); those that the paper does not give are missing.
        omega0: root of the exceptional point, or the mean decay for a pair of them; nan for neither.
    """

    name: str
    parameters: Table[float]
    omega0: float = math.nan


def benchmark() -> ReferenceBicycle:
    """The benchmark (equation bench) at its critical speed (equation flus), as it has no other."""
    native = from_si({**laws.bench, "v": 0.0, "g": GRAVITY})
    native["Fr"] = laws.Fr_c(*(native[n] for n in _GEOMETRY))
    return ReferenceBicycle("benchmark", Table({name: float(value) for name, value in native.items()}))


def optimised() -> ReferenceBicycle:
    """The optimised benchmark: ω0 = −1 with χ_H, ζ_B, ζ_H of the benchmark (equations chib, a2, w0)."""
    chi_H = laws.bench["x_H"] / laws.bench["w"]
    return _at_point("optimised benchmark", laws.ep4(-1.0, ZETA_B, ZETA_H, chi_H)[0], chi_H=chi_H)


def table_1() -> tuple[ReferenceBicycle, ReferenceBicycle, ReferenceBicycle]:
    """The rows EP4, 2EP2 and CEP2 of Table 1, at their exceptional points (equations chib1, tls, epset)."""
    ep4, double, pair = (on_ep_set(name, offset) for name, offset in TILT_OFFSETS.items())
    return ep4, double, pair


def on_ep_set(name: str, tilt_offset: float) -> ReferenceBicycle:
    """The χ_H = 1 bicycle on the EP set whose steer axis tilt differs from that of EP4 by an offset in rad."""
    point = laws.ep4_chi_H_1(ZETA_B, ZETA_H)
    tilt = float(point.lambda_s) + tilt_offset
    # at EP4 both are the same number; the form for EP4 has no pole to cancel
    Fr = float(laws.epset(ZETA_B, ZETA_H, tilt)) if tilt_offset else float(point.Fr)
    return _at_point(name, point, chi_H=1.0, Fr=Fr, mu=MU, lambda_s=tilt)


def _at_point(name: str, point: laws.EP4, **given: float) -> ReferenceBicycle:
    """A bicycle with the heights of the benchmark and what the laws say of the parameters not given."""
    given |= {"zeta_B": ZETA_B, "zeta_H": ZETA_H}
    parameters = {n: given[n] if n in given else float(getattr(point, n)) for n in ("Fr", *_GEOMETRY)}
    return ReferenceBicycle(name, Table(parameters), float(point.omega0))


def experimental() -> ReferenceBicycle:
    """The bicycle that was built, as measured on its photograph; speed, mass ratio and tilt are not given."""
    return ReferenceBicycle("experimental", Table({"chi_B": 1.526, "chi_H": 0.921, "zeta_B": -1.158, "zeta_H": -0.526}))


_GEOMETRY = ("mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")
