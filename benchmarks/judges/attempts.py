"""Solves of the package, judged: the claim, and what the judge says of its design."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from benchmarks.judges.grid import verdict
from tmsopt import Problem, solve

SOLVED = 1e-6
"""Relative excess over the best known value up to which a problem counts as solved.

Two solves of one optimum agree to 1e-9, the tolerance of the recheck times a multiplier; the evolution's value, which
stops a little inside the limits, is good to 1e-6.
"""

FEASIBLE = 1e-6
"""Violation, relative to the size of the two sides, that the judge lets pass: limits are met to 1e-9 at the worst case
that a search with golden sections and 4e-9 steps found, and constraints on roots amplify that."""

EXACT = 1e-12
"""Violation up to which a rival's own value may serve as the best known; otherwise it is only a start to solve from."""

SCALE = 0.01
"""Of |best| in relative errors: a value near 0 has no scale of its own."""


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
        return abs(self.value - self.judged) <= self.granted + SOLVED * max(SCALE, abs(self.judged))

    @property
    def per_start(self) -> float:
        """Seconds per start tried, everything included."""
        return self.seconds / max(self.starts, 1)

    @property
    def optimal(self) -> bool:
        """Whether a feasible optimum is claimed."""
        return self.status == "optimal"

    @property
    def counts(self) -> bool:
        """Whether its value can be the best known."""
        return self.optimal and self.feasible and self.honest


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


def started_at(problem: Problem, design: Mapping[str, float]) -> Problem:
    """The problem with a design, or the one nearest to it in the box, as its first start."""
    start = {n: min(max(design[n], lower), upper) for n, (lower, upper) in problem.free.items()}
    return replace(problem, start=start)
