"""The best value that anybody reached on each random system, looked for in every way there is."""

import math
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from tqdm import tqdm

from benchmarks.judges import SAME, System, confirmed_system, ideals, started_at, values_of
from benchmarks.reports.tables import Asked, facts, origin, page, share
from benchmarks.rivals import Followed, evolve_system
from benchmarks.suites import COUNT, OSCILLATORS, Known, known, random_system, write
from tmsopt import Solution, solve

STARTS = 32
"""Of the long run, all of them tried, with seed 1."""


def claimed(system: System, solution: Solution) -> tuple[float, dict[str, float]] | None:
    """Value and free parameters of a solution that the judges confirm; None for any other."""
    design = {n: float(solution.parameters[n]) for n in system.free}
    good = solution.status == "optimal" and confirmed_system(system, design, solution.value)
    return (solution.value, design) if good else None


Found = tuple[str, float, Mapping[str, float]]
"""Source, value and design."""


def looked_for(index: int, starts: int = STARTS, before: Known | None = None) -> Known:
    """Everything that might do well on one system, judged, beside what was known before."""
    system = random_system(index)
    ends = [] if "locate" in system.goal else [evolve_system(system)]
    solved = [("starts", solve(system.problem, starts=starts, seed=1, exhaustive=True, throw=False))]
    solved += [("from evolution", solve(started_at(system.problem, e.parameters), starts=1, throw=False)) for e in ends]
    found: list[Found] = [(source, *good) for source, s in solved if (good := claimed(system, s)) is not None]
    found += [("evolution", *end) for e in ends if (end := _ended(system, e)) is not None]
    if before:
        found += [(source, value, before.parameters) for source, value in before.known.items()]
    least: dict[str, float] = {}
    for source, value, _ in found:
        least[source] = min((least.get(source, value), value), key=lambda v: system.sign * v)
    _, value, design = min(found, key=lambda f: system.sign * f[1], default=("", math.nan, {}))
    return Known(index, value, design, least, ends[0].evaluations if ends else 0)


def _ended(system: System, end: Followed) -> tuple[float, dict[str, float]] | None:
    """An evolution's end by isolated roots, which do not flatter a design beside a multiple root."""
    design = dict(end.parameters)
    own = values_of(next(ideals(system, design)))
    values = {**design, **own}
    return (float(system.worth(values)), design) if float(system.violation(values)) <= 0 else None


def report(asked: Asked) -> str:
    """What is missing in the file, or all that are asked for by their count, looked at; who reached the values."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / OSCILLATORS.name if asked.quick else OSCILLATORS
        rows = known(path)
        for index in tqdm(range(asked.of(COUNT, 2)), "known", unit="system"):
            if asked.count or index not in rows:
                rows[index] = looked_for(index, 2 if asked.quick else STARTS, rows.get(index))
                write(path, {"origin": origin(asked.command)}, "systems", rows.values())
    of = {k: random_system(k) for k in rows}
    reached = [
        (s, share(of[k].excess(r.known[s], r.value) <= SAME for k, r in rows.items() if s in r.known))
        for s in ("starts", "from evolution", "evolution")
    ]
    return page("Best values of the random systems", asked, facts(reached), f"Kept in `{OSCILLATORS}`.")
