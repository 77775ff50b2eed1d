"""Compares the experimental bicycle with the scaling law, and shows how flat the optimum of the law is."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from tmsopt import laws
from tmsopt.paper.reference import ReferenceBicycle, benchmark, experimental, optimised_benchmark
from tmsopt.records import Array
from tmsopt.roots import is_stable

TILT = np.deg2rad(20.0)
"""Assumed steer axis tilt in rad; the source gives no tilt for the experimental bicycle."""

MASS_RATIOS = (0.1, 1.0, 3.0)
"""Assumed mass ratios; the source gives no mass ratio for the experimental bicycle."""

FLAT_SHARE = 0.01
"""Fr_c counts as equally good if it exceeds the smallest Fr_c by at most this share."""

_CURVE_POINTS = 601  # number of points of a curve
_CHECKED_SPEED = 1 + 1e-6  # speed relative to Fr_c at which stability is checked


@dataclass(frozen=True)
class CriticalSpeed:
    """Fr_c over χ_B for one geometry.

    Attributes:
        chi_B: ascending values, shape (n,).
        Fr_c: critical Froude numbers, shape (n,); nan where no higher speed is stable.
        chi_H, mu: parameters of this curve; at χ_H = 1 the mass ratio has no influence and is nan.
        minimum: (χ_B, Fr_c) at the minimum; nan if no χ_B is stable.
        experimental_Fr_c: Fr_c at the χ_B of the experimental bicycle; nan if it is unstable.
        flat_range: range of χ_B in which Fr_c exceeds the minimum by at most `FLAT_SHARE`.
    """

    chi_B: Array
    Fr_c: Array
    chi_H: float
    mu: float
    minimum: tuple[float, float]
    experimental_Fr_c: float
    flat_range: tuple[float, float]


@dataclass(frozen=True)
class Experiment:
    """The law and the bicycles to compare with it.

    Attributes:
        ratio, law: ζ_B/ζ_H and χ_B of the law, shape (n,).
        bicycles: the experimental bicycle, the benchmark, and the optimised benchmark.
        lambda_s: steer axis tilt of `critical` in rad.
        least_tilt: tilt in rad above which H is in front of the steer axis.
        critical: Fr_c over χ_B, first for χ_H = 1, then for the measured χ_H and each of `MASS_RATIOS`.
    """

    ratio: Array
    law: Array
    bicycles: tuple[ReferenceBicycle, ...]
    lambda_s: float
    least_tilt: float
    critical: tuple[CriticalSpeed, ...]


def experiment(lambda_s: float = TILT) -> Experiment:
    """The law χ_B = √(ζ_B/ζ_H) with three bicycles, and Fr_c over χ_B for the experimental bicycle.

    Self-stability needs a tilt above `least_tilt` (equation lscf).
    """
    experimental_bicycle = experimental()
    p, ratio = experimental_bicycle.parameters, np.linspace(1.0, 3.0, _CURVE_POINTS)
    shapes = [(1.0, np.nan), *((p["chi_H"], mu) for mu in MASS_RATIOS)]
    return Experiment(
        ratio=ratio,
        law=np.asarray(laws.chib1(-ratio, np.full_like(ratio, -1.0))),
        bicycles=(experimental_bicycle, benchmark(), optimised_benchmark()),
        lambda_s=lambda_s,
        least_tilt=float(np.arctan((p["chi_H"] - 1) / p["zeta_H"])),
        critical=tuple(_compute_critical_speed(chi_H, mu, lambda_s) for chi_H, mu in shapes),
    )


def _compute_critical_speed(chi_H: float, mu: float, lambda_s: float) -> CriticalSpeed:
    """Fr_c between its poles χ_B = χ_H and χ_B = χ_H ζ_B/ζ_H."""
    p = experimental().parameters
    low, high = chi_H, chi_H * p["zeta_B"] / p["zeta_H"]

    def geometry(chi_B: Any) -> tuple[Any, ...]:
        return np.nan_to_num(mu), chi_B, chi_H, p["zeta_B"], p["zeta_H"], lambda_s

    def value(chi_B: Any) -> Any:
        critical = laws.Fr_c(*geometry(chi_B))
        a = np.moveaxis(laws.copo(critical * _CHECKED_SPEED, *geometry(chi_B)), 0, -1)
        return np.where(is_stable(np.nan_to_num(a)), critical, np.nan)[()]

    def square(chi_B: float) -> float:
        return float(laws.flus(*geometry(chi_B)))

    chi_B, margin = np.linspace(low, high, _CURVE_POINTS)[1:-1], 1e-3 * (high - low)
    ends = low + margin, high - margin
    best = float(minimize_scalar(square, bounds=ends, method="bounded", options={"xatol": 1e-10}).x)
    flat_range = np.nan, np.nan
    if np.isfinite(value(best)):
        # Fr_c² has one minimum between two poles; on each side of it, find where Fr_c is larger by `FLAT_SHARE`.
        level = (1 + FLAT_SHARE) ** 2 * square(best)
        low, high = (float(brentq(lambda x: square(x) - level, best, end)) for end in ends)
        flat_range = low, high
    else:
        best = np.nan
    return CriticalSpeed(chi_B, value(chi_B), chi_H, mu, (best, value(best)), value(p["chi_B"]), flat_range)
