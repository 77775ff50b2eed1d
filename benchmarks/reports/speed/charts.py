"""Charts in memory, beside stacked eigenvalues, a loop of numpy.roots and the rate at which memory is copied."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from benchmarks.judges import companion
from benchmarks.reports.tables import Asked, duration, page, table, times
from benchmarks.suites import PLANE
from benchmarks.timing import best
from tmsopt import chart
from tmsopt.models import tms
from tmsopt.records import Array

STACKED = "stacked numpy.linalg.eigvals"

_LOOP = 2_000
_BLOCK = 20_000  # matrices in work at once: their arrays stay in the cache
_COPIED = 256 * 2**20  # bytes: far beyond any cache
_USUAL = ("kind", "abscissa", "damping_ratio", "real_roots")
_LAYERS = {"abscissa": ("abscissa",), "class": ("kind",), "class, abscissa, damping ratio, real roots": _USUAL}


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


def methods(points: int) -> Iterator[Method]:
    """Rivals first, with a fifth of the designs. They have their coefficients ready; a chart makes its own."""
    ready = grid_coefficients(points // 5)
    yield Method("loop of numpy.roots", "abscissa", _LOOP, lambda: [np.roots(a).real.max() for a in ready[:_LOOP]])
    yield Method(STACKED, "abscissa", len(ready), lambda: stacked(ready))
    across = int(np.sqrt(points))
    for gives, layers in _LAYERS.items():
        width = sum(layer.itemsize for layer in charted(2, layers).values())
        yield Method("chart", gives, across**2, partial(charted, across, layers), width)


def charted(across: int, layers: tuple[str, ...]) -> dict[str, Any]:
    """Layers of a square chart of the plane."""
    found = chart(PLANE, points=(across, across), layers=layers, boundaries=False)
    return dict(found.layers)


def grid_coefficients(points: int) -> Array:
    """Coefficients of a square grid of designs of the plane, shape (points, 5)."""
    across = int(np.ceil(np.sqrt(points)))
    grid = np.meshgrid(*(np.linspace(*ends, across) for ends in PLANE.posed.free.values()))
    columns = {n: g.ravel()[:points] for n, g in zip(PLANE.free, grid, strict=True)}
    return np.stack(np.broadcast_arrays(*tms.coefficients({**PLANE.fixed, **columns})), axis=-1)


def stacked(a: Array) -> list[Array]:
    """Largest real part of the eigenvalues of stacked companion matrices, a block at a time."""
    blocks = (a[start : start + _BLOCK] for start in range(0, len(a), _BLOCK))
    return [np.linalg.eigvals(companion(block)).real.max(axis=-1) for block in blocks]


def copy_rate(repeats: int = 5) -> float:
    """Bytes a second that NumPy copies from one large array to another."""
    source = np.ones(_COPIED // 8)
    target = np.zeros_like(source)
    return _COPIED / best({"copy": lambda: np.copyto(target, source)}, repeats)["copy"]


def report(asked: Asked) -> str:
    """The report in Markdown."""
    every = list(methods(asked.of(1_000_000, 40_000)))
    seconds = best({m.name + m.gives: m.work for m in every}, 2 if asked.quick else 5)
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
    return page(
        "Charts",
        asked,
        table(header, rows),
        "The least of several rounds, in which all take turns; one thread. Rivals have their coefficients ready, a "
        f"chart computes them from the parameters. Copying is `numpy.copyto` of {_COPIED // 2**20} MB, "
        f"{copied / 1e9:.3g} GB/s; beside it is what a chart puts out.",
    )
