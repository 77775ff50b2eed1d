"""Stability charts: what kind of motion each design of a two-parameter grid has."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.charts.files import save_layers
from tmsopt.charts.stored import gathered
from tmsopt.charts.survey import USUAL, Grid, Survey, survey
from tmsopt.design.files import problem_of
from tmsopt.design.problem import Problem
from tmsopt.errors import Fault, InputError
from tmsopt.records import Array
from tmsopt.roots import CLASSES
from tmsopt.tracing.domain import Domain, domain

LARGEST = 20_000_000
"""Designs of a chart, which is held in memory at some 40 bytes each."""

CHART_LAYERS = ("kind", "abscissa", "damping_ratio", "real_roots", "satisfied", "margin")
"""Layers that a chart in memory has."""


@dataclass(frozen=True)
class Chart:
    """Classes and roots over a grid of two parameters.

    Attributes:
        axes: names of the two parameters; arrays have shape (len(second), len(first)), as an image has.
        grid: the values along each axis.
        kind: class codes, decided by coefficients: unstable with a real root ≥ 0 (capsize), unstable without one
            (weave), stable, stable with all roots real (heavily damped).
        abscissa, damping_ratio: from roots that are jointly right next to an exceptional point; nan if undefined.
        real_roots: number of different real roots, from coefficients.
        satisfied: where every inequality constraint of the problem holds.
        margin: least difference of the sides of an inequality, negative where one is violated, nan where one does not
            exist.
        domain: the exact boundaries, if asked for.
        quantities: name → values of an expression of the user's.
    """

    problem: Problem
    axes: tuple[str, str]
    grid: tuple[Array, Array]
    kind: NDArray[np.int8]
    abscissa: Array
    damping_ratio: Array
    real_roots: NDArray[np.int8]
    satisfied: NDArray[np.bool_]
    margin: Array
    domain: Domain | None
    quantities: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    @property
    def shares(self) -> dict[str, float]:
        """Share of the grid in each class."""
        return {name: float(np.mean(self.kind == code)) for code, name in enumerate(CLASSES)}

    @property
    def left_aside(self) -> tuple[str, ...]:
        """Names of the equality constraints: they hold on curves, which `trace` follows, and nowhere on a grid."""
        return tuple(n for n, c in self.problem.conditions.items() if c.equality)

    def to_json(self) -> dict[str, Any]:
        """Summary, boundaries and corners; the arrays themselves go to a file."""
        allowed = np.where(self.satisfied, self.abscissa, np.nan)
        best = int(np.nanargmin(allowed)) if np.any(np.isfinite(allowed)) else None
        row, column = divmod(best, len(self.grid[0])) if best is not None else (0, 0)
        return {
            "schema": 1,
            "title": self.problem.title,
            "model": self.problem.model.name,
            "axes": {n: {"min": float(g[0]), "max": float(g[-1]), "points": len(g)} for n, g in self._named()},
            "classes": self.shares,
            "satisfied": float(np.mean(self.satisfied)),
            "least_abscissa": None
            if best is None
            else {
                "value": float(self.abscissa.flat[best]),
                self.axes[0]: float(self.grid[0][column]),
                self.axes[1]: float(self.grid[1][row]),
            },
            "boundaries": None if self.domain is None else self.domain.to_json(),
        }

    def _named(self) -> list[tuple[str, Array]]:
        return list(zip(self.axes, self.grid, strict=True))


def chart(
    problem: Problem,
    axes: tuple[str, str] | None = None,
    *,
    points: tuple[int, int] = (400, 300),
    boundaries: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> Chart:
    """Classify every design of a grid over the two free parameters; the others must be fixed.

    Equality constraints are left aside.

    Args:
        axes: horizontal and vertical parameter; by default in the order of the problem.
        points: along each axis; the ends of the box are grid points.
        boundaries: also trace the exact boundary curves.
        progress: called with the number of designs done and in all.

    Raises:
        InputError: unless exactly two parameters are free and the axes name them, or for other numbers of points.
    """
    names = plane_of(problem_of(problem), axes)
    _check(points)
    work = survey(problem, names, points, CHART_LAYERS)
    return chart_of(work, gathered(work, progress)[0], domain(problem) if boundaries else None)


def chart_of(work: Survey, layers: Mapping[str, NDArray[Any]], boundaries: Domain | None) -> Chart:
    """A chart of what was computed over a plane, `CHART_LAYERS` and quantities."""
    across, up = work.grid.axes
    return Chart(
        problem=work.problem,
        axes=(across, up),
        grid=(work.grid.values[0], work.grid.values[1]),
        domain=boundaries,
        quantities={n: layers[n] for n in work.quantities},
        **{n: layers[n] for n in CHART_LAYERS},
    )


def _check(points: Any) -> None:
    try:
        across, up = (int(p) for p in points)
    except (TypeError, ValueError):
        across = up = 0
    if min(across, up) < 2 or across * up > LARGEST:
        message = f"found {points!r}; accepted: two whole numbers, each 2 or more, their product {LARGEST:.0e} or less"
        raise InputError([Fault(message, ("points",))])


def plane_of(problem: Problem, axes: tuple[str, str] | None = None) -> tuple[str, str]:
    """The two free parameters of a problem, in the order asked for.

    Raises:
        InputError: unless there are exactly two, and the axes name them.
    """
    free = list(problem.free)
    if len(free) != 2:
        message = f"a plane has two free parameters, and {len(free)} are free ({', '.join(free) or 'none'})"
        advice = "; fix the others" if len(free) > 2 else "; write e.g. Fr = { min = 0.1, max = 5 }"
        raise InputError([Fault(message + advice, ("parameters",))])
    if axes is not None and (isinstance(axes, str) or sorted(axes) != sorted(free)):
        raise InputError([Fault(f"found {axes!r}; accepted: {' and '.join(free)}", ("axes",))])
    return axes or (free[0], free[1])


def save_arrays(found: Chart, path: Path) -> None:
    """Write a chart as a NumPy archive: the axes by name, `kind`, `abscissa`, `damping_ratio`, `real_roots`,
    `satisfied`, `about`.

    Raises:
        OSError: when the file cannot be written.
    """
    grid = Grid(found.axes, found.grid)
    save_layers(found.problem, grid, {n: getattr(found, n) for n in USUAL} | dict(found.quantities), path)
