"""Section (b): charts, beside stacked eigenvalues, a loop of numpy.roots and the rate at which memory is copied."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.reports.tables import origin, table
from benchmarks.timing import best, duration, times
from tmsopt import load
from tmsopt.charts.stored import gathered
from tmsopt.charts.survey import USUAL, Survey, survey
from tmsopt.design.problem import Problem
from tmsopt.records import Array
from tmsopt.roots import quartic_is_stable
from tmsopt.tracing.seeds import coefficients

STACKED = "stacked numpy.linalg.eigvals"
PROBLEM = Path(__file__).parents[3] / "problems" / "chart.toml"

_LOOP = 2_000
_BLOCK = 20_000  # matrices in work at once: their arrays stay in the cache
_COPIED = 256 * 2**20  # bytes: far beyond any cache
_LAYERS = {"abscissa": ("abscissa",), "class": ("kind",), "class, abscissa, damping ratio, real roots": USUAL}


@dataclass(frozen=True)
class Method:
    """A way to a chart: what it gives, of how many designs, and the work.

    Attributes:
        width: bytes of the answer for a design; 0 where it is not a chart.
    """

    name: str
    gives: str
    points: int
    work: Callable[[], Any]
    width: int = 0


def methods(problem: Problem, points: int) -> Iterator[Method]:
    """Rivals first, with a fifth of the designs. They have their coefficients ready; a chart makes its own."""
    ready = grid_coefficients(problem, points // 5)
    yield Method("loop of numpy.roots", "abscissa", _LOOP, lambda: [np.roots(a).real.max() for a in ready[:_LOOP]])
    yield Method(STACKED, "abscissa", len(ready), lambda: by_blocks(stacked, ready))
    across = int(np.sqrt(points))
    many = np.ascontiguousarray(grid_coefficients(problem, points).T)
    for engine in engines():
        yield Method(
            f"tmsopt.roots.quartic_is_stable, {engine}", "stable or not", points,
            partial(quartic_is_stable, *many, compiled=engine == "numba"),
        )  # fmt: skip
        for gives, layers in _LAYERS.items():
            work = survey(problem, points=(across, across), layers=layers, engine=engine)
            yield Method(f"chart, {engine}", gives, work.grid.size, partial(gathered, work), width(work))


def engines() -> list[str]:
    """Those that are installed."""
    return ["numpy", *(["numba"] if find_spec("numba") else [])]


def width(work: Survey) -> int:
    """Bytes of all layers for a design."""
    return sum(work.dtype(name).itemsize for name in work.names)


def grid_coefficients(problem: Problem, points: int) -> Array:
    """Coefficients of a square grid of designs, shape (points, 5)."""
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


@dataclass(frozen=True)
class Large:
    """A chart to a folder, made by a process of its own.

    Attributes:
        memory: most bytes that the process ever had, Python, its packages and pages of the files included.
        written: bytes of the folder.
    """

    points: int
    seconds: float
    memory: int
    written: int


_LARGE = """
import json, re, resource, sys, time
from pathlib import Path
import tmsopt
from tmsopt.charts.stored import chart_to
problem = tmsopt.load(sys.argv[1], asks=False)
began = time.perf_counter()
chart_to(problem, sys.argv[2], points=json.loads(sys.argv[3]), layers=("kind", "abscissa"), single=True)
seconds = time.perf_counter() - began
status = Path("/proc/self/status")  # ru_maxrss counts the parent too, from before exec
peak = status.exists() and re.search(r"VmHWM:\\s*(\\d+)", status.read_text())
print(json.dumps([seconds, int(peak[1]) if peak else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss]))
"""


def large(across: int, up: int) -> Large:
    """Class and abscissa in single precision of many designs, to a folder that is removed."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "large.chart"
        given = [sys.executable, "-c", _LARGE, str(PROBLEM), str(folder), json.dumps([across, up])]
        done = subprocess.run(given, cwd=PROBLEM.parent.parent, check=True, capture_output=True, text=True)
        seconds, memory = json.loads(done.stdout)
        written = sum(f.stat().st_size for f in folder.rglob("*") if f.is_file())
    return Large(across * up, seconds, memory * (1 if sys.platform == "darwin" else 1024), written)


def section(command: str, quick: bool = False) -> str:
    """The report in Markdown."""
    problem = load(PROBLEM, asks=False)
    every = list(methods(problem, 40_000 if quick else 1_000_000))
    seconds = best({m.name + m.gives: m.work for m in every}, 2 if quick else 5)
    copied = copy_rate()
    each = [seconds[m.name + m.gives] / m.points for m in every]
    base = next(e for e, m in zip(each, every, strict=True) if m.name == STACKED)
    rows = [
        (
            m.name,
            m.gives,
            m.points,
            duration(e),
            f"{1 / e:.3g}",
            times(base / e),
            f"{m.width / e / 1e6:.3g} MB/s, {100 * m.width / e / copied:.2g} %" if m.width else "–",
        )
        for m, e in zip(every, each, strict=True)
    ]
    header = ("method", "gives", "designs", "time a design", "designs a second", f"rate, {STACKED} = 1", "of copying")
    parts = [
        "## Charts",
        origin(command),
        table(header, rows),
        f"The least of several rounds, in which all take turns; one thread. Rivals have their coefficients ready, a "
        f"chart computes them from the parameters. Copying is `numpy.copyto` of {_COPIED // 2**20} MB, "
        f"{copied / 1e9:.3g} GB/s; beside it is what a chart puts out.",
        _size(large(1000, 1000) if quick else large(10_000, 10_000)),
    ]
    return "\n\n".join(parts) + "\n"


def _size(found: Large) -> str:
    return (
        f"To a folder, class and abscissa in single precision: {found.points:.0e} designs in "
        f"{duration(found.seconds)}, {found.points / found.seconds:.3g} a second, {found.written / 1e6:.0f} MB, with "
        f"{found.memory / 2**20:.0f} MB of memory at most."
    )
