"""Questions put to branch and bound, within a time, and whether they admit the design that they are about."""

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
from tmsopt.global_search.tasks import FOUND, INFEASIBLE, UNDECIDED, Decision, Task, task
from tmsopt.problem.solution import Solution
from tmsopt.program.formulate import design_of, variables_of
from tmsopt.program.starts import initial_point
from tmsopt.progress import Counts

_HOLDS = 1e-6  # of a row, relative to its range: SCIP itself asks for 1e-9, and multiple roots have half the digits

_AROUND = 1e-4  # of a range, which counts as
_COARSE = 1e-2  # at least: SCIP cannot look closer
_TIGHTENING = 1.0  # seconds to keep a0 away from 0
_FIRST = 2.0  # seconds for the first turn, twice as many for each that follows
_WAYS = (((1.0, False), (1.0, True)), ((4.0, False), (0.25, False)), ((16.0, False), (4.0, True)))
"""Turns: units, as multiples of the usual one, and whether compact."""


class Clock:
    """Time and nodes that a proof has used.

    Attributes:
        note: what is known meanwhile, for who listens.
    """

    def __init__(self, seconds: float, crew: SolverPool, progress: Counts | None = None) -> None:
        self.seconds, self.crew, self.progress = seconds, crew, progress
        self.began = time.perf_counter()
        self.nodes, self.note = 0, ""
        self.interrupted = False

    @property
    def used(self) -> float:
        """Seconds since the beginning."""
        return time.perf_counter() - self.began

    @property
    def left(self) -> float:
        """Seconds to the end; none after an interruption."""
        return 0.0 if self.interrupted else max(self.seconds - self.used, 0.0)

    def race(self, tasks: Sequence[Task]) -> list[Decision]:
        """Decisions on tasks, all at once until one is shown to have no feasible point; none if the user interrupts."""
        try:
            decisions = self.crew.race(tasks, self.tick)
        except KeyboardInterrupt:
            self.interrupted = True
            return [Decision(UNDECIDED)]
        self.nodes += sum(decision.nodes for decision in decisions)
        return decisions

    def tick(self) -> None:
        """Tell the reader how far it is."""
        if self.progress:
            self.progress(min(self.used, self.seconds), self.seconds, self.note)


@dataclass(frozen=True)
class Answer:
    """What branch and bound says to a question.

    Attributes:
        verdict: ``infeasible``: no design; ``found``; ``undecided``.
        better: the optimum that was reached from the design that was found.
        other: that design, where it is feasible and better, and no optimum was reached from it.
    """

    verdict: str
    better: Solution | None = None
    other: Mapping[str, float] | None = None


Confirm = Callable[[Mapping[str, float]], Answer]


def answer(question: Question, clock: Clock, share: float, confirm: Confirm) -> Answer:
    """Ask for each sign of a0 in turn, within a share of the time that is left.

    The time that branch and bound needs varies wildly with how a question is put. So it is put in two ways at once, for
    a short time, and then anew in others for longer.

    Args:
        confirm: what to make of a design that was found; ``undecided`` if it is none, but for the solver's tolerance.

    Raises:
        UnsupportedOperation: for an operation that the solver cannot take.
    """
    end = clock.used + share * clock.left
    for sign in question.signs():
        told = _asked(question, sign, clock, end, confirm)
        if told.verdict != INFEASIBLE:
            return told
    return Answer(INFEASIBLE)


def _asked(question: Question, sign: int, clock: Clock, end: float, confirm: Confirm) -> Answer:
    """One sign of a0."""
    least = 0.0
    if (leading := question.leading(sign)) is not None:
        least = clock.race([task(leading, min(_TIGHTENING, end - clock.used), least=True)])[0].bound
        if least == math.inf:  # not even the constraints can be met
            return Answer(INFEASIBLE)
    for turn in count():
        left = min(end - clock.used, clock.left)
        if left <= 0:
            return Answer(UNDECIDED)
        seconds = min(left, _FIRST * 2.0 ** min(turn, 30))  # one that gives up at once comes to thousands of turns
        ways = [replace(question, unit=question.unit * u, compact=c) for u, c in _WAYS[turn % len(_WAYS)]]
        try:
            decisions = clock.race([task(way.program(sign, max(least, 0.0)), seconds) for way in ways])
        except UnsupportedOperation:
            if turn == 0:
                raise
            continue  # numbers are too large or too small in these units alone
        if any(decision.verdict == INFEASIBLE for decision in decisions):
            return Answer(INFEASIBLE)
        for decision in decisions:
            if decision.point is not None:
                found = confirm(design_of(question.problem, decision.point.tolist()))
                if found.verdict == FOUND:
                    return found
    raise AssertionError  # unreachable: time ends


def doubt(question: Question, design: Mapping[str, float]) -> str:
    """Why the answer to a question would say nothing of a design that should be one; empty if it is admitted.

    A wrong limit, range or equation would exclude the design itself: what is proved of the others would be worthless.
    """
    nearest: list[tuple[float, str]] = []
    for sign in question.signs():
        nlp = question.program(sign)
        x = initial_point(nlp, question.problem, design)
        rows = nlp.evaluate(x)[1]
        _, *reached = ranges(nlp.numeric_formula, list(zip(nlp.lower, nlp.upper, strict=True)))
        sizes = np.array([max(map(abs, ends)) for ends in reached])
        sizes = np.where(np.isfinite(sizes), np.maximum(sizes, 1e-300), 1.0)
        off = np.maximum(np.array(nlp.row_lower) - rows, rows - np.array(nlp.row_upper)) / sizes
        span = np.maximum(1.0, np.abs(x))
        outside = np.maximum(np.array(nlp.lower) - x, x - np.array(nlp.upper)) / span
        named = [*zip(off.tolist(), nlp.rows, strict=True), *zip(outside.tolist(), nlp.variables, strict=True)]
        nearest.append(max(((np.inf if np.isnan(e) else e), name) for e, name in named))
    if not nearest:
        return "the question admits no design, so not even the one that was found"
    excess, name = min(nearest)
    return "" if excess <= _HOLDS else f"the question excludes the design that was found: {name} by {excess:.2g}"


def contradicted(question: Question, design: Mapping[str, float], clock: Clock) -> bool:
    """Whether the solver finds nothing feasible even close around a design that is: then no answer of it is worth much.

    `doubt` looks at the equations; this looks at what became of them in the solver, its ranges and tolerances included.
    """
    at = variables_of(question.problem, design)
    verdicts = []
    for sign in question.signs():
        nlp = question.program(sign)
        near = tuple(
            (max(lo, x - d), min(hi, x + d))
            for x, lo, hi in zip(at, nlp.lower, nlp.upper, strict=False)
            for d in [_AROUND * max(hi - lo, _COARSE * (1 + abs(x)))]
        )
        verdicts += [d.verdict for d in clock.race([task(nlp, min(_TIGHTENING, clock.left), within=near)])]
    return all(verdict == INFEASIBLE for verdict in verdicts)
