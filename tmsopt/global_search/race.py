"""Runs a global solver on several tasks in parallel; the first infeasible one stops the others.

SCIP can crash, and does if two threads of one process run it. In a separate process a crash costs nothing else, the
solver can be stopped at any moment, and its output is not shown.
"""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.global_search.tasks import INFEASIBLE, UNDECIDED, Decision, GlobalSolver, SolverFailed, Task
from tmsopt.killable import Killable, ProcessEnded

_TICK = 0.02  # seconds between polls
_GRACE = 5.0  # seconds a solver may overrun its limit, as SCIP does while it solves a relaxation


class SolverPool:
    """Processes that are reused from one question to the next; use it as a context manager."""

    def __init__(self, solver: GlobalSolver) -> None:
        self._solver = solver
        self._idle: list[Killable] = []

    def __enter__(self) -> "SolverPool":
        return self

    def __exit__(self, *_: object) -> None:
        while self._idle:
            self._idle.pop().end()

    def start_processes(self, count: int) -> None:
        """Start processes until `count` are idle."""
        while len(self._idle) < count:
            self._idle.append(Killable(self._solver.prepare))

    def race(self, tasks: Sequence[Task], tick: Callable[[], None] = lambda: None) -> list[Decision]:
        """Decide tasks in parallel until one is infeasible.

        Args:
            tick: called at every poll.

        Raises:
            NotAccepted: if the solver supports none of the tasks.
            SolverFailed: if the solver raised an error and decided nothing.
            KeyboardInterrupt: if the user stops it; no process is left behind.
        """
        self.start_processes(len(tasks))
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
                    break  # after one more poll, since ending a process that is nearly done costs a new one
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
        return _collect_decisions(answers)


def _collect_decisions(answers: Sequence["Future[Decision]"]) -> list[Decision]:
    """Decisions in the order of the tasks; undecided if the process was ended or crashed."""
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
        raise SolverFailed(f"{type(failed[0]).__name__}: {' '.join(str(failed[0]).split())}") from failed[0]
    if refused and not decisions:
        raise refused[0]
    return decisions
