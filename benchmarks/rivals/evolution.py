"""SciPy's differential evolution on eigenvalues, worst over scenarios and tolerances: a reference without factors."""

import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from benchmarks.judges.grid import Judge
from tmsopt.design.problem import Problem
from tmsopt.records import Array

POINTS = 33
"""Points per band of the grid on which the evolution ends."""

_COARSE = 9  # points per band of the grid on which it begins
_LOOSE = 0.0  # violation that the rule ignores, except of an equality
_BAND = 1e-4  # width granted to an equality, which random steps cannot meet
_INFEASIBLE = 1e6  # added to the violation, so that any feasible design beats any other
_AROUND = 0.02  # of the box: where the second run looks


@dataclass(frozen=True)
class Evolved:
    """Where the evolution ended.

    Attributes:
        value: the objective in the problem's own sense, nan where nothing feasible was found.
        violation: on the grid, relative to the size of the two sides.
    """

    parameters: Mapping[str, float]
    value: float
    violation: float
    seconds: float


def evolve(problem: Problem, seed: int = 0) -> Evolved:
    """Feasible before infeasible, then by violation or objective; a coarse grid in the whole box, then the full one."""
    began = time.perf_counter()
    lower, upper = np.array([*problem.free.values()]).reshape(-1, 2).T
    loose = _BAND if any(c.comparison == "==" for c in problem.conditions.values()) else _LOOSE
    x = _run(Judge(problem, _COARSE), Bounds(lower, upper), loose, seed, 400)
    if problem.variations:
        reach = _AROUND * (upper - lower)
        near = Bounds(np.maximum(lower, x - reach), np.minimum(upper, x + reach))
        x = _run(Judge(problem, POINTS), near, loose, seed, 120, np.clip(x, near.lb, near.ub))
    found = Judge(problem, POINTS)(x[:, None])
    value = float(found.value[0]) if found.violation[0] <= loose else float("nan")
    parameters = problem.ordered(dict(zip(problem.free, x.tolist(), strict=True)))
    return Evolved(parameters, value, float(found.violation[0]), time.perf_counter() - began)


def _run(judge: Judge, bounds: Bounds, loose: float, seed: int, generations: int, x0: Array | None = None) -> Array:
    sign = -1.0 if judge.problem.sense == "maximize" else 1.0

    def merit(x: Any) -> Any:
        columns = x.reshape(len(judge.names), -1)
        found = judge(columns)
        feasible = np.where(np.isfinite(found.value), sign * found.value, _INFEASIBLE)
        return np.where(found.violation <= loose, feasible, _INFEASIBLE + found.violation).reshape(x.shape[1:])

    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        answer = differential_evolution(
            merit,
            bounds,
            rng=seed,
            maxiter=generations,
            popsize=12,
            tol=1e-10,
            vectorized=True,
            updating="deferred",
            polish=False,
            x0=x0,
        )
    return np.asarray(answer.x)
