"""Charts: the kind of motion of each design on a grid over two or three parameters."""

import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.charts.export import make_dataset, save_layers
from tmsopt.charts.folder import SCHEMA, Tiles, grid_of, read_folder, write_folder
from tmsopt.charts.survey import LAYERS, USUAL, Grid, Survey, Tally, add_tallies, layer_faults, limits_of, plan_survey
from tmsopt.deprecated import ignore_option
from tmsopt.errors import InputError, call_faults, count_faults, input_error
from tmsopt.executor import Crash, here, processes
from tmsopt.files import as_path
from tmsopt.problem.files import Given
from tmsopt.problem.problem import Problem
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Printable
from tmsopt.roots import CLASSES
from tmsopt.tracing.domain import Domain, domain

if TYPE_CHECKING:
    from xarray import Dataset

LARGEST = 20_000_000
"""Most designs of a chart in memory, about 40 bytes each."""

TILE = 2**18
"""Designs of a tile: about 40 MB during its computation."""

_MOST_WORKERS = 256


def _layer_property(name: str, meaning: str) -> Any:
    return property(lambda self: self.layers[name], doc=meaning)


@dataclass(frozen=True, repr=False)
class Chart(Printable):
    """Classes, roots and quantities over a grid of two or three parameters.

    Attributes:
        about: description of the chart, as plain data.
        grid: the values along each axis.
        layers: name → array of shape (len(second), len(first)), as an image, with a third axis in front. Layers in a
            folder are memory maps.
        counts: over all designs.
        domain: the exact boundaries in a plane, if requested.
        path: of its folder; None in memory.
        run: ``engine``, ``seconds``, ``per_second``, and for a folder the number of ``designs`` computed now; empty for
            an opened chart.

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

    kind = _layer_property("kind", "Class codes from the coefficients: indices into `tmsopt.roots.CLASSES`.")
    abscissa = _layer_property(
        "abscissa",
        "Abscissa of roots that give back the coefficients, also near an exceptional point; nan if undefined.",
    )
    damping_ratio = _layer_property("damping_ratio", "Damping ratio of the same roots; nan if undefined.")
    real_roots = _layer_property("real_roots", "Number of distinct real roots, from the coefficients.")
    satisfied = _layer_property("satisfied", "Whether every inequality constraint of the problem holds.")
    margin = _layer_property(
        "margin", "Least distance of the sides of an inequality, negative if one is violated; nan if undefined."
    )

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the parameters, the horizontal one first."""
        return tuple(self.about["axes"])

    @property
    def problem(self) -> Problem:
        """The charted problem.

        Raises:
            InputError: for an opened folder with a model of the user, which the folder does not hold.
        """
        if self.asked is None:
            name = self.about["problem"]["model"]
            raise input_error(
                f"'{self.path}' does not hold its model {name!r}, only numbers; compute it again from the problem"
            )
        return self.asked

    @property
    def quantities(self) -> dict[str, NDArray[Any]]:
        """Name → values of an expression of the user."""
        return {n: layer for n, layer in self.layers.items() if n not in LAYERS}

    @property
    def shares(self) -> dict[str, float]:
        """Share of the grid in each class; empty without the layer ``kind``."""
        return self.counts.shares

    @property
    def left_aside(self) -> tuple[str, ...]:
        """Names of the equality constraints, which a chart ignores: they hold on curves, which `trace` follows."""
        return tuple(n for n, c in self.problem.posed.conditions.items() if c.equality)

    def save(self, path: str | Path, layers: Sequence[str] | None = None) -> None:
        """Write axes and layers as a NumPy archive, or as netCDF if the path ends in ``.nc``.

        Args:
            layers: names; all by default.

        Raises:
            InputError: for unknown layers; for netCDF if xarray or a netCDF library is missing.
            OSError: if the file cannot be written.
        """
        names = tuple(self.layers) if layers is None else layers
        if faults := layer_faults(names, list(self.layers)):
            raise InputError(faults)
        chosen = {n: self.layers[n] for n in names}
        save_layers(self.problem.posed, Grid(self.axes, self.grid), chosen, as_path(path, "the file to write"))

    def to_xarray(self) -> "Dataset":
        """All layers as a dataset with axes and units.

        Raises:
            InputError: if xarray is not installed.
        """
        made: Dataset = make_dataset(self.problem.posed, Grid(self.axes, self.grid), self.layers)
        return made

    def to_json(self) -> dict[str, Any]:
        """Summary, boundaries and corners, without the arrays."""
        counts, plane = self.counts, self.path is None and len(self.grid) == 2
        of = self.asked.posed.parameter_set if self.asked else None  # a folder may not hold its model
        grid = Grid(self.axes, self.grid)
        place = grid.design(counts.place) if counts.place >= 0 else None
        data: dict[str, Any] = {
            "schema": 1,
            "title": self.about["title"],
            "model": self.about["problem"]["model"],
            "axes": {n: {**axis, "unit": of[n].unit if of else "1"} for n, axis in grid.describe().items()},
            **({} if plane else {"layers": list(self.layers)}),
            "classes": counts.shares,
            "satisfied": None if counts.satisfied is None else counts.satisfied / counts.designs,
            "least_abscissa": place and {"value": counts.least, **place},
        }
        if plane or self.domain:
            data["boundaries"] = self.domain and self.domain.to_json()
        data["fallbacks"] = counts.fallbacks
        if self.path is not None:
            data["path"] = str(self.path)
        return data | dict(self.run)


@ignore_option("engine")
def chart(
    problem: Given,
    axes: Sequence[str] | None = None,
    *,
    folder: str | Path | None = None,
    points: Sequence[int] | None = None,
    layers: Sequence[str] | None = None,
    quantities: Mapping[str, str] | None = None,
    single: bool = False,
    workers: int = 1,
    fresh: bool = False,
    tile: int = TILE,
    boundaries: bool = True,
    progress: Listener | None = None,
) -> Chart:
    """Classify every design of a grid over the two or three free parameters; the others must be fixed.

    Equality constraints are ignored. A chart in a folder continues where the same call stopped before.

    Args:
        problem: a problem, its file, or a solution.
        axes: the free parameters, the horizontal one first; by default in the problem's order.
        folder: folder for the arrays, e.g. ``big.chart``, up to 1e9 designs; by default in memory, up to 2e7.
        points: along each axis, 400x300 or 120x100x80 by default; the ends of the box are grid points.
        layers: names among `tmsopt.charts.LAYERS`; all by default, all but the margin in a folder.
        quantities: name → expression of an additional layer.
        single: store numbers in single precision.
        workers: number of processes; 1 computes in this one.
        fresh: move an existing folder aside.
        tile: designs computed at a time.
        boundaries: also trace the exact boundary curves in a plane.
        progress: called with a `tmsopt.Progress` from time to time.

    Raises:
        InputError: for bad input; for a damaged folder, or one with another chart, with the differences; if a worker
            crashes.
        OSError: if the disk is full; tiles recorded before stay valid.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> plane = tmsopt.Problem(swing, free={"c": (-1, 1), "k": (-1, 1)})
        >>> corner = tmsopt.chart(plane, points=(4, 4), boundaries=False).abscissa[0, 3]  # k = -1, c = 1
        >>> f"{corner:.6f}"  # (√5 - 1)/2
        '0.618034'

    More: docs/how_to/charts.md
    """
    faults = count_faults("workers", workers, 1, _MOST_WORKERS) + count_faults("tile", tile, 1)
    if faults := faults + call_faults("progress", progress):
        raise InputError(faults)
    steps = start_steps(progress, "charting", "design") or (lambda *_: None)
    wanted = layers if layers is not None else tuple(LAYERS) if folder is None else USUAL
    work = plan_survey(problem, axes, points, wanted, quantities, single)
    path, grid, about = None if folder is None else as_path(folder, "a folder"), work.grid, _describe(work, tile)
    if path is None and grid.size > LARGEST:
        message = f"{grid.size:.3g} designs do not fit into memory; give a folder x.chart, or at most {LARGEST:.0e}"
        raise input_error(message, "points")
    grid.tiles(tile)  # raises for too many tiles
    memory = {} if path else {n: np.empty(grid.shape, dtype) for n, dtype in work.dtypes.items()}
    where = write_folder(path, about, grid, fresh) if path else nullcontext(Tiles(memory, tile))
    with where as target, processes(workers) if workers > 1 else here() as executor:
        began = time.perf_counter()
        remaining = [rows for rows in grid.tiles(target.tile) if rows.start not in target.done]
        done = before = add_tallies(target.done.values()).designs
        steps(done, grid.size)
        for place, found in executor.map(work.compute, remaining):
            if isinstance(found, Crash):
                cause = f"a worker that computed {tile} designs crashed ({found.cause})"
                raise input_error(f"{cause}; give fewer workers or a smaller tile", "workers")
            target.write(remaining[place], *found)
            done += found[1].designs
            steps(done, grid.size)
    seconds, new = time.perf_counter() - began, done - before
    for layer in memory.values():
        layer.flags.writeable = False
    run = {"engine": "numpy", **({"designs": new} if path else {}), "seconds": seconds, "per_second": new / seconds}
    charted = work.problem.problem
    edges = domain(charted, progress=progress) if boundaries and len(grid.axes) == 2 else None
    return Chart(about, grid.values, target.layers, add_tallies(target.done.values()), edges, path, run, charted)


def open_chart(path: str | Path) -> Chart:
    """Open a finished chart in a folder.

    Raises:
        InputError: if the folder holds no chart, or an unfinished or damaged one.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     made = tmsopt.chart("problems/chart.toml", points=(20, 10), folder=f"{folder}/plane.chart")
        ...     tmsopt.open_chart(f"{folder}/plane.chart").counts == made.counts
        True

    More: docs/how_to/charts.md
    """
    path = as_path(path, "a folder that tmsopt.chart made")
    about, problem, tiles = read_folder(path)
    grid, counts = grid_of(about), add_tallies(tiles.done.values())
    if counts.designs < grid.size:
        message = (
            f"'{path}' is not finished: {counts.designs} of {grid.size} designs; run its command again to finish it"
        )
        raise input_error(message)
    return Chart(about, grid.values, tiles.layers, counts, path=path, asked=problem)


def _describe(work: Survey, tile: int) -> dict[str, Any]:
    """Everything that identifies a chart, as plain data."""
    problem, grid = work.problem, work.grid
    stated: dict[str, Any] = {
        "model": problem.model.name,
        "fixed": dict(problem.fixed),
        "constraints": {n: problem.constraints[n] for n in limits_of(problem)},
    }
    if problem.model.statement is not None:
        stated["statement"] = dict(problem.model.statement)
    layers = {n: {"dtype": d.str} for n, d in work.dtypes.items()}
    for name, expression in work.quantities.items():
        layers[name]["expression"] = expression
    return {
        "schema": SCHEMA,
        "title": problem.title,
        "problem": stated,
        "axes": grid.describe(),
        "dimensions": list(grid.axes[::-1]),
        "shape": list(grid.shape),
        "layers": layers,
        "classes": list(CLASSES),
        "versions": {"tmsopt": version("tmsopt")},
        "tile": tile,
    }
