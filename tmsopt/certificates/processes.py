"""Processes that run SCIP side by side, the first that is done with a question stopping the others."""

import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any

from tmsopt.arithmetic.walk import NotAccepted
from tmsopt.certificates.scip import INFEASIBLE, UNDECIDED, Decision, Task

_TICK = 0.02  # seconds between looks
_GRACE = 5.0  # seconds that SCIP may take longer than it was given, as it does in the midst of a relaxation


class Crew:
    """Processes that are kept from one question to the next; to be closed."""

    def __init__(self) -> None:
        self.idle: list[Any] = []

    def __enter__(self) -> "Crew":
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self.idle:
            worker.kill()
            worker.communicate()
        self.idle.clear()

    def ahead(self, count: int) -> None:
        """Start processes that will be needed."""
        while len(self.idle) < count:
            self.idle.append(_started())

    def race(self, tasks: Sequence[Task], tick: Callable[[], None] = lambda: None) -> list[Decision]:
        """Decisions on tasks, run all at once, until one is shown to have no feasible point.

        Raises:
            NotAccepted: for operations or numbers that cannot be written for SCIP, if no task can.
            KeyboardInterrupt: when the user stops it; no process is left behind.
        """
        self.ahead(len(tasks))
        jobs = [_Job(self.idle.pop(), task) for task in tasks]
        try:
            while any(job.running for job in jobs):
                tick()
                if any(isinstance(job.decision, Decision) and job.decision.verdict == INFEASIBLE for job in jobs):
                    break
                next(job for job in jobs if job.running).thread.join(_TICK)
        except StopIteration:
            pass  # the last one ended between the two looks
        finally:
            for job in jobs:
                if job.running or job.failed:
                    job.worker.kill()
                    job.thread.join()
                    job.worker.communicate()
                else:
                    self.idle.append(job.worker)
        refused = [job.decision for job in jobs if isinstance(job.decision, NotAccepted)]
        if refused and len(refused) == len(jobs):
            raise refused[0]
        return [job.decision for job in jobs if isinstance(job.decision, Decision)]


class _Job:
    """A task at a worker, waited for in a thread."""

    def __init__(self, worker: Any, task: Task) -> None:
        self.worker, self.failed = worker, False
        self.decision: Decision | NotAccepted = Decision(UNDECIDED)
        self.thread = threading.Thread(target=self._wait, args=(task,), daemon=True)
        self.thread.start()

    @property
    def running(self) -> bool:
        return self.thread.is_alive()

    def _wait(self, task: Task) -> None:
        late = threading.Timer(task.seconds + _GRACE, self.worker.kill)
        late.start()
        try:
            pickle.dump(task, self.worker.stdin)
            self.worker.stdin.flush()
            self.decision = pickle.load(self.worker.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):  # stopped or crashed
            self.failed = True
        finally:
            late.cancel()


def _started() -> Any:
    command = [sys.executable, "-m", "tmsopt.certificates.worker"]
    return subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # an interrupt is for this process alone
    )
