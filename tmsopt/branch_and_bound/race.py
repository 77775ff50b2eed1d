"""A global solver on several questions side by side, the first that is done stopping the others.

SCIP can crash, and two of it in the threads of one process do. In a process of its own it takes nothing with it, can be
stopped at any moment, and what it prints is not seen.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from queue import Empty, SimpleQueue

from tmsopt.arithmetic.walk import NotAccepted
from tmsopt.branch_and_bound.tasks import INFEASIBLE, UNDECIDED, Decision, Failed, GlobalSolver, Task
from tmsopt.processes import Inbox, Worker

_TICK = 0.02  # seconds between looks
_GRACE = 5.0  # seconds that a solver may take longer than it was given, as SCIP does in the midst of a relaxation


class Crew:
    """Processes that are kept from one question to the next; to be closed."""

    def __init__(self, solver: GlobalSolver) -> None:
        self._solver = solver
        self._idle: list[Worker] = []
        self._inbox: Inbox = SimpleQueue()

    def __enter__(self) -> "Crew":
        return self

    def __exit__(self, *_: object) -> None:
        while self._idle:
            self._idle.pop().end()

    def ahead(self, count: int) -> None:
        """Start processes that will be needed."""
        while len(self._idle) < count:
            self._idle.append(Worker(self._inbox, apart=True))
            self._idle[-1].send(_prepare, self._solver.prepare)

    def race(self, tasks: Sequence[Task], tick: Callable[[], None] = lambda: None) -> list[Decision]:
        """Decisions on tasks, run all at once, until one is shown to have no feasible point.

        Raises:
            NotAccepted: for operations or numbers that the solver cannot take, if no task can.
            Failed: if the solver raised, and decided nothing.
            KeyboardInterrupt: when the user stops it; no process is left behind.
        """
        self.ahead(len(tasks))
        began = time.monotonic()
        answers: list[Decision | NotAccepted | Failed] = [Decision(UNDECIDED) for _ in tasks]
        running = {self._idle.pop(): number for number in range(len(tasks))}
        try:
            for worker, number in running.items():
                worker.send(_answer, self._solver.decide, tasks[number])
            while running:
                tick()
                try:
                    worker, answer = self._inbox.get(timeout=_TICK)
                except Empty:
                    if any(isinstance(a, Decision) and a.verdict == INFEASIBLE for a in answers):
                        break  # not before: one that is all but done is worth more than a new process
                else:
                    asked = running.pop(worker, None)
                    if answer is None:  # stopped or crashed, now or between two questions
                        worker.end()
                        self._idle = [other for other in self._idle if other is not worker]
                    elif asked is not None:
                        answers[asked] = answer
                        self._idle.append(worker)
                late = time.monotonic() - began - _GRACE
                for worker in [w for w, number in running.items() if tasks[number].seconds < late]:
                    del running[worker]
                    worker.end()
        finally:
            for worker in running:
                worker.end()
        return _heard(answers)


def _heard(answers: Sequence[Decision | NotAccepted | Failed]) -> list[Decision]:
    decisions = [answer for answer in answers if isinstance(answer, Decision)]
    for answer in answers:
        if isinstance(answer, Failed) and all(decision.verdict == UNDECIDED for decision in decisions):
            raise answer
        if isinstance(answer, NotAccepted) and not decisions:
            raise answer
    return decisions


def _prepare(prepare: Callable[[], None]) -> None:
    with suppress(Exception):  # it is raised again, and heard, where there is a task
        prepare()


def _answer(decide: Callable[[Task], Decision], task: Task) -> Decision | NotAccepted | Failed:
    try:
        return decide(task)
    except NotAccepted as error:
        return error
    except Exception as error:  # of the solver; raised again where somebody hears it
        return Failed(f"{type(error).__name__}: {' '.join(str(error).split())}")
