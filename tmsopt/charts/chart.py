"""Charts: what kind of motion each design of a grid over two or three parameters has."""

import time
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.charts.files import dataset, save_layers
from tmsopt.charts.folder import Folder, complete, writing
from tmsopt.charts.received import (
    ABOUT,
    MOST_TILES,
    SCHEMA,
    damaged,
    number_of_tiles,
    read_about,
    read_axis,
    read_layer,
    read_record,
)
from tmsopt.charts.summary import Tally, total
from tmsopt.charts.survey import LAYERS, USUAL, Grid, Survey, survey
from tmsopt.charts.tiles import TILE, Memory, computed
from tmsopt.design.files import Given
from tmsopt.design.problem import Problem
from tmsopt.disk import path_of
from tmsopt.errors import Fault, InputError, call_faults, count_faults, list_faults, short, suggest
from tmsopt.models import MODELS
from tmsopt.progress import Listener, counted
from tmsopt.records import Array, Shown
from tmsopt.roots import CLASSES
from tmsopt.tracing.domain import Domain, domain

if TYPE_CHECKING:
    from xarray import Dataset

LARGEST = 20_000_000
"""Designs of a chart in memory, some 40 bytes each."""


def _layer(name: str, meaning: str) -> Any:
    return property(lambda self: self.layers[name], doc=meaning)


@dataclass(frozen=True, repr=False)
class Chart(Shown):
    """Classes, roots and quantities over a grid of two or three parameters.

    Attributes:
        about: what was charted, as plain data.
        grid: the values along each axis.
        layers: name → array of shape (len(second), len(first)), as an image has, a third axis before them. Those in a
            folder are memory maps, read when they are looked at.
        counts: over all designs.
        domain: the exact boundaries over a plane, if asked for.
        path: of its folder; None in memory.
        run: of the process that computed it: ``engine``, ``seconds``, ``per_second``, of a folder also how many
            ``designs`` were left to it; empty where the chart was only opened.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])  # stable where c and k are positive
        >>> plane = tmsopt.Problem(swing, free={"c": (-1, 1), "k": (-1, 1)})
        >>> chart = tmsopt.chart(plane, points=(4, 4), boundaries=False)
        >>> chart.shares["stable"], chart.shares["capsize"]
        (0.25, 0.5)

    More: docs/how_to/charts.md
    """

    about: Mapping[str, Any] = field(repr=False)
    grid: tuple[Array, ...] = field(repr=False)
    layers: Mapping[str, NDArray[Any]] = field(repr=False)
    counts: Tally
    domain: Domain | None = field(default=None, repr=False)
    path: Path | None = None
    run: Mapping[str, Any] = field(default_factory=dict)
    asked: Problem | None = field(default=None, repr=False)

    kind = _layer("kind", "Class codes, decided by coefficients, places in `tmsopt.roots.CLASSES`.")
    abscissa = _layer("abscissa", "Jointly right next to an exceptional point; nan if undefined.")
    damping_ratio = _layer("damping_ratio", "Jointly right next to an exceptional point; nan if undefined.")
    real_roots = _layer("real_roots", "Number of different real roots, from coefficients.")
    satisfied = _layer("satisfied", "Where every inequality constraint of the problem holds.")
    margin = _layer("margin", "Least difference of the sides of an inequality, negative where one is violated, or nan.")

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the parameters, the horizontal one first."""
        return tuple(self.about["axes"])

    @property
    def problem(self) -> Problem:
        """What was charted.

        Raises:
            InputError: for an opened folder of a model of the user's own, which it does not hold.
        """
        if self.asked is None:
            name = self.about["problem"]["model"]
            raise InputError([Fault(f"'{self.path}' does not hold its model {name!r}, only numbers; chart it again")])
        return self.asked

    @property
    def quantities(self) -> dict[str, NDArray[Any]]:
        """Name → values of an expression of the user's."""
        return {n: layer for n, layer in self.layers.items() if n not in LAYERS}

    @property
    def shares(self) -> dict[str, float]:
        """Share of the grid in each class; empty where the kind was not asked for."""
        return self.counts.shares

    @property
    def left_aside(self) -> tuple[str, ...]:
        """Names of the equality constraints: they hold on curves, which `trace` follows, and nowhere on a grid."""
        return tuple(n for n, c in self.problem.conditions.items() if c.equality)

    def save(self, path: str | Path, layers: Sequence[str] | None = None) -> None:
        """Write axes and layers, all of them unless named, as a NumPy archive or, to a name ending in nc, as netCDF.

        Raises:
            InputError: for unknown layers; for netCDF where xarray or a library for it is not installed.
            OSError: when the file cannot be written.
        """
        names = tuple(self.layers) if layers is None else layers
        faults = list_faults("layers", names, "['kind', 'abscissa']")
        if faults := faults or [
            Fault(f"found {short(n)}; {suggest(n, self.layers)}", ("layers",)) for n in names if n not in [*self.layers]
        ]:
            raise InputError(faults)
        kept = {n: self.layers[n] for n in names}
        save_layers(self.problem, Grid(self.axes, self.grid), kept, path_of(path, "the file to write"))

    def to_xarray(self) -> "Dataset":
        """Every layer over the axes, with units.

        Raises:
            InputError: where xarray is not installed.
        """
        made: Dataset = dataset(self.problem, Grid(self.axes, self.grid), self.layers)
        return made

    def _units(self) -> dict[str, str]:
        """Units of the axes; nothing of a chart in a folder that does not hold its model, a system without units."""
        try:
            of = self.problem.parameter_set
        except InputError:
            return {}
        return {n: of[n].unit for n in self.axes}

    def to_json(self) -> dict[str, Any]:
        """Summary, boundaries and corners; the arrays themselves go to a file."""
        units = self._units()
        grid, counts, plane = Grid(self.axes, self.grid), self.counts, self.path is None and len(self.grid) == 2
        return {
            "schema": 1, "title": self.about["title"], "model": self.about["problem"]["model"],
            "axes": {
                n: {"min": float(v[0]), "max": float(v[-1]), "points": len(v)} | {"unit": units.get(n, "1")}
                for n, v in zip(self.axes, self.grid, strict=True)
            },
            **({} if plane else {"layers": list(self.layers)}), "classes": counts.shares,
            "satisfied": None if counts.satisfied is None else counts.satisfied / counts.designs,
            "least_abscissa": {"value": counts.least, **grid.at(counts.place)} if counts.place >= 0 else None,
            **({"boundaries": self.domain and self.domain.to_json()} if plane or self.domain else {}),
            "fallbacks": counts.fallbacks, **({} if self.path is None else {"path": str(self.path)}), **self.run,
        }  # fmt: skip


def chart(
    problem: Given, axes: Sequence[str] | None = None, *, folder: str | Path | None = None,
    points: Sequence[int] | None = None, layers: Sequence[str] | None = None,
    quantities: Mapping[str, str] | None = None, single: bool = False, engine: str = "auto", workers: int = 1,
    fresh: bool = False, tile: int = TILE, boundaries: bool = True, progress: Listener | None = None,
) -> Chart:  # fmt: skip
    """Classify every design of a grid over the two or three free parameters; the others must be fixed.

    Equality constraints are left aside. A chart in a folder goes on where the same call was ended before.

    Args:
        problem: or its file, or a solution of it.
        axes: the free parameters, the horizontal one first, which runs fastest; by default in the problem's order.
        folder: where to keep the arrays, e.g. ``big.chart``, up to 1e9 designs; by default in memory, up to 2e7.
        points: along each axis, by default 400x300 or 120x100x80; the ends of the box are grid points.
        layers: names among `tmsopt.charts.LAYERS`; by default all, in a folder all but the margin.
        quantities: name → expression, further layers.
        single: keep numbers in single precision.
        engine: ``auto``, ``numpy`` or ``numba``; the numbers do not depend on it.
        workers: threads.
        fresh: move a folder of that name aside.
        tile: designs computed at a time by a worker.
        boundaries: also trace the exact boundary curves over a plane.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for bad input; for a folder that holds another chart, with the differences, or is damaged.
        OSError: where the disk is full; what is recorded stays right.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> plane = tmsopt.Problem(swing, free={"c": (-1, 1), "k": (-1, 1)})
        >>> corner = tmsopt.chart(plane, points=(4, 4), boundaries=False).abscissa[0, 3]  # k = -1, c = 1
        >>> f"{corner:.6f}"  # (√5 - 1)/2
        '0.618034'

    More: docs/how_to/charts.md
    """
    if faults := [*count_faults("workers", workers, 1, _MOST_WORKERS), *count_faults("tile", tile, 1),
                  *call_faults("progress", progress)]:  # fmt: skip
        raise InputError(faults)
    steps = counted(progress, "charting", "design")
    wanted = layers if layers is not None else tuple(LAYERS) if folder is None else USUAL
    work = survey(problem, axes, points, wanted, quantities, engine, single)
    path, grid = None if folder is None else path_of(folder, "a folder"), work.grid
    if path is None and grid.size > LARGEST:
        message = f"{grid.size:.3g} designs do not fit into memory; give a folder, or {LARGEST:.0e} or less"
        raise InputError([Fault(message, ("points",))])
    if path is not None and (tiles := number_of_tiles(grid.shape, tile)) > MOST_TILES:
        raise InputError([Fault(f"found {tile}, which makes {tiles} tiles; accepted: {MOST_TILES}", ("tile",))])
    about = _about(work, (None if path is None else _kept_tile(path, fresh)) or tile)
    where: AbstractContextManager[Memory | Folder] = (
        nullcontext(Memory(grid, {n: work.dtype(n) for n in work.names})) if path is None
        else writing(path, about, dict(zip(grid.axes, grid.values, strict=True)), fresh)
    )  # fmt: skip
    began = time.perf_counter()
    with where as target:
        left = complete(target.done, grid.tiles(about["tile"]))
        before = done = sum(t.designs for t in target.done.values())
        if steps:
            steps(done, grid.size)
        for rows, arrays, counts in computed(work, left, workers):
            target.write(rows, arrays, counts)
            done += counts.designs
            if steps:
                steps(done, grid.size)
    seconds = time.perf_counter() - began
    run: dict[str, Any] = {"engine": work.engine} | ({} if path is None else {"designs": done - before})
    run |= {"seconds": seconds, "per_second": (done - before) / seconds}
    edges = domain(work.problem, progress=progress) if boundaries and len(grid.axes) == 2 else None
    if isinstance(target, Folder):
        return _opened(target.path, run, edges, work.problem)
    return Chart(about, grid.values, target.layers, total(target.done.values()), edges, None, run, work.problem)


def open_chart(path: str | Path) -> Chart:
    """A finished chart in a folder.

    Raises:
        InputError: where that is none, or is not finished, or damaged.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     made = tmsopt.chart("problems/chart.toml", points=(20, 10), folder=f"{folder}/plane.chart")
        ...     tmsopt.open_chart(f"{folder}/plane.chart").counts == made.counts
        True

    More: docs/how_to/charts.md
    """
    return _opened(path_of(path, "a folder that tmsopt.chart made"))


_MOST_WORKERS = 256


def _about(work: Survey, tile: int) -> dict[str, Any]:
    """All that makes a chart another one, as plain data."""
    problem, grid = work.problem, work.grid
    return {
        "schema": SCHEMA, "title": problem.title,
        "problem": {
            "model": problem.model.name,
            **({} if problem.model.statement is None else {"statement": dict(problem.model.statement)}),
            "fixed": dict(problem.fixed),
            "constraints": {n: t for n, t in problem.constraints.items() if not problem.conditions[n].equality},
        },
        "axes": {
            n: {"min": float(v[0]), "max": float(v[-1]), "points": len(v)}
            for n, v in zip(grid.axes, grid.values, strict=True)
        },
        "dimensions": list(grid.axes[::-1]), "shape": list(grid.shape),
        "layers": {
            n: {"dtype": np.lib.format.dtype_to_descr(work.dtype(n))}
            | ({"expression": work.quantities[n]} if n in work.quantities else {})
            for n in work.names
        },
        "classes": list(CLASSES), "versions": {"tmsopt": version("tmsopt")}, "tile": tile,
    }  # fmt: skip


def _kept_tile(path: Path, fresh: bool) -> int | None:
    """The size of tiles of a chart that was begun; another one would change nothing but the record."""
    if fresh or not path.exists():
        return None
    kept: int = read_about(path)["tile"]
    return kept


def _opened(
    path: Path, run: Mapping[str, Any] | None = None, edges: Domain | None = None, asked: Problem | None = None
) -> Chart:
    about = read_about(path)
    try:
        asked = asked or _posed(about)
    except ValueError as error:
        raise damaged(path, f"{ABOUT} does not say what was charted ({error!s:.300})") from None
    grid = Grid(tuple(about["axes"]), tuple(read_axis(path, n, axis) for n, axis in about["axes"].items()))
    done, _ = read_record(path, about)
    counts = total(done.values())
    if left := complete(done, grid.tiles(about["tile"])):
        message = f"'{path}' is not finished: {counts.designs} of {grid.size} designs; run its command again to go on"
        raise InputError([Fault(message + f" from row {left[0].start}")])
    layers = {n: read_layer(path, n, about) for n in about["layers"]}
    return Chart(about, grid.values, layers, counts, edges, path, run or {}, asked)


def _posed(about: Mapping[str, Any]) -> Problem | None:
    """The problem of a folder, but for equality constraints; None for a model of the user's own."""
    said = about["problem"]
    if "statement" in said or said["model"] not in MODELS:
        return None
    free = {n: (axis["min"], axis["max"]) for n, axis in about["axes"].items()}
    return Problem(MODELS[said["model"]], said["fixed"], free, said["constraints"], title=about["title"])
