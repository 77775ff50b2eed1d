"""Riemann sheets: all eigenvalues over a grid of two parameters."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np

from tmsopt.errors import Fault, callback_faults, count_faults, list_faults, short
from tmsopt.files import write_csv
from tmsopt.problem import Problem, ProblemSource, units_of
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Array, Complex, Table, Tabular, plain
from tmsopt.spectra.plane import order_by_parts, plane_of, split_complex

GRID = (81, 81)
"""Default numbers of points along the two axes."""

MAX_DRAWN = 8
"""Largest number of sheets in a picture."""

_MAX_AXIS_POINTS = 2000


@dataclass(frozen=True, repr=False)
class Sheets(Tabular):
    """All eigenvalues over a grid of two parameters, the result of `sheets`.

    Attributes:
        problem: the problem in which only these two parameters are free.
        parameters: every parameter at the exceptional point, or at the start or the middle of the ranges.
        grid: the values along the horizontal and the vertical axis.
        values: ω for a complex system, otherwise s; shape (rows, columns, n). The first index belongs to the vertical
            axis, and the last one is in the order of the real parts. It is nan where the matrices are not defined.
        multiple: the multiple eigenvalues at `parameters`, if the problem locates a pattern.

    Example:
        >>> over = tmsopt.sheets("problems/loss_only_dimer.toml", grid=(3, 3))
        >>> over.axes, over.values.shape, f"{over.multiple[0].imag:.6f}"
        (('d', 'k'), (3, 3, 2), '-0.600000')

    More: docs/how_to/encircle.md
    """

    problem: Problem
    parameters: Table[float]
    grid: tuple[Array, Array] = field(repr=False)
    values: Complex = field(repr=False)
    multiple: tuple[complex, ...] = ()

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the two parameters, the horizontal one first."""
        return tuple(self.problem.free)

    @property
    def letter(self) -> str:
        """The name of the eigenvalues: ``omega`` for a complex system, otherwise ``root``."""
        return "omega" if self.problem.model.is_complex else "root"

    @property
    def picture_indices(self) -> list[int]:
        """The sheets of a picture: all, or those nearest to a multiple eigenvalue, or the first ones."""
        count, (x, y) = self.values.shape[2], self.grid
        if count <= MAX_DRAWN or not self.multiple:
            return [*range(min(count, MAX_DRAWN))]
        column, row = (np.abs(v - self.parameters[n]).argmin() for n, v in zip(self.axes, (x, y), strict=True))
        return sorted(np.abs(self.values[row, column] - self.multiple[0]).argsort()[:MAX_DRAWN].tolist())

    def records(self) -> Iterator[dict[str, float]]:
        """One record for each point of the grid: the two parameters, then the parts of each eigenvalue."""
        names = [
            *self.axes,
            *(f"{self.letter}{k}_{part}" for k in range(self.values.shape[2]) for part in ("re", "im")),
        ]
        for y, row in zip(self.grid[1].tolist(), self.values, strict=True):
            for x, parts in zip(self.grid[0].tolist(), row.view(float).tolist(), strict=True):
                yield dict(zip(names, [x, y, *parts], strict=True))

    def write_csv(self, path: str | PathLike[str]) -> None:
        """Write the records to a CSV file.

        Raises:
            OSError: when the file cannot be written.
        """
        write_csv(path, list(self.records()), units_of(self.problem.posed))

    def to_json(self) -> dict[str, Any]:
        """The JSON of `tmsopt sheets`."""
        return {
            **self.problem.posed.heading,
            "axes": plain(dict(zip(self.axes, self.grid, strict=True))),
            "units": units_of(self.problem.posed),
            **plain(self, "parameters"),
            self.letter: plain({"re": self.values.real, "im": self.values.imag}),
            "multiple": [split_complex(z) for z in self.multiple],
        }


def sheets(
    problem: ProblemSource,
    over: Sequence[str] | None = None,
    *,
    grid: Sequence[int] = GRID,
    progress: Listener | None = None,
) -> Sheets:
    """Compute all eigenvalues of a system with matrices over the ranges of two free parameters.

    Args:
        problem: a problem, its file, or a solution.
        over: names of the two parameters, the horizontal one first; by default the first two that are free. Other free
            parameters keep their values at the located point, or at the start or the middle of their ranges.
        grid: numbers of points along both axes.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        InputError: for a model without matrices, fewer than two free parameters or bad arguments.

    Example:
        >>> over = tmsopt.sheets("problems/loss_only_dimer.toml", grid=(5, 4))
        >>> over.values[-1, 2].round(6).tolist()  # at d = 0, k = 2: -0.6i ± √(k² - 0.16)
        [(-1.959592-0.6j), (1.959592-0.6j)]

    More: docs/how_to/encircle.md
    """
    faults = callback_faults("progress", progress)
    if list_faults("grid", grid, "") or len(grid) != 2 or any(count_faults("", n, 2, _MAX_AXIS_POINTS) for n in grid):
        accepted = f"two whole numbers, each from 2 to {_MAX_AXIS_POINTS}, such as (81, 81)"
        faults.append(Fault(f"found {short(grid)}; accepted: {accepted}", ("grid",)))
    plane = plane_of(problem, "over", over, None, progress, faults)
    x, y = (np.linspace(*plane.problem.free[n], count) for n, count in zip(plane.names, grid, strict=True))
    rows = list[Complex]()
    steps = start_steps(progress, "computing eigenvalues", "row")
    for row in y:
        M = plane.matrices(np.stack([x, np.full(len(x), row)], axis=1))
        is_finite = np.isfinite(M).all(axis=(1, 2))
        values = np.full(M.shape[:2], np.nan, dtype=complex)
        values[is_finite] = plane.user_values(np.linalg.eigvals(M[is_finite]))
        rows.append(np.take_along_axis(values, order_by_parts(values), axis=-1))
        if steps:
            steps(len(rows), len(y))
    solution = plane.solution
    roots = (solution.eigenfrequencies or solution.roots) if solution and solution.status == "optimal" else ()
    multiple = tuple(complex(root.re, root.im) for root in roots if root.multiplicity > 1)
    return Sheets(plane.problem.problem, plane.design, (x, y), np.array(rows), multiple)
