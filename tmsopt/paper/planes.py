"""Data of the paper's figures for χ_H = 1, planes and a surface: charts, exact boundaries, the EP set."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tmsopt import laws
from tmsopt.charts.chart import Chart, chart
from tmsopt.models import tms
from tmsopt.paper.reference import MU, ZETA_B, ZETA_H, table_1
from tmsopt.problem.problem import Problem
from tmsopt.records import Array, Table
from tmsopt.tracing.branch import Trace
from tmsopt.tracing.swallowtail import Swallowtail, swallowtail
from tmsopt.tracing.trace import trace

_FR_RANGE, _TILT_RANGE = (0.01, 5.0), (0.01, 1.5)
"""Ranges of Fr and of the tilt (in rad) in the planes."""

_CHI_B_RANGE = (1.001, 1.999)
"""Range of χ_B in the planes. A bicycle with λ_s > 0 can be stable for χ_B between 1 and ζ_B/ζ_H = 2."""

OFF_LAW_CHI_B = -0.1
"""Distance of χ_B from the law `chib1` in Fig. fig2."""

OFF_LAW_TILT = -0.18
"""Distance of the tilt from the law `tls` in Fig. fig2, in rad."""

SECTIONS = (0.0, -0.1, 0.5)
"""Distances from the Froude number of EP4 in Fig. fig00."""


@dataclass(frozen=True)
class Plane:
    """A plane of two parameters with the curves of the laws; all other parameters are fixed.

    Attributes:
        ep_set: traced 2EP2 and CEP2; None if the plane does not contain the EP set.
        laws: label of an equation → (horizontal, vertical) values of its curve; nan where the curve does not exist.
        marked_points: name → point to mark, (horizontal, vertical).
    """

    chart: Chart
    ep_set: Trace | None
    laws: Mapping[str, tuple[Array, Array]]
    marked_points: Mapping[str, tuple[float, float]]


def ep4() -> Table[float]:
    """Parameters of the EP4 of Table 1, from the closed-form laws."""
    return table_1()[0].parameters


def tilt_plane(chi_B_offset: float = 0.0, points: tuple[int, int] = (320, 240), boundaries: bool = True) -> Plane:
    """The plane (Fr, λ_s) at a distance in χ_B from the law `chib1`.

    Args:
        boundaries: whether to compute exact boundaries, and at distance 0 the EP set.
    """
    ep4_parameters, tilt = ep4(), np.linspace(*_TILT_RANGE, 1200)
    chi_B, is_on_law = ep4_parameters["chi_B"] + chi_B_offset, not chi_B_offset
    curves, marked = {"Frc1": (np.sqrt(laws.Frc1(chi_B, ZETA_B, ZETA_H, tilt)), tilt)}, {}
    if is_on_law:
        curves["epset"] = (np.asarray(laws.epset(ZETA_B, ZETA_H, tilt)), tilt)
        curves["tls"] = (np.array(_FR_RANGE), np.full(2, ep4_parameters["lambda_s"]))
        marked = {"EP4": (ep4_parameters["Fr"], ep4_parameters["lambda_s"])}
    plane = chart(
        bicycle({"chi_B": chi_B}, {"Fr": _FR_RANGE, "lambda_s": _TILT_RANGE}), points=points, boundaries=boundaries
    )
    return Plane(plane, ep_set() if is_on_law and boundaries else None, curves, marked)


def chi_B_plane(tilt_offset: float = 0.0, points: tuple[int, int] = (320, 240), boundaries: bool = True) -> Plane:
    """The plane (Fr, χ_B) at a distance in rad from the tilt of the law `tls`."""
    ep4_parameters, chi_B = ep4(), np.linspace(*_CHI_B_RANGE, 1200)
    tilt = ep4_parameters["lambda_s"] + tilt_offset
    curves = {
        "Frc1": (np.sqrt(laws.Frc1(chi_B, ZETA_B, ZETA_H, tilt)), chi_B),
        "chib1": (np.array(_FR_RANGE), np.full(2, ep4_parameters["chi_B"])),
    }
    marked = {"least Fr_c": (float(laws.frm(ZETA_B, ZETA_H, tilt)), ep4_parameters["chi_B"])}
    if not tilt_offset:
        marked["EP4"] = (ep4_parameters["Fr"], ep4_parameters["chi_B"])
    problem = bicycle({"lambda_s": tilt}, {"Fr": _FR_RANGE, "chi_B": _CHI_B_RANGE})
    return Plane(chart(problem, points=points, boundaries=boundaries), None, curves, marked)


def section(Fr_offset: float, points: tuple[int, int] = (240, 200)) -> Plane:
    """The plane (χ_B, λ_s) at a distance from the Froude number of EP4."""
    ep4_parameters = ep4()
    problem = bicycle({"Fr": ep4_parameters["Fr"] + Fr_offset}, {"chi_B": _CHI_B_RANGE, "lambda_s": (0.01, 1.2)})
    marked = {} if Fr_offset else {"EP4": (ep4_parameters["chi_B"], ep4_parameters["lambda_s"])}
    return Plane(chart(problem, points=points), None, {}, marked)


def surface() -> Swallowtail:
    """The discriminant surface around the EP4 of Table 1 in (Fr, χ_B, λ_s)."""
    box = {"Fr": (1.9, 3.2), "chi_B": (1.1, 1.8), "lambda_s": (0.02, 0.75)}
    return swallowtail(bicycle({}, box))


def ep_set() -> Trace:
    """The EP set of the paper, traced by the pattern without the laws."""
    free = {"Fr": _FR_RANGE, "chi_B": (1.01, 3.0), "lambda_s": _TILT_RANGE}
    return trace(bicycle({}, free), "2EP2", step=0.004)


def bicycle(fixed: Mapping[str, float], free: Mapping[str, tuple[float, float]]) -> Problem:
    """The χ_H = 1 bicycle with the heights of the benchmark."""
    geometry = {"chi_H": 1.0, "zeta_B": ZETA_B, "zeta_H": ZETA_H, "mu": MU}
    return Problem(tms, fixed={**geometry, **fixed}, free=dict(free))
