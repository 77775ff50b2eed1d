"""A Pareto front as data: efficient designs, kinks where the active limits change, and gaps."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from tmsopt.files import write_csv
from tmsopt.problem.problem import Problem
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import units_of
from tmsopt.records import Tabular, plain


@dataclass(frozen=True)
class FrontPoint:
    """An efficient design: no other design that was found improves one objective without a loss in another.

    Attributes:
        objectives: values of the objectives, in the order of the problem.
        solution: the rechecked design; its problem minimises one objective with limits on the others.
        limits: names of the user's active constraints and bounds.
        label: what is special about the point, e.g. ``least Fr``, ``EP3 -> pair+real``; empty for most points.
    """

    objectives: tuple[float, ...]
    solution: Solution
    limits: tuple[str, ...]
    label: str = ""

    @property
    def structure(self) -> str:
        """The roots on the rightmost line, e.g. ``EP4``."""
        return self.solution.structure

    @property
    def stable(self) -> bool | None:
        """Whether all roots lie left of the axis; see `Solution`."""
        return self.solution.stable

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; missing numbers are None."""
        solution = plain(self.solution, "parameters abscissa abscissa_realised stable structure")
        missed = {"missed_as_stored": plain(self.solution.missed)} if self.solution.missed else {}
        return plain(self, "objectives") | solution | missed | plain(self, "limits label")


@dataclass(frozen=True)
class Kink:
    """A change along the front, in the order of its points.

    Attributes:
        name: e.g. ``EP3 -> pair+real``, ``lambda_s.min becomes active``.
        index: index of the last point before the change.
        width: length of the stretch that contains the change, with each objective divided by its range.
    """

    name: str
    index: int
    width: float


@dataclass(frozen=True)
class Gap:
    """A stretch without points of the front.

    Attributes:
        reason: why there are no points: no efficient design was found, or a sub-problem was not solved.
        index: index of the point before the gap. With two objectives, the gap ends at the next point.
        failed: whether a sub-problem was not solved.
    """

    reason: str
    index: int
    failed: bool


@dataclass(frozen=True, repr=False)
class Front(Tabular):
    """A Pareto front, the result of `pareto`.

    Attributes:
        objectives: the expressions that are minimised.
        points: sorted by the first objective, best first; none dominates another.
        kinks: changes along the front; only for two objectives.
        gaps: stretches without points; for three objectives, sub-problems that failed.
        ideal, nadir: smallest and largest value of each objective over the points.
        solved: number of sub-problems that were solved.
        notes: sentences for the reader.
        interrupted: whether the user stopped the search; the front then holds the points that were found.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", 1])  # the abscissa is -c/2 up to c = 2
        >>> asked = tmsopt.Problem(swing, free={"c": (1, 3)}, pareto=("abscissa", "c"))
        >>> front = tmsopt.pareto(asked, points=5, workers=1)
        >>> [f"{x:.6f}" for x in (*front.ideal, *front.nadir)]
        ['-1.000000', '1.000000', '-0.500000', '2.000000']

    More: docs/how_to/fronts.md
    """

    problem: Problem
    objectives: tuple[str, ...]
    points: tuple[FrontPoint, ...]
    kinks: tuple[Kink, ...]
    gaps: tuple[Gap, ...]
    solved: int
    seconds: float
    notes: tuple[str, ...] = ()
    interrupted: bool = False

    def __len__(self) -> int:
        return len(self.points)

    @property
    def ideal(self) -> tuple[float, ...]:
        """Smallest value of each objective."""
        return tuple(map(min, zip(*(p.objectives for p in self.points), strict=True)))

    @property
    def nadir(self) -> tuple[float, ...]:
        """Largest value of each objective on the front."""
        return tuple(map(max, zip(*(p.objectives for p in self.points), strict=True)))

    def records(self) -> Iterable[dict[str, Any]]:
        """Yield one record per point: objectives, parameters, roots, limits, label."""
        for point in self.points:
            values = dict(zip(self.objectives, point.objectives, strict=True))
            yield {
                **values,
                **point.solution.parameters,
                **values,
                "abscissa": point.solution.abscissa,
                "structure": point.structure,
                "stable": point.stable,
                "limits": "; ".join(point.limits),
                "label": point.label,
            }

    def write_csv(self, path: str | PathLike[str]) -> None:
        """Write the points as one table.

        Raises:
            OSError: if the file cannot be written.
        """
        text_of = {None: "", True: "true", False: "false"}
        write_csv(
            path,
            [{**row, "stable": text_of[row["stable"]]} for row in self.records()],
            units_of(self.problem.posed, self.objectives),
        )

    def to_json(self) -> dict[str, Any]:
        """The JSON of `tmsopt solve` for a front; missing numbers are None."""
        return {
            **self.problem.posed.heading,
            "status": "optimal",
            "objective": {"sense": "pareto", "expressions": list(self.objectives)},
            "units": units_of(self.problem.posed, self.objectives),
            **plain(self, "ideal nadir points kinks gaps notes solved"),
            "seconds": round(self.seconds, 4),
            **({"interrupted": True} if self.interrupted else {}),
        }


def efficient_points(points: Sequence[FrontPoint], slack: Sequence[float]) -> list[FrontPoint]:
    """The points that no other point dominates, sorted by their objectives; equal points are kept once.

    Args:
        slack: for each objective, the largest difference that rounding errors can cause.
    """
    values, allowed_excess = np.array([p.objectives for p in points]), np.asarray(slack)
    kept_indices: list[int] = []
    for k, objectives in enumerate(values):
        excess = values - objectives
        is_dominated = (excess <= allowed_excess).all(axis=1) & (excess < -allowed_excess).any(axis=1)
        if not is_dominated.any() and not (np.abs(excess[kept_indices]) <= allowed_excess).all(axis=1).any():
            kept_indices.append(k)
    kept_points = (points[k] for k in kept_indices)
    # rounded, so that rounding errors do not decide
    return sorted(kept_points, key=lambda p: [float(f"{x:.9g}") for x in p.objectives])
