"""Adds boundary points near a design to the NLP as variables, so that the stability radius of the design is exact.

A boundary point at the displacement u satisfies the boundary equations e(u) = 0 and u + Jᵀλ = 0 with their Jacobian J.
Stability ends at this point or nearer, so that |u| bounds the radius from above, even if the point is not the nearest.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Formula, fold, formula
from tmsopt.algebra.kinds import FLOATS, gradients
from tmsopt.models import Values
from tmsopt.problem.cases import weight_of
from tmsopt.program.lifts import ProgramBuilder
from tmsopt.program.nlp import AddedVariable
from tmsopt.roots.patterns.pattern import Roots


@dataclass(frozen=True)
class _BoundaryPoint:
    """The boundary point of one case.

    Attributes:
        names: names of the displaced parameters.
        unknowns: names of the displacements u and of the squared frequency w in formulas.
        slopes: the Jacobian of the boundary equations in these unknowns.
    """

    case: int
    names: tuple[str, ...]
    unknowns: list[str]
    equation_count: int
    slopes: Formula

    @property
    def has_frequency(self) -> bool:
        return len(self.unknowns) > len(self.names)


Displacements = Mapping[int, Mapping[str, Any]]
"""Case → parameter → variable of its displacement, in units of its weight."""


def lift_displacements(weights: Mapping[str, float], displacements: Displacements) -> AddedVariable:
    """The radius and all displacements as variables; their starting values come from the cases."""

    def guess(values: Sequence[Values], z: Sequence[Roots]) -> list[list[float]]:
        guesses = [float(values[0]["radius"])]
        for k, displacement in displacements.items():
            guesses += _measure_displacement(weights, tuple(displacement), values[0], values[k])
        return [guesses]

    return AddedVariable("radius", 1 + sum(map(len, displacements.values())), guess)


def _measure_displacement(
    weights: Mapping[str, float], names: Sequence[str], nominal: Values, displaced: Values
) -> list[float]:
    return [float(displaced[n] - nominal[n]) / weight_of(n, float(nominal[n]), weights) for n in names]


def lift_boundary_points(
    build: ProgramBuilder,
    radius: Any,
    displacements: Displacements,
    edges: Mapping[int, str],
    numeric_inputs: Callable[[Values], Mapping[str, float]],
    weights: Mapping[str, float],
) -> AddedVariable:
    """Add the conditions of a boundary point for each case in `displacements`, and radius² ≤ u·u.

    Args:
        edges: case → the boundary on which its point lies.
        numeric_inputs: design → name and value of each number on which the polynomial of the design depends.
    """
    boundary_points, first_index = [], build.size[0]
    for k, displacement in displacements.items():
        edge, u = edges[k], [*displacement.values()]
        w = [build.add_variable(f"w.{k}", 0.0)] if edge == "weave" else []
        equations = _edge_equations(edge, build.polynomial(k), *w)
        slopes = gradients(equations, [*u, *w])
        multipliers = [build.add_variable(f"l{j}.{k}") for j in range(len(equations))]
        stationarity = [
            sum((m * row[j] for m, row in zip(multipliers, slopes, strict=True)), x)
            for j, x in enumerate([*u, *[0] * len(w)])
        ]
        for row in (*equations, *stationarity):
            build.add_row("radius", row, 0.0, 0.0)
        build.add_row("radius", sum(x * x for x in u) - radius * radius, 0.0, np.inf)
        gradient = formula(x for row in slopes for x in row)
        boundary_points.append(
            _BoundaryPoint(k, tuple(displacement), [x.value for x in (*u, *w)], len(equations), gradient)
        )
    return AddedVariable(
        "boundary points",
        build.size[0] - first_index,
        partial(_guess_unknowns, boundary_points, numeric_inputs, weights),
    )


def _edge_equations(edge: str, a: Sequence[Any], w: Any = None) -> list[Any]:
    """Expressions that vanish on a boundary: real and imaginary part of p(i√w), or the last or first coefficient."""
    if edge == "weave":
        return [sum((-w) ** k * c for k, c in enumerate(a[::-1][odd::2])) for odd in (0, 1)]
    return [a[-1] if edge == "capsize" else a[0]]


def _guess_unknowns(
    points: Sequence[_BoundaryPoint],
    numeric_inputs: Callable[[Values], Mapping[str, float]],
    weights: Mapping[str, float],
    values: Sequence[Values],
    z: Sequence[Roots],
) -> list[list[float]]:
    """w of the pair nearest to the imaginary axis, and multipliers by least squares."""
    guesses: list[float] = []
    for point in points:
        w = [_axis_pair_size(z[point.case])] if point.has_frequency else []
        u = _measure_displacement(weights, point.names, values[0], values[point.case])
        inputs = {**numeric_inputs(values[0]), **dict(zip(point.unknowns, [*u, *w], strict=True))}
        slopes = np.array(fold(point.slopes, inputs, FLOATS), dtype=float).reshape(point.equation_count, -1)
        multipliers = np.linalg.lstsq(slopes.T, -np.array([*u, *[0.0] * len(w)]), rcond=None)[0]
        guesses += [*w, *multipliers.tolist()]
    return [guesses]


def _axis_pair_size(z: Roots) -> float:
    """|s|² of the pair nearest to the imaginary axis."""
    pairs = z[z.imag > 0]
    return float(np.abs(pairs[np.argmin(np.abs(pairs.real))]) ** 2) if pairs.size else 1.0
