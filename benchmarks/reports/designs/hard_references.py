"""The best value of each hard problem that is found without the package, kept: what `hard_designs` measures against."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from benchmarks.reports.tables import Asked, facts, origin, page, table
from benchmarks.rivals import best_known
from benchmarks.suites import HARD, HARD_COUNT, HARD_SEED, Target, hard_family, hard_problem, targets, write
from benchmarks.timing import over_processes

SEARCHES = 2
"""Searches of each problem, each with its own random numbers."""


def path_of(seed: int) -> Path:
    """Where the values of a seed are kept."""
    return HARD if seed == HARD_SEED else HARD.with_stem(f"{HARD.stem}_{seed}")


def target(index: int, seed: int, searches: range = range(SEARCHES)) -> Target:
    """The best of a few searches."""
    problem = hard_problem(index, seed)
    found = [best_known(problem, number) for number in searches]
    best = min(found, key=lambda b: (not b.feasible, problem.posed.sign * b.value if b.feasible else b.violation))
    seconds = round(sum(b.seconds for b in found), 1)
    return Target(index, hard_family(index), best.value, best.violation, best.design, "evolution", seconds)


def better(seed: int, one: Target, other: Target) -> Target:
    """Of two references of one problem: feasible before not, then by value, then by violation."""
    sign = hard_problem(one.index, seed).posed.sign
    return min((one, other), key=lambda t: (not t.solvable, sign * t.value if t.solvable else 0.0, t.violation))


def run(indices: Sequence[int], seed: int, workers: int, command: str) -> dict[int, Target]:
    """All that are not in the file yet, which is written anew after every tenth."""
    known = targets(path_of(seed))
    missing = [i for i in indices if i not in known]
    return searched(missing, seed, workers, command, range(SEARCHES))


def searched(indices: Sequence[int], seed: int, workers: int, command: str, searches: range) -> dict[int, Target]:
    """What the file has, after searches of these problems; the better of old and new is kept."""
    for some in (indices[k : k + 10] for k in range(0, len(indices), 10)):
        found = list(over_processes(partial(target, seed=seed, searches=searches), some, workers))
        known = targets(path_of(seed))  # as others left it
        known |= {t.index: better(seed, known.get(t.index, t), t) for t in found}
        write(path_of(seed), {"origin": origin(command), "seed": seed}, "problems", known.values())
    return targets(path_of(seed))


def report(asked: Asked) -> str:
    """What is missing in the file, computed; who reached the values."""
    found = [
        t
        for i, t in run(range(asked.of(HARD_COUNT, 3)), asked.seed, asked.workers, asked.command).items()
        if i < asked.of(HARD_COUNT, 3)
    ]
    families = dict.fromkeys(t.family for t in found)
    rows = [
        (name, len(some), sum(t.solvable for t in some), f"{sum(t.seconds for t in some) / len(some):.1f} s")
        for name in families
        if (some := [t for t in found if t.family == name])
    ]
    return page(
        "Best values of the hard problems",
        asked,
        facts([("problems", len(found)), ("with a feasible design", sum(t.solvable for t in found))]),
        table(("family", "problems", "solvable", "CPU per problem"), rows),
    )
