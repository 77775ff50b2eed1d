"""Global bounds for the suite of random designs, judged by what other methods reach."""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from tqdm import tqdm

from benchmarks.reports.tables import Asked, facts, median, page, share, table
from benchmarks.suites import Reference, random_problem, references
from tmsopt import Solution, certify, solve

RELATIVE, ABSOLUTE = 1e-4, 1e-5
"""Gap that counts as proven."""

_ROUNDING = 1e-8  # relative: a reference's coefficients lie within 1e-10 of a design that reaches its value


@dataclass(frozen=True)
class Proof:
    """What became of one problem.

    Attributes:
        before, after: the default solve, and what was certified: the same design or its replacement.
    """

    index: int
    before: Solution
    after: Solution
    seconds: float
    reference: Reference

    @property
    def free(self) -> int:
        """Free parameters."""
        return len(self.after.problem.free)

    @property
    def solvable(self) -> bool:
        """Whether any method found a feasible design."""
        return self.reference.solvable or self.after.status == "optimal"

    @property
    def best(self) -> float:
        """The least abscissa that any method is known to reach, this one included."""
        known = [self.reference.value] if self.reference.solvable else []
        return min([*known, *([self.after.value] if self.after.status == "optimal" else [])], default=math.inf)

    @property
    def closed(self) -> bool:
        """Whether the gap is small enough to call the design proven."""
        enough = max(RELATIVE * abs(self.after.value), ABSOLUTE) * (1 + 1e-9)
        return self.after.status == "optimal" and self.after.bound.gap < enough

    @property
    def excluded(self) -> bool:
        """Whether it is proved that no design is feasible."""
        return self.after.status == "infeasible" and self.after.bound.value == math.inf

    @property
    def wrong(self) -> bool:
        """Whether a design is known that the bound excludes."""
        return self.after.bound.value > self.best + _ROUNDING * max(1e-3, abs(self.best))

    @property
    def replaced(self) -> bool:
        """Whether a better design took the place of the default solve's."""
        before, after = self.before.value, self.after.value
        return self.after.status == "optimal" and not abs(before - after) <= 1e-12 * (1 + abs(after))


def proofs(count: int, seed: int, seconds: float) -> Iterator[Proof]:
    """Default solves, then certificates, one after the other."""
    known = references()
    for index in tqdm(range(count), unit="problem"):
        design = solve(random_problem(index, seed), throw=False)
        began = time.perf_counter()
        proved = certify(design, seconds=seconds)
        yield Proof(index, design, proved, time.perf_counter() - began, known[index])


def report(asked: Asked) -> str:
    """The report in Markdown."""
    every = list(proofs(asked.of(200, 4), asked.seed, asked.within(60, 5)))
    solvable, others = [p for p in every if p.solvable], [p for p in every if not p.solvable]
    closed = [p for p in solvable if p.closed]
    rows = [
        ("feasible problems", len(solvable)),
        ("**gap below 1e-4 (relative) or 1e-5 (absolute)**", f"**{share(p.closed for p in solvable)}**"),
        ("of these, by the product of the roots alone", sum(p.after.bound.method == "omega0" for p in closed)),
        (
            "of these, gap below 1e-6, or 1e-7 absolute",
            sum(p.after.bound.gap <= 1e-6 * max(abs(p.after.value), 0.1) * (1 + 1e-9) for p in closed),
        ),
        ("problems without a feasible design known", len(others)),
        ("**proved infeasible**", f"**{share(p.excluded for p in others)}**"),
        ("designs replaced by a better one", sum(p.replaced for p in every)),
        ("**bounds above a value that some method reaches**", f"**{sum(p.wrong for p in every)}**"),
        ("median time of a proof", median(p.seconds for p in closed)),
        ("90 % of these times below", median((p.seconds for p in closed), 0.9)),
        ("median nodes", sorted(p.after.bound.nodes for p in closed)[len(closed) // 2] if closed else "–"),
    ]
    left = []
    for p in (p for p in every if not (p.closed or p.excluded)):
        found, bound = p.after, p.after.bound
        numbers = (f"{found.value:.9g}", f"{bound.value:.9g}", f"{bound.gap:.1e}", bound.nodes, f"{p.seconds:.0f} s")
        left.append((p.index, p.free, found.status, *numbers))
    replaced = (p for p in every if p.replaced)
    better = [(p.index, p.free, *(f"{v:.9g}" for v in (p.before.value, p.after.value, p.best))) for p in replaced]
    return page(
        "Proved designs",
        asked,
        facts(rows),
        "The random designs of the solve benchmark. A bound is wrong if it lies above the least abscissa that the "
        "default solve, 500 starts or differential evolution reach at a design judged feasible "
        "(`benchmarks/suites/references.json`), or the certified design itself, by more than "
        f"{_ROUNDING:.0e} of it. Times include the start of SCIP's processes.",
        "### By number of free parameters",
        _by_freedom(solvable),
        "### Replaced",
        table(("problem", "free", "before", "after", "best known"), better, "None."),
        "### Not proved",
        table(("problem", "free", "status", "value", "bound", "gap", "nodes", "time"), left, "None."),
    )


def _by_freedom(solvable: Sequence[Proof]) -> str:
    rows = []
    for free in sorted({p.free for p in solvable}):
        group = [p for p in solvable if p.free == free]
        closed = [p for p in group if p.closed]
        nodes = max((p.after.bound.nodes for p in closed), default=0)
        rows.append((free, len(group), len(closed), median(p.seconds for p in closed), nodes))
    return table(("free", "feasible", "proved", "median time", "most nodes"), rows)
