"""From starts to the nearest point of one edge: IPOPT, with solvers that serve every design of a model."""

import math
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.boundaries.boundaries import Edge
from tmsopt.boundaries.surroundings import WeightedDesign
from tmsopt.models import Model
from tmsopt.program.ipopt import Point, Run, ipopt, polisher
from tmsopt.program.nlp import NLP
from tmsopt.records import Array

ALIKE = 1e-9
"""Relative difference of distances that is no difference."""

_ITERATIONS, _UNFINISHED = 200, "Maximum_Iterations_Exceeded"
_FEASIBLE = 1e-10  # violation of scaled coefficients, up to which a point counts as on the edge
_STATIONARY = 1e-8
_SHIFTED = 1e-8  # share by which what is left of a violation shifts the square of the distance, times its multiplier
_LARGE = 50_000  # operations times displacements: the expression of a Hessian would take too many
_KEPT = 64  # solvers, of so many edges and models


@dataclass(frozen=True)
class Approach:
    """Where one run ended, in weights; `refined` where the conditions of a nearest point hold to rounding.

    They do not where a violation, times its multiplier, still moves the distance: beside roots of multiplicity 5 or 6.
    """

    u: Array = field(default_factory=lambda: np.zeros(0))
    refined: bool = False

    @property
    def distance(self) -> float:
        """√Σ u²; inf for no point."""
        return float(np.linalg.norm(self.u)) if self.u.size else math.inf


def approach(place: WeightedDesign, edge: Edge, sign: float, size: float) -> Callable[[Array, float], Approach | None]:
    """A function from a start, and a distance to beat, to a nearest point of an edge; None where it ends elsewhere.

    Args:
        sign: sign of a0 on the side of the edge that is stable or heavily damped.
        size: distance to expect, the unit in which the NLP measures.
    """
    solver, n = _solver(place, edge), len(place.weights)
    numbers = (place.parameters[name] for name in place.problem.parameter_set.names)
    nlp = replace(
        solver.nlp,
        lower=(*(place.space.lower / size).tolist(), *solver.nlp.lower[n:]),
        upper=(*(place.space.upper / size).tolist(), *solver.nlp.upper[n:]),
        settings=(*numbers, *place.weights.values(), *place.scale.tolist(), *place.sizes.tolist(), sign, size),
    )

    def from_start(u: Array, below: float) -> Approach | None:
        c = sign * place.space.coefficients(u)
        if not (np.all(np.isfinite(c)) and c.any()):
            return None
        raw = solver.run(np.concatenate([u / size, edge.guess(c)]), nlp)
        if below == math.inf and raw.status == _UNFINISHED:  # nothing is known yet: it may go on
            raw = solver.run(raw.x, nlp)
        if float(np.linalg.norm(raw.x[:n])) * size >= below * (1 - ALIKE):
            return None
        point = solver.polish(raw, nlp)
        if not point.violation <= _FEASIBLE:
            return None
        u_found = np.clip(point.x[:n] * size, place.space.lower, place.space.upper)
        amiss = point.violation * float(np.abs(point.row_multipliers).max(initial=0.0))
        return Approach(u_found, point.stationarity <= _STATIONARY and amiss <= _SHIFTED * point.objective)

    return from_start


@dataclass(frozen=True)
class _Solver:
    """What finds nearest points of one edge, for every design of a model."""

    nlp: NLP
    run: Callable[[Array, NLP], Run]
    polish: Callable[[Run, NLP], Point]


_BUILT = threading.local()  # a solver belongs to one thread


def _solver(place: WeightedDesign, edge: Edge) -> _Solver:
    """The solver for an edge, kept: what differs between designs are parameters of the NLP."""
    known: OrderedDict[Hashable, _Solver] = vars(_BUILT).setdefault("solvers", OrderedDict())
    key = (place.problem.model, place.problem.parameter_set.name, tuple(place.weights), edge.name)
    if key not in known:
        nlp = _nlp(place, edge)
        known[key] = _Solver(nlp, ipopt(nlp, max_iterations=_ITERATIONS), polisher(nlp))
        if len(known) > _KEPT:
            known.popitem(last=False)
    known.move_to_end(key)
    return known[key]


def _nlp(place: WeightedDesign, edge: Edge) -> NLP:
    """Minimise y·y, y = u/size, over displacements and the unknowns of the edge.

    Its settings are the parameters, the weights, scales and sizes of the coefficients, the sign of a0, and the size.
    """
    model, of = place.problem.model, place.problem.parameter_set
    n, extra = len(place.weights), len(edge.unknowns)
    around = _around(model, of.name, tuple(place.weights))
    kind: Any = ca.MX if around.n_instructions() * n >= _LARGE else ca.SX
    x, p = kind.sym("x", n + extra), kind.sym("p", around.size1_in(1))
    y, unknowns = x[:n], [x[n + k] for k in range(extra)]
    c, sizes = (ca.vertsplit(column) for column in around(y, p))
    equations = [e / sizes[k] for e, k in zip(edge.equations(c, unknowns), edge.powers, strict=True)]
    others = edge.nonnegative(c, unknowns)
    return NLP(
        formulation="nearest",
        variables=(*place.weights, *edge.unknowns),
        functions=ca.Function("nlp", [x, p], [ca.sumsqr(y), ca.vertcat(*equations, *others)]),
        lower=(-np.inf,) * n + (0.0,) * extra,
        upper=(np.inf,) * n + edge.upper,
        rows=(*[edge.name] * len(equations), *["others"] * len(others)),
        row_lower=(0.0,) * (len(equations) + len(others)),
        row_upper=(*[0.0] * len(equations), *[np.inf] * len(others)),
        settings=(np.nan,) * p.numel(),
    )


@lru_cache(maxsize=_KEPT)
def _around(model: Model, set_name: str, weighted: tuple[str, ...]) -> ca.Function:
    """Coefficients at a displacement, and their sizes, as functions of that and of an NLP's settings."""
    of, n = model.parameter_set(set_name), len(weighted)
    parts = (len(of.names), n, model.degree + 1, model.degree + 1, 2)
    y, p = ca.SX.sym("y", n), ca.SX.sym("p", sum(parts))
    columns = iter(ca.vertsplit(p))
    numbers, weights, scale, sizes, (sign, size) = ([next(columns) for _ in range(count)] for count in parts)
    parameters = dict(zip(of.names, numbers, strict=True))
    moved = {name: parameters[name] + weights[k] * size * y[k] for k, name in enumerate(weighted)}
    a = model.coefficients({**parameters, **moved}, of)
    c = [sign * coefficient / unit for coefficient, unit in zip(a, scale, strict=True)]
    return ca.Function("around", [y, p], [ca.vertcat(*c), ca.vertcat(*sizes)], {"max_num_dir": 1})
