"""Questions put to branch and bound, within a time, and whether they admit the design that they are about."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tmsopt.design.bounds.program import Question
from tmsopt.design.bounds.ranges import ranges
from tmsopt.design.bounds.scip import FOUND, INFEASIBLE, UNDECIDED, decide
from tmsopt.design.formulations import design_of
from tmsopt.design.starts import complete

_HOLDS = 1e-6  # of a row, relative to its range: SCIP itself asks for 1e-9, and multiple roots have half the digits

Progress = Callable[[float, float], None]


class Clock:
    """Time and nodes that a proof has used."""

    def __init__(self, seconds: float, progress: Progress | None = None) -> None:
        self.seconds, self.progress = seconds, progress
        self.began = time.perf_counter()
        self.nodes = 0

    @property
    def used(self) -> float:
        """Seconds since the beginning."""
        return time.perf_counter() - self.began

    @property
    def left(self) -> float:
        """Seconds to the end."""
        return max(self.seconds - self.used, 0.0)

    def tick(self) -> None:
        """Tell the reader how far it is."""
        if self.progress:
            self.progress(min(self.used, self.seconds), self.seconds)


@dataclass(frozen=True)
class Answer:
    """What branch and bound says to a question.

    Attributes:
        verdict: ``infeasible``: no design; ``found``; ``undecided``.
        design: the free parameters that were found.
    """

    verdict: str
    design: Mapping[str, float] | None = None


def answer(question: Question, clock: Clock, share: float) -> Answer:
    """Ask for each sign of a0 in turn, within a share of the time that is left.

    Raises:
        NotAccepted: for an operation that cannot be written for SCIP.
    """
    end = clock.used + share * clock.left
    verdict = INFEASIBLE
    for nlp in question.programs().values():
        decision = decide(nlp, min(end, clock.seconds) - clock.used, tick=clock.tick)
        clock.nodes += decision.nodes
        if decision.interrupted:
            clock.seconds = 0.0
        if decision.verdict == FOUND and decision.point is not None:
            return Answer(FOUND, design_of(question.problem, decision.point.tolist()))
        if decision.verdict != INFEASIBLE:
            verdict = UNDECIDED
    return Answer(verdict)


def doubt(question: Question, design: Mapping[str, float]) -> str:
    """Why the answer to a question would say nothing of a design that should be one; empty if it is admitted.

    A wrong limit, range or equation would exclude the design itself: what is proved of the others would be worthless.
    """
    nearest: list[tuple[float, str]] = []
    for nlp in question.programs().values():
        x = complete(nlp, question.problem, design)
        rows = np.array(nlp.functions(x)[1]).ravel()
        sizes = np.array(
            [max(map(abs, ends)) for ends in ranges(nlp.functions, list(zip(nlp.lower, nlp.upper, strict=True)))[1]]
        )
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
