"""From starts to the nearest point of one edge, by solvers that serve every design of a model."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from tmsopt.algebra.formula import formula, symbol
from tmsopt.boundaries.boundaries import Edge
from tmsopt.boundaries.surroundings import WeightedDesign
from tmsopt.models import Model
from tmsopt.program.ipopt import Run, polisher
from tmsopt.program.nlp import NLP, name_of
from tmsopt.records import Array

ALIKE = 1e-9
"""Relative difference of distances that is no difference."""

_ITERATIONS, _UNFINISHED = 200, "Maximum_Iterations_Exceeded"
_FEASIBLE = 1e-10  # violation of scaled coefficients, up to which a point counts as on the edge
_STATIONARY = 1e-8
_SHIFTED = 1e-8  # share by which what is left of a violation shifts the square of the distance, times its multiplier
_KEPT = 64  # programs, of so many edges and models
_WEIGHT, _SCALE, _SIZE, _SIGN = "weight of ", "scale ", "size ", "sign of a0"
"""What numbers of a program are called beside the parameters, of which none has a blank in its name."""


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


Method = Callable[..., Callable[[Array], Run]]
"""`ipopt`, or `sqp`: what solves a program from a start."""


def approach(
    place: WeightedDesign, edge: Edge, sign: float, size: float, method: Method
) -> Callable[[Array, Approach], Approach]:
    """A function from a start, and the best so far, to a nearest point of an edge; the best where it ends elsewhere.

    Args:
        sign: sign of a0 on the side of the edge that is stable or heavily damped.
        size: distance to expect, the unit in which the NLP measures.
    """
    n = len(place.weights)
    plain = _nlp(place.problem.model, place.problem.parameter_set.name, tuple(place.weights), edge)
    own = [place.parameters[name] for name in place.problem.parameter_set.names]
    own += [*place.weights.values(), *place.scale.tolist(), *place.sizes.tolist(), sign, size]
    nlp = replace(
        plain,
        lower=(*(place.lower / size).tolist(), *plain.lower[n:]),
        upper=(*(place.upper / size).tolist(), *plain.upper[n:]),
        numbers=dict(zip(plain.formula.names[len(plain.variables) :], own, strict=True)),
    )
    run, polish = method(nlp, max_iterations=_ITERATIONS), polisher(nlp)

    def from_start(u: Array, best: Approach) -> Approach:
        c = sign * place.coefficients(u)
        if not (np.all(np.isfinite(c)) and c.any()):
            return best
        raw = run(np.concatenate([u / size, edge.guess(c)]))
        if not best.u.size and raw.status == _UNFINISHED:  # nothing is known yet: it may go on
            raw = run(raw.x)
        if float(np.linalg.norm(raw.x[:n])) * size >= best.distance * (1 - ALIKE):
            return best
        point = polish(raw, nlp)
        if not point.violation <= _FEASIBLE:
            return best
        u_found = np.clip(point.x[:n] * size, place.lower, place.upper)
        amiss = point.violation * float(np.abs(point.row_multipliers).max(initial=0.0))
        return Approach(u_found, point.stationarity <= _STATIONARY and amiss <= _SHIFTED * point.objective)

    return from_start


@lru_cache(maxsize=_KEPT)
def _nlp(model: Model, set_name: str, weighted: tuple[str, ...], edge: Edge) -> NLP:
    """Minimise y·y, y = u/size, over displacements and the unknowns of the edge; the same for every design.

    Its numbers are the parameters, the weights, scales and sizes of the coefficients, the sign of a0, and the size.
    """
    of, n, extra = model.parameter_set(set_name), len(weighted), len(edge.unknowns)
    x = [symbol(name_of(k)) for k in range(n + extra)]
    numbers = [*of.names, *(_WEIGHT + name for name in weighted)]
    numbers += [f"{kind}{k}" for kind in (_SCALE, _SIZE) for k in range(model.degree + 1)] + [_SIGN, _SIZE]
    given = {name: symbol(name) for name in numbers}
    moved = {name: given[name] + given[_WEIGHT + name] * given[_SIZE] * y for name, y in zip(weighted, x, strict=False)}
    a = model.coefficients({name: moved.get(name, given[name]) for name in of.names}, of)
    c = [given[_SIGN] * coefficient / given[f"{_SCALE}{k}"] for k, coefficient in enumerate(a)]
    equations = [e / given[f"{_SIZE}{k}"] for k, e in edge.equations(c, x[n:]).items()]
    others = edge.nonnegative(x[n:])
    rows = [*equations, *others]
    return NLP(
        formulation="nearest",
        variables=(*weighted, *edge.unknowns),
        formula=formula([sum(y * y for y in x[:n]), *rows], (*(y.value for y in x), *numbers)),
        numbers={},
        lower=(-np.inf,) * n + (0.0,) * extra,
        upper=(*(np.inf,) * n, *edge.unknowns.values()),
        rows=(*[edge.name] * len(equations), *["others"] * len(others)),
        row_lower=(0.0,) * len(rows),
        row_upper=(*[0.0] * len(equations), *[np.inf] * len(others)),
    )
