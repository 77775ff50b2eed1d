"""How often, how well and how fast random constrained designs are solved, beside SciPy."""

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import repeat

import numpy as np
from tqdm import tqdm

from benchmarks.judges import EXACT, FLOOR, SAME, Attempt, attempt
from benchmarks.reports.designs.references import Settings, reference
from benchmarks.reports.tables import Asked, facts, median, page, share, table, times
from benchmarks.rivals import EVOLUTION, FEASIBLE, LOCAL, STARTS, Found, differential, local
from benchmarks.suites import SEED, Reference, random_problem, references
from benchmarks.timing import quantile
from tmsopt import Problem

_LOCAL = 20  # problems for the local rivals
_TOLERANCES = (1e-3, 1e-6, SAME)


@dataclass(frozen=True)
class Record:
    """Everything known about one problem.

    Attributes:
        default: at default settings, timed.
        reference: the best that is known of it.
        rivals: by name; those that were run.
    """

    index: int
    problem: Problem
    default: Attempt
    reference: Reference
    rivals: Mapping[str, Found]

    @property
    def best(self) -> float:
        """The least abscissa that any method reached at a feasible design; nan where there is none."""
        known = [self.default.value] if self.default.optimal else []
        known += [self.reference.value] if self.reference.solvable else []
        known += [f.value for f in self.rivals.values() if f.feasible and (f.violation <= EXACT or not known)]
        return min(known, default=math.nan)

    @property
    def solvable(self) -> bool:
        """Whether any method found a feasible design."""
        return math.isfinite(self.best)

    @property
    def error(self) -> float:
        """Relative error of the default solve; inf where it ends at no feasible design.

        A design counts that is given without a claim to be the best, as where a problem has none.
        """
        return self.relative(self.default.value) if self.default.optimal or self.default.feasible else math.inf

    @property
    def solved(self) -> bool:
        """Whether the default solve reached the best value known."""
        return self.error <= SAME

    @property
    def contradicted(self) -> bool:
        """Whether a design is feasible although `solve` says that none is."""
        return self.solvable and self.default.status == "infeasible"

    @property
    def unsettled(self) -> bool:
        """Whether no design is feasible and none is excluded."""
        return not self.solvable and self.default.status != "infeasible"

    @property
    def by(self) -> Iterator[str]:
        """Who has the best value, or any feasible design where none is claimed."""
        if self.reference.solvable and self.relative(self.reference.value) <= SAME:
            yield "reference"
        for name, found in self.rivals.items():
            if found.feasible and self.relative(found.value) <= 1e-6:
                yield f"{name} (violation {found.violation:.0e})"

    def relative(self, value: float) -> float:
        """Excess of a value over the best one."""
        return (value - self.best) / max(FLOOR, abs(self.best))


def measured(count: int, seed: int, workers: int, quick: bool) -> list[Record]:
    """Default solves and the evolution one after another in this process; the rest is spread over the workers."""
    problems = [random_problem(i, seed) for i in range(count)]
    attempt("warm-up", random_problem(1, seed))  # imports and first allocations are nobody's time
    defaults = [attempt("default", p) for p in tqdm(problems, "default solves")]
    rivals: list[dict[str, Found]] = [{} for _ in problems]
    for i in tqdm(range(count), "vectorised evolution"):
        rivals[i][EVOLUTION] = differential(problems[i])
    kept = references() if seed == SEED else {}
    missing = [i for i in range(count) if i not in kept]
    with ProcessPoolExecutor(workers) as pool:
        few = _some(defaults, 2 if quick else _LOCAL)
        for i, found in zip(few, tqdm(pool.map(_local, few, repeat(seed)), "local rivals", len(few)), strict=True):
            rivals[i].update(found)
        every = pool.map(reference, missing, repeat(Settings(seed)))
        kept |= dict(zip(missing, tqdm(every, "references", len(missing)), strict=True))
    return [Record(i, p, defaults[i], kept[i], rivals[i]) for i, p in enumerate(problems)]


def _some(defaults: Sequence[Attempt], wanted: int) -> list[int]:
    """A fixed random choice of the problems that are not claimed infeasible: speed means nothing on the others."""
    eligible = [i for i, own in enumerate(defaults) if own.status != "infeasible"]
    return sorted(np.random.default_rng(0).permutation(eligible)[:wanted].tolist())


def _local(index: int, seed: int) -> dict[str, Found]:
    return {method: local(method, random_problem(index, seed)) for method in LOCAL}


def report(asked: Asked) -> str:
    """The report in Markdown."""
    records = measured(asked.of(200, 6), asked.seed, asked.workers, asked.quick)
    return page(
        "Random constrained designs",
        asked,
        _counts(records),
        "The best known is that of `benchmarks/suites/references.json`: 500 starts with another seed, evolutions and "
        "solves from their ends; or that of a rival or of the default solve itself. Errors are relative to it, or to "
        "1e-3 where it is smaller. A time per start is the time of the whole solve over the starts that it tried.",
        "### Default settings, by number of free parameters",
        _by_freedom(records),
        "### Beside SciPy on the eigenvalues",
        _rivals(records),
        "A rival minimises the largest real part of the eigenvalues; its design counts if it violates nothing by "
        f"more than {FEASIBLE:.0e}. An equality is solved for a parameter, so that no rival has to follow it. "
        "Differential evolution has the constraints as such (`NonlinearConstraint`), `tol` = 1e-8, evaluates a "
        "generation at once, and is otherwise SciPy's. "
        f"The others start from the first {STARTS} designs of `solve` and their best end counts; Nelder–Mead has a "
        "penalty for violations. Times of these three are taken with all cores busy.",
        "### Failures",
        _failures(records),
    )


def _counts(records: Sequence[Record]) -> str:
    solvable = [r for r in records if r.solvable]
    claimed = [r for r in records if r.default.status == "infeasible"]
    return facts(
        [
            ("problems", len(records)),
            ("solvable: some method found a feasible design", len(solvable)),
            ("of these, no stable design known", sum(r.best >= 0 for r in solvable)),
            (
                "**solved at default settings, within 1e-8 of the best known**",
                f"**{share(r.solved for r in solvable)}**",
            ),
            ("of these, given with the words that it is not known to be the best", sum(_doubted(r) for r in solvable)),
            ("claimed infeasible, and no method found a feasible design", sum(not r.solvable for r in claimed)),
            ("claimed infeasible, but a method found a feasible design", sum(r.contradicted for r in records)),
            ("neither: no feasible design found, none excluded", sum(r.unsettled for r in records)),
            ("median time per start", median(r.default.per_start for r in solvable)),
            ("90 % of times per start below", median((r.default.per_start for r in solvable), 0.9)),
            ("median time of a solve", median(r.default.seconds for r in solvable)),
            ("median time of a solve that ends infeasible", median(r.default.seconds for r in claimed)),
            (f"median time of a solve over that of {EVOLUTION}", f"1 : {times(quantile(_ratios(solvable)))}"),
            ("the same where the solve is equal or better", f"1 : {times(quantile(_ratios(solvable, worse=False)))}"),
        ]
    )


def _doubted(record: Record) -> bool:
    """Whether the design counts although no optimum is claimed."""
    return record.solved and not record.default.optimal


def _ratios(records: Sequence[Record], worse: bool = True) -> list[float]:
    """Seconds of the evolution over those of the default solve."""
    own = ((r, r.rivals[EVOLUTION]) for r in records)
    return [f.seconds / r.default.seconds for r, f in own if worse or not r.error > r.relative(f.value) + SAME]


def _by_freedom(records: Sequence[Record]) -> str:
    rows = []
    for free in sorted({len(r.problem.free) for r in records}):
        group = [r for r in records if len(r.problem.free) == free]
        own = [r.default for r in group if r.solvable]
        solved = sum(r.solved for r in group if r.solvable)
        each, whole = median(a.per_start for a in own), median(a.seconds for a in own)
        rows.append((free, len(group), len(own), solved, each, whole, times(quantile(a.starts for a in own))))
    return table(("free", "problems", "solvable", "solved", "time per start", "time", "starts"), rows)


def _rivals(records: Sequence[Record]) -> str:
    solvable = [r for r in records if r.solvable]
    own = [(r.error, r.default.seconds) for r in solvable]
    rows = [_row("default solve", own)]
    for name in (EVOLUTION, *LOCAL):
        run = [(r, r.rivals[name]) for r in solvable if name in r.rivals]
        rows.append(_row(name, [(r.relative(f.value) if f.feasible else math.inf, f.seconds) for r, f in run]))
    within = (f"within {t:.0e}" for t in _TOLERANCES)
    return table(("method", "solvable problems", "feasible", *within, "median time"), rows)


def _row(name: str, ends: Sequence[tuple[float, float]]) -> tuple[object, ...]:
    shares = (share(error <= t for error, _ in ends) for t in (1e300, *_TOLERANCES))
    return (name, len(ends), *shares, median(seconds for _, seconds in ends))


def _failures(records: Sequence[Record]) -> str:
    rows = [
        (
            r.index,
            len(r.problem.free),
            r.default.status,
            f"{r.default.value:.10g}",
            f"{r.best:.10g}",
            f"{r.error:.1e}",
            ", ".join(r.by),
        )
        for r in records
        if (r.solvable and not r.solved) or r.contradicted or r.unsettled
    ]
    return table(("problem", "free", "status", "value", "best known", "error", "reached by"), rows, "None.")
