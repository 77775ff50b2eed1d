"""A suite of random systems of degree 3 to 12: how many are solved, how fast, and beside evolution."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tqdm import tqdm

from benchmarks.judges import FLOOR, SAME, System
from benchmarks.reports.systems.known import claimed
from benchmarks.reports.tables import Asked, duration, facts, median, page, share, table, times
from benchmarks.rivals import Followed, evolve_system
from benchmarks.suites import COUNT, SEED, Known, known, random_system
from benchmarks.timing import exponent, quantile
from tmsopt import solve

_QUICK = 3
_EVERY = 3  # every so many systems the evolution is run beside ours
_CLOSE = (1e-3, 1e-6, SAME)
_WITHIN = 1e-6


@dataclass(frozen=True)
class Solved:
    """A default solve, judged.

    Attributes:
        value: claimed and confirmed; nan otherwise.
        said: the status, or that its claim is not confirmed.
        seconds: of the processor.
    """

    system: System
    value: float
    said: str
    structure: str
    starts: int
    seconds: float

    @property
    def per_start(self) -> float:
        """Processor seconds per start tried, everything included."""
        return self.seconds / max(self.starts, 1)

    def error(self, of: Mapping[int, Known]) -> float:
        """Relative excess over the best value that anybody knows; inf without a confirmed value."""
        if math.isnan(self.value):
            return math.inf
        best = of[self.system.index].value if self.system.index in of else math.nan
        return self.system.excess(self.value, self.value if math.isnan(best) else best)


def solved(system: System) -> Solved:
    """One default solve; a crash is a failure like another."""
    problem = system.problem
    began = time.process_time()
    try:
        solution = solve(problem, throw=False)
    except Exception as error:
        return Solved(system, math.nan, f"crash: {error!r}", "", 0, time.process_time() - began)
    seconds = time.process_time() - began
    good = claimed(system, solution)
    said = solution.status if good or solution.status != "optimal" else f"{solution.value:.10g} is not confirmed"
    value = good[0] if good else math.nan
    return Solved(system, value, said, solution.structure, solution.starts.tried, seconds)


def report(asked: Asked) -> str:
    """The report in Markdown."""
    systems = [random_system(k) for k in range(asked.of(COUNT, _QUICK))]
    solved(systems[0])  # imports and first allocations are nobody's time
    own = [solved(s) for s in tqdm(systems, "random systems", unit="system")]
    some = [one for one in own[:: 4 if asked.quick else _EVERY] if "locate" not in one.system.goal]
    generations = 5 if asked.quick else 1000
    evolved = [(one, evolve_system(one.system, generations=generations)) for one in tqdm(some, "evolution")]
    of = known()
    return page(
        "Random systems",
        asked,
        _overview(own, of),
        _NOTE,
        "### By degree",
        _by_degree(own, of),
        "### By kind",
        _by_kind(own, of),
        "### Beside differential evolution on the eigenvalues",
        _agreement(own, of),
        _race(evolved),
        "### Failures",
        _failures(own, of),
    )


_NOTE = (
    f"`benchmarks.suites.random_systems`, seed {SEED}: systems of 2 to 6 degrees of freedom, given by M, D, K (masses, "
    "dampers, springs, gyroscopic and circulatory terms, negative damping), by a state matrix with output feedback, or "
    "by a polynomial, with 3 to 8 free parameters and up to three limits. The best known is the best of 32 starts of "
    "another seed, all tried, of an evolution, of a solve from its end (`python -m benchmarks --only known`), "
    "and of the default solve. Errors are relative to it, or to 1e-3 where it is smaller. A system is solved when the "
    f"status is `optimal`, the value is within {SAME:.0e} of the best known, as in the suite of random designs, and "
    "judges that share nothing with the package confirm the claim: limits at the design, and its value by the "
    "isolated roots of the exact polynomial of the numbers as stored, or of the multiple roots that they round. "
    "Times are processor time, in which other load on the machine does not count; that of the whole solve over the "
    "starts that it tried is a time per start."
)


def _overview(own: Sequence[Solved], of: Mapping[int, Known]) -> str:
    errors = [one.error(of) for one in own]
    return facts(
        [
            ("systems", len(own)),
            (f"**solved, within {SAME:.0e} of the best known**", f"**{share(e <= SAME for e in errors)}**"),
            ("within 1e-06", share(e <= _WITHIN for e in errors)),
            ("better than the best known by more than 1e-08", sum(e < -SAME for e in errors)),
            ("optimal, but not confirmed", sum("not confirmed" in one.said for one in own)),
            ("multiple root on the rightmost line", sum("EP" in one.structure for one in own)),
            ("median time per start", median(one.per_start for one in own)),
            ("90 % of times per start below", median((one.per_start for one in own), 0.9)),
            ("median time of a solve", median(one.seconds for one in own)),
        ]
    )


def _by_degree(own: Sequence[Solved], of: Mapping[int, Known]) -> str:
    groups = {n: [one for one in own if one.system.degree == n] for n in sorted({one.system.degree for one in own})}
    rows = [
        (
            n,
            share(one.error(of) <= SAME for one in group),
            median(one.per_start for one in group),
            duration(max(one.per_start for one in group)),
            median(one.seconds for one in group),
            f"{quantile(one.starts for one in group):.0f}",
        )
        for n, group in groups.items()
    ]
    degrees = [one.system.degree for one in own]
    laws = (
        f"Time of a start ~ degree^{exponent(degrees, [one.per_start for one in own]):.1f}, "
        f"of a solve ~ degree^{exponent(degrees, [one.seconds for one in own]):.1f}."
    )
    header = ("degree", "solved", "median time per start", "longest", "median time of a solve", "median starts")
    return f"{table(header, rows)}\n\n{laws}"


def _by_kind(own: Sequence[Solved], of: Mapping[int, Known]) -> str:
    groups = sorted({(one.system.kind, _asked(one.system)) for one in own})
    rows = [
        (*g, share(one.error(of) <= SAME for one in own if (one.system.kind, _asked(one.system)) == g)) for g in groups
    ]
    return table(("kind", "asked", "solved"), rows)


def _asked(system: System) -> str:
    return "locate" if "locate" in system.goal else " ".join(*system.goal.items())


def _agreement(own: Sequence[Solved], of: Mapping[int, Known]) -> str:
    both = [(one, of[one.system.index]) for one in own if one.system.index in of]
    both = [(one, kept) for one, kept in both if "evolution" in kept.known]
    if not both:
        return "No evolution is kept."
    gaps = [
        one.system.excess(kept.known["evolution"], one.value) if math.isfinite(one.value) else -math.inf
        for one, kept in both
    ]
    rows = [(f"evolution ends within {w:.0e} of the default solve", share(abs(g) <= w for g in gaps)) for w in _CLOSE]
    rows += [
        (f"evolution is worse by more than {_WITHIN:.0e}", share(g > _WITHIN for g in gaps)),
        (f"evolution is better by more than {_WITHIN:.0e}", share(g < -_WITHIN for g in gaps)),
        ("median evaluations of the evolution", f"{quantile(kept.evaluations for _, kept in both):.0f}"),
    ]
    return facts(rows)


def _race(evolved: Sequence[tuple[Solved, Followed]]) -> str:
    """How long each took to values as good as ours, and to the evolution's own."""
    good = [(one, e) for one, e in evolved if math.isfinite(one.value)]
    if not good:
        return "Nobody to race with."
    rows = []
    for within in (1e-2, 1e-3, 1e-4, 1e-6):
        reached = [
            (one, e.reached(one.system.sign * one.value + within * max(FLOOR, abs(one.value)))) for one, e in good
        ]
        met = [(one, t) for one, t in reached if math.isfinite(t)]
        solves, starts = quantile(t / one.seconds for one, t in met), quantile(t / one.per_start for one, t in met)
        rows.append((f"{within:.0e}", share(math.isfinite(t) for _, t in reached), times(solves), times(starts)))
    note = (
        f"{len(good)} systems, both in this run. SciPy's evolution, vectorised, 15 members for each parameter, "
        "stacked eigenvalues of the state matrix, limits by rank, until it converges to 1e-8: its time to a value "
        "within so much of ours, by the eigenvalues that it saw, over the time of our whole solve and of one start; "
        "medians where it got there."
    )
    header = ("within", "reached by the evolution", "its time over a default solve", "over one start")
    ends = quantile(e.seconds / one.seconds for one, e in good)
    return f"{table(header, rows)}\n\n{note} To its own end it takes {times(ends)} times a default solve."


def _failures(own: Sequence[Solved], of: Mapping[int, Known]) -> str:
    rows = [
        (
            one.system.index,
            one.system.kind,
            one.system.degree,
            len(one.system.free),
            _asked(one.system),
            one.said,
            f"{one.value:.10g}",
            f"{of[one.system.index].value:.10g}" if one.system.index in of else "–",
            f"{one.error(of):.1e}",
        )
        for one in own
        if not one.error(of) <= SAME
    ]
    header = ("system", "kind", "degree", "free", "asked", "status", "value", "best known", "error")
    return table(header, rows, "None.")
