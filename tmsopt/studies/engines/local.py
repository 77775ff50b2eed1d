"""Engines of this machine: this process, or a few of its own."""

from collections.abc import Generator, Sequence
from queue import Empty, SimpleQueue

from tmsopt.errors import Fault, InputError
from tmsopt.processes import Inbox, Worker, cores
from tmsopt.studies.engines.dispatch import Assignments
from tmsopt.studies.engines.work import EngineError, Note, Unit, Work, attempt, keep, pickled, silent, timed
from tmsopt.studies.row import Row

_READY, _HERE = "ready", "here"
_ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
        "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS",
    ),
    "1",
)  # fmt: skip
_STILLBORN = 8  # workers in a row that end before they are ready; then it is not chance
_LOOK = 1.0  # s; some systems do not hear Ctrl-C while they wait
_PATIENCE = 5.0  # s that a worker may take to end when it has closed its pipe


def in_process(work: Work, units: Sequence[Unit], note: Note = silent) -> Generator[Row]:
    """Rows of the units, solved here one after the other. A crash of the solver is the end."""
    for unit in units:
        yield from attempt(work, unit)


def processes(work: Work, units: Sequence[Unit], workers: int, note: Note = silent) -> Generator[Row]:
    """Rows of the units as they come, solved by processes of this machine with one thread each.

    A finished unit that a worker has sent survives it, and what it was doing when it ended is known. Workers end when
    this generator is closed, interrupted, or its process is killed.

    Raises:
        InputError: for less than one worker.
        EngineError: if workers end before they start, or cannot load the work.
    """
    if workers < 1:
        raise InputError([Fault(f"{workers}; accepted: 1 or more, here up to {cores()} are of use", ("workers",))])
    assignments = Assignments(work, units, note)
    inbox: Inbox = SimpleQueue()
    crew: dict[Worker, bool] = {}  # with whether they have the work
    stillborn = 0
    try:
        blob = pickled(work)
        while assignments.unfinished:
            while len(crew) < min(workers, assignments.unfinished):
                worker = Worker(inbox, _ONE_THREAD)
                worker.send(_take, blob)
                crew[worker] = False
                assignments.join(worker.name)
            for worker in crew:
                for unit in assignments.batch(worker.name):
                    worker.send(timed, _HERE, unit)
            try:
                worker, message = inbox.get(timeout=_LOOK)
            except Empty:
                continue
            if message is None:
                ready = crew.pop(worker)
                stillborn += not ready
                yield from _ended(assignments, worker, ready, stillborn, note)
            elif isinstance(message, str):
                crew[worker], stillborn = _ready(message), 0
            else:
                unit, rows, seconds = message
                if assignments.delivered(worker.name, unit, seconds):
                    yield from rows
    finally:
        for worker in crew:
            worker.end()


def _take(blob: bytes) -> str:
    """Keep the work in this worker: `_READY`, or why it cannot be."""
    try:
        keep(_HERE, blob)
    except Exception as error:
        return repr(error)
    return _READY


def _ready(message: str) -> bool:
    """Whether a worker has the work."""
    if message != _READY:
        raise EngineError(f"worker processes cannot load the study: {message}")
    return True


def _ended(assignments: Assignments, worker: Worker, ready: bool, stillborn: int, note: Note) -> Sequence[Row]:
    """Rows given up because a worker ended."""
    cause = worker.end(_PATIENCE)
    if stillborn == _STILLBORN:
        raise EngineError(f"worker processes end before they start ({cause})")
    told = f"worker {worker.name} died ({cause})"
    if ready:
        return assignments.ended(worker.name, told, cause)
    assignments.returned(worker.name)
    note(f"{told} before it started")
    return ()
