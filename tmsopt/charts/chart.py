"""Charts: the class of motion and other numbers for each design on a grid over two or three parameters."""

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
from tmsopt.charts.survey import (
    DEFAULT_LAYERS,
    LAYERS,
    MEMORY_LAYERS,
    Grid,
    Survey,
    Tally,
    add_tallies,
    layer_faults,
    limits_of,
    plan_survey,
)
from tmsopt.deprecated import ignore_option
from tmsopt.errors import InputError, callback_faults, count_faults, input_error
from tmsopt.executor import Crash, in_process, processes
from tmsopt.files import as_path
from tmsopt.problem.files import ProblemSource
from tmsopt.problem.problem import Problem
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Printable
from tmsopt.roots import CLASSES
from tmsopt.tracing.domain import Domain, domain

if TYPE_CHECKING:
    from xarray import Dataset

MAX_DESIGNS_IN_MEMORY = 20_000_000
"""Largest number of designs of a chart in memory; each takes about 40 bytes."""

DEFAULT_TILE = 2**18
"""Default number of designs of a tile. The designs of a tile are computed together, which takes about 40 MB."""

_MAX_WORKERS = 256  # largest number of processes


def _layer_property(name: str, meaning: str) -> Any:
    return property(lambda self: self.layers[name], doc=meaning)


@dataclass(frozen=True, repr=False)
class Chart(Printable):
    """Classes, roots and quantities over a grid of two or three parameters.

    Attributes:
        about: description of the chart, as plain data.
        grid: the values along each axis.
        layers: name → array. The last index of an array belongs to the first axis, as in an image. Layers in a folder
            are memory maps.
        counts: counts over all designs.
        domain: the exact boundaries in a plane, if requested.
        path: the folder of the chart; None for a chart in memory.
        run: ``engine``, ``seconds``, ``per_second``, and for a folder the number of ``designs`` that this call
            computed; empty for an opened chart.
        asked: the charted problem; None if the folder does not hold its model.

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
        "Abscissa, from roots that reproduce the coefficients, also near an exceptional point; nan if undefined.",
    )
    damping_ratio = _layer_property("damping_ratio", "Damping ratio of the same roots; nan if undefined.")
    real_roots = _layer_property("real_roots", "Number of distinct real roots, from the coefficients.")
    satisfied = _layer_property("satisfied", "Whether every inequality constraint of the problem holds.")
    margin = _layer_property(
        "margin",
        "Smallest difference between the sides of an inequality, negative if one is violated; nan if undefined.",
    )

    petermann = _layer_property(
        "petermann", "Largest Petermann factor of an eigenvalue (`tmsopt.roots.find_conditioning`); nan if undefined."
    )
    phase_rigidity = _layer_property("phase_rigidity", "Smallest phase rigidity of an eigenvalue; nan if undefined.")

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the parameters, the horizontal one first."""
        return tuple(self.about["axes"])

    @property
    def problem(self) -> Problem:
        """The charted problem.

        Raises:
            InputError: for an opened folder with a model that the user defined, because the folder does not hold it.
        """
        if self.asked is None:
            name = self.about["problem"]["model"]
            raise input_error(
                f"'{self.path}' does not hold its model {name!r}, only numbers; compute it again from the problem"
            )
        return self.asked

    @property
    def quantities(self) -> dict[str, NDArray[Any]]:
        """Name → values of an expression that the user gave."""
        return {n: layer for n, layer in self.layers.items() if n not in LAYERS}

    @property
    def shares(self) -> dict[str, float]:
        """Share of the grid in each class; empty without the layer ``kind``."""
        return self.counts.shares

    @property
    def left_aside(self) -> tuple[str, ...]:
        """Names of the equality constraints. A chart ignores them, because they hold only on curves; see `trace`."""
        return tuple(n for n, c in self.problem.posed.conditions.items() if c.equality)

    def save(self, path: str | Path, layers: Sequence[str] | None = None) -> None:
        """Write axes and layers as a NumPy archive, or as netCDF if the path ends in ``.nc``.

        Args:
            layers: names of layers; all by default.

        Raises:
            InputError: for unknown layers; for netCDF if xarray or a netCDF library is missing.
            OSError: if the file cannot be written.
        """
        names = tuple(self.layers) if layers is None else layers
        if faults := layer_faults(names, list(self.layers)):
            raise InputError(faults)
        chosen_layers = {n: self.layers[n] for n in names}
        save_layers(self.problem.posed, Grid(self.axes, self.grid), chosen_layers, as_path(path, "the file to write"))

    def to_xarray(self) -> "Dataset":
        """All layers as a dataset with axes and units.

        Raises:
            InputError: if xarray is not installed.
        """
        dataset: Dataset = make_dataset(self.problem.posed, Grid(self.axes, self.grid), self.layers)
        return dataset

    def to_json(self) -> dict[str, Any]:
        """Summary, boundaries and corners, without the arrays."""
        counts, is_plane = self.counts, self.path is None and len(self.grid) == 2
        parameters = self.asked.posed.parameter_set if self.asked else None  # a folder may not hold the model
        grid = Grid(self.axes, self.grid)
        design = grid.design(counts.place) if counts.place >= 0 else None
        data: dict[str, Any] = {
            "schema": 1,
            "title": self.about["title"],
            "model": self.about["problem"]["model"],
            "axes": {
                n: {**axis, "unit": parameters[n].unit if parameters else "1"} for n, axis in grid.describe().items()
            },
            **({} if is_plane else {"layers": list(self.layers)}),
            "classes": counts.shares,
            "satisfied": None if counts.satisfied is None else counts.satisfied / counts.designs,
            "least_abscissa": design and {"value": counts.least, **design},
        }
        if is_plane or self.domain:
            data["boundaries"] = self.domain and self.domain.to_json()
        data["fallbacks"] = counts.fallbacks
        if self.path is not None:
            data["path"] = str(self.path)
        return data | dict(self.run)


@ignore_option("engine")
def chart(
    problem: ProblemSource,
    axes: Sequence[str] | None = None,
    *,
    folder: str | Path | None = None,
    points: Sequence[int] | None = None,
    layers: Sequence[str] | None = None,
    quantities: Mapping[str, str] | None = None,
    single: bool = False,
    workers: int = 1,
    fresh: bool = False,
    tile: int = DEFAULT_TILE,
    boundaries: bool = True,
    progress: Listener | None = None,
) -> Chart:
    """Classify every design of a grid over the two or three free parameters; the others must be fixed.

    Equality constraints are ignored. If the same call was stopped before, a chart in a folder is continued.

    Args:
        problem: a problem, its file, or a solution.
        axes: the free parameters, the horizontal one first; by default in the problem's order.
        folder: folder for the arrays, e.g. ``big.chart``, for up to 1e9 designs; by default they are in memory, for
            up to 2e7.
        points: numbers of points along the axes, by default 400x300 or 120x100x80; the ends of the box are grid points.
        layers: names from `tmsopt.charts.LAYERS`; by default all except ``petermann`` and
            ``phase_rigidity``, and in a folder not ``margin`` either.
        quantities: name → expression of an additional layer.
        single: store numbers in single precision.
        workers: number of processes; with 1, no further process is started.
        fresh: move an existing folder aside.
        tile: number of designs that are computed together.
        boundaries: also trace the exact boundary curves, if there are two axes.
        progress: called with a `tmsopt.Progress` from time to time.

    Raises:
        InputError: for bad input, for a damaged folder or one with another chart, or if a worker crashes.
        OSError: if the disk is full; the tiles that are already recorded stay valid.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> plane = tmsopt.Problem(swing, free={"c": (-1, 1), "k": (-1, 1)})
        >>> corner = tmsopt.chart(plane, points=(4, 4), boundaries=False).abscissa[0, 3]  # k = -1, c = 1
        >>> f"{corner:.6f}"  # (√5 - 1)/2
        '0.618034'

    More: docs/how_to/charts.md
    """
    faults = count_faults("workers", workers, 1, _MAX_WORKERS) + count_faults("tile", tile, 1)
    if faults := faults + callback_faults("progress", progress):
        raise InputError(faults)
    steps = start_steps(progress, "charting", "design") or (lambda *_: None)
    layer_names = layers if layers is not None else MEMORY_LAYERS if folder is None else DEFAULT_LAYERS
    survey = plan_survey(problem, axes, points, layer_names, quantities, single)
    path, grid, about = None if folder is None else as_path(folder, "a folder"), survey.grid, _describe(survey, tile)
    if path is None and grid.size > MAX_DESIGNS_IN_MEMORY:
        message = f"{grid.size:.3g} designs do not fit into memory; give a folder x.chart, "
        message += f"or at most {MAX_DESIGNS_IN_MEMORY:.0e} designs"
        raise input_error(message, "points")
    grid.tiles(tile)  # raises an error for too many tiles
    memory = {} if path else {n: np.empty(grid.shape, dtype) for n, dtype in survey.dtypes.items()}
    tiles_context = write_folder(path, about, grid, fresh) if path else nullcontext(Tiles(memory, tile))
    with tiles_context as tiles, processes(workers) if workers > 1 else in_process() as executor:
        start_time = time.perf_counter()
        remaining_tiles = [rows for rows in grid.tiles(tiles.tile) if rows.start not in tiles.tallies]
        finished_count = old_count = add_tallies(tiles.tallies.values()).designs
        steps(finished_count, grid.size)
        for index, result in executor.map(survey.compute, remaining_tiles):
            if isinstance(result, Crash):
                cause = f"a worker that computed {tile} designs crashed ({result.cause})"
                raise input_error(f"{cause}; give fewer workers or a smaller tile", "workers")
            tiles.write(remaining_tiles[index], *result)
            finished_count += result[1].designs
            steps(finished_count, grid.size)
    seconds, computed_count = time.perf_counter() - start_time, finished_count - old_count
    for layer in memory.values():
        layer.flags.writeable = False
    run = {
        "engine": "numpy",
        **({"designs": computed_count} if path else {}),
        "seconds": seconds,
        "per_second": computed_count / seconds,
    }
    source_problem = survey.problem.problem
    is_plane = boundaries and len(grid.axes) == 2 and survey.problem.model.polynomial is not None
    exact_domain = domain(source_problem, progress=progress) if is_plane else None
    return Chart(
        about, grid.values, tiles.layers, add_tallies(tiles.tallies.values()), exact_domain, path, run, source_problem
    )


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
    grid, counts = grid_of(about), add_tallies(tiles.tallies.values())
    if counts.designs < grid.size:
        message = (
            f"'{path}' is not finished: {counts.designs} of {grid.size} designs; run its command again to finish it"
        )
        raise input_error(message)
    return Chart(about, grid.values, tiles.layers, counts, path=path, asked=problem)


def _describe(survey: Survey, tile: int) -> dict[str, Any]:
    """Everything that identifies a chart, as plain data."""
    problem, grid = survey.problem, survey.grid
    statement: dict[str, Any] = {
        "model": problem.model.name,
        "fixed": dict(problem.fixed),
        "constraints": {n: problem.constraints[n] for n in limits_of(problem)},
    }
    if problem.model.statement is not None:
        statement["statement"] = dict(problem.model.statement)
    layers = {n: {"dtype": d.str} for n, d in survey.dtypes.items()}
    for name, expression in survey.quantities.items():
        layers[name]["expression"] = expression
    return {
        "schema": SCHEMA,
        "title": problem.title,
        "problem": statement,
        "axes": grid.describe(),
        "dimensions": list(grid.axes[::-1]),
        "shape": list(grid.shape),
        "layers": layers,
        "classes": list(CLASSES),
        "versions": {"tmsopt": version("tmsopt")},
        "tile": tile,
    }
