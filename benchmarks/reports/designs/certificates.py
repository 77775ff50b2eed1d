"""Global bounds for the suite of random designs, judged by what other methods reach."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

from tqdm import tqdm

from benchmarks.reports import Asked, facts, median, page, share, table
from benchmarks.suites import Reference, random_problem, references
from tmsopt import certify, solve

RELATIVE, ABSOLUTE = 1e-4, 1e-5
"""Gap that counts as proven."""

_ROUNDING = 1e-8  # relative: a reference's coefficients lie within 1e-10 of a design that reaches its value


@dataclass(frozen=True)
class Proof:
    """What became of one problem.

    Attributes:
        value: of the design, certified or its replacement.
        before: of the design that the default solve found.
        best: the least value that any method is known to reach, this one included.
    """

    index: int
    free: int
    status: str
    before: float
    value: float
    bound: float
    gap: float
    method: str
    nodes: int
    seconds: float
    reference: Reference

    @property
    def solvable(self) -> bool:
        """Whether any method found a feasible design."""
        return self.reference.solvable or self.status == "optimal"

    @property
    def best(self) -> float:
        """The least abscissa known."""
        known = [self.reference.value] if self.reference.solvable else []
        return min([*known, *([self.value] if self.status == "optimal" else [])], default=math.inf)

    @property
    def closed(self) -> bool:
        """Whether the gap is small enough to call the design proven."""
        return self.status == "optimal" and self.gap < max(RELATIVE * abs(self.value), ABSOLUTE) * (1 + 1e-9)

    @property
    def excluded(self) -> bool:
        """Whether it is proved that no design is feasible."""
        return self.status == "infeasible" and self.bound == math.inf

    @property
    def wrong(self) -> bool:
        """Whether a design is known that the bound excludes."""
        return self.bound > self.best + _ROUNDING * max(1e-3, abs(self.best))


def proofs(count: int, seed: int, seconds: float) -> list[Proof]:
    """Default solves, then certificates, one after the other."""
    known = references()
    found = []
    for index in tqdm(range(count), unit="problem"):
        design = solve(random_problem(index, seed), throw=False)
        began = time.perf_counter()
        proved = certify(design, seconds=seconds)
        took = time.perf_counter() - began
        bound = proved.bound
        found.append(
            Proof(
                index, len(design.problem.free), proved.status, design.value, proved.value, bound.value, bound.gap,
                bound.method, bound.nodes, took, known[index],
            )
        )  # fmt: skip
    return found


def report(asked: Asked) -> str:
    """The report in Markdown."""
    every = proofs(asked.of(200, 4), asked.seed, asked.within(60, 5))
    solvable, others = [p for p in every if p.solvable], [p for p in every if not p.solvable]
    closed = [p for p in solvable if p.closed]
    rows = [
        ("feasible problems", len(solvable)),
        ("**gap below 1e-4 (relative) or 1e-5 (absolute)**", f"**{share(p.closed for p in solvable)}**"),
        ("of these, by the product of the roots alone", sum(p.method == "omega0" for p in closed)),
        (
            "of these, gap below 1e-6, or 1e-7 absolute",
            sum(p.gap <= 1e-6 * max(abs(p.value), 0.1) * (1 + 1e-9) for p in closed),
        ),
        ("problems without a feasible design known", len(others)),
        ("**proved infeasible**", f"**{share(p.excluded for p in others)}**"),
        ("designs replaced by a better one", sum(_replaced(p) for p in every)),
        ("**bounds above a value that some method reaches**", f"**{sum(p.wrong for p in every)}**"),
        ("median time of a proof", median(p.seconds for p in closed)),
        ("90 % of these times below", median((p.seconds for p in closed), 0.9)),
        ("median nodes", sorted(p.nodes for p in closed)[len(closed) // 2] if closed else "–"),
    ]
    left = [
        (p.index, p.free, p.status, f"{p.value:.9g}", f"{p.bound:.9g}", f"{p.gap:.1e}", p.nodes, f"{p.seconds:.0f} s")
        for p in every
        if not (p.closed or p.excluded)
    ]
    better = [(p.index, p.free, f"{p.before:.9g}", f"{p.value:.9g}", f"{p.best:.9g}") for p in every if _replaced(p)]
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


def _replaced(proof: Proof) -> bool:
    return proof.status == "optimal" and not abs(proof.before - proof.value) <= 1e-12 * (1 + abs(proof.value))


def _by_freedom(solvable: Sequence[Proof]) -> str:
    rows = []
    for free in sorted({p.free for p in solvable}):
        group = [p for p in solvable if p.free == free]
        closed = [p for p in group if p.closed]
        nodes = max((p.nodes for p in closed), default=0)
        rows.append((free, len(group), len(closed), median(p.seconds for p in closed), nodes))
    return table(("free", "feasible", "proved", "median time", "most nodes"), rows)
