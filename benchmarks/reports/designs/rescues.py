"""What every rescue of the search is worth: problems on which it steps in, solved again without it."""

import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from tqdm import tqdm

import tmsopt
from benchmarks.reports.tables import Asked, facts, page, table
from benchmarks.suites import HARD_COUNT, hard_problem, random_problem
from benchmarks.suites.conflicts import conflict
from benchmarks.suites.narrow_optima import hidden, references
from benchmarks.suites.random_systems import random_system
from benchmarks.suites.varied_designs import varied_problem
from benchmarks.timing import over_processes

_SAME = 1e-7  # relative difference of values, and 1e-8 where they are small
_HARD_SEEDS = (1, 2, 3)
_SUITES = {
    "solve": range(200),
    "systems": range(100),
    "narrow": sorted(references()),
    "conflicts": range(50),
    "variety": range(200),
}


@dataclass(frozen=True)
class Answer:
    """How one solve ended.

    Attributes:
        gain: what it promises, larger is better; nan without an objective.
        steps: rescues that stepped in.
        moved: limits that a relaxation moves, and their sum.
    """

    problem: str
    status: str
    gain: float
    seconds: float
    steps: frozenset[str]
    moved: tuple[tuple[str, ...], float] = ((), 0.0)


def problem_of(name: str) -> tmsopt.Problem:
    """A problem of a suite by its name, such as ``hard 3 71``."""
    suite, *numbers = name.split()
    first = int(numbers[-1])
    match suite:
        case "solve":
            return random_problem(first)
        case "hard":
            return hard_problem(first, int(numbers[0]))
        case "systems":
            return random_system(first).problem
        case "conflicts":
            return conflict(first).problem
        case "variety":
            return varied_problem(first)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "problem.toml"
        path.write_text(hidden(first).text, encoding="utf-8")
        return tmsopt.load(path)


def names_of(share: float = 1.0) -> list[str]:
    """All problems, or the first ones of each suite."""
    hard = [f"hard {seed} {k}" for seed in _HARD_SEEDS for k in range(math.ceil(share * HARD_COUNT))]
    others = {suite: numbers[: math.ceil(share * len(numbers))] for suite, numbers in _SUITES.items()}
    return hard + [f"{suite} {k}" for suite, numbers in others.items() for k in numbers]


def answer(name: str, without: str = "") -> Answer:
    """Solve one problem, and note which rescues step in."""
    steps = set[str]()

    def noted(rescue: tmsopt.Rescue) -> tmsopt.Rescue:
        def run(state: tmsopt.SearchState, policy: tmsopt.Policy) -> tmsopt.SearchState:
            steps.add(rescue.name)
            return rescue.run(state, policy)

        return replace(rescue, run=run)

    policy = tmsopt.POLICY.without(without) if without else tmsopt.POLICY
    policy = replace(policy, rescues=tuple(map(noted, policy.rescues)))
    found = tmsopt.solve(problem_of(name), throw=False, policy=policy)
    sign = 1 if found.problem.maximize else -1
    amounts: Mapping[str, float] = found.relaxation.amounts if found.relaxation else {}
    moved = tuple(sorted(amounts)), sum(amounts.values())
    return Answer(name, found.status, sign * found.value, found.seconds, frozenset(steps), moved)


def difference(own: Answer, other: Answer) -> str:
    """What becomes of an answer without a rescue; empty where it is as good."""
    if own.status != other.status:
        return f"{own.status} → {other.status}"
    close = math.isclose(own.gain, other.gain, rel_tol=_SAME, abs_tol=_SAME / 10)
    if own.status == "optimal" and not close and not math.isnan(own.gain + other.gain):
        return "better" if other.gain > own.gain else "worse optimum"
    (names, amount), (others, rest) = own.moved, other.moved
    return "" if names == others or math.isclose(amount, rest, rel_tol=1e-3) else "another relaxation"


def report(asked: Asked) -> str:
    """The report in Markdown."""
    names = names_of(0.02 if asked.quick else 1.0)
    whole = dict(zip(names, tqdm(over_processes(answer, names, asked.workers), total=len(names)), strict=True))
    rows, every = [], []
    for rescue in tmsopt.POLICY.rescues:
        own = [name for name in names if rescue.name in whole[name].steps]
        others = list(over_processes(partial(answer, without=rescue.name), own, asked.workers))
        changes = list(_changes(whole, others))
        spent = sum(other.seconds for other in others) / max(sum(whole[name].seconds for name in own), 1e-9)
        worse = sum(change != "better" for _, change in changes)
        rows.append((rescue.name, len(own), worse, len(changes) - worse, f"{spent:.2f}", rescue.evidence))
        every += [(rescue.name, name, change) for name, change in changes]
    return page(
        "Rescues of the search",
        asked,
        facts([("problems", len(names)), ("answered as optimal", sum(a.status == "optimal" for a in whole.values()))]),
        "Each problem on which a rescue steps in is solved once more without it; the others cannot change.",
        table(("rescue", "steps in", "worse without", "better without", "time without", "evidence"), rows),
        "### Every change",
        table(("rescue", "problem", "without it"), every, "None."),
    )


def _changes(whole: Mapping[str, Answer], others: Sequence[Answer]) -> Iterator[tuple[str, str]]:
    for other in others:
        if change := difference(whole[other.problem], other):
            yield other.problem, change
