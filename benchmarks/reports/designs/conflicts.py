"""Infeasible problems: whether the relaxation that is reported is enough, and 1 % less of it is not."""

import math
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from tqdm import tqdm

from benchmarks.judges import FEASIBLE, MET, verdict
from benchmarks.reports.tables import Asked, median, page, share, table
from benchmarks.rivals import least_violation
from benchmarks.suites import Conflict, conflicts, moved
from tmsopt import solve

LESS = 0.99
"""Share of a relaxation that must not be enough."""


@dataclass(frozen=True)
class Relaxed:
    """How a reported relaxation did.

    Attributes:
        amounts: as reported; empty where nothing is.
        enough: whether the reported design satisfies all moved limits.
        violation: of the reported design.
        less: status of a solve with 1 % less.
        evolved: the evolution's least violation with 1 % less, relative to the sides.
    """

    conflict: Conflict
    status: str
    amounts: Mapping[str, float]
    violation: float
    less: str
    evolved: float
    seconds: float

    @property
    def enough(self) -> bool:
        """Whether the moved limits can be met."""
        return bool(self.amounts) and self.violation <= FEASIBLE

    @property
    def needed(self) -> bool:
        """Whether 1 % less is not enough, by the package and by the evolution."""
        return bool(self.amounts) and self.less == "infeasible" and self.evolved > MET

    @property
    def cause(self) -> str:
        """What is wrong; empty where nothing is."""
        if self.status != "infeasible":
            return f"claimed {self.status}"
        if not self.amounts:
            return "no relaxation reported"
        if not self.enough:
            return f"the relaxed design violates by {self.violation:.0e}"
        if self.evolved <= MET:
            return "1 % less is enough for the evolution"
        return "" if self.needed else f"1 % less ends {self.less}"


def check(conflict: Conflict) -> Relaxed:
    """Solve a conflict, and try the relaxation that the solution reports; a crash is a failure like another."""
    problem = conflict.problem
    try:
        solution = solve(problem, throw=False)
    except Exception as error:
        return Relaxed(conflict, f"crash: {error!r}", {}, math.inf, "", math.nan, math.nan)
    relaxation = solution.relaxation
    if relaxation is None or not relaxation.amounts:
        return Relaxed(conflict, solution.status, {}, math.inf, "", math.nan, solution.seconds)
    amounts, design = dict(relaxation.amounts), relaxation.parameters
    less = moved(problem, amounts, LESS)
    return Relaxed(
        conflict=conflict,
        status=solution.status,
        amounts=amounts,
        violation=verdict(moved(problem, amounts), design).violation,
        less=solve(less, throw=False).status,
        evolved=least_violation(less).violation,
        seconds=solution.seconds,
    )


def report(asked: Asked) -> str:
    """The report in Markdown."""
    wanted = conflicts(asked.of(50, 2), asked.seed)
    with ProcessPoolExecutor(asked.workers) as pool:
        checks = list(tqdm(pool.map(check, wanted), desc="conflicts", total=len(wanted)))
    rows = []
    for kind in dict.fromkeys(c.conflict.kind for c in checks):
        group = [c for c in checks if c.conflict.kind == kind]
        said = sum(c.status == "infeasible" for c in group)
        enough, needed = sum(c.enough for c in group), sum(c.needed for c in group)
        rows.append((kind, len(group), said, enough, needed, median(c.seconds for c in group)))
    header = (
        "conflict",
        "problems",
        "said infeasible",
        "relaxation is enough",
        f"{LESS:.0%} of it is not",
        "median time",
    )
    failed = [(k, c.conflict.kind, c.cause, dict(c.amounts)) for k, c in enumerate(checks) if c.cause]
    return page(
        "Conflicts",
        asked,
        f"**{share(c.enough and c.needed for c in checks)}** as they should be.",
        table(header, rows),
        "Each is infeasible by a closed form. A relaxation is enough when the reported design meets all moved limits "
        "by the independent judge; it is needed when with 1 % less the solve says infeasible and two differential "
        "evolutions on the violation find no feasible design either.",
        "### Failures",
        table(("problem", "conflict", "cause", "relaxation"), failed, "None."),
    )
