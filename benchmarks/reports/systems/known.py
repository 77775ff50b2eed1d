"""The best value that anybody reached on each random system, looked for in every way there is."""

import math
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from tqdm import tqdm

from benchmarks.judges import SAME, System, confirmed_system, ideals, started_at, values_of
from benchmarks.reports import Asked, facts, origin, page, share
from benchmarks.rivals import Followed, evolve_system
from benchmarks.suites import COUNT, OSCILLATORS, Known, known, random_system, write
from tmsopt import Solution, solve

STARTS = 32
"""Of the long run, all of them tried, with seed 1."""

_EVOLUTIONS = 1


def claimed(system: System, solution: Solution) -> tuple[float, dict[str, float]] | None:
    """Value and free parameters of a solution that the judges confirm; None for any other."""
    design = {n: float(solution.parameters[n]) for n in system.free}
    good = solution.status == "optimal" and confirmed_system(system, design, solution.value)
    return (solution.value, design) if good else None


def looked_for(index: int, starts: int = STARTS, evolutions: int = _EVOLUTIONS) -> Known:
    """Everything that might do well on one system, judged."""
    system = random_system(index)
    ends = [] if "locate" in system.goal else [evolve_system(system, seed) for seed in range(evolutions)]
    solved = [("starts", solve(system.problem, starts=starts, seed=1, exhaustive=True, throw=False))]
    solved += [("from evolution", solve(started_at(system.problem, e.parameters), starts=1, throw=False)) for e in ends]
    found = [(source, *good) for source, s in solved if (good := claimed(system, s)) is not None]
    found += [("evolution", *end) for e in ends if (end := _ended(system, e)) is not None]
    return _best(system, found, ends)


def _best(system: System, found: Sequence[tuple[str, float, dict[str, float]]], ends: Sequence[Followed]) -> Known:
    least: dict[str, float] = {}
    for source, value, _ in found:
        least[source] = min((least.get(source, value), value), key=lambda v: system.sign * v)
    top = min(found, key=lambda f: system.sign * f[1], default=("", math.nan, {}))
    return Known(system.index, top[1], top[2], least, ends[0].evaluations if ends else 0)


def _ended(system: System, end: Followed) -> tuple[float, dict[str, float]] | None:
    """An evolution's end by isolated roots, which do not flatter a design beside a multiple root."""
    design = dict(end.parameters)
    own = values_of(next(ideals(system, design)))
    values = {**design, **own}
    return (float(system.worth(values)), design) if float(system.violation(values)) <= 0 else None


def better(system: System, one: Known, other: Known | None) -> Known:
    """Two looks at a system in one."""
    if other is None:
        return one
    found = [(s, v, dict(k.parameters)) for k in (one, other) for s, v in k.known.items() if np.isfinite(v)]
    best = min((one, other), key=lambda k: system.sign * k.value if math.isfinite(k.value) else math.inf)
    least = {s: min((v for t, v, _ in found if t == s), key=lambda v: system.sign * v) for s, _, _ in found}
    return Known(one.index, best.value, best.parameters, least, one.evaluations)


def report(asked: Asked) -> str:
    """What is missing in the file, or all that are asked for by their count, looked at; who reached the values."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / OSCILLATORS.name if asked.quick else OSCILLATORS
        rows = known(path)
        for index in tqdm(range(asked.of(COUNT, 2)), "known", unit="system"):
            if asked.count or index not in rows:
                found = looked_for(index, 2 if asked.quick else STARTS)
                rows[index] = better(random_system(index), found, rows.get(index))
                write(path, {"origin": origin(asked.command)}, "systems", rows.values())
    reached = [
        (
            source,
            share(
                random_system(k).excess(r.known[source], r.value) <= SAME for k, r in rows.items() if source in r.known
            ),
        )
        for source in ("starts", "from evolution", "evolution")
    ]
    return page("Best values of the random systems", asked, facts(reached), f"Kept in `{OSCILLATORS}`.")
