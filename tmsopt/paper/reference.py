"""The bicycles of the paper as data; their parameters are in closed form if the paper gives one."""

import math
from dataclasses import dataclass

from tmsopt import laws
from tmsopt.models import GRAVITY, from_si
from tmsopt.records import Table

ZETA_B, ZETA_H = laws.bench["z_B"] / laws.bench["w"], laws.bench["z_H"] / laws.bench["w"]
"""Heights of the benchmark bicycle relative to its wheelbase; the paper uses them in all its examples."""

MU = laws.bench["m_H"] / laws.bench["m_B"]
"""Mass ratio of the benchmark; at χ_H = 1 the polynomial does not depend on it."""

TILT_OFFSETS = Table({"EP4": 0.0, "2EP2": -0.05, "CEP2": 0.8})
"""Steer axis tilts of Table 1 in rad, relative to the tilt of EP4."""


@dataclass(frozen=True)
class ReferenceBicycle:
    """A bicycle of the paper.

    Attributes:
        name: name in figures.
        parameters: native parameters (dimensionless, rad), without those that the paper does not give.
        omega0: root of the exceptional point, or the mean real part of a pair of such roots; nan without one.
    """

    name: str
    parameters: Table[float]
    omega0: float = math.nan


def benchmark() -> ReferenceBicycle:
    """The benchmark (equation bench) at its critical speed (equation flus), the only speed that the paper gives."""
    native = from_si({**laws.bench, "v": 0.0, "g": GRAVITY})
    native["Fr"] = laws.Fr_c(*(native[n] for n in _GEOMETRY))
    return ReferenceBicycle("benchmark", Table({name: float(value) for name, value in native.items()}))


def optimised_benchmark() -> ReferenceBicycle:
    """The optimised benchmark: ω0 = −1 with χ_H, ζ_B, ζ_H of the benchmark (equations chib, a2, w0)."""
    chi_H = laws.bench["x_H"] / laws.bench["w"]
    return _make_bicycle("optimised benchmark", laws.ep4(-1.0, ZETA_B, ZETA_H, chi_H)[0], chi_H=chi_H)


def table_1() -> tuple[ReferenceBicycle, ReferenceBicycle, ReferenceBicycle]:
    """The rows EP4, 2EP2 and CEP2 of Table 1, at their exceptional points (equations chib1, tls, epset)."""
    ep4, double_pair, pair = (ep_set_bicycle(name, offset) for name, offset in TILT_OFFSETS.items())
    return ep4, double_pair, pair


def ep_set_bicycle(name: str, tilt_offset: float) -> ReferenceBicycle:
    """The χ_H = 1 bicycle on the EP set at a given offset in rad from the steer axis tilt of EP4."""
    point = laws.ep4_chi_H_1(ZETA_B, ZETA_H)
    tilt = float(point.lambda_s) + tilt_offset
    # Both forms are equal at EP4, but there the first one has a pole that cancels.
    Fr = float(laws.epset(ZETA_B, ZETA_H, tilt)) if tilt_offset else float(point.Fr)
    return _make_bicycle(name, point, chi_H=1.0, Fr=Fr, mu=MU, lambda_s=tilt)


def _make_bicycle(name: str, point: laws.EP4, **known: float) -> ReferenceBicycle:
    """A bicycle with the heights of the benchmark and the known parameters; the laws give the other parameters."""
    known |= {"zeta_B": ZETA_B, "zeta_H": ZETA_H}
    parameters = {n: known[n] if n in known else float(getattr(point, n)) for n in ("Fr", *_GEOMETRY)}
    return ReferenceBicycle(name, Table(parameters), float(point.omega0))


def experimental() -> ReferenceBicycle:
    """The bicycle that was built, as measured on its photograph; its speed, mass ratio and tilt are unknown."""
    return ReferenceBicycle("experimental", Table({"chi_B": 1.526, "chi_H": 0.921, "zeta_B": -1.158, "zeta_H": -0.526}))


_GEOMETRY = ("mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")
