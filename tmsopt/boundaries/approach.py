"""Finds the nearest point of one edge (a piece of a boundary) from a start.

All designs of a model share the compiled NLP of an edge.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from tmsopt.algebra.formula import formula, symbol
from tmsopt.boundaries.boundaries import Edge
from tmsopt.boundaries.weighted_design import WeightedDesign
from tmsopt.models import Model
from tmsopt.program.ipopt import Run, make_polisher
from tmsopt.program.nlp import NLP, variable_name
from tmsopt.records import Array

SAME_DISTANCE = 1e-9
"""Relative difference below which distances count as equal."""

_MAX_ITERATIONS = 200  # iterations of one run of the solver
_UNFINISHED = "Maximum_Iterations_Exceeded"  # status of a run that reaches this number
_MAX_VIOLATION = 1e-10  # largest violation of the equations, in scaled coefficients, of a point on the edge
_MAX_GRADIENT = 1e-8  # largest gradient of the Lagrangian at a nearest point
_MAX_SHIFT = 1e-8  # largest relative change of the squared distance that the violation may cause
_MAX_PROGRAMS = 64  # in the cache, one for each edge and model
_WEIGHT, _SCALE, _SIZE, _SIGN = "weight of ", "scale ", "size ", "sign of a0"
"""Names of the numbers of a program that are no parameters; names of parameters have no blanks."""


@dataclass(frozen=True)
class EdgePoint:
    """The point at which one run of a solver ends, as a displacement u in units of the weights.

    Attributes:
        u: the displacement; empty if there is no point.
        refined: whether the conditions of a nearest point hold up to rounding. Near roots of multiplicity 5 or 6 they
            may not hold, because there a small violation of the equations still changes the distance.
    """

    u: Array = field(default_factory=lambda: np.zeros(0))
    refined: bool = False

    @property
    def distance(self) -> float:
        """√Σ u²; inf if there is no point."""
        return float(np.linalg.norm(self.u)) if self.u.size else math.inf


Method = Callable[..., Callable[[Array], Run]]
"""`make_ipopt` or `make_sqp`: an NLP → its solver."""


def make_edge_search(
    base: WeightedDesign, edge: Edge, sign: float, size: float, method: Method
) -> Callable[[Array, EdgePoint], EdgePoint]:
    """Return a function (start, best point so far) → the nearest point of an edge, or the best point if the run fails.

    Args:
        sign: sign of a0 on the stable, or heavily damped, side of the edge.
        size: expected distance, the unit in which the NLP measures.
    """
    n = len(base.weights)
    template = _build_program(base.problem.model, base.problem.parameter_set.name, tuple(base.weights), edge)
    numbers = [base.parameters[name] for name in base.problem.parameter_set.names]
    numbers += [*base.weights.values(), *base.scale.tolist(), *base.sizes.tolist(), sign, size]
    nlp = replace(
        template,
        lower=(*(base.lower / size).tolist(), *template.lower[n:]),
        upper=(*(base.upper / size).tolist(), *template.upper[n:]),
        numbers=dict(zip(template.formula.names[len(template.variables) :], numbers, strict=True)),
    )
    run, polish = method(nlp, max_iterations=_MAX_ITERATIONS), make_polisher(nlp)

    def solve_from(u: Array, best: EdgePoint) -> EdgePoint:
        c = sign * base.coefficients(u)
        if not (np.all(np.isfinite(c)) and c.any()):
            return best
        run_end = run(np.concatenate([u / size, edge.guess(c)]))
        if not best.u.size and run_end.status == _UNFINISHED:  # continue the run, because there is no point yet
            run_end = run(run_end.x)
        if float(np.linalg.norm(run_end.x[:n])) * size >= best.distance * (1 - SAME_DISTANCE):
            return best
        point = polish(run_end, nlp)
        if not point.violation <= _MAX_VIOLATION:
            return best
        u_found = np.clip(point.x[:n] * size, base.lower, base.upper)
        shift = point.violation * float(np.abs(point.row_multipliers).max(initial=0.0))
        return EdgePoint(u_found, point.stationarity <= _MAX_GRADIENT and shift <= _MAX_SHIFT * point.objective)

    return solve_from


@lru_cache(maxsize=_MAX_PROGRAMS)
def _build_program(model: Model, set_name: str, weighted_names: tuple[str, ...], edge: Edge) -> NLP:
    """Build the program that minimises y·y, y = u/size, over displacements u and the unknowns of the edge.

    All designs of a model share it: its numbers are the parameters, the weights, the scales and sizes of the
    coefficients, the sign of a0, and the size.
    """
    parameter_set, n, unknown_count = model.parameter_set(set_name), len(weighted_names), len(edge.unknowns)
    x = [symbol(variable_name(k)) for k in range(n + unknown_count)]
    numbers = [*parameter_set.names, *(_WEIGHT + name for name in weighted_names)]
    numbers += [f"{kind}{k}" for kind in (_SCALE, _SIZE) for k in range(model.degree + 1)] + [_SIGN, _SIZE]
    symbols = {name: symbol(name) for name in numbers}
    displaced_parameters = {
        name: symbols[name] + symbols[_WEIGHT + name] * symbols[_SIZE] * y
        for name, y in zip(weighted_names, x, strict=False)
    }
    a = model.coefficients(
        {name: displaced_parameters.get(name, symbols[name]) for name in parameter_set.names}, parameter_set
    )
    c = [symbols[_SIGN] * coefficient / symbols[f"{_SCALE}{k}"] for k, coefficient in enumerate(a)]
    equations = [e / symbols[f"{_SIZE}{k}"] for k, e in edge.equations(c, x[n:]).items()]
    inequalities = edge.nonnegative(x[n:])
    rows = [*equations, *inequalities]
    return NLP(
        formulation="nearest",
        variables=(*weighted_names, *edge.unknowns),
        formula=formula([sum(y * y for y in x[:n]), *rows], (*(y.value for y in x), *numbers)),
        numbers={},
        lower=(-np.inf,) * n + (0.0,) * unknown_count,
        upper=(*(np.inf,) * n, *edge.unknowns.values()),
        rows=(*[edge.name] * len(equations), *["others"] * len(inequalities)),
        row_lower=(0.0,) * len(rows),
        row_upper=(*[0.0] * len(equations), *[np.inf] * len(inequalities)),
    )
