"""Feet: nearest points of the boundaries of stability as variables, so that a radius is exact wherever the design is.

A foot u meets e(u) = 0, the equations of its boundary, and u + Jᵀλ = 0 with their slopes J. Stability ends there or
nearer: |u| bounds the radius from above, be it the nearest foot or another.
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
from tmsopt.program.lifts import Rows
from tmsopt.program.nlp import AddedVariable
from tmsopt.roots.patterns.pattern import Roots


@dataclass(frozen=True)
class _Foot:
    """One case, and slopes of its equations in the unknowns u and w."""

    case: int
    names: tuple[str, ...]
    unknowns: list[str]
    equations: int
    slopes: Formula

    @property
    def weave(self) -> bool:
        return len(self.unknowns) > len(self.names)


Feet = Mapping[int, Mapping[str, Any]]
"""Number of a case → parameter → variable of its displacement, in units of its weight."""


def lift_displacements(weights: Mapping[str, float], feet: Feet) -> AddedVariable:
    """The radius and all displacements, to start where the cases are evaluated."""

    def guess(values: Sequence[Values], z: Sequence[Roots]) -> list[list[float]]:
        moves = (x for k, foot in feet.items() for x in _displacement(weights, tuple(foot), values[0], values[k]))
        return [[float(values[0]["radius"]), *moves]]

    return AddedVariable("radius", 1 + sum(map(len, feet.values())), guess)


def _displacement(weights: Mapping[str, float], names: Sequence[str], own: Values, at: Values) -> list[float]:
    return [float(at[n] - own[n]) / weight_of(n, float(own[n]), weights) for n in names]


def lift_feet(
    build: Rows,
    radius: Any,
    feet: Feet,
    edges: Mapping[int, str],
    known: Callable[[Values], Mapping[str, float]],
    weights: Mapping[str, float],
) -> AddedVariable:
    """The conditions of a foot in some cases, and radius² ≤ u·u.

    Args:
        edges: the boundaries that they stand on.
        known: the numbers of a numeric design that decide on a polynomial, by name.
    """
    made, first = [], build.size[0]
    for k, foot in feet.items():
        edge, u = edges[k], [*foot.values()]
        w = [build.variable(f"w.{k}", 0.0)] if edge == "weave" else []
        equations = _on_edge(edge, build.polynomial(k), *w)
        slopes = gradients(equations, [*u, *w])
        multipliers = [build.variable(f"l{j}.{k}") for j in range(len(equations))]
        pull = [
            sum((m * row[j] for m, row in zip(multipliers, slopes, strict=True)), x)
            for j, x in enumerate([*u, *[0] * len(w)])
        ]
        for row in (*equations, *pull):
            build.row("radius", row, 0.0, 0.0)
        build.row("radius", sum(x * x for x in u) - radius * radius, 0.0, np.inf)
        asked = formula(x for row in slopes for x in row)
        made.append(_Foot(k, tuple(foot), [x.value for x in (*u, *w)], len(equations), asked))
    return AddedVariable("feet", build.size[0] - first, partial(_guess, made, known, weights))


def _on_edge(edge: str, a: Sequence[Any], w: Any = None) -> list[Any]:
    """What is 0 on a boundary: p(i√w), in its even and its odd powers; the last coefficient, or the first one."""
    if edge == "weave":
        return [sum((-w) ** k * c for k, c in enumerate(a[::-1][odd::2])) for odd in (0, 1)]
    return [a[-1] if edge == "capsize" else a[0]]


def _guess(
    feet: Sequence[_Foot],
    known: Callable[[Values], Mapping[str, float]],
    weights: Mapping[str, float],
    values: Sequence[Values],
    z: Sequence[Roots],
) -> list[list[float]]:
    """√w of the pair next to the axis, and multipliers by least squares."""
    found: list[float] = []
    for foot in feet:
        w = [_pair(z[foot.case])] if foot.weave else []
        u = _displacement(weights, foot.names, values[0], values[foot.case])
        at = {**known(values[0]), **dict(zip(foot.unknowns, [*u, *w], strict=True))}
        slopes = np.array(fold(foot.slopes, at, FLOATS), dtype=float).reshape(foot.equations, -1)
        multipliers = np.linalg.lstsq(slopes.T, -np.array([*u, *[0.0] * len(w)]), rcond=None)[0]
        found += [*w, *multipliers.tolist()]
    return [found]


def _pair(z: Roots) -> float:
    """|s|² of the pair that is nearest to the imaginary axis."""
    pairs = z[z.imag > 0]
    return float(np.abs(pairs[np.argmin(np.abs(pairs.real))]) ** 2) if pairs.size else 1.0
