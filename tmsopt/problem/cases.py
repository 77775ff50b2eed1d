"""Cases: the variations of a design that a problem considers, by scenarios, tolerances and the robustness radius."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.records import AnyNumbers, Numbers, Table

DEFAULT_POINT_COUNT = 7
"""Number of points of a band in the first search. If the worst case lies between two points, more are added."""

_MAX_CORNER_CASES = 16
"""Greatest number of cases in the first search with tolerances; the worst-case check covers the other corners."""


@dataclass(frozen=True)
class Band:
    """Every value of a parameter from `min` to `max`; the first search uses `points` evenly spaced values.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])  # s² + c s + k: the softest spring decides, at c = 2
        >>> springs = tmsopt.Problem(swing, free={"c": (0, 4)}, scenarios={"k": tmsopt.Band(1, 4)}, minimize="abscissa")
        >>> f"{tmsopt.solve(springs).parameters['c']:.6f}"
        '2.000000'

    More: docs/how_to/bands.md
    """

    min: float
    max: float
    points: int = DEFAULT_POINT_COUNT

    @property
    def values(self) -> tuple[float, ...]:
        """The points of the first search, with both ends."""
        return tuple(np.linspace(self.min, self.max, self.points).tolist())


Scenario = Band | tuple[float, ...]
"""A band, or a list of values."""


@dataclass(frozen=True)
class Case:
    """One variation of a nominal design.

    Attributes:
        at: parameter → value instead of the nominal one, from a scenario.
        offset: parameter → amount added, from a tolerance.
        direction: parameter → change per unit of the robustness radius, in units of its weight.
        edge: for the nearest point of a boundary of stability, the name of the boundary. The search for the point began
            from `direction`, and its change is not multiplied by the radius.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> springs = tmsopt.Problem(swing, free={"c": (0, 4)}, scenarios={"k": [1.0, 4.0]}, minimize="abscissa")
        >>> tmsopt.solve(springs).worst.at  # the softest decays slowest
        {'k': 1.0}

    More: docs/how_to/bands.md
    """

    at: Numbers = Table()
    offset: Numbers = Table()
    direction: Numbers = Table()
    edge: str = ""

    def applied(self, parameters: AnyNumbers, radius: Any = 0.0, weights: Numbers | None = None) -> dict[str, Any]:
        """The varied design, for numbers, arrays or CasADi expressions."""
        values = {**parameters, **self.at}
        for name, change in self.offset.items():
            values[name] = values[name] + change
        distance = 1.0 if self.edge else radius
        for name, slope in self.direction.items():
            values[name] = values[name] + distance * slope * weight_of(name, parameters[name], weights or {})
        return values


def weight_of(name: str, value: Any, weights: Numbers) -> Any:
    """Weight of a parameter: the one in `weights`, or else its absolute value, or 1 if the value is 0."""
    if name in weights:
        return weights[name]
    if isinstance(value, float | int) and value == 0:
        return 1.0
    return value.fabs() if hasattr(value, "fabs") else abs(value)  # CasADi expressions have abs from 3.7 on


def points_of(scenario: Scenario) -> tuple[float, ...]:
    """The values that a scenario lists."""
    return scenario.values if isinstance(scenario, Band) else scenario


@dataclass(frozen=True)
class Cover:
    """A bound on the roots over all cases.

    Attributes:
        limit: no root of any case is right of it, if `proven`.
        proven: whether interval arithmetic over all boxes proved it; otherwise only a search found no worse case.
        boxes: number of boxes that bands and tolerances were divided into.
    """

    limit: float
    proven: bool
    boxes: int


def parse_scenario(scenario: Any) -> Any:
    """A scenario from a band, a mapping with its min, max and points, or a list of values."""
    if isinstance(scenario, Mapping) and {"min", "max"} <= set(scenario) <= {"min", "max", "points"}:
        return Band(**scenario)
    return tuple(scenario) if isinstance(scenario, list) else scenario


def middle_of(scenario: Scenario) -> float:
    """The nominal value: the middle of a band or of the values."""
    values = points_of(scenario)
    return (min(values) + max(values)) / 2


def first_cases(
    scenarios: Mapping[str, Scenario], tolerances: Numbers, directions: Sequence[str] = ()
) -> tuple[Case, ...]:
    """Every scenario point with corners of the tolerance box, and steps of both signs in each of `directions`."""
    points = itertools.product(*(points_of(s) for s in scenarios.values()))
    grid = [Table(dict(zip(scenarios, point, strict=True))) for point in points]
    corners = [
        Table({n: s * t for (n, t), s in zip(tolerances.items(), signs, strict=True)})
        for signs in itertools.product((-1.0, 1.0), repeat=len(tolerances))
    ]
    corners_of_points = [tuple(corners)] * len(grid)
    if len(grid) * len(corners) > _MAX_CORNER_CASES:  # two opposite corners at each point, other ones at the next point
        corners_of_points = [(corners[k % len(corners)], corners[-1 - k % len(corners)]) for k in range(len(grid))]
    cases = tuple(Case(at, offset) for at, offsets in zip(grid, corners_of_points, strict=True) for offset in offsets)
    steps = tuple(Case(direction=Table({name: sign})) for name in directions for sign in (-1.0, 1.0))
    return (() if cases == (Case(),) else cases) + steps
