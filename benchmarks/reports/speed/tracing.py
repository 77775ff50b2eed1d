"""How exactly and how fast root patterns are traced, beside SciPy and a contour: ``python -m benchmarks.trace``."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import click
import numpy as np

from benchmarks.reports.tables import keep, kept, origin
from tmsopt import Problem, chart, domain, laws, models, trace
from tmsopt.models.tms import copo
from tmsopt.records import Array
from tmsopt.roots import PATTERNS, discriminant

T = TypeVar("T")

ZETA_B, ZETA_H = -0.4, -0.2
_FIXED = {"chi_H": 1.0, "zeta_B": ZETA_B, "zeta_H": ZETA_H, "mu": 0.1}
_SET = {"Fr": (0.5, 4.0), "chi_B": (1.01, 3.0), "lambda_s": (0.02, 1.4)}
_PLANE = {"Fr": (0.01, 5.0), "lambda_s": (0.01, 1.4)}
_REPEATS = 5


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


def ep_set(repeats: int = _REPEATS) -> tuple[Result, Result, Result]:
    """The EP set by `trace`, by SciPy's root finder along lambda_s, and as a contour of the discriminant."""
    problem = Problem(models.tms, fixed=_FIXED, free=_SET, locate="2EP2")
    best, seconds = None, np.inf
    for _ in range(repeats):
        found = trace(problem, step=0.001)
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
    from scipy.optimize import root

    pattern = PATTERNS["2EP2"]

    def mismatch(x: Array, T: float) -> list[float]:
        a = copo(x[0], 0.1, x[1], 1.0, ZETA_B, ZETA_H, T)
        return [p - a[0] * q for p, q in zip(a[1:], pattern.monic([x[2], x[3]])[1:], strict=True)]

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
    Fr, tilt = np.meshgrid(np.linspace(*_PLANE["Fr"], 800), np.linspace(*_PLANE["lambda_s"], 600))
    values = discriminant(copo(Fr, 0.1, np.sqrt(2), 1.0, ZETA_B, ZETA_H, np.tan(tilt)))
    lines = Figure().subplots().contour(Fr, tilt, values, levels=[0.0])
    points = np.concatenate([p.vertices for p in lines.get_paths()])
    seconds = time.perf_counter() - began
    distance = np.abs(points[:, 0] - laws.epset(ZETA_B, ZETA_H, points[:, 1]))
    near = distance < 0.01
    error = float(np.max(distance[near])) if near.any() else np.nan
    return Result("contour of the discriminant, 800 × 600", int(near.sum()), error, seconds)


def others() -> list[tuple[str, int, float]]:
    """Name, points and seconds of other sets: EP4 over chi_H, the discriminant curve, a domain, a chart."""
    ep4 = Problem(
        models.tms,
        fixed={"zeta_B": ZETA_B, "zeta_H": ZETA_H, "mu": 0.1},
        free={**_SET, "Fr": (0.01, 10.0), "chi_H": (0.8, 1.2)},
        locate="EP4",
    )
    off_law = Problem(models.tms, fixed={**_FIXED, "chi_B": np.sqrt(2) - 0.1}, free=_PLANE)
    rows = []
    for name, found in (("EP4 over chi_H", trace(ep4)), ("EP2 beside the law", trace(off_law, "EP2"))):
        rows.append((f"{name}, {len(found.branches)} branches", found.points, found.seconds))
    arcs, seconds = _timed(lambda: domain(off_law))
    count = sum(len(a.points["Fr"]) for a in (*arcs.stability, *arcs.heavy_damping))
    rows.append(("boundaries of stability and heavy damping in a plane", count, seconds))
    _, seconds = _timed(lambda: chart(off_law, points=(400, 300), boundaries=False))
    rows.append(("chart of 400 × 300 designs", 120_000, seconds))
    return rows


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    began = time.perf_counter()
    done = work()
    return done, time.perf_counter() - began


def section(command: str, quick: bool = False) -> str:
    """The report in Markdown."""
    repeats = 1 if quick else _REPEATS
    results = ep_set(repeats)
    lines = [
        "## Tracing",
        "",
        origin(command),
        "",
        "The EP set of the paper, 2EP2 through EP4 to CEP2, at chi_H = 1:",
        "",
    ]
    lines += ["| method | points | largest error in Fr | µs a point | points a second |", "|---|---|---|---|---|"]
    for r in results:
        error = f"{r.error:.1e}" if np.isfinite(r.error) else "–"
        cost = f"{r.microseconds:.0f}" if r.points else "–"
        rate = f"{1e6 / r.microseconds:.0f}" if r.points else "–"
        lines.append(f"| {r.name} | {r.points} | {error} | {cost} | {rate} |")
    ratio = results[1].microseconds / results[0].microseconds
    lines += [
        "",
        f"The least of {repeats} runs each: SciPy takes {ratio:.0f} times as long a point. The error is against the "
        "closed form `epset`; points of the contour count when they lie within 0.01 of it.",
        "",
        "| other work | points | seconds, search for branches included | points a second |",
        "|---|---|---|---|",
    ]
    lines += [f"| {name} | {points} | {s:.2f} | {points / s:.0f} |" for name, points, s in others()]
    return "\n".join(lines) + "\n"


@click.command()
@kept
def main(output: Path) -> None:
    """Trace the EP set in three ways, print the tables and keep them."""
    text = section("python -m benchmarks.trace")
    click.echo(text)
    keep(output, "trace", text)


if __name__ == "__main__":
    main()
