"""Who takes part in a Dask cluster: a scheduler that answers, and workers that would come to the same bits."""

import asyncio
import pickle
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from tmsopt.errors import Fault, InputError
from tmsopt.studies.engines.work import EngineError, Unit, keep, timed
from tmsopt.studies.row import Row

TOPIC = "tmsopt-rows"
"""Of the events that carry finished units. One for all studies: schedulers never forget a topic."""
COMPARED = ("tmsopt", "casadi", "numpy", "scipy")
"""Distributions whose versions decide about bits."""
_MESSAGE = 0.02  # s of finished work that is worth a message of its own


PATIENCE = 10.0
"""s for a scheduler to answer."""


def connected(address: str) -> Any:
    """A client of the scheduler at an address.

    Whether there is one is asked before, for a `Client` that cannot connect neither gives up at once nor quietly.
    """
    try:
        import distributed
    except ImportError:
        raise _refused('a Dask cluster needs a package that is not installed: pip install "tmsopt[cluster]"') from None
    try:
        with ThreadPoolExecutor(1) as thread:  # notebooks run a loop of their own in this one
            found = thread.submit(asyncio.run, _what_answers(address)).result()
        reason = "" if found == "Scheduler" else f"a Dask {found.lower()} does"
    except Exception as error:  # whatever listens there may answer anything
        reason = str(error) or type(error).__name__
    if reason:
        raise _refused(
            f"no Dask scheduler answers at '{address}' ({reason}); start one with 'dask scheduler', which prints its "
            "address, tcp://HOST:8786, and workers with 'dask worker ADDRESS --nthreads 1'"
        )
    connect: Any = distributed.Client
    return connect(address, timeout=PATIENCE, set_as_default=False)


async def _what_answers(address: str) -> str:
    from distributed import Security, rpc

    security: Any = Security
    connect: Any = rpc
    with suppress(TimeoutError):
        async with asyncio.timeout(PATIENCE):
            async with connect(address, connection_args=security().get_connection_args("client")) as server:
                return str((await server.identity())["type"])
    raise OSError(f"nothing within {PATIENCE:.0f} s")


def check_threads(threads: Mapping[str, int]) -> None:
    wrong = [f"{place} has {count}" for place, count in threads.items() if count != 1]
    if wrong:
        raise _refused(
            f"workers need one thread each, two in one IPOPT crash the process; {', '.join(wrong)}: "
            "start every worker with 'dask worker ADDRESS --nthreads 1'"
        )


def _refused(message: str) -> InputError:
    return InputError([Fault(message, ("scheduler",))])


def admitted(client: Any, place: str, digest: str, blob: bytes) -> str:
    """Send the work to a worker; the id of its process.

    Raises:
        OSError: the worker is gone.
        InputError: it has other versions, or none of tmsopt.
        EngineError: it cannot load the work.
    """
    theirs = client.run(versions(), workers=[place], on_error="return").get(place, OSError(place))
    if isinstance(theirs, OSError):
        raise theirs
    if isinstance(theirs, Exception):
        raise _refused(f"worker {place} does not answer: {theirs!r}; it needs the same Python and packages")
    other = [
        f"{name} {theirs.get(name)} instead of {version}"
        for name, version in versions()().items()
        if theirs.get(name) != version and "unknown" not in (version, theirs.get(name))
    ]
    if other:
        raise _refused(
            f"worker {place} has {', '.join(other)}; rows are the same bits only with the same versions: "
            "install them there and start it again"
        )
    process = client.run(receive, digest, blob, workers=[place], on_error="return").get(place, OSError(place))
    if isinstance(process, OSError):
        raise process
    if isinstance(process, Exception):
        raise EngineError(f"worker {place} cannot load the study: {process!r}") from process
    return str(process)


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
    """Keep the work; what tells this process from a later one at the same address."""
    keep(digest, blob)
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
    done: list[tuple[Unit, Sequence[Row], float]] = []
    sent = time.perf_counter()
    for unit in units:
        done.append(timed(digest, unit))
        now = time.perf_counter()
        if now - sent >= _MESSAGE or unit == units[-1]:
            worker.log_event(TOPIC, {"run": run, "batch": number, "done": pickle.dumps(done)})
            done, sent = [], now
