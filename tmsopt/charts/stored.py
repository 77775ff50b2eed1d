"""Large charts: a grid computed tile by tile to a folder, resumed where it was left, read back as it is looked at."""

import threading
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.charts import folder
from tmsopt.charts.summary import Tally, tally, total
from tmsopt.charts.survey import USUAL, Grid, Survey, survey
from tmsopt.design.problem import Problem
from tmsopt.errors import Fault, InputError
from tmsopt.records import Progress
from tmsopt.roots import CLASSES

TILE = 2**18
"""Designs of a tile: some 40 MB while it is computed."""

_SYNC = 1.0  # seconds between two records of finished tiles


@dataclass(frozen=True)
class StoredChart:
    """A finished chart in a folder; arrays are memory maps, read when they are looked at.

    Attributes:
        about: what was charted, as plain data.
        grid: axes and values along them.
        counts: over all designs.
        run: of the process that finished it: ``engine``, ``designs``, ``seconds``, ``per_second``; empty where the
            chart was only opened.
    """

    path: Path
    about: Mapping[str, Any] = field(repr=False)
    grid: Grid
    counts: Tally
    run: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def layers(self) -> dict[str, NDArray[Any]]:
        """Name → array of the grid's shape, the last axis first."""
        return {n: folder.read_array(self.path, "layers", n) for n in self.about["layers"]}

    @property
    def shares(self) -> dict[str, float]:
        """Share of the grid in each class; empty where the kind was not asked for."""
        return self.counts.shares

    def to_json(self) -> dict[str, Any]:
        """Summary; the arrays are in the folder."""
        return _summary(self.about, self.grid, self.counts) | {"path": str(self.path)} | dict(self.run)


def summary(work: Survey, counts: Tally) -> dict[str, Any]:
    """A chart summed up, as plain data."""
    return _summary(_about(work, TILE), work.grid, counts)


def _summary(about: Mapping[str, Any], grid: Grid, counts: Tally) -> dict[str, Any]:
    best = {"value": counts.least, **grid.at(counts.place)} if counts.place >= 0 else None
    return {
        "schema": 1,
        "title": about["title"],
        "model": about["problem"]["model"],
        "axes": {
            n: {"min": float(v[0]), "max": float(v[-1]), "points": len(v)}
            for n, v in zip(grid.axes, grid.values, strict=True)
        },
        "layers": list(about["layers"]),
        "classes": counts.shares,
        "satisfied": None if counts.satisfied is None else counts.satisfied / counts.designs,
        "least_abscissa": best,
        "fallbacks": counts.fallbacks,
    }


def chart_to(
    problem: Problem,
    path: str | Path,
    axes: Sequence[str] | None = None,
    *,
    points: Sequence[int] = (400, 300),
    layers: Sequence[str] = USUAL,
    quantities: Mapping[str, str] | None = None,
    single: bool = False,
    engine: str = "auto",
    workers: int = 1,
    fresh: bool = False,
    tile: int = TILE,
    progress: Progress | None = None,
) -> StoredChart:
    """Chart a grid of two or three free parameters to a folder; the same call again goes on where it was ended.

    Args:
        path: of the folder, e.g. ``big.chart``.
        axes: the free parameters, the one that runs fastest first; by default in the order of the problem.
        points: along each axis, up to 1e9 in all; the ends of the box are grid points.
        layers: names among `tmsopt.charts.survey.LAYERS`.
        quantities: name → expression, further layers.
        single: keep numbers in single precision.
        engine: ``auto``, ``numpy`` or ``numba``; the classes do not depend on it.
        workers: threads.
        fresh: move a folder of that name aside.
        tile: designs computed at a time by a worker.
        progress: called with the number of designs done and in all.

    Raises:
        InputError: for bad input; for a folder that holds another chart, with the differences, or is damaged.
        OSError: where the disk is full; what is recorded stays right.
    """
    if not isinstance(workers, int) or not 1 <= workers <= _MOST_WORKERS:
        message = f"found {workers!r}; accepted: a whole number from 1 to {_MOST_WORKERS}"
        raise InputError([Fault(message, ("workers",))])
    work = survey(problem, axes, points, layers, quantities, engine, single)
    return store(work, path, workers=workers, fresh=fresh, tile=tile, progress=progress)


def store(
    work: Survey,
    path: str | Path,
    *,
    workers: int = 1,
    fresh: bool = False,
    tile: int = TILE,
    progress: Progress | None = None,
) -> StoredChart:
    """A survey to a folder; see `chart_to`.

    Raises:
        InputError: for a folder that holds another chart, or is damaged.
    """
    place = Path(path)
    about = _about(work, _kept_tile(place, fresh) or tile)
    values = dict(zip(work.grid.axes, work.grid.values, strict=True))
    began = time.perf_counter()
    with folder.writing(place, about, values, fresh) as target:
        left = folder.complete(target.done, work.grid.tiles(about["tile"]))
        before = done = sum(t.designs for t in target.done.values())
        if progress:
            progress(done, work.grid.size)
        synced = began
        for rows, arrays, counts in computed(work, left, workers):
            target.write(rows, arrays, counts)
            done += counts.designs
            if time.perf_counter() - synced > _SYNC:
                target.sync()
                synced = time.perf_counter()
            if progress:
                progress(done, work.grid.size)
    seconds = time.perf_counter() - began
    run = {"engine": work.engine, "designs": done - before, "seconds": seconds}
    return _opened(place, run | {"per_second": (done - before) / seconds})


def open_chart(path: str | Path) -> StoredChart:
    """A finished chart.

    Raises:
        InputError: where that is none, or is not finished, or damaged.
    """
    return _opened(Path(path), {})


def computed(
    work: Survey, tiles: Iterable[range], workers: int = 1
) -> Iterator[tuple[range, dict[str, NDArray[Any]], Tally]]:
    """Rows, layers and counts of tiles, in order, a few of them computed ahead by threads."""

    every = list(tiles)
    most = max(map(len, every), default=0)
    own = threading.local()

    def compute(rows: range) -> tuple[range, dict[str, NDArray[Any]], Tally]:
        began = time.perf_counter()
        if not hasattr(own, "room"):
            own.room = work.room(most)
        layers, fallbacks = work.tile(rows, own.room)
        first = rows.start * work.grid.shape[-1]
        return rows, layers, tally(layers, first, fallbacks, time.perf_counter() - began)

    ahead: deque[Future[tuple[range, dict[str, NDArray[Any]], Tally]]] = deque()
    with ThreadPoolExecutor(workers, thread_name_prefix="tmsopt-chart") as pool:
        try:
            for rows in every:
                ahead.append(pool.submit(compute, rows))
                if len(ahead) > workers + 1:
                    yield ahead.popleft().result()
            while ahead:
                yield ahead.popleft().result()
        finally:
            for future in ahead:
                future.cancel()


def gathered(work: Survey, progress: Progress | None = None, workers: int = 1) -> tuple[dict[str, Any], Tally]:
    """All layers as arrays of the grid's shape in memory, and the counts."""
    grid = work.grid
    arrays: dict[str, Any] = {n: np.empty((grid.rows, grid.shape[-1]), work.dtype(n)) for n in work.names}
    counts: list[Tally] = []
    if progress:
        progress(0, grid.size)
    for rows, layers, part in computed(work, grid.tiles(TILE), workers):
        for name, layer in layers.items():
            arrays[name][rows.start : rows.stop] = layer
        counts.append(part)
        if progress:
            progress(rows.stop * grid.shape[-1], grid.size)
    return {n: a.reshape(grid.shape) for n, a in arrays.items()}, total(counts)


_MOST_WORKERS = 256


def _about(work: Survey, tile: int) -> dict[str, Any]:
    """All that makes a chart another one, as plain data."""
    problem, grid = work.problem, work.grid
    of = problem.parameter_set
    return {
        "schema": folder.SCHEMA,
        "title": problem.title,
        "problem": {
            "model": problem.model.name,
            **({} if problem.model.statement is None else {"statement": dict(problem.model.statement)}),
            "fixed": dict(problem.fixed),
            "constraints": {n: t for n, t in problem.constraints.items() if not problem.conditions[n].equality},
        },
        "axes": {
            n: {"min": float(v[0]), "max": float(v[-1]), "points": len(v), "unit": of[n].unit}
            for n, v in zip(grid.axes, grid.values, strict=True)
        },
        "dimensions": list(grid.axes[::-1]),
        "shape": list(grid.shape),
        "layers": {
            n: {"dtype": np.lib.format.dtype_to_descr(work.dtype(n))}
            | ({"expression": work.quantities[n]} if n in work.quantities else {})
            for n in work.names
        },
        "classes": list(CLASSES),
        "versions": {"tmsopt": version("tmsopt")},
        "tile": tile,
    }


def _kept_tile(path: Path, fresh: bool) -> int | None:
    """The size of tiles of a chart that was begun; another one would change nothing but the record."""
    return None if fresh or not path.exists() else int(folder.read_about(path)["tile"])


def _opened(path: Path, run: Mapping[str, Any]) -> StoredChart:
    about = folder.read_about(path)
    try:
        shape, names, tile = tuple(map(int, about["shape"])), tuple(map(str, about["axes"])), int(about["tile"])
        dtypes = {str(n): np.dtype(layer["dtype"]) for n, layer in about["layers"].items()}
        known = isinstance(about["title"], str) and isinstance(about["problem"]["model"], str)
    except (KeyError, TypeError, ValueError, AttributeError):
        known = False
    if not known:
        raise folder.damaged(path, f"{folder.ABOUT} does not say what was charted")
    grid = Grid(names, tuple(np.asarray(folder.read_array(path, "axes", n)) for n in names))
    if grid.shape != shape:
        raise folder.damaged(path, f"axes of shape {grid.shape} for arrays of shape {shape}")
    done = folder.read_tiles(path)
    counts = total(done.values())
    if left := folder.complete(done, grid.tiles(tile)):
        message = f"'{path}' is not finished: {counts.designs} of {grid.size} designs; run its command again to go on"
        raise InputError([Fault(message + f" from row {left[0].start}")])
    if counts.designs != grid.size:
        raise folder.damaged(path, f"{folder.TILES} counts {counts.designs} of {grid.size} designs")
    for name, dtype in dtypes.items():
        array = folder.read_array(path, "layers", name)
        if array.shape != shape or array.dtype != dtype:
            raise folder.damaged(path, f"layers/{name}.npy is not of shape {shape} and type {dtype}")
    return StoredChart(path, about, grid, counts, run)
