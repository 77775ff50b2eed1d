"""A race to equal accuracy: every method runs until it sees the known optimum, or until its time is up.

A rival is credited with the first design it ever evaluates that is feasible and good enough, whether it would have
known to stop there or not, and the time that the watching takes is not its own.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.judges import EXACT
from benchmarks.rivals.reduced import Reduced
from benchmarks.rivals.seekers import Seeker
from benchmarks.timing import ipopt_runs
from tmsopt import Problem, solve
from tmsopt.records import Array

TOLERANCES = (1e-3, 1e-6, 1e-8)
"""Excess over the optimum, relative to it."""

OWN = "tmsopt.solve"
OWN_WAYS: Mapping[str, Mapping[str, Any]] = {OWN: {}, "the same, first start alone": {"starts": 1}}
"""Ours by name: the options of a solve. From one start it cannot know whether it missed something; no rival knows."""

_ROUNDING = 1e-12  # relative: of eigenvalues that are simple
_REPEATS = 3  # solves of ours, before and after each round of rivals


@dataclass(frozen=True)
class Moment:
    """A design that was better than all before it.

    Attributes:
        seconds, evaluations: spent when it was known.
        violation: relative to the size of the two sides.
    """

    value: float
    seconds: float
    evaluations: int
    parameters: Mapping[str, float]
    violation: float = 0.0


@dataclass(frozen=True)
class Run:
    """What one method did with one problem.

    Attributes:
        moments: every improvement among feasible designs, in order.
        note: why there are none; empty where it ran.
    """

    method: str
    moments: tuple[Moment, ...]
    seconds: float
    evaluations: int
    note: str = ""

    @property
    def best(self) -> float:
        """The least abscissa of a feasible design; inf without one."""
        return self.moments[-1].value if self.moments else np.inf

    def reached(self, optimum: float, tolerance: float) -> Moment | None:
        """The first moment within a tolerance of the optimum."""
        return next((m for m in self.moments if m.value <= optimum + tolerance * abs(optimum)), None)


@dataclass(frozen=True)
class Heat:
    """One problem, its optimum, and what every method did with it; the first run is ours.

    Attributes:
        limit: seconds that a rival had.
        proof: how the optimum is known.
        design: its free parameters.
    """

    title: str
    problem: Problem
    optimum: float
    proof: str
    design: Mapping[str, float]
    runs: tuple[Run, ...]
    limit: float

    def error(self, run: Run) -> float:
        """Excess of the best value of a run over the optimum, relative to it."""
        return max(0.0, (run.best - self.optimum) / abs(self.optimum))

    def off(self, run: Run) -> float:
        """How far the best design of a run is from the optimal one: the largest difference, in widths of the box."""
        if not run.moments:
            return np.inf
        found = run.moments[-1].parameters
        return max(abs(found[n] - self.design[n]) / (hi - lo) for n, (lo, hi) in self.problem.posed.free.items())

    def ratio(self, run: Run, tolerance: float) -> float:
        """Time of a run over ours until both are within a tolerance; inf where the run never is."""
        ours, other = (r.reached(self.optimum, tolerance) for r in (self.runs[0], run))
        return other.seconds / ours.seconds if ours and other else np.inf if ours else np.nan

    def least_ratio(self, run: Run, tolerance: float) -> float:
        """The same, as if a run that never is there were there at the limit."""
        ratio = self.ratio(run, tolerance)
        return self.limit / self.runs[0].seconds if ratio == np.inf else ratio


class _Over(BaseException):
    """The race is over; not an Exception, lest an optimiser takes it for a failed evaluation."""


class _Clock:
    """Watches one rival: time and evaluations, and every improvement among its feasible designs."""

    def __init__(self, problem: Problem, goal: float, limit: float) -> None:
        self.moments: list[Moment] = []
        self.evaluations = 0
        self.seconds = 0.0
        self._judge = Reduced(problem)
        self._goal, self._limit = goal, limit
        self._resumed = time.perf_counter()

    def __call__(self, x: Array, values: Array) -> None:
        self.seconds += time.perf_counter() - self._resumed
        self.evaluations += x.shape[1]
        best = self.moments[-1].value if self.moments else np.inf
        better = np.flatnonzero(values < best)
        for column in better[np.argsort(values[better])]:
            found = self._judge.found("", x[:, column], 0.0)  # in the box, its abscissa there, and what it violates
            if found.feasible and found.value < best:
                self.moments.append(
                    Moment(found.value, self.seconds, self.evaluations, found.parameters, found.violation)
                )
                break
        if self.seconds > self._limit or (self.moments and self.moments[-1].value <= self._goal):
            raise _Over
        self._resumed = time.perf_counter()


def run(method: str, seeker: Seeker, problem: Problem, goal: float, limit: float) -> Run:
    """One rival, until it sees a feasible design at the goal or its seconds are up."""
    if obstacle := seeker.obstacle:
        return Run(method, (), 0.0, 0, obstacle)
    clock = _Clock(problem, goal, limit)
    note = ""
    try:
        seeker.search(problem, clock)
    except _Over:
        pass
    except Exception as error:
        note = f"failed: {error!r}"
    return Run(method, tuple(clock.moments), clock.seconds, clock.evaluations, note)


def own(problem: Problem, method: str = OWN) -> Run:
    """Ours: the best time of a few whole solves, and the evaluations of the factored problem in one of them."""
    seconds = []
    for _ in range(_REPEATS):
        began = time.perf_counter()
        solution = solve(problem, throw=False, **OWN_WAYS[method])
        seconds.append(time.perf_counter() - began)
    with ipopt_runs() as runs:
        solve(problem, throw=False, **OWN_WAYS[method])
    evaluations = sum(run.evaluations for run in runs)
    if solution.status != "optimal":
        return Run(method, (), min(seconds), evaluations, f"failed: {solution.status}")
    moment = Moment(solution.value, min(seconds), evaluations, dict(solution.parameters))
    return Run(method, (moment,), min(seconds), evaluations)


def heat(
    title: str,
    problem: Problem,
    known: tuple[float, str, Mapping[str, float]],
    seekers: Mapping[str, Seeker],
    limit: float,
) -> Heat:
    """All methods on one problem, one after another; a rival that does better without violation is the optimum."""
    optimum, proof, design = known
    goal = optimum + TOLERANCES[-1] * abs(optimum)
    before = [own(problem, method) for method in OWN_WAYS]
    rivals = [run(name, seeker, problem, goal, limit) for name, seeker in seekers.items()]
    after = [own(problem, method) for method in OWN_WAYS]
    ours = [min(pair, key=lambda r: r.seconds) for pair in zip(before, after, strict=True)]
    for rival in rivals:
        if rival.moments and rival.moments[-1].violation <= EXACT and rival.best < optimum - _ROUNDING * abs(optimum):
            last = rival.moments[-1]
            optimum, proof, design = last.value, f"{rival.method}, lower than {proof}", last.parameters
    return Heat(title, problem, optimum, proof, design, (*ours, *rivals), limit)


def median_ratio(heats: Sequence[Heat], method: str, tolerance: float) -> tuple[int, float, bool]:
    """On how many problems a method gets within a tolerance, the median time over ours, and whether that is exact.

    Where a method never gets there, its limit counts: if the median is one of these, it is only a lower bound.
    """
    pairs = [(h, r) for h in heats for r in h.runs if r.method == method]
    reached = sum(bool(np.isfinite(h.ratio(r, tolerance))) for h, r in pairs)
    least = sorted((h.least_ratio(r, tolerance), h.ratio(r, tolerance) == np.inf) for h, r in pairs)
    middle = least[(len(least) - 1) // 2 : len(least) // 2 + 1]
    return reached, float(np.mean([ratio for ratio, _ in middle])), not any(bound for _, bound in middle)
