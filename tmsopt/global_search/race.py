"""Runs a global solver on several tasks in parallel; the first infeasible one stops the others.

SCIP can crash, and it does crash if two threads of one process run it. In a separate process, a crash affects nothing
else, the solver can be stopped at any moment, and its output is hidden.
"""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.global_search.tasks import INFEASIBLE, UNDECIDED, Decision, GlobalSolver, SolverFailed, Task
from tmsopt.killable import KillableProcess, ProcessEnded

_POLL_SECONDS = 0.02  # time between polls
_GRACE_SECONDS = 5.0  # time by which a solver may exceed its limit; SCIP does so while it solves a relaxation


class SolverPool:
    """Processes that are reused from one question to the next; use it as a context manager."""

    def __init__(self, solver: GlobalSolver) -> None:
        self._solver = solver
        self._idle: list[KillableProcess] = []

    def __enter__(self) -> "SolverPool":
        return self

    def __exit__(self, *_: object) -> None:
        while self._idle:
            self._idle.pop().end()

    def start_processes(self, count: int) -> None:
        """Start processes until `count` are idle."""
        while len(self._idle) < count:
            self._idle.append(KillableProcess(self._solver.prepare))

    def race(self, tasks: Sequence[Task], tick: Callable[[], None] = lambda: None) -> list[Decision]:
        """Decide tasks in parallel until one is infeasible.

        Args:
            tick: called at every poll.

        Raises:
            UnsupportedOperation: if the solver supports none of the tasks.
            SolverFailed: if the solver raised an error and decided nothing.
            KeyboardInterrupt: if the user presses Ctrl-C; no process is left behind.
        """
        self.start_processes(len(tasks))
        began = time.monotonic()
        running: list[tuple[KillableProcess, Future[Decision]]] = []
        try:
            for task in tasks:
                process = self._idle.pop()
                running.append((process, process.call(self._solver.decide, task)))
            answers = [answer for _, answer in running]
            while pending_answers := [answer for answer in answers if not answer.done()]:
                tick()
                finished_answers, _ = wait(pending_answers, _POLL_SECONDS, FIRST_COMPLETED)
                decided_answers = (answer for answer in answers if answer.done() and not answer.exception())
                if not finished_answers and any(answer.result().verdict == INFEASIBLE for answer in decided_answers):
                    break  # this waits for one poll more, because a process that finishes in it can be reused
                time_allowed = time.monotonic() - began - _GRACE_SECONDS
                for task, (process, answer) in zip(tasks, running, strict=True):
                    if task.seconds < time_allowed and not answer.done():
                        process.end()
        finally:
            for process, answer in running:
                if answer.done() and not isinstance(answer.exception(), ProcessEnded):
                    self._idle.append(process)
                else:
                    process.end()
        return _collect_decisions(answers)


def _collect_decisions(answers: Sequence["Future[Decision]"]) -> list[Decision]:
    """Collect the decisions in the order of the tasks; a task is undecided if its process crashed or was ended."""
    decisions, unsupported, failures = list[Decision](), list[UnsupportedOperation](), list[BaseException]()
    for answer in answers:
        match answer.exception() if answer.done() else ProcessEnded():
            case None:
                decisions.append(answer.result())
            case ProcessEnded():
                decisions.append(Decision(UNDECIDED))
            case UnsupportedOperation() as error:
                unsupported.append(error)
            case error:
                failures.append(error)
    if failures and all(decision.verdict == UNDECIDED for decision in decisions):
        raise SolverFailed(f"{type(failures[0]).__name__}: {' '.join(str(failures[0]).split())}") from failures[0]
    if unsupported and not decisions:
        raise unsupported[0]
    return decisions
