"""A traced curve of a root pattern as data: points, tangents, labels, events."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.deprecated import rename_attribute
from tmsopt.files import write_csv
from tmsopt.problem.problem import Problem
from tmsopt.problem.unit_system import units_of
from tmsopt.records import Array, Table, Tabular, Truth, plain


@dataclass(frozen=True)
class EventPoint:
    """A point of a branch where something happens.

    Attributes:
        name: ``EP4``, ``EP3``, ``2EP2``, ``double zero``, ``weave``, ``capsize``, ``fold``, ``constraint`` or ``end``,
            or the name of a user's `tmsopt.Event`. An event that stops a branch is its last point, and the first point
            of the next branch.
        detail: the event in words, such as the parameter that folds or the limit that ends the branch.
        parameters: every parameter of the point.
        index: index of the point among the points of the branch.
        residual: relative mismatch of the coefficients at the point.

    Example:
        >>> found = next(e for e in tmsopt.trace("problems/ep_set.toml").events if e.name == "EP4")
        >>> f"{found.parameters['chi_B']:.6f}"  # the square root of 2
        '1.414214'

    More: docs/how_to/tracing.md
    """

    name: str
    detail: str
    parameters: Table[float]
    index: int
    residual: float = 0.0


@dataclass(frozen=True, repr=False)
class Branch(Tabular):
    """A curve of designs with one root pattern; every event is one of its points.

    Attributes:
        pattern: name of the traced pattern.
        parameters: name → values along the curve, every parameter of the set, shape (n,).
        unknowns: factor coefficients of the pattern, by name, shape (n,).
        tangent: free parameter → its derivative by the arclength.
        arclength: length of the curve from its first point, with each free parameter in widths of its range.
        kinds: name of the root pattern at each point. For example, one curve has the patterns 2EP2, EP4 and CEP2.
        stable: whether every root is left of the imaginary axis, except the roots that the pattern places on it.
        heavily_damped: whether all roots are real and negative, except the roots that the pattern places at 0.
        satisfied: whether every inequality constraint of the problem holds.
        abscissa: largest real part of the roots, from the factors.
        events: events on the curve, in the order of the arclength.
        closed: whether the last point is equal to the first.
        residual: largest mismatch of a coefficient along the curve, relative to its terms.
        eigenfrequency: the multiple eigenfrequency of a complex system as ``omega_re`` and ``omega_im``, which are
            printed instead of `unknowns`; None for a real system.

    Example:
        >>> branch = tmsopt.trace("problems/ep_set.toml").branches[0]
        >>> law = tmsopt.laws.epset(-0.4, -0.2, branch.parameters["lambda_s"])  # the law of the paper
        >>> bool(abs(branch.parameters["Fr"] - law).max() < 1e-9)
        True

    More: docs/how_to/tracing.md
    """

    pattern: str
    parameters: Mapping[str, Array]
    unknowns: Mapping[str, Array]
    tangent: Mapping[str, Array]
    arclength: Array
    kinds: NDArray[np.str_]
    stable: Truth
    heavily_damped: Truth
    satisfied: Truth
    abscissa: Array
    events: tuple[EventPoint, ...]
    closed: bool
    residual: float
    eigenfrequency: Mapping[str, Array] | None = None

    def __len__(self) -> int:
        return len(self.arclength)

    @property
    def pattern_unknowns(self) -> Mapping[str, Array]:
        """The unknowns of the pattern; for a complex system, the multiple eigenfrequency."""
        return self.unknowns if self.eigenfrequency is None else self.eigenfrequency

    told = rename_attribute("told", "pattern_unknowns")

    def records(self) -> Iterable[dict[str, Any]]:
        """One record per point, as written to CSV."""
        events_at: dict[int, list[str]] = {}
        for event in self.events:
            events_at.setdefault(event.index, []).append(
                f"{event.name}: {event.detail}" if event.detail else event.name
            )
        columns: dict[str, NDArray[Any]] = {
            "arclength": self.arclength,
            **self.parameters,
            **{f"d_{name}": column for name, column in self.tangent.items()},
            **name_unknowns(self.pattern, self.pattern_unknowns, self.parameters),
            "abscissa": self.abscissa,
            "kind": self.kinds,
            "stable": self.stable,
            "heavily_damped": self.heavily_damped,
            "constraints": self.satisfied,
        }
        for k, row in enumerate(zip(*(column.tolist() for column in columns.values()), strict=True)):
            yield dict(zip(columns, row, strict=True)) | {"event": "; ".join(events_at.get(k, []))}

    def to_json(self) -> dict[str, Any]:
        """Columns and events; numbers that are not finite are null."""
        rows = list(self.records())
        return plain(self, "pattern closed") | {
            "points": len(self),
            "residual": self.residual,
            "events": [plain(event, "name detail index parameters") for event in self.events],
            "columns": plain({name: [row[name] for row in rows] for name in rows[0]}),
        }


@dataclass(frozen=True, repr=False)
class Trace(Tabular):
    """Every branch of a pattern that was found in the box.

    Attributes:
        starts: number of designs from which branches were searched.
        seconds: total time; `seconds_walking` is the time for following the curves only.

    Example:
        >>> traced = tmsopt.trace("problems/ep_set.toml")
        >>> len(traced.branches), "EP4" in [event.name for event in traced.events]
        (1, True)

    More: docs/how_to/tracing.md
    """

    problem: Problem
    pattern: str
    branches: tuple[Branch, ...]
    starts: int
    seconds: float
    seconds_walking: float

    @property
    def points(self) -> int:
        """Number of points on all branches."""
        return sum(len(b) for b in self.branches)

    @property
    def events(self) -> tuple[EventPoint, ...]:
        """Events of all branches."""
        return tuple(e for b in self.branches for e in b.events)

    @property
    def varying(self) -> list[str]:
        """The free parameters; those that are constant on every branch come last."""

        def is_varying(name: str) -> bool:
            low, high = self.problem.free[name]
            return any(np.ptp(b.parameters[name]) > 1e-9 * (high - low) for b in self.branches)

        return sorted(self.problem.free, key=lambda name: not is_varying(name))

    def records(self) -> Iterable[dict[str, Any]]:
        """The points of all branches, with a first column `branch`."""
        return ({"branch": k, **row} for k, branch in enumerate(self.branches) for row in branch.records())

    def write_csv(self, path: str | PathLike[str]) -> None:
        """Write the records to a CSV file.

        Raises:
            OSError: when the file cannot be written.
        """
        write_csv(path, list(self.records()), units_of(self.problem.posed))

    def to_json(self) -> dict[str, Any]:
        """The JSON of `tmsopt trace`."""
        return {
            **self.problem.posed.heading,
            "pattern": self.pattern,
            "free": list(self.problem.free),
            "units": units_of(self.problem.posed),
            **plain(self, "branches starts points seconds"),
            "seconds_per_point": self.seconds_walking / max(self.points, 1),
        }


@dataclass(frozen=True)
class BranchPoint:
    """A point of a curve that `continue_from` follows.

    Attributes:
        parameters: every parameter of the point.
        unknowns: factor coefficients of the pattern, by name.
        tangent: free parameter → its derivative by the arclength, in the direction of travel.
        arclength: length of the curve from the first point, with each free parameter in widths of its range. It is
            negative behind the first point.
        kind: name of the root pattern, such as ``2EP2`` or ``CEP2`` on one curve.
        stable: whether every root is left of the imaginary axis, except the roots that the pattern places on it.
        abscissa: largest real part of the roots.
        events: names of the events at this point; most points have none.

    Example:
        >>> point = next(tmsopt.continue_from("problems/ep_set.toml"))
        >>> law = tmsopt.laws.epset(-0.4, -0.2, point.parameters["lambda_s"])  # the law of the paper
        >>> bool(abs(point.parameters["Fr"] - law) < 1e-12)
        True

    More: docs/how_to/tracing.md
    """

    parameters: Table[float]
    unknowns: Table[float]
    tangent: Table[float]
    arclength: float
    kind: str
    stable: bool
    abscissa: float
    events: tuple[str, ...] = ()


def table_at(columns: Mapping[str, Array], row: int) -> Table[float]:
    """One row of columns as a table."""
    return Table({name: float(column[row]) for name, column in columns.items()})


def name_unknowns(pattern: str, unknowns: Mapping[str, Array], parameters: Iterable[str]) -> dict[str, Array]:
    """Unknowns by unique names: if a parameter has the same name, the unknown gets the pattern as a prefix."""
    return {f"{pattern}.{name}" if name in parameters else name: column for name, column in unknowns.items()}


def kinds_along(branch: Branch) -> list[str]:
    """The pattern at each point; a special point, such as an EP4, gets the pattern of the point before it."""
    special_rows = {e.index for e in branch.events if str(branch.kinds[e.index]) == e.name}
    kinds = [str(k) for k in branch.kinds]
    for row in sorted(special_rows) if len(kinds) > 1 else ():
        kinds[row] = kinds[row - 1] if row else kinds[1]
    return kinds
