"""The experimental bicycle beside the scaling law, and how flat the optimum is that the law describes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from tmsopt import laws
from tmsopt.paper.reference import ReferenceBicycle, benchmark, experimental, optimised
from tmsopt.records import Array
from tmsopt.roots import is_stable

TILT = np.deg2rad(20.0)
"""Assumed steer axis tilt in rad: the source gives none for the experimental bicycle."""

MASS_RATIOS = (0.1, 1.0, 3.0)
"""Assumed mass ratios, likewise."""

_POINTS = 601
_JUST_ABOVE = 1 + 1e-6  # of Fr_c: where a bicycle that gains stability at Fr_c must have it


@dataclass(frozen=True)
class ExperimentPoint:
    """A bicycle in the plane of the law: χ_B over ζ_B/ζ_H; ω0 where it fulfils the law for any χ_H (equation chib)."""

    name: str
    ratio: float
    chi_B: float
    chi_H: float
    omega0: float


@dataclass(frozen=True)
class CriticalSpeed:
    """Fr_c over χ_B for one geometry.

    Attributes:
        chi_B: ascending, shape (n,).
        Fr_c: shape (n,), nan where no speed above it is stable.
        chi_H, mu: of this curve; at χ_H = 1 the mass ratio has no influence and is nan.
        best: (χ_B, Fr_c) at the minimum, nan where no χ_B is stable.
        own: Fr_c at the χ_B that was built, likewise.
        flat: range of χ_B where Fr_c exceeds the minimum by at most `slack`, as a fraction.
    """

    chi_B: Array
    Fr_c: Array
    chi_H: float
    mu: float
    best: tuple[float, float]
    own: float
    flat: tuple[float, float]
    slack: float


@dataclass(frozen=True)
class Experiment:
    """Attributes: the law's curve, shape (n,); bicycles beside it; Fr_c over χ_B at `lambda_s` (rad)."""

    ratio: Array
    law: Array
    points: tuple[ExperimentPoint, ...]
    chi_B: float
    lambda_s: float
    least_tilt: float
    critical: tuple[CriticalSpeed, ...]


def experiment(lambda_s: float = TILT, mass_ratios: tuple[float, ...] = MASS_RATIOS) -> Experiment:
    """The law χ_B = √(ζ_B/ζ_H) with three bicycles, and Fr_c over χ_B for the experimental one.

    The first critical curve is that of the law, χ_H = 1; the others have the measured χ_H. `least_tilt` is the
    tilt in rad above which H stands in front of the steer axis, as self-stability needs (equation lscf).
    """
    built = experimental()
    p = built.parameters
    ratio = np.linspace(1.0, 3.0, _POINTS)
    curves = [_critical(1.0, np.nan, lambda_s), *(_critical(p["chi_H"], mu, lambda_s) for mu in mass_ratios)]
    return Experiment(
        ratio=ratio,
        law=np.asarray(laws.chib1(-ratio, np.full_like(ratio, -1.0))),
        points=tuple(_point(bicycle) for bicycle in (built, benchmark(), optimised())),
        chi_B=p["chi_B"],
        lambda_s=lambda_s,
        least_tilt=float(np.arctan((p["chi_H"] - 1) / p["zeta_H"])),
        critical=tuple(curves),
    )


def _point(bicycle: ReferenceBicycle) -> ExperimentPoint:
    p = bicycle.parameters
    return ExperimentPoint(bicycle.name, p["zeta_B"] / p["zeta_H"], p["chi_B"], p["chi_H"], bicycle.omega0)


def _critical(chi_H: float, mu: float, lambda_s: float, slack: float = 0.01) -> CriticalSpeed:
    """Fr_c between its poles χ_B = χ_H and χ_B = χ_H ζ_B/ζ_H."""
    p = experimental().parameters
    low, high = chi_H, chi_H * p["zeta_B"] / p["zeta_H"]
    weight = 0.0 if np.isnan(mu) else mu

    def value(chi_B: Array) -> Array:
        geometry = (weight, chi_B, chi_H, p["zeta_B"], p["zeta_H"], lambda_s)
        critical = laws.Fr_c(*geometry)
        a = np.moveaxis(laws.copo(critical * _JUST_ABOVE, *geometry), 0, -1)
        return np.where(is_stable(np.nan_to_num(a)), critical, np.nan)

    def square(chi_B: float) -> float:
        return float(laws.flus(weight, chi_B, chi_H, p["zeta_B"], p["zeta_H"], lambda_s))

    def level(chi_B: float) -> float:
        return float(value(np.asarray(chi_B)))

    margin = 1e-3 * (high - low)
    chi_B = np.linspace(low, high, _POINTS)[1:-1]
    least = minimize_scalar(square, bounds=(low + margin, high - margin), method="bounded", options={"xatol": 1e-10})
    stable = bool(np.isfinite(level(float(least.x))))
    best = float(least.x) if stable else np.nan
    return CriticalSpeed(
        chi_B=chi_B,
        Fr_c=value(chi_B),
        chi_H=chi_H,
        mu=mu,
        best=(best, level(best)),
        own=level(p["chi_B"]),
        flat=_flat(square, best, (low + margin, high - margin), (1 + slack) ** 2) if stable else (np.nan, np.nan),
        slack=slack,
    )


def _flat(
    square: Callable[[float], float], best: float, ends: tuple[float, float], factor: float
) -> tuple[float, float]:
    """Where a function with one minimum between two poles exceeds it by a factor, on either side."""
    level = factor * square(best)
    low, high = (float(brentq(lambda x: square(x) - level, best, end)) for end in ends)
    return low, high
