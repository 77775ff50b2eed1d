"""Rivals that search on until somebody stops them: SciPy's, CMA-ES and PyGRANSO, all on the eigenvalues.

Each is given the problem, the box and the constraints in the form that suits it, and restarts for ever; the race that
watches the evaluations decides when it is over.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from itertools import count
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.optimize import dual_annealing

from benchmarks.rivals.nonsmooth import pygranso, rightmost
from benchmarks.rivals.reduced import Reduced, Watch
from benchmarks.rivals.searches import LOCAL, differential, local, quiet
from tmsopt import Problem
from tmsopt.program import choose_starts
from tmsopt.records import Array

_MANY = 1_000_000
_STEP = 1e-6  # of the box, for central differences of smooth functions: right to some 1e-10


@dataclass(frozen=True)
class Seeker:
    """A search and the packages it needs beyond those of the project.

    Attributes:
        search: (problem, watch) → only when it gives up; watch is told of every evaluation and may end it.
    """

    search: Callable[[Problem, Watch], object]
    packages: tuple[str, ...] = ()

    @property
    def obstacle(self) -> str:
        """Why it cannot run; empty where it can. Its packages are imported, which is nobody's time."""
        absent = [name for name in self.packages if "." not in name and find_spec(name) is None]
        if absent:
            return f"not installed: {', '.join(absent)}"
        try:
            with quiet():
                numeric = import_module("numpy.core.numeric")
                with patch.object(numeric, "Inf", np.inf, create=True):  # PyGRANSO 1.2 wants it, NumPy 2 dropped it
                    for name in self.packages:
                        import_module(name)
        except ImportError as error:
            return f"cannot be imported: {error}"
        return ""

    @property
    def versions(self) -> str:
        """Of its packages, as they are distributed."""
        return ", ".join(f"{n} {version(n)}" for n in self.packages if "." not in n)


def _local(method: str) -> Seeker:
    return Seeker(lambda problem, watch: local(method, problem, starts=_MANY, watch=watch))


def _evolution(problem: Problem, watch: Watch) -> None:
    for seed in count():
        differential(problem, seed, watch)


def _annealing(problem: Problem, watch: Watch) -> None:
    """SciPy's generalised simulated annealing with its local searches, violations as an exact penalty."""
    reduced = Reduced(problem, watch)
    for seed in count():
        with quiet():
            dual_annealing(reduced.penalised, list(zip(reduced.lower, reduced.upper, strict=True)), rng=seed)


def _cma_es(problem: Problem, watch: Watch) -> None:
    """BIPOP-CMA-ES in the unit box, a population at once: bounds by its own transformation, violations as a penalty."""
    cma = import_module("cma")
    reduced = Reduced(problem, watch)
    width = reduced.upper - reduced.lower

    def generation(designs: Any) -> list[float]:
        return [float(v) for v in reduced.penalised(reduced.lower[:, None] + width[:, None] * np.array(designs).T)]

    for seed, start in enumerate(_starts(reduced), start=1):
        options = {"bounds": [0, 1], "seed": seed, "verbose": -9, "tolfun": 1e-13, "tolx": 1e-13, "tolflatfitness": 20}
        with quiet():
            first = np.clip((start - reduced.lower) / width, 0.05, 0.95)
            cma.fmin2(None, first, 0.3, options, restarts=9, bipop=True, parallel_objective=generation)


def _pygranso(problem: Problem, watch: Watch) -> None:
    """PyGRANSO in the unit box, with exact gradients and the box as constraints."""
    reduced = Reduced(problem, watch)
    width = reduced.upper - reduced.lower

    def combined(share: Array) -> tuple[float, Array, Array, Array]:
        x, unit = reduced.lower + width * share, np.eye(len(share))
        slope, row_slopes = slopes(reduced, x)
        limits = np.concatenate([-reduced.rows(x), -share, share - 1])
        inward = np.concatenate([-row_slopes * width, -unit, unit]).T
        return reduced.abscissa(x), slope * width, limits, inward

    for start in _starts(reduced):
        pygranso(combined, (start - reduced.lower) / width, viol_ineq_tol=1e-9)


SEEKERS: Mapping[str, Seeker] = {
    **{method: _local(method) for method in LOCAL},
    "differential evolution": Seeker(_evolution),
    "dual annealing": Seeker(_annealing),
    "CMA-ES": Seeker(_cma_es, ("cma",)),
    "PyGRANSO": Seeker(_pygranso, ("torch", "osqp", "gurobipy", "pygranso", "pygranso.pygranso")),
}
"""By name: local searches from one start after another, global ones from one seed after another."""


def slopes(reduced: Reduced, x: Array) -> tuple[Array, Array]:
    """Gradient of the abscissa (n,) and of the rows (rows, n) at one design.

    The coefficients and rows are smooth, so central differences serve for them.
    """
    step = np.diag(_STEP * (reduced.upper - reduced.lower))
    around = np.concatenate([x[:, None] + step, x[:, None] - step], axis=1)
    with np.errstate(all="ignore"):
        forward, backward = np.split(reduced.coefficients(around), 2)
        above, below = np.split(reduced.rows(around), 2, axis=-1)
        twice = 2 * np.diag(step)
        _, slope = rightmost(reduced.coefficients(x), ((forward - backward) / twice[:, None]).T)
    return slope, np.nan_to_num((above - below) / twice)


def _starts(reduced: Reduced) -> Iterator[Array]:
    for design in choose_starts(reduced.problem.posed, 0, _MANY):
        yield np.array([design[n] for n in reduced.names])
