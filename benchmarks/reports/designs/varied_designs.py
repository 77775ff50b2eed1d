"""Varied problems: scenarios, tolerances, damping, objectives of many kinds, and the failures by cause."""

import math
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import repeat

from tqdm import tqdm

from benchmarks.judges import EXACT, FEASIBLE, NOWHERE, SCALE, SOLVED, Attempt, Verdict, attempt, started_at, verdict
from benchmarks.reports.tables import Asked, facts, median, page, share, table
from benchmarks.rivals import POINTS, evolve
from benchmarks.suites import varied_problem
from tmsopt import Problem

REFERENCE_STARTS = 16
"""Starts of the long run, all of them tried."""

SLOW = 10.0
"""Seconds beyond which a default solve counts as slow."""


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
        return -1.0 if self.problem.posed.sense == "maximize" else 1.0

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
        return self.sign * (self.default.value - self.best) / max(SCALE, abs(self.best))

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
    def by(self) -> list[str]:
        """Who reached the best value."""
        near = SOLVED * max(SCALE, abs(self.best))
        return [n for n, v in self.known.items() if abs(v - self.best) <= near]


def trials(count: int, seed: int, workers: int) -> list[Trial]:
    """All problems; default solves one after another in this process, the rest over the workers."""
    attempt("warm-up", varied_problem(1, seed), starts=1)  # imports and first allocations are nobody's time
    defaults = [attempt("default", varied_problem(i, seed)) for i in tqdm(range(count), desc="default solves")]
    with ProcessPoolExecutor(workers) as pool:
        every = pool.map(_trial, range(count), repeat(seed), defaults)
        return list(tqdm(every, desc="references", total=count))


def _trial(index: int, seed: int, default: Attempt) -> Trial:
    """Where the default solve found nothing feasible, the search may give up early: the evolutions check that claim."""
    problem = varied_problem(index, seed)
    evolved = evolve(problem)
    if evolved.violation > FEASIBLE and not default.optimal:
        evolved = min(evolved, evolve(problem, seed=1), key=lambda e: e.violation)
    n, exhaustive = REFERENCE_STARTS, default.status != "infeasible"
    others = (
        attempt("from the evolution", started_at(problem, evolved.parameters), starts=1),
        attempt(f"{n} starts", problem, starts=n, seed=1, exhaustive=exhaustive),
    )
    return Trial(index, problem, default, others, verdict(problem, evolved.parameters))


def report(asked: Asked) -> str:
    """The report in Markdown."""
    every = trials(asked.of(200, 4), asked.seed, asked.workers)
    good = [t for t in every if not t.cause]
    stable = sum(t.solvable and t.default.optimal and t.default.abscissa < 0 for t in every)
    slow = ", ".join(str(t.index) for t in every if t.default.seconds > SLOW)
    return page(
        "Varied design problems",
        asked,
        facts(
            [
                ("problems", len(every)),
                ("with scenarios", sum(bool(t.problem.scenarios) for t in every)),
                ("with tolerances", sum(bool(t.problem.tolerances) for t in every)),
                ("in SI", sum(t.problem.posed.parameter_set.name == "SI" for t in every)),
                ("somebody found a feasible design", sum(t.solvable for t in every)),
                ("of these, stable at the best known", stable),
                ("**solved at default settings**", f"**{share(not t.cause for t in every)}**"),
                ("of these, infeasible and nobody found otherwise", sum(not t.solvable for t in good)),
                ("median time of a solve", median(t.default.seconds for t in every)),
                ("90 % of times below", median((t.default.seconds for t in every), 0.9)),
                (f"longer than {SLOW:.0f} s", slow or "none"),
            ]
        ),
        "A problem is solved when the default solve ends `optimal`, an independent judge (eigenvalues, up to 1025 "
        "points per band, corners and inside of the tolerance box) finds its design feasible within "
        f"{FEASIBLE:.0e} and its value as claimed, and the best known value is within {SOLVED:.0e}; or when it ends "
        "`infeasible` and nobody found a feasible design. The others: differential evolution on eigenvalues "
        f"({POINTS} points per band), a solve from its end, and {REFERENCE_STARTS} starts of another seed, all tried. "
        "Where eigenvalues scatter beside a multiple root, what 2e-15 of the coefficients does to them is granted.",
        "### Objectives",
        _objectives(every),
        "### Failures by cause",
        _failures(every),
    )


def _objectives(trials: Sequence[Trial]) -> str:
    asked = Counter(_asked(t) for t in trials)
    failed = Counter(_asked(t) for t in trials if t.cause)
    return table(("objective", "problems", "failed"), ((n, k, failed[n]) for n, k in sorted(asked.items())))


def _asked(trial: Trial) -> str:
    assert trial.problem.posed.objective is not None
    return f"{trial.problem.posed.sense} {trial.problem.posed.objective.text}".replace("**", "^")


def _failures(trials: Sequence[Trial]) -> str:
    rows = [
        (
            t.index,
            len(t.problem.free),
            ", ".join(n for n in ("scenarios", "tolerances") if getattr(t.problem, n)),
            _asked(t),
            t.cause,
            f"{t.default.value:.9g}",
            f"{t.best:.9g}",
            ", ".join(t.by),
        )
        for t in trials
        if t.cause
    ]
    header = ("problem", "free", "with", "objective", "cause", "value", "best known", "reached by")
    return table(header, sorted(rows, key=lambda row: str(row[4])), "None.")
