"""What every rescue of the search is worth: problems on which it steps in, solved again without it."""

import inspect
import io
import math
import tempfile
import tokenize
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from tqdm import tqdm

import tmsopt
from benchmarks.reports.tables import Asked, page, table
from benchmarks.suites import HARD_COUNT, hard_problem, random_problem
from benchmarks.suites.conflicts import conflict
from benchmarks.suites.narrow_optima import hidden
from benchmarks.suites.random_systems import random_system
from benchmarks.suites.varied_designs import varied_problem
from benchmarks.timing import over_processes

_STATUSES = ("optimal", "infeasible", "not_converged")
_DROPPED = """\
Gone on 2026-11-28, with how often they stepped in on these problems: multiple roots (654; kept where sectors
and half-planes meet), through a0 = 0 (248), designs sought for stability (203), ideal roots (55), off plateau
(44), opposite faces (5), attained ends (2), and the least abscissa as a start; and, in the program, powers taken
apart where they must be 0 (0). One by now: start kept (59), off the edge (48) and nudge (12), as *aside*;
unbounded (15) and runaway (6), in the judgement of an end. Stages by now: restarts, basins, designs sought for
limits, ways and exchanges of contacts. Beside version 1.1 no true optimum is lost; one relaxation, of hard 1
203, is larger than need be."""
_SAME = 1e-7  # relative difference of values, and 1e-8 where they are small
_HARD_SEEDS = (1, 2, 3)
_SUITES = {
    "solve": range(200),
    "systems": range(100),
    "narrow": sorted(hidden()),
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
        path.write_text(hidden()[first].text, encoding="utf-8")
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


def is_worse(own: Answer, other: Answer) -> bool:
    """Whether an answer that differs is worse: no optimum any more, a worse one, or more limits moved."""
    if own.status != other.status or own.status != "optimal":
        return own.status == "optimal" or other.status != "optimal"
    return other.gain < own.gain


def tokens_of(rescue: tmsopt.Rescue) -> int:
    """Names, operators, numbers and strings of the functions of a rescue, without docstrings."""
    functions = {f.__name__: f for f in (rescue.applies, rescue.run) if f.__name__ != "<lambda>"}
    counted = {tokenize.NAME, tokenize.OP, tokenize.NUMBER, tokenize.STRING}
    each = (tokenize.generate_tokens(io.StringIO(inspect.getsource(f)).readline) for f in functions.values())
    return sum(t.type in counted and not t.string.startswith('"""') for tokens in each for t in tokens)


def report(asked: Asked) -> str:
    """The report in Markdown."""
    names = names_of(0.02 if asked.quick else 1.0)
    whole = dict(zip(names, tqdm(over_processes(answer, names, asked.workers), total=len(names)), strict=True))
    rows, every = [], []
    for rescue in tmsopt.POLICY.rescues:
        own = [name for name in names if rescue.name in whole[name].steps]
        others = list(over_processes(partial(answer, without=rescue.name), own, asked.workers))
        pairs = [(whole[other.problem], other) for other in others]
        changed = [(one, other, change) for one, other in pairs if (change := difference(one, other))]
        worse = sum(is_worse(one, other) for one, other, _ in changed)
        spent = sum(other.seconds for other in others) / max(sum(whole[name].seconds for name in own), 1e-9)
        counts = len(own), worse, len(changed) - worse
        rows.append((rescue.name, tokens_of(rescue), *counts, f"{spent:.2f}"))
        every += [(rescue.name, one.problem, change) for one, _, change in changed]
    return page(
        "Rescues of the search",
        asked,
        table(("suite", "problems", *_STATUSES), _answers(whole)),
        "Each problem on which a rescue steps in is solved once more without it; the others cannot change. Tokens are "
        "those of its own two functions.",
        table(("rescue", "tokens", "steps in", "worse without", "better without", "time without"), rows),
        _DROPPED,
        "### Every change",
        table(("rescue", "problem", "without it"), every, "None."),
    )


def _answers(whole: Mapping[str, Answer]) -> Iterator[tuple[object, ...]]:
    """How many problems of each suite end how."""
    suites = dict.fromkeys(name.rpartition(" ")[0] for name in whole)
    for suite in suites:
        found = [a.status for name, a in whole.items() if name.rpartition(" ")[0] == suite]
        yield (suite, len(found), *(found.count(status) for status in _STATUSES))
