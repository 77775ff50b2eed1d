"""The nearest point of one edge as an NLP: least distance subject to a factored form, no eigenvalue in it."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tmsopt.formulation.ipopt import ipopt
from tmsopt.formulation.nlp import NLP
from tmsopt.formulation.polish import polisher
from tmsopt.margins.boundaries import Edge
from tmsopt.margins.surroundings import Place
from tmsopt.records import Array

ALIKE = 1e-9
"""Relative difference of distances that is no difference."""

_ITERATIONS = 200
_FEASIBLE = 1e-10  # violation of scaled coefficients, up to which a point counts as on the edge
_STATIONARY = 1e-8


@dataclass(frozen=True)
class Approach:
    """Where one run ended.

    Attributes:
        u: displacement, in weights.
        refined: whether the conditions of a nearest point hold to rounding.
    """

    u: Array
    refined: bool

    @property
    def distance(self) -> float:
        """√Σ u²."""
        return float(np.linalg.norm(self.u))


def approach(place: Place, edge: Edge, sign: float, size: float) -> Callable[[Array, float], Approach | None]:
    """A function from a start, and a distance to beat, to a nearest point of an edge; None where it ends elsewhere.

    Args:
        sign: sign of a0 on the side of the edge that is stable or heavily damped.
        size: distance to expect, the unit in which the NLP measures.
    """
    nlp = _nlp(place, edge, sign, size)
    run, polish = ipopt(nlp, max_iterations=_ITERATIONS), polisher(nlp)
    n = len(place.weights)

    def from_start(u: Array, below: float) -> Approach | None:
        c = sign * place.space.coefficients(u)
        if not (np.all(np.isfinite(c)) and c.any()):
            return None
        raw = run(np.concatenate([u / size, edge.guess(c)]))
        if float(np.linalg.norm(raw.x[:n])) * size >= below * (1 - ALIKE):
            return None
        point = polish(raw, nlp)
        if not point.violation <= _FEASIBLE:
            return None
        u_found = np.clip(point.x[:n] * size, place.space.lower, place.space.upper)
        return Approach(u_found, point.stationarity <= _STATIONARY)

    return from_start


def _nlp(place: Place, edge: Edge, sign: float, size: float) -> NLP:
    """Minimise y·y, y = u/size, over displacements and the unknowns of the edge."""
    n, extra = len(place.weights), len(edge.unknowns)
    x = ca.SX.sym("x", n + extra)
    y, unknowns = [x[k] for k in range(n)], [x[n + k] for k in range(extra)]
    c = ca.vertsplit(sign * place.symbolic(size * x[:n]))
    equations = [e / place.sizes[k] for e, k in zip(edge.equations(c, unknowns), edge.powers, strict=True)]
    others = edge.nonnegative(c, unknowns)
    f, g = sum(v * v for v in y), ca.vertcat(*equations, *others)
    return NLP(
        formulation="nearest",
        variables=(*place.weights, *edge.unknowns),
        functions=ca.Function("nlp", [x], [f, g]),
        lower=(*(place.space.lower / size).tolist(), *[0.0] * extra),
        upper=(*(place.space.upper / size).tolist(), *edge.upper),
        rows=(*[edge.name] * len(equations), *["others"] * len(others)),
        row_lower=(0.0,) * (len(equations) + len(others)),
        row_upper=(*[0.0] * len(equations), *[np.inf] * len(others)),
    )
