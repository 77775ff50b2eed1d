"""SciPy's optimisers on the eigenvalues: what one would try without factors.

Every rival minimises the largest real part of the eigenvalues in the box, with the constraints in the form that suits
it best.
"""

import contextlib
import io
import time
import warnings
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, differential_evolution, minimize

from benchmarks.rivals.reduced import Found, Reduced, Watch
from tmsopt import Problem
from tmsopt.program import choose_starts

STARTS = 5
"""Designs that the local rivals start from: the first ones of `tmsopt.solve`."""

EVOLUTION = "DE, vectorised"
"""Differential evolution, a whole generation at once."""

LOCAL = ("SLSQP", "Nelder–Mead", "COBYLA")
"""The local rivals."""


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Nothing printed and no warnings: a search that fails says so by its best value."""
    with warnings.catch_warnings(), np.errstate(all="ignore"), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        yield


def differential(problem: Problem, seed: int = 0, watch: Watch | None = None) -> Found:
    """Differential evolution with the constraints as such (Lampinen's rule)."""
    reduced = Reduced(problem, watch)
    bounds = Bounds(reduced.lower, reduced.upper)
    constraints: Any = NonlinearConstraint(reduced.rows, 0.0, np.inf) if reduced.constrained else ()
    objective: Any = reduced.abscissae
    way: dict[str, Any] = {"tol": 1e-8, "rng": seed, "vectorized": True, "updating": "deferred", "polish": False}
    began = time.perf_counter()
    with quiet():
        answer = differential_evolution(objective, bounds, constraints=constraints, **way)
        return reduced.found(EVOLUTION, answer.x, time.perf_counter() - began)


def local(method: str, problem: Problem, starts: int = STARTS, watch: Watch | None = None) -> Found:
    """One of `LOCAL` from the first starts; Nelder–Mead has violations as an exact penalty."""
    reduced = Reduced(problem, watch)
    bounds, n = Bounds(reduced.lower, reduced.upper), len(reduced.names)
    rows = [{"type": "ineq", "fun": reduced.rows}] if reduced.constrained else []
    least = float((reduced.upper - reduced.lower).min())
    function, constraints, options = {
        "SLSQP": (reduced.abscissa, rows, {"ftol": 1e-14, "maxiter": 300}),
        "Nelder–Mead": (
            reduced.penalised,
            [],
            {"xatol": 1e-12, "fatol": 1e-12, "maxiter": 1000 * n, "maxfev": 1000 * n},
        ),
        "COBYLA": (reduced.abscissa, rows, {"maxiter": 5000, "tol": 1e-12, "rhobeg": 0.1 * least}),
    }[method]
    search: dict[str, Any] = {"method": method.replace("–", "-"), "constraints": constraints, "options": options}
    began = time.perf_counter()
    ends: list[Found] = []
    with quiet():
        for design in choose_starts(problem.posed, 0, starts):
            start = np.array([design[name] for name in reduced.names])
            answer: Any = minimize(function, start, bounds=bounds, **search)
            ends.append(reduced.found(method, np.asarray(answer.x), 0.0))
    best = min(ends, key=lambda f: (not f.feasible, f.value if f.feasible else f.violation))
    return replace(best, seconds=time.perf_counter() - began)
