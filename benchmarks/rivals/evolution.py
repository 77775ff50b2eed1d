"""SciPy's differential evolution on eigenvalues, a generation at once: a reference without factors.

Feasible before infeasible, then by violation or objective.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from benchmarks.judges import SAME, Designs, Judge, System, exactly
from benchmarks.rivals.searches import quiet
from tmsopt import Problem
from tmsopt.records import Array

POINTS = 33
"""Points per band of the grid on which the evolution of a problem ends."""

_COARSE = 9  # points per band of the grid on which it begins
_BAND = 1e-4  # width granted to an equality, which random steps cannot meet
_INFEASIBLE = 1e6  # added to the violation, so that any feasible design beats any other
_AROUND = 0.02  # of the box: where the second run looks
_ZOOMS = tuple((10.0**-k, max(1e-10, 10.0 ** (-k - 2))) for k in range(9))
"""Shares of the box in which the best design is sought, and violations of equations that are granted there."""

MET = 1e-9
"""Violation that counts as none, relative to the size of the two sides."""


@dataclass(frozen=True)
class Best:
    """The best design known, or the least violating one.

    Attributes:
        value: in the problem's own sense, by isolated roots; nan where no design is feasible.
    """

    value: float
    violation: float
    design: dict[str, float]
    seconds: float

    @property
    def feasible(self) -> bool:
        """Whether a design is feasible."""
        return self.violation <= MET


def best_known(problem: Problem, seed: int = 0) -> Best:
    """The end of an evolution in the whole box and of others around it, by isolated roots.

    A design that rounds one with a multiple root counts with the value of that, as it does for the package.
    """
    began, at = time.process_time(), Designs(problem)
    x, sign = np.zeros(0), problem.posed.sign
    for reach, band in _ZOOMS:
        width, slack = reach * (at.upper - at.lower), band if at.equalities else 0.0
        lower, upper = (at.lower, at.upper) if not x.size else (x - width, x + width)
        bounds = Bounds(np.maximum(lower, at.lower), np.minimum(upper, at.upper))
        near = np.clip(x, bounds.lb, bounds.ub) if x.size else None
        x = _minimised(partial(_merit, at, slack), bounds, seed, 300, popsize=20, tol=1e-12, x0=near)
    design = dict(zip(at.names, x.tolist(), strict=True))
    ends = [(one.violation, one.value) for one in exactly(problem, design)]
    violation, value = min(ends, key=lambda end: (end[0] > MET, sign * end[1] if end[0] <= MET else end[0]))
    seconds = round(time.process_time() - began, 2)
    return Best(value if violation <= MET else float("nan"), violation, design, seconds)


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


@dataclass(frozen=True)
class Followed:
    """An evolution watched on its way.

    Attributes:
        moments: CPU seconds and the least merit by then, at each generation that lowered it.
        evaluations: of the eigenvalues.
    """

    parameters: Mapping[str, float]
    moments: tuple[tuple[float, float], ...]
    evaluations: int
    seconds: float

    def reached(self, merit: float) -> float:
        """CPU seconds until a merit was met; inf if it never was."""
        return next((t for t, found in self.moments if found <= merit), float("inf"))


def _merit(at: Designs, slack: float, x: Array) -> Array:
    return at(x, slack).merit


def evolve(problem: Problem, seed: int = 0) -> Evolved:
    """The worst over scenarios and tolerances; a coarse grid in the whole box, then the full one."""
    lower, upper = np.array([*problem.free.values()]).reshape(-1, 2).T
    loose = _BAND if any(c.comparison == "==" for c in problem.posed.conditions.values()) else 0.0
    sign = -1.0 if problem.posed.sense == "maximize" else 1.0

    def run(points: int, bounds: Bounds, generations: int, x0: Array | None = None) -> Array:
        judge = Judge(problem, points)

        def merit(x: Array) -> Array:
            found = judge(x)
            return _ranked(sign * found.value, found.violation, loose)

        return _minimised(merit, bounds, seed, generations, popsize=12, tol=1e-10, x0=x0)

    x = run(_COARSE, Bounds(lower, upper), 400)
    if problem.posed.scenarios:
        reach = _AROUND * (upper - lower)
        near = Bounds(np.maximum(lower, x - reach), np.minimum(upper, x + reach))
        x = run(POINTS, near, 120, np.clip(x, near.lb, near.ub))
    found = Judge(problem, POINTS)(x[:, None])
    value = float(found.value[0]) if found.violation[0] <= loose else float("nan")
    parameters = problem.posed.ordered(dict(zip(problem.free, x.tolist(), strict=True)))
    return Evolved(parameters, value, float(found.violation[0]))


def least_violation(problem: Problem) -> Evolved:
    """The less violating of two evolutions."""
    return min((evolve(problem, seed) for seed in (0, 1)), key=lambda e: e.violation)


def evolve_system(system: System, seed: int = 0, generations: int = 1000) -> Followed:
    """On the eigenvalues of the state matrix."""
    names = list(system.free)
    moments: list[tuple[float, float]] = []
    evaluations = 0
    began = time.process_time()

    def merit(x: Array) -> Array:
        nonlocal evaluations
        evaluations += x.shape[1]
        found, beyond = system.judged(dict(zip(names, x, strict=True)))
        every = _ranked(system.sign * found[system.objective], beyond)
        least = float(every.min())
        if not moments or least < moments[-1][1]:
            moments.append((time.process_time() - began, least))
        return every

    bounds = Bounds(*np.array(list(system.free.values())).T)
    x = _minimised(merit, bounds, seed, generations, popsize=15, tol=SAME)
    design = dict(zip(names, x.tolist(), strict=True))
    return Followed(design, tuple(moments), evaluations, time.process_time() - began)


def _ranked(value: Array, violation: Array, loose: float = 0.0) -> Array:
    """The merit of designs: any feasible one beats any other."""
    feasible = np.where(np.isfinite(value), value, _INFEASIBLE)
    return np.where(violation <= loose, feasible, _INFEASIBLE + violation)


def _minimised(merit: Callable[[Array], Array], bounds: Bounds, seed: int, generations: int, **options: Any) -> Array:
    """Where the evolution of a merit of designs (n, m) ends."""

    def generation(x: Any) -> Any:
        return merit(x.reshape(len(x), -1)).reshape(x.shape[1:])

    with quiet():
        settings: dict[str, Any] = {"vectorized": True, "updating": "deferred", "polish": False, **options}
        answer = differential_evolution(generation, bounds, rng=seed, maxiter=generations, **settings)
    return np.asarray(answer.x)
