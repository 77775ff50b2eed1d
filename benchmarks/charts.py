"""Section (b): charts, beside stacked eigenvalues, a loop of numpy.roots and the rate at which memory is copied."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.measure import best, duration, times
from benchmarks.report import origin, table
from tmsopt import Chart, chart, load
from tmsopt.design.problem import Problem
from tmsopt.roots import abscissa, is_stable
from tmsopt.study.grid import coefficients

Array = NDArray[np.float64]

STACKED = "stacked numpy.linalg.eigvals"
_LOOP = 2_000
_BLOCK = 20_000  # designs in work at once, of every method: the intermediate arrays stay in the cache
_COPIED = 256 * 2**20  # bytes: far beyond any cache
_PROBLEM = Path(__file__).parent.parent / "problems" / "chart.toml"


@dataclass(frozen=True)
class Method:
    """A way to a chart: what it gives, of how many designs, and the work."""

    name: str
    gives: str
    points: int
    work: Callable[[], Any]


def methods(problem: Problem, points: int) -> list[Method]:
    """Rivals first. Those that begin with coefficients have them ready; a chart makes its own."""
    ready = grid_coefficients(problem, points)
    across = int(np.sqrt(points))
    return [
        Method("loop of numpy.roots", "abscissa", _LOOP, lambda: [np.roots(a).real.max() for a in ready[:_LOOP]]),
        Method(STACKED, "abscissa", points, lambda: by_blocks(stacked, ready)),
        Method("tmsopt.roots.abscissa", "abscissa", points, lambda: by_blocks(abscissa, ready)),
        Method("tmsopt.roots.is_stable", "stable or not", points, lambda: by_blocks(is_stable, ready)),
        Method(
            "tmsopt.chart", "class, abscissa, damping ratio, real roots", across**2,
            lambda: chart(problem, points=(across, across), boundaries=False),
        ),
    ]  # fmt: skip


def grid_coefficients(problem: Problem, points: int) -> Array:
    """Coefficients of a square grid of designs."""
    across = int(np.ceil(np.sqrt(points)))
    first, second = np.meshgrid(*(np.linspace(*ends, across) for ends in problem.free.values()))
    columns = dict(zip(problem.free, (first.ravel()[:points], second.ravel()[:points]), strict=True))
    return coefficients(problem, columns)


def stacked(a: Array) -> Array:
    """Largest real part of the eigenvalues of stacked companion matrices, as in `numpy.roots`."""
    companion = np.zeros((len(a), 4, 4))
    companion[:, 0, :] = -a[:, 1:] / a[:, :1]
    companion[:, np.arange(1, 4), np.arange(3)] = 1
    return np.asarray(np.linalg.eigvals(companion).real.max(axis=-1))


def by_blocks(work: Callable[[Array], Any], a: Array) -> None:
    """Some work on all coefficients, a block at a time."""
    for start in range(0, len(a), _BLOCK):
        work(a[start : start + _BLOCK])


def copy_rate(repeats: int = 5) -> float:
    """Bytes a second that NumPy copies from one large array to another."""
    source = np.ones(_COPIED // 8)
    target = np.zeros_like(source)
    return _COPIED / best({"copy": lambda: np.copyto(target, source)}, repeats)["copy"]


def bytes_per_design(found: Chart) -> float:
    """Of everything that a chart says about a design."""
    arrays = (found.kind, found.abscissa, found.damping_ratio, found.real_roots, found.satisfied, found.margin)
    return sum(a.nbytes for a in arrays) / found.kind.size


def section(command: str, quick: bool = False) -> str:
    """The report in Markdown."""
    problem = load(_PROBLEM, asks=False)
    every = methods(problem, 20_000 if quick else 250_000)
    seconds = best({m.name: m.work for m in every}, 2 if quick else 5)
    each = {m.name: seconds[m.name] / m.points for m in every}
    rows = [
        (
            m.name,
            m.gives,
            m.points,
            duration(each[m.name]),
            f"{1 / each[m.name]:.3g}",
            times(each[STACKED] / each[m.name]),
        )
        for m in every
    ]
    width = bytes_per_design(chart(problem, points=(50, 50), boundaries=False))
    rate, copied = width / each["tmsopt.chart"], copy_rate()
    parts = [
        "## Charts",
        origin(command),
        table(("method", "gives", "designs", "time a design", "designs a second", f"{STACKED} = 1"), rows),
        f"A chart has {width:.0f} bytes for a design, {rate / 1e6:.3g} MB/s; memory is copied at {copied / 1e9:.3g} "
        f"GB/s, {times(copied / rate)} times as fast (`numpy.copyto` of {_COPIED // 2**20} MB). The least of several "
        "rounds, in which all methods take turns.",
    ]
    return "\n\n".join(parts) + "\n"
