"""Answers a question by branch and bound within a time limit, and checks that the question admits a known design."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.algebra.intervals import ranges
from tmsopt.global_search.question import Question
from tmsopt.global_search.race import SolverPool
from tmsopt.global_search.tasks import FOUND, INFEASIBLE, UNDECIDED, Decision, Task, make_task
from tmsopt.problem.solution import Solution
from tmsopt.program.formulate import design_of, variables_of
from tmsopt.program.starts import initial_point
from tmsopt.progress import Counts

_ROW_TOLERANCE = 1e-6  # relative to a row's range: SCIP meets a row to 1e-9, but multiple roots have half the digits
_HALF_WIDTH = 1e-4  # half the width of the box around a known design, relative to the range of each variable
_MIN_RANGE = 1e-2  # relative to 1 + |x|: shorter ranges count as this long, since SCIP cannot resolve less
_SHORT_SECONDS = 1.0  # time limit for a bound on a0, and for the box around a known design
_FIRST_SECONDS = 2.0  # time limit of the first turn; each turn doubles it
_TURNS = (((1.0, False), (1.0, True)), ((4.0, False), (0.25, False)), ((16.0, False), (4.0, True)))
"""Formulations that race in each turn: (factor on the unit of the roots, compact)."""


class Clock:
    """Counts the time and the search nodes that a proof has used.

    Attributes:
        note: the state of the proof, shown as progress.
    """

    def __init__(self, seconds: float, pool: SolverPool, progress: Counts | None = None) -> None:
        self.seconds, self.pool, self.progress = seconds, pool, progress
        self.began = time.perf_counter()
        self.nodes, self.note = 0, ""
        self.interrupted = False

    @property
    def seconds_used(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self.began

    @property
    def seconds_left(self) -> float:
        """Seconds left; 0 after an interruption."""
        return 0.0 if self.interrupted else max(self.seconds - self.seconds_used, 0.0)

    def race(self, tasks: Sequence[Task]) -> list[Decision]:
        """Decide tasks in parallel; the first infeasible one stops the others, Ctrl-C leaves all undecided."""
        try:
            decisions = self.pool.race(tasks, self.report_progress)
        except KeyboardInterrupt:
            self.interrupted = True
            return [Decision(UNDECIDED)]
        self.nodes += sum(decision.nodes for decision in decisions)
        return decisions

    def report_progress(self) -> None:
        """Report the seconds used, the seconds granted and the note."""
        if self.progress:
            self.progress(min(self.seconds_used, self.seconds), self.seconds, self.note)


@dataclass(frozen=True)
class Answer:
    """The answer of branch and bound to a question.

    Attributes:
        verdict: ``infeasible`` (no such design), ``found`` or ``undecided``.
        better: the optimum reached from the point that the solver found.
        point: that point, if it is feasible and better but no optimum was reached from it.
    """

    verdict: str
    better: Solution | None = None
    point: Mapping[str, float] | None = None


PointCheck = Callable[[Mapping[str, float]], Answer]
"""Judges a point that the solver found."""


def answer_question(question: Question, clock: Clock, share: float, confirm: PointCheck) -> Answer:
    """Answer a question for each sign of a0 in turn, within a share of the time left.

    The time of branch and bound varies strongly with the formulation. Each turn races two formulations, and each turn
    lasts longer than the one before.

    Args:
        confirm: judges a point that the solver found; ``undecided`` if the point is feasible only within the solver's
            tolerance.

    Raises:
        UnsupportedOperation: for an operation that the solver does not support.
    """
    end = clock.seconds_used + share * clock.seconds_left
    for sign in question.possible_signs():
        reply = _answer_for_sign(question, sign, clock, end, confirm)
        if reply.verdict != INFEASIBLE:
            return reply
    return Answer(INFEASIBLE)


def _answer_for_sign(question: Question, sign: int, clock: Clock, end: float, confirm: PointCheck) -> Answer:
    """Answer a question for one sign of a0."""
    least_lead = 0.0
    if (leading := question.leading_program(sign)) is not None:
        least_lead = clock.race([make_task(leading, min(_SHORT_SECONDS, end - clock.seconds_used), minimise=True)])[
            0
        ].bound
        if least_lead == math.inf:  # the constraints alone are infeasible
            return Answer(INFEASIBLE)
    for turn in count():
        seconds_left = min(end - clock.seconds_used, clock.seconds_left)
        if seconds_left <= 0:
            return Answer(UNDECIDED)
        seconds = min(
            seconds_left, _FIRST_SECONDS * 2.0 ** min(turn, 30)
        )  # a solver that gives up at once takes many turns
        variants = [replace(question, unit=question.unit * u, compact=c) for u, c in _TURNS[turn % len(_TURNS)]]
        try:
            decisions = clock.race([make_task(v.program(sign, max(least_lead, 0.0)), seconds) for v in variants])
        except UnsupportedOperation:
            if turn == 0:
                raise
            continue  # only these units make some number too large or too small
        if any(decision.verdict == INFEASIBLE for decision in decisions):
            return Answer(INFEASIBLE)
        for decision in decisions:
            if decision.point is not None:
                reply = confirm(design_of(question.problem, decision.point.tolist()))
                if reply.verdict == FOUND:
                    return reply
    raise AssertionError  # unreachable: time ends


def find_exclusion(question: Question, design: Mapping[str, float]) -> str:
    """Say why a question excludes a design that it must admit; empty if it admits the design.

    A question with a wrong limit, range or equation excludes the known design, and then its answer proves nothing.
    """
    excesses: list[tuple[float, str]] = []
    for sign in question.possible_signs():
        nlp = question.program(sign)
        x = initial_point(nlp, question.problem, design)
        rows = nlp.evaluate(x)[1]
        _, *row_ranges = ranges(nlp.numeric_formula, list(zip(nlp.lower, nlp.upper, strict=True)))
        sizes = np.array([max(map(abs, ends)) for ends in row_ranges])
        sizes = np.where(np.isfinite(sizes), np.maximum(sizes, 1e-300), 1.0)
        row_excesses = np.maximum(np.array(nlp.row_lower) - rows, rows - np.array(nlp.row_upper)) / sizes
        span = np.maximum(1.0, np.abs(x))
        variable_excesses = np.maximum(np.array(nlp.lower) - x, x - np.array(nlp.upper)) / span
        named_excesses = [
            *zip(row_excesses.tolist(), nlp.rows, strict=True),
            *zip(variable_excesses.tolist(), nlp.variables, strict=True),
        ]
        excesses.append(max(((np.inf if np.isnan(e) else e), name) for e, name in named_excesses))
    if not excesses:
        return "the question excludes every design, the known one too"
    excess, name = min(excesses)
    return "" if excess <= _ROW_TOLERANCE else f"the question excludes the known design: {name} by {excess:.2g}"


def is_excluded_by_solver(question: Question, design: Mapping[str, float], clock: Clock) -> bool:
    """Whether the solver calls a small box around a feasible design infeasible; if so, its answers prove nothing.

    `find_exclusion` checks the equations; this checks the solver's own model of them, with its ranges and tolerances.
    """
    point = variables_of(question.problem, design)
    verdicts = []
    for sign in question.possible_signs():
        nlp = question.program(sign)
        near_box = tuple(
            (max(lo, x - d), min(hi, x + d))
            for x, lo, hi in zip(point, nlp.lower, nlp.upper, strict=False)
            for d in [_HALF_WIDTH * max(hi - lo, _MIN_RANGE * (1 + abs(x)))]
        )
        verdicts += [
            d.verdict for d in clock.race([make_task(nlp, min(_SHORT_SECONDS, clock.seconds_left), box=near_box)])
        ]
    return all(verdict == INFEASIBLE for verdict in verdicts)
