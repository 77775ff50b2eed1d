"""Engines of this machine: this process, or a few of its own."""

import multiprocessing
import signal
import threading
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from tmsopt.errors import Fault, InputError
from tmsopt.studies.engines.dispatch import Ledger
from tmsopt.studies.engines.serve import READY, serve
from tmsopt.studies.engines.work import EngineError, Note, Unit, Work, attempt, pickled, silent
from tmsopt.studies.row import Row

_ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "BLIS_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "NUMBA_NUM_THREADS",
    ),
    "1",
)
_STILLBORN = 8  # workers in a row that end before they are ready; then it is not chance


def cores() -> int:
    """How many processes this one may keep busy: cores, less what affinity, quotas and LOKY_MAX_CPU_COUNT deny it."""
    import loky

    return int(loky.cpu_count())


def in_process(work: Work, units: Sequence[Unit], note: Note = silent) -> Generator[Row]:
    """Rows of the units, solved here one after the other. A crash of the solver is the end."""
    for unit in units:
        yield from attempt(work, unit)


def processes(work: Work, units: Sequence[Unit], workers: int, note: Note = silent) -> Generator[Row]:
    """Rows of the units as they come, solved by processes of this machine with one thread each.

    Every worker has a pipe of its own, so a finished unit that it has sent survives it, and what it was doing when it
    ended is known. Workers end when this generator is closed, interrupted, or its process is killed.

    Raises:
        InputError: for less than one worker.
        EngineError: if workers end before they start, or cannot load the work.
    """
    if workers < 1:
        raise InputError([Fault(f"{workers}; accepted: 1 or more, here up to {cores()} are of use", ("workers",))])
    ledger = Ledger(work, units, note)
    crew: dict[Connection, _Worker] = {}
    stillborn = 0
    try:
        blob = pickled(work)
        while ledger.unfinished:
            while len(crew) < min(workers, ledger.unfinished):
                worker = _start(blob)
                crew[worker.pipe] = worker
                ledger.join(worker.name)
            for worker in crew.values():
                worker.send(ledger.batch(worker.name))
            for pipe in wait(list(crew)):
                worker = crew[pipe]  # type: ignore[index]  # wait returns what it was given
                message = worker.receive()
                if message is None:
                    del crew[worker.pipe]
                    stillborn += not worker.ready
                    yield from _ended(ledger, worker, stillborn, note)
                elif isinstance(message, str):
                    worker.ready, stillborn = _ready(message), 0
                else:
                    unit, rows, seconds = message
                    if ledger.delivered(worker.name, unit, seconds):
                        yield from rows
    finally:
        for worker in crew.values():
            worker.process.terminate()
        for worker in crew.values():
            worker.end()


def _ready(message: str) -> bool:
    """Whether a worker has the work."""
    if message != READY:
        raise EngineError(f"worker processes cannot load the study: {message}")
    return True


def _ended(ledger: Ledger, worker: "_Worker", stillborn: int, note: Note) -> Sequence[Row]:
    """Rows given up because a worker ended."""
    cause = worker.end()
    if stillborn == _STILLBORN:
        raise EngineError(f"worker processes end before they start ({cause})")
    told = f"worker {worker.name} died ({cause})"
    if worker.ready:
        return ledger.ended(worker.name, told, cause)
    ledger.returned(worker.name)
    note(f"{told} before it started")
    return ()


@dataclass
class _Worker:
    process: BaseProcess
    pipe: Connection
    ready: bool = False

    @property
    def name(self) -> str:
        return str(self.process.pid)

    def send(self, units: Sequence[Unit]) -> None:
        if units:
            with suppress(OSError):  # it has ended; its pipe says so when it is read
                self.pipe.send(units)

    def receive(self) -> Any:
        """The next message; None once it has ended and all it sent is read."""
        try:
            return self.pipe.recv()
        except (EOFError, OSError):
            return None

    def end(self) -> str:
        """How the process ended; it has been told to, or closed its pipe by ending."""
        from loky.backend.utils import kill_process_tree

        self.pipe.close()
        self.process.join(5.0)
        if self.process.exitcode is None:
            kill_process_tree(self.process)
        code = self.process.exitcode or 0
        return f"signal {-code}" if code < 0 else f"exit code {code}"


def _start(blob: bytes) -> _Worker:
    """A new worker. Loky's processes neither copy this one nor run its script again."""
    import loky  # noqa: F401  # registers its kind of process

    ours, theirs = multiprocessing.Pipe()
    make = multiprocessing.get_context("loky").Process  # type: ignore[attr-defined]
    process: BaseProcess = make(target=serve, args=(theirs, blob), env=_ONE_THREAD, daemon=True)
    with _interrupts_held():
        process.start()
    theirs.close()
    return _Worker(process, ours)


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """What is started meanwhile never hears Ctrl-C, from its first instruction on; here it comes a moment later."""
    if not hasattr(signal, "pthread_sigmask") or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
