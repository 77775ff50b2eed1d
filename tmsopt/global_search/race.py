"""A global solver on several questions side by side, the first that is done stopping the others.

SCIP can crash, and two of it in the threads of one process do. In a process of its own it takes nothing with it, can be
stopped at any moment, and what it prints is not seen.
"""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.global_search.tasks import INFEASIBLE, UNDECIDED, Decision, Failed, GlobalSolver, Task
from tmsopt.killable import Killable, ProcessEnded

_TICK = 0.02  # seconds between looks
_GRACE = 5.0  # seconds that a solver may take longer than it was given, as SCIP does in the midst of a relaxation


class SolverPool:
    """Processes that are kept from one question to the next; to be closed."""

    def __init__(self, solver: GlobalSolver) -> None:
        self._solver = solver
        self._idle: list[Killable] = []

    def __enter__(self) -> "SolverPool":
        return self

    def __exit__(self, *_: object) -> None:
        while self._idle:
            self._idle.pop().end()

    def ahead(self, count: int) -> None:
        """Start processes that will be needed."""
        while len(self._idle) < count:
            self._idle.append(Killable(self._solver.prepare))

    def race(self, tasks: Sequence[Task], tick: Callable[[], None] = lambda: None) -> list[Decision]:
        """Decisions on tasks, run all at once, until one is shown to have no feasible point.

        Raises:
            UnsupportedOperation: for operations or numbers that the solver cannot take, if no task can.
            Failed: if the solver raised, and decided nothing.
            KeyboardInterrupt: when the user stops it; no process is left behind.
        """
        self.ahead(len(tasks))
        began = time.monotonic()
        running: list[tuple[Killable, Future[Decision]]] = []
        try:
            for task in tasks:
                process = self._idle.pop()
                running.append((process, process.call(self._solver.decide, task)))
            answers = [answer for _, answer in running]
            while waiting := [answer for answer in answers if not answer.done()]:
                tick()
                finished, _ = wait(waiting, _TICK, FIRST_COMPLETED)
                decided = (answer for answer in answers if answer.done() and not answer.exception())
                if not finished and any(answer.result().verdict == INFEASIBLE for answer in decided):
                    break  # not before: one that is all but done is worth more than a new process
                late = time.monotonic() - began - _GRACE
                for task, (process, answer) in zip(tasks, running, strict=True):
                    if task.seconds < late and not answer.done():
                        process.end()
        finally:
            for process, answer in running:
                if answer.done() and not isinstance(answer.exception(), ProcessEnded):
                    self._idle.append(process)
                else:
                    process.end()
        return _decisions(answers)


def _decisions(answers: Sequence["Future[Decision]"]) -> list[Decision]:
    """Decisions in the order of the tasks; undecided where a process was ended or crashed."""
    decisions, refused, failed = list[Decision](), list[UnsupportedOperation](), list[BaseException]()
    for answer in answers:
        match answer.exception() if answer.done() else ProcessEnded():
            case None:
                decisions.append(answer.result())
            case ProcessEnded():
                decisions.append(Decision(UNDECIDED))
            case UnsupportedOperation() as error:
                refused.append(error)
            case error:
                failed.append(error)
    if failed and all(decision.verdict == UNDECIDED for decision in decisions):
        raise Failed(f"{type(failed[0]).__name__}: {' '.join(str(failed[0]).split())}") from failed[0]
    if refused and not decisions:
        raise refused[0]
    return decisions
