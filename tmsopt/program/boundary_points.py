"""Feet: nearest points of the boundaries of stability as variables, so that a radius is exact wherever the design is.

A foot u meets e(u) = 0, the equations of its boundary, and u + Jᵀλ = 0 with their slopes J. Stability ends there or
nearer: |u| bounds the radius from above, be it the nearest foot or another.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.models import Values
from tmsopt.problem.cases import weight_of
from tmsopt.program.lifts import Rows
from tmsopt.program.nlp import AddedVariable
from tmsopt.roots.patterns.pattern import Roots


@dataclass(frozen=True)
class _Foot:
    """One case, and a function from what is given, u and w to slopes."""

    case: int
    names: tuple[str, ...]
    weave: bool
    slopes: ca.Function


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
    given: Any,
    known: Callable[[Values], list[float]],
    weights: Mapping[str, float],
) -> AddedVariable:
    """The conditions of a foot in some cases, and radius² ≤ u·u.

    Args:
        edges: the boundaries that they stand on.
        given: what else decides on a polynomial; `known`: the numbers for it, of numeric designs.
    """
    made, first = [], build.size[0]
    for k, foot in feet.items():
        edge, u = edges[k], ca.vertcat(*foot.values())
        w = [build.variable(f"w.{k}", 0.0)] if edge == "weave" else []
        equations = ca.vertcat(*_on_edge(edge, build.polynomial(k), *w))
        slopes = ca.densify(ca.jacobian(equations, ca.vertcat(u, *w)))
        multipliers = ca.vertcat(*(build.variable(f"l{j}.{k}") for j in range(equations.numel())))
        pull = ca.vertcat(u, *[0] * len(w)) + slopes.T @ multipliers
        for row in (*ca.vertsplit(equations), *ca.vertsplit(pull)):
            build.row("radius", row, 0.0, 0.0)
        build.row("radius", ca.sumsqr(u) - radius * radius, 0.0, np.inf)
        function = ca.Function("slopes", [given, u, ca.vertcat(*w)], [slopes])
        made.append(_Foot(k, tuple(foot), bool(w), function))
    return AddedVariable("feet", build.size[0] - first, partial(_guess, made, known, weights))


def _on_edge(edge: str, a: Sequence[Any], w: Any = None) -> list[Any]:
    """What is 0 on a boundary: p(i√w), in its even and its odd powers; the last coefficient, or the first one."""
    if edge == "weave":
        return [sum((-w) ** k * c for k, c in enumerate(a[::-1][odd::2])) for odd in (0, 1)]
    return [a[-1] if edge == "capsize" else a[0]]


def _guess(
    feet: Sequence[_Foot],
    known: Callable[[Values], list[float]],
    weights: Mapping[str, float],
    values: Sequence[Values],
    z: Sequence[Roots],
) -> list[list[float]]:
    """√w of the pair next to the axis, and multipliers by least squares."""
    found: list[float] = []
    for foot in feet:
        w = [_pair(z[foot.case])] if foot.weave else []
        u = _displacement(weights, foot.names, values[0], values[foot.case])
        slopes = foot.slopes(known(values[0]), u, w).full()
        multipliers = np.linalg.lstsq(slopes.T, -np.array([*u, *[0.0] * len(w)]), rcond=None)[0]
        found += [*w, *multipliers.tolist()]
    return [found]


def _pair(z: Roots) -> float:
    """|s|² of the pair that is nearest to the imaginary axis."""
    pairs = z[z.imag > 0]
    return float(np.abs(pairs[np.argmin(np.abs(pairs.real))]) ** 2) if pairs.size else 1.0
