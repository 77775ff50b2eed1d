"""The stages of the solve benchmark: what is timed, one problem after another, and what only has to be known."""

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Any, TypeVar

import numpy as np
from tqdm import tqdm

from benchmarks.rivals.reduced import LOCAL, SCALAR, VECTORISED, Found, differential
from benchmarks.suites.random_designs import random_problem
from tmsopt.design.problem import Problem
from tmsopt.solver.solve import solve

REFERENCE_STARTS = 200
"""Starts of the reference, all of them tried."""

EXACT = 1e-12
"""Violation up to which a rival's own value may serve as the best known; otherwise it is only a start to solve from."""

_FLOOR = 1e-3  # of |best|, in relative errors: an abscissa near 0 has no scale of its own

Item = TypeVar("Item")


@dataclass(frozen=True)
class Own:
    """What `solve` did with a problem."""

    status: str
    value: float
    parameters: Mapping[str, float]
    tried: int
    seconds: float

    @property
    def per_start(self) -> float:
        """Seconds per start tried, everything included."""
        return self.seconds / max(self.tried, 1)

    @property
    def optimal(self) -> bool:
        """Whether a feasible optimum is claimed."""
        return self.status == "optimal"


@dataclass(frozen=True)
class Record:
    """Everything known about one problem.

    Attributes:
        default: at default settings, timed.
        reference: the best of many starts and of solves that start where a rival ended.
        rivals: by name; those that were run.
    """

    index: int
    problem: Problem
    default: Own
    reference: Own
    rivals: Mapping[str, Found]

    @property
    def best(self) -> float:
        """The least abscissa that any method reached at a feasible design; nan where there is none."""
        known = [own.value for own in (self.default, self.reference) if own.optimal]
        known += [f.value for f in self.rivals.values() if f.feasible and (f.violation <= EXACT or not known)]
        return min(known, default=float("nan"))

    @property
    def solvable(self) -> bool:
        """Whether any method found a feasible design."""
        return bool(np.isfinite(self.best))

    @property
    def error(self) -> float:
        """Relative error of the default solve; inf where it claims no optimum."""
        return self.relative(self.default.value) if self.default.optimal else float("inf")

    @property
    def solved(self) -> bool:
        """Whether the default solve reached the best value known."""
        return self.error <= 1e-8

    @property
    def contradicted(self) -> bool:
        """Whether a design is feasible although `solve` says that none is."""
        return self.solvable and "infeasible" in (self.default.status, self.reference.status)

    def relative(self, value: float) -> float:
        """Excess of a value over the best one."""
        return (value - self.best) / max(_FLOOR, abs(self.best))


def measure(count: int, seed: int, evolved: int, local: int, workers: int) -> list[Record]:
    """Run all stages: `evolved` problems for the scalar differential evolution, `local` for the local optimisers.

    Default solves and both evolutions run one after another in this process; the rest is spread over the workers.
    """
    indices = range(count)
    _own(random_problem(1, seed))  # imports and first allocations are nobody's time
    defaults = [_own(random_problem(i, seed)) for i in _progress(indices, "default solves")]
    rivals: list[dict[str, Found]] = [{} for _ in indices]
    for i in _progress(_evolved(defaults, evolved), "differential evolution"):
        rivals[i][SCALAR] = differential(random_problem(i, seed))
    for i in _progress(indices, "vectorised evolution"):
        rivals[i][VECTORISED] = differential(random_problem(i, seed), vectorized=True)
    with ProcessPoolExecutor(workers) as pool:
        few = _evolved(defaults, local)
        for i, found in zip(few, _progress(pool.map(_local, few, repeat(seed)), "local rivals", len(few)), strict=True):
            rivals[i].update(found)
        ends = [[f.parameters for f in found.values() if f.feasible] for found in rivals]
        claimed = [own.status == "infeasible" for own in defaults]
        every = pool.map(_reference, indices, repeat(seed), ends, claimed)
        references = list(_progress(every, "references", count))
    return [Record(i, random_problem(i, seed), defaults[i], references[i], rivals[i]) for i in indices]


def _evolved(defaults: Sequence[Own], wanted: int) -> list[int]:
    """A fixed random choice of the problems that are not claimed infeasible: speed means nothing on the others."""
    eligible = [i for i, own in enumerate(defaults) if own.status != "infeasible"]
    return sorted(np.random.default_rng(0).permutation(eligible)[:wanted].tolist())


def _local(index: int, seed: int) -> dict[str, Found]:
    problem = random_problem(index, seed)
    return {name: rival(problem) for name, rival in LOCAL.items()}


def _reference(index: int, seed: int, ends: Sequence[Mapping[str, float]], claimed_infeasible: bool) -> Own:
    """Many starts of another seed, and one solve from each rival's end.

    Where the default solve found nothing feasible, the search may give up early: the evolutions check that claim.
    """
    problem = random_problem(index, seed)
    found = [_own(problem, starts=REFERENCE_STARTS, seed=1, exhaustive=not claimed_infeasible)]
    for end in ends:
        found.append(_own(started_at(problem, end), starts=1))
    return min(found, key=lambda own: own.value if own.optimal else math.inf)


def started_at(problem: Problem, design: Mapping[str, float]) -> Problem:
    """The problem with a design, or the one nearest to it in the box, as its first start."""
    start = {n: min(max(design[n], lower), upper) for n, (lower, upper) in problem.free.items()}
    return replace(problem, start=start)


def _own(problem: Problem, **options: Any) -> Own:
    """One solve; a crash is a failure like another."""
    began = time.perf_counter()
    try:
        solution = solve(problem, throw=False, **options)
    except Exception as error:
        return Own(f"crash: {error!r}", math.nan, {}, 0, time.perf_counter() - began)
    tried = solution.starts.tried
    return Own(solution.status, solution.value, dict(solution.parameters), tried, solution.seconds)


def _progress(items: Iterable[Item], stage: str, total: int | None = None) -> Iterator[Item]:
    return iter(tqdm(items, desc=stage, total=total, unit="problem"))
