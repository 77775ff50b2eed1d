"""How exactly and how fast root patterns are traced, beside SciPy and a contour."""

import time
from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from benchmarks.reports.tables import Asked, page, table
from benchmarks.suites import EP_SET, HEIGHTS, PLANE
from tmsopt import laws, trace
from tmsopt.models import copo
from tmsopt.records import Array
from tmsopt.roots import discriminant, pattern

ZETA_B, ZETA_H = HEIGHTS["zeta_B"], HEIGHTS["zeta_H"]


@dataclass(frozen=True)
class Result:
    """One way to get the EP set: how many points, how exact in Fr, and at what cost."""

    name: str
    points: int
    error: float
    seconds: float

    @property
    def microseconds(self) -> float:
        """Per point."""
        return 1e6 * self.seconds / max(self.points, 1)


def ep_set(repeats: int) -> tuple[Result, Result, Result]:
    """The EP set by `trace`, by SciPy's root finder along lambda_s, and as a contour of the discriminant."""
    best, seconds = None, np.inf
    for _ in range(repeats):
        found = trace(EP_SET, step=0.001)
        if found.seconds_walking < seconds:
            best, seconds = found, found.seconds_walking
    assert best is not None
    branch = best.branches[0]
    Fr, tilt = branch.parameters["Fr"], branch.parameters["lambda_s"]
    traced = Result("tmsopt.trace, pseudo-arclength", len(branch), _error(Fr, tilt), seconds)
    return traced, _by_scipy(tilt, repeats), _by_contour()


def _error(Fr: Array, tilt: Array) -> float:
    """Largest difference from the closed form, in Fr."""
    return float(np.max(np.abs(Fr - laws.epset(ZETA_B, ZETA_H, tilt)))) if Fr.size else np.nan


def _by_scipy(tilt: Array, repeats: int) -> Result:
    """scipy.optimize.root on the same factored equations at the same tilts, each started from the one before."""

    monic = pattern("2EP2", 4).monic

    def mismatch(x: Array, T: float) -> list[float]:
        a = copo(x[0], 0.1, x[1], 1.0, ZETA_B, ZETA_H, T)
        return [p - a[0] * q for p, q in zip(a[1:], monic([x[2], x[3]])[1:], strict=True)]

    seconds = np.inf
    for _ in range(repeats):
        began = time.perf_counter()
        x = np.array([float(laws.epset(ZETA_B, ZETA_H, tilt[0])), np.sqrt(2), 1.0, 3.5])
        Fr = []
        for angle in tilt:
            x = root(mismatch, x, args=(float(np.tan(angle)),), tol=1e-14).x
            Fr.append(x[0])
        seconds = min(seconds, time.perf_counter() - began)
    return Result("scipy.optimize.root, one tilt after the other", len(Fr), _error(np.array(Fr), tilt), seconds)


def _by_contour() -> Result:
    """The zero contour of the discriminant at chi_B = √2 on a grid: it does not change sign across the EP set."""
    from matplotlib.figure import Figure

    began = time.perf_counter()
    Fr, tilt = np.meshgrid(np.linspace(*PLANE.posed.free["Fr"], 800), np.linspace(*PLANE.posed.free["lambda_s"], 600))
    values = discriminant(copo(Fr, 0.1, np.sqrt(2), 1.0, ZETA_B, ZETA_H, np.tan(tilt)))
    lines = Figure().subplots().contour(Fr, tilt, values, levels=[0.0])
    points = np.concatenate([p.vertices for p in lines.get_paths()])
    seconds = time.perf_counter() - began
    distance = np.abs(points[:, 0] - laws.epset(ZETA_B, ZETA_H, points[:, 1]))
    near = distance < 0.01
    error = float(np.max(distance[near])) if near.any() else np.nan
    return Result("contour of the discriminant, 800 × 600", int(near.sum()), error, seconds)


def report(asked: Asked) -> str:
    """The report in Markdown."""
    repeats = 1 if asked.quick else 5
    results = ep_set(repeats)
    rows = [
        (
            r.name,
            r.points,
            f"{r.error:.1e}" if np.isfinite(r.error) else "–",
            *((f"{r.microseconds:.0f}", f"{1e6 / r.microseconds:.0f}") if r.points else "––"),
        )
        for r in results
    ]
    ratio = results[1].microseconds / results[0].microseconds
    return page(
        "Tracing",
        asked,
        "The EP set of the paper, 2EP2 through EP4 to CEP2, at chi_H = 1:",
        table(("method", "points", "largest error in Fr", "µs a point", "points a second"), rows),
        f"The least of {repeats} runs each: SciPy takes {ratio:.0f} times as long a point. The error is against the "
        "closed form `epset`; points of the contour count when they lie within 0.01 of it.",
    )
