"""The experimental bicycle compared with the scaling law, and the flatness of the law's optimum."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from tmsopt import laws
from tmsopt.paper.reference import ReferenceBicycle, benchmark, experimental, optimised_benchmark
from tmsopt.records import Array
from tmsopt.roots import is_stable

TILT = np.deg2rad(20.0)
"""Assumed steer axis tilt in rad: the source gives none for the experimental bicycle."""

MASS_RATIOS = (0.1, 1.0, 3.0)
"""Assumed mass ratios, which the source does not give either."""

SLACK = 0.01
"""Relative excess over the least Fr_c that counts as equally good."""

_POINTS = 601
_JUST_ABOVE = 1 + 1e-6  # speed relative to Fr_c at which stability is checked


@dataclass(frozen=True)
class CriticalSpeed:
    """Fr_c over χ_B for one geometry.

    Attributes:
        chi_B: ascending, shape (n,).
        Fr_c: shape (n,), nan where no speed above it is stable.
        chi_H, mu: parameters of this curve; at χ_H = 1 the mass ratio has no influence and is nan.
        best: (χ_B, Fr_c) at the minimum; nan if no χ_B is stable.
        own: Fr_c at the χ_B of the built bicycle; nan if unstable.
        flat: range of χ_B where Fr_c exceeds the minimum by at most `SLACK`.
    """

    chi_B: Array
    Fr_c: Array
    chi_H: float
    mu: float
    best: tuple[float, float]
    own: float
    flat: tuple[float, float]


@dataclass(frozen=True)
class Experiment:
    """The law's curve, shape (n,); bicycles to compare, the built one first; Fr_c over χ_B at `lambda_s` (rad)."""

    ratio: Array
    law: Array
    bicycles: tuple[ReferenceBicycle, ...]
    lambda_s: float
    least_tilt: float
    critical: tuple[CriticalSpeed, ...]


def experiment(lambda_s: float = TILT) -> Experiment:
    """The law χ_B = √(ζ_B/ζ_H) with three bicycles, and Fr_c over χ_B for the experimental one.

    The first critical curve is that of the law, χ_H = 1; the others have the measured χ_H. `least_tilt` is the
    tilt in rad above which H stands in front of the steer axis, as self-stability needs (equation lscf).
    """
    built = experimental()
    p, ratio = built.parameters, np.linspace(1.0, 3.0, _POINTS)
    shapes = [(1.0, np.nan), *((p["chi_H"], mu) for mu in MASS_RATIOS)]
    return Experiment(
        ratio=ratio,
        law=np.asarray(laws.chib1(-ratio, np.full_like(ratio, -1.0))),
        bicycles=(built, benchmark(), optimised_benchmark()),
        lambda_s=lambda_s,
        least_tilt=float(np.arctan((p["chi_H"] - 1) / p["zeta_H"])),
        critical=tuple(_critical(chi_H, mu, lambda_s) for chi_H, mu in shapes),
    )


def _critical(chi_H: float, mu: float, lambda_s: float) -> CriticalSpeed:
    """Fr_c between its poles χ_B = χ_H and χ_B = χ_H ζ_B/ζ_H."""
    p = experimental().parameters
    low, high = chi_H, chi_H * p["zeta_B"] / p["zeta_H"]

    def geometry(chi_B: Any) -> tuple[Any, ...]:
        return np.nan_to_num(mu), chi_B, chi_H, p["zeta_B"], p["zeta_H"], lambda_s

    def value(chi_B: Any) -> Any:
        critical = laws.Fr_c(*geometry(chi_B))
        a = np.moveaxis(laws.copo(critical * _JUST_ABOVE, *geometry(chi_B)), 0, -1)
        return np.where(is_stable(np.nan_to_num(a)), critical, np.nan)[()]

    def square(chi_B: float) -> float:
        return float(laws.flus(*geometry(chi_B)))

    chi_B, margin = np.linspace(low, high, _POINTS)[1:-1], 1e-3 * (high - low)
    ends = low + margin, high - margin
    best = float(minimize_scalar(square, bounds=ends, method="bounded", options={"xatol": 1e-10}).x)
    flat = np.nan, np.nan
    if np.isfinite(value(best)):
        # Fr_c² has one minimum between two poles; find where Fr_c exceeds it by the slack on either side
        level = (1 + SLACK) ** 2 * square(best)
        low, high = (float(brentq(lambda x: square(x) - level, best, end)) for end in ends)
        flat = low, high
    else:
        best = np.nan
    return CriticalSpeed(chi_B, value(chi_B), chi_H, mu, (best, value(best)), value(p["chi_B"]), flat)
