"""Who takes part in a Dask cluster: a scheduler that answers, and workers that would come to the same bits."""

import asyncio
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from tmsopt.errors import Fault, InputError
from tmsopt.study.batch.engines.member import receive, versions
from tmsopt.study.batch.engines.work import EngineError

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
