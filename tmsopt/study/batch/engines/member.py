"""What a worker of a Dask cluster does."""

import pickle
import time
from collections.abc import Callable, Sequence
from typing import Any

from tmsopt.studies.row import Row
from tmsopt.study.batch.engines.work import Unit, Work, attempt

TOPIC = "tmsopt-rows"
"""Of the events that carry finished units. One for all studies: schedulers never forget a topic."""

COMPARED = ("tmsopt", "casadi", "numpy", "scipy")
"""Distributions whose versions decide about bits."""

_MESSAGE = 0.02  # s of finished work that is worth a message of its own
_KEPT = 4  # studies that a worker keeps the solvers of

_WORKS: dict[str, Work] = {}
"""Of this process: digest → work with the solvers it has built. Tasks of Dask have no other place to keep anything."""


def versions() -> Callable[[], dict[str, str]]:
    """A function that says which versions a process runs; it travels whole, so it answers where tmsopt is missing."""
    names = COMPARED

    def probe() -> dict[str, str]:
        import sys
        from importlib import metadata, util

        found = {"python": f"{sys.version_info[0]}.{sys.version_info[1]}"}
        for name in names:
            try:
                found[name] = metadata.version(name)
            except metadata.PackageNotFoundError:
                found[name] = "unknown" if util.find_spec(name) else "missing"
        return found

    return probe


def receive(digest: str, blob: bytes, dask_worker: Any) -> str:
    """Keep the work, the last of a few; what tells this process from a later one at the same address."""
    _WORKS[digest] = _WORKS.pop(digest) if digest in _WORKS else pickle.loads(blob)
    while len(_WORKS) > _KEPT:
        del _WORKS[next(iter(_WORKS))]
    return str(dask_worker.id)


def solve(run: str, number: int, digest: str, process: str, units: tuple[Unit, ...]) -> None:
    """Solve units in order and send what is finished to the scheduler, which passes it on to the client.

    What takes long is sent before the next unit begins. A message is on its way some milliseconds, so a worker that is
    killed takes that much finished work with it.

    A scheduler may start a task again after it has ended a worker. This one then does nothing: the client decides what
    is tried again, where, and how often.
    """
    from distributed import get_worker

    worker = get_worker()
    if worker.id != process:
        return
    work = _WORKS[digest]
    done: list[tuple[Unit, Sequence[Row], float]] = []
    sent = time.perf_counter()
    for unit in units:
        started = time.perf_counter()
        rows = attempt(work, unit)
        now = time.perf_counter()
        done.append((unit, rows, now - started))
        if now - sent >= _MESSAGE or unit == units[-1]:
            worker.log_event(TOPIC, {"run": run, "batch": number, "done": pickle.dumps(done)})
            done, sent = [], now
