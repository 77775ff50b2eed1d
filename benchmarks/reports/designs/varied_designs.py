"""The stages of the variety benchmark: a default solve of each problem, and everything that might do better."""

import math
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import repeat
from typing import Any

from tqdm import tqdm

from benchmarks.judges.grid import NOWHERE, Verdict, verdict
from benchmarks.reports.designs.random_designs import started_at
from benchmarks.rivals.evolution import Evolved, evolve
from benchmarks.suites.varied_designs import varied_problem
from tmsopt.design.problem import Problem
from tmsopt.solver.solve import solve

REFERENCE_STARTS = 16
"""Starts of the long run, all of them tried."""

SOLVED = 1e-6
"""Relative excess over the best known value up to which a problem counts as solved.

Two solves of one optimum agree to 1e-9, the tolerance of the recheck times a multiplier; the evolution's value, which
stops a little inside the limits, is good to 1e-6.
"""

FEASIBLE = 1e-6
"""Violation, relative to the size of the two sides, that the judge lets pass: limits are met to 1e-9 at the worst case
that a search with golden sections and 4e-9 steps found, and constraints on roots amplify that."""

EXACT = 1e-12
"""Violation up to which the evolution's own value may serve as the best known; otherwise it is only a start."""

SLOW = 10.0
"""Seconds beyond which a default solve counts as slow."""

_FLOOR = 0.01  # of |best| in relative errors: a value near 0 has no scale of its own


@dataclass(frozen=True)
class Attempt:
    """One solve, and what the judge says of its design.

    Attributes:
        value: as claimed.
        judged: by eigenvalues on a dense grid.
        granted: difference of the two that the scatter of multiple roots explains.
        abscissa: as claimed.
    """

    source: str
    status: str
    value: float
    parameters: Mapping[str, float]
    seconds: float
    starts: int
    violation: float = math.inf
    judged: float = math.nan
    granted: float = 0.0
    abscissa: float = math.nan

    @property
    def feasible(self) -> bool:
        """Whether the design satisfies everything, whatever is claimed."""
        return self.violation <= FEASIBLE

    @property
    def honest(self) -> bool:
        """Whether the claimed value is the design's."""
        return abs(self.value - self.judged) <= self.granted + SOLVED * max(_FLOOR, abs(self.judged))

    @property
    def counts(self) -> bool:
        """Whether its value can be the best known."""
        return self.status == "optimal" and self.feasible and self.honest


@dataclass(frozen=True)
class Trial:
    """Everything known about one problem.

    Attributes:
        others: solves that start elsewhere, or more often.
        evolved: what the judge says of the end of the differential evolution.
    """

    index: int
    problem: Problem
    default: Attempt
    others: tuple[Attempt, ...]
    evolved: Verdict

    @property
    def sign(self) -> float:
        """−1 where the objective is maximised."""
        return -1.0 if self.problem.sense == "maximize" else 1.0

    @cached_property
    def known(self) -> dict[str, float]:
        """Feasible values by source."""
        found = {a.source: a.value for a in (self.default, *self.others) if a.counts}
        if self.evolved.violation <= EXACT and abs(self.evolved.value) < NOWHERE:
            found["differential evolution"] = self.evolved.value
        return found

    @property
    def best(self) -> float:
        """The best value known; nan where there is none."""
        return self.sign * min((self.sign * v for v in self.known.values()), default=math.nan)

    @property
    def solvable(self) -> bool:
        """Whether anybody found a feasible design."""
        every = (self.default, *self.others)
        return bool(self.known) or any(a.feasible for a in every) or self.evolved.violation <= FEASIBLE

    @property
    def error(self) -> float:
        """Excess of the default solve's value over the best one."""
        return self.sign * (self.default.value - self.best) / max(_FLOOR, abs(self.best))

    @property
    def cause(self) -> str:  # noqa: PLR0911 - one return per cause
        """Why the default solve failed; empty where it did not."""
        match self.default.status:
            case "optimal":
                if not self.default.feasible:
                    return f"claims a design that violates by {self.default.violation:.0e}"
                if not self.default.honest:
                    return f"claims {self.default.value:.9g}, is {self.default.judged:.9g}"
                if self.error > 1e-4:
                    return "missed basin"
                return "imprecise" if self.error > SOLVED else ""
            case "infeasible":
                return "wrong infeasible" if self.solvable else ""
            case "not_converged":
                return "not converged" if self.solvable else "undecided"
            case crash:
                return crash

    @property
    def slow(self) -> bool:
        """Whether the default solve took too long."""
        return self.default.seconds > SLOW

    @property
    def by(self) -> list[str]:
        """Who reached the best value."""
        near = SOLVED * max(_FLOOR, abs(self.best))
        return [n for n, v in self.known.items() if abs(v - self.best) <= near]


def trials(count: int, seed: int, workers: int) -> list[Trial]:
    """All problems; default solves one after another in this process, the rest over the workers."""
    attempt("warm-up", varied_problem(1, seed), starts=1)  # imports and first allocations are nobody's time
    defaults = [attempt("default", varied_problem(i, seed)) for i in tqdm(range(count), desc="default solves")]
    with ProcessPoolExecutor(workers) as pool:
        every = pool.map(_trial, range(count), repeat(seed), defaults)
        return list(tqdm(every, desc="references", total=count))


def _trial(index: int, seed: int, default: Attempt, starts: int = REFERENCE_STARTS) -> Trial:
    problem = varied_problem(index, seed)
    evolved = evolve(problem)
    if evolved.violation > FEASIBLE and default.status != "optimal":
        evolved = min(evolved, evolve(problem, seed=1), key=lambda e: e.violation)
    others = list(_others(problem, evolved, starts, exhaustive=default.status != "infeasible"))
    return Trial(index, problem, default, tuple(others), verdict(problem, evolved.parameters))


def _others(problem: Problem, evolved: Evolved, starts: int, exhaustive: bool) -> Iterator[Attempt]:
    """Where the default solve found nothing feasible, the search may give up early: the evolutions check that claim."""
    yield attempt("from the evolution", started_at(problem, evolved.parameters), starts=1)
    if starts:
        yield attempt(f"{starts} starts", problem, starts=starts, seed=1, exhaustive=exhaustive)


def attempt(source: str, problem: Problem, **options: Any) -> Attempt:
    """One solve, judged; a crash is a failure like another."""
    began = time.perf_counter()
    try:
        solution = solve(problem, throw=False, **options)
    except Exception as error:
        return Attempt(source, f"crash: {error!r}", math.nan, {}, time.perf_counter() - began, 0)
    seconds = time.perf_counter() - began
    parameters = dict(solution.parameters)
    own = Attempt(
        source, solution.status, solution.value, parameters, seconds, solution.starts.tried, abscissa=solution.abscissa
    )
    if not all(map(math.isfinite, parameters.values())):
        return own
    judged = verdict(problem, parameters)
    return replace(own, violation=judged.violation, judged=judged.value, granted=judged.granted)
