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
from tmsopt.progress import ReportCount

_ROW_TOLERANCE = 1e-6  # relative to the range of a row: SCIP meets a row to 1e-9, but multiple roots lose digits
_HALF_WIDTH = 1e-4  # half the width of the box around a known design, relative to the range of each variable
_MIN_RANGE = 1e-2  # relative to 1 + |x|: a shorter range counts as this long, since SCIP cannot resolve less
_SHORT_SECONDS = 1.0  # time limit for a bound on a0, and for the box around a known design
_FIRST_SECONDS = 2.0  # time limit of the first turn; each turn doubles it
_TURNS = (((1.0, False), (1.0, True)), ((4.0, False), (0.25, False)), ((16.0, False), (4.0, True)))
"""Formulations that run in parallel in each turn: (factor on the unit of the roots, value of `Question.compact`)."""


class Clock:
    """Counts the time and the search nodes that a proof has used.

    Attributes:
        note: what the proof has reached, in words; shown as progress.
    """

    def __init__(self, seconds: float, pool: SolverPool, progress: ReportCount | None = None) -> None:
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
        """Seconds left before the time limit; 0 after an interruption."""
        return 0.0 if self.interrupted else max(self.seconds - self.seconds_used, 0.0)

    def race(self, tasks: Sequence[Task]) -> list[Decision]:
        """Decide tasks in parallel. The first infeasible task stops the others; Ctrl-C leaves all tasks undecided."""
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
        better_solution: the optimum reached from the point that the solver found.
        point: the free parameters at that point, if they were accepted without a search for an optimum.
    """

    verdict: str
    better_solution: Solution | None = None
    point: Mapping[str, float] | None = None


PointCheck = Callable[[Mapping[str, float]], Answer]
"""Free parameters at a point that the solver found → the answer that they give."""


def answer_question(question: Question, clock: Clock, time_share: float, confirm: PointCheck) -> Answer:
    """Answer a question for each sign of a0 in turn, within a share of the time left.

    The time of branch and bound varies strongly with the formulation. Each turn races two formulations, and each turn
    lasts longer than the one before.

    Args:
        confirm: checks a point that the solver found; its answer is ``undecided`` if the point is feasible only within
            the solver's tolerance.

    Raises:
        UnsupportedOperation: for an operation that the solver does not support.
    """
    end_time = clock.seconds_used + time_share * clock.seconds_left
    for sign in question.possible_signs():
        answer = _answer_for_sign(question, sign, clock, end_time, confirm)
        if answer.verdict != INFEASIBLE:
            return answer
    return Answer(INFEASIBLE)


def _answer_for_sign(question: Question, sign: int, clock: Clock, end_time: float, confirm: PointCheck) -> Answer:
    """Answer a question for one sign of a0; `end_time` is in seconds of the clock."""
    least_lead = 0.0
    if (leading := question.leading_program(sign)) is not None:
        least_lead = clock.race(
            [make_task(leading, min(_SHORT_SECONDS, end_time - clock.seconds_used), minimise=True)]
        )[0].bound
        if least_lead == math.inf:  # the constraints exclude every design
            return Answer(INFEASIBLE)
    for turn in count():
        seconds_left = min(end_time - clock.seconds_used, clock.seconds_left)
        if seconds_left <= 0:
            return Answer(UNDECIDED)
        seconds = min(
            seconds_left, _FIRST_SECONDS * 2.0 ** min(turn, 30)
        )  # a solver that gives up at once takes many turns
        turn_formulations = _TURNS[turn % len(_TURNS)]
        variants = [replace(question, unit=question.unit * k, compact=compact) for k, compact in turn_formulations]
        try:
            decisions = clock.race([make_task(v.program(sign, max(least_lead, 0.0)), seconds) for v in variants])
        except UnsupportedOperation:
            if turn == 0:
                raise
            continue  # these units make a number too large or too small; others may not
        if any(decision.verdict == INFEASIBLE for decision in decisions):
            return Answer(INFEASIBLE)
        for decision in decisions:
            if decision.point is not None:
                answer = confirm(design_of(question.problem, decision.point.tolist()))
                if answer.verdict == FOUND:
                    return answer
    raise AssertionError  # unreachable, because the time ends


def find_exclusion(question: Question, design: Mapping[str, float]) -> str:
    """Say why a question excludes a design that it must admit; empty if it admits the design.

    If a question has a wrong limit, range or equation, it excludes the known design, and its answer proves nothing.
    """
    excesses: list[tuple[float, str]] = []
    for sign in question.possible_signs():
        nlp = question.program(sign)
        x = initial_point(nlp, question.problem, design)
        rows = nlp.evaluate(x)[1]
        _, *row_ranges = ranges(nlp.numeric_formula, list(zip(nlp.lower, nlp.upper, strict=True)))
        row_sizes = np.array([max(map(abs, ends)) for ends in row_ranges])
        row_sizes = np.where(np.isfinite(row_sizes), np.maximum(row_sizes, 1e-300), 1.0)
        row_excesses = np.maximum(np.array(nlp.row_lower) - rows, rows - np.array(nlp.row_upper)) / row_sizes
        variable_excesses = np.maximum(np.array(nlp.lower) - x, x - np.array(nlp.upper)) / np.maximum(1.0, np.abs(x))
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
    """Whether the solver finds a small box around a feasible design infeasible; then its answers prove nothing.

    `find_exclusion` checks the equations. This function checks the solver's model of them, with ranges and tolerances.
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
