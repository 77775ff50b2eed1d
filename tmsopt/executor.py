"""Executors call a function for many items: in this process, in processes of this machine or on a Dask cluster.

An item that ends its worker yields a `Crash`, and no other item is lost. The workers end at once when the iterator is
closed, on Ctrl-C, and with this process, even by kill -9.
"""

import asyncio
import math
import os
import pickle
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from queue import Empty, SimpleQueue
from typing import Any, Self

from tmsopt.errors import input_error
from tmsopt.killable import Killable, ProcessEnded

PATIENCE = 10.0
"""Time limit in s for an answer of a Dask scheduler."""

Note = Callable[[str], None]
"""A callback for one line about workers that join, leave or crash."""

_BATCH = 0.2  # s of work in one batch
_RECENT = 64  # batches whose mean time per item predicts the next ones
_AHEAD = 2  # batches in flight per worker: it computes one while the next travels
_CHECK = 1.0  # s between checks of the workers; some systems ignore Ctrl-C during a wait
_TRIES = 2  # crashes of an item, alone in flight, before it is given up
_WORKER = "'dask worker ADDRESS --nthreads 1'"
_START_TRIES = 3  # attempts to start a process that ends at once


@dataclass(frozen=True)
class Crash:
    """The result of an item that ended its workers.

    Attributes:
        cause: e.g. ``signal 9``; empty if unknown.
    """

    cause: str


class EngineError(RuntimeError):
    """The executor cannot continue. Results that it has yielded are valid; the other items can be submitted again."""


def ignore_note(line: str) -> None:
    """A `Note` that does nothing."""


class Executor:
    """Calls a function for items. It is a context manager; leaving it ends the workers.

    Attributes:
        name: ``in process``, ``2 processes`` or the address of a cluster.
    """

    def __init__(self, name: str, pool: "_ProcessPool | _DaskPool | None" = None, note: Note = ignore_note) -> None:
        self.name, self._pool, self._note = name, pool, note

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        if self._pool is not None:
            self._pool.end()

    def map(self, function: Callable[[Any], Any], items: Iterable[Any]) -> Generator[tuple[int, Any]]:
        """Yield the index of each item with its result or `Crash`, in the order in which they finish.

        Batches of items are sent to the workers. When one ends, each batch in flight is tried again with nothing else
        in flight, then its items one by one.

        Raises:
            Exception: any that the function raises.
            EngineError: if the workers cannot continue.
        """
        if self._pool is None:
            yield from enumerate(map(function, items))
            return
        try:
            yield from self._results(self._pool, function, list(items))
        except BaseException:  # interrupted, closed or failed: nobody reads the rest
            self._pool.end()
            raise

    def _results(
        self, pool: "_ProcessPool | _DaskPool", function: Callable[[Any], Any], items: Sequence[Any]
    ) -> Generator[tuple[int, Any]]:
        import cloudpickle

        blob, inbox = cloudpickle.dumps(function), SimpleQueue[Any]()
        in_flight, suspects, crashes = dict[Any, Sequence[int]](), deque[Sequence[int]](), Counter[int]()
        recent, first, is_alone = deque[float](maxlen=_RECENT), 0, False

        def send(batch: Sequence[int]) -> None:
            future = pool.submit(blob, cloudpickle.dumps([items[place] for place in batch]))
            in_flight[future] = batch
            future.add_done_callback(inbox.put)

        while in_flight or suspects or first < len(items):
            if suspects and not in_flight:
                is_alone = True
                send(suspects.popleft())
            while not (suspects or is_alone) and first < len(items):
                most = _AHEAD * max(1, pool.workers)
                if len(in_flight) >= most:
                    break
                size = _batch_size(recent, (len(items) - first) // most)
                send(range(first, first + size))
                first += size
            try:
                future = inbox.get(timeout=_CHECK)
            except Empty:
                pool.look()
                continue
            batch, was_alone, is_alone = in_flight.pop(future), is_alone, False
            try:
                results, seconds, error = pickle.loads(pool.result(future))
            except _Died as died:
                cause, given_up = str(died), False
                if not was_alone:
                    suspects.append(batch)
                elif len(batch) == 1:
                    crashes.update(batch)
                    given_up = crashes[batch[0]] == _TRIES
                if was_alone and not given_up:
                    suspects.extendleft((place,) for place in reversed(batch))
                action = "given up" if given_up else "tried again, alone"
                self._note(f"worker died{f' ({cause})' if cause else ''}; its item is {action}")
                if given_up:
                    yield batch[0], Crash(cause)
                continue
            yield from zip(batch, results, strict=False)  # fewer results where one item raised
            if error is not None:
                raise error
            recent.append(seconds / len(batch))


def cores() -> int:
    """Number of usable cores, within affinity, quotas and LOKY_MAX_CPU_COUNT."""
    import loky

    return int(loky.cpu_count())


def here() -> Executor:
    """A loop in this process, which a crash ends."""
    return Executor("in process")


def processes(workers: int, note: Note = ignore_note) -> Executor:
    """Processes of this machine, with one thread each.

    Raises:
        InputError: if `workers` is less than 1.
    """
    if workers < 1:
        message = f"found {workers}; accepted: 1 or more; this machine has {cores()} cores"
        raise input_error(message, "workers")
    return Executor(f"{workers} processes", _ProcessPool(workers), note)


def cluster(address: str, note: Note = ignore_note) -> Executor:
    """The workers of the Dask scheduler at an address. They may join and leave; without any, items wait.

    Raises:
        InputError: if `distributed` is not installed, no scheduler answers, or a worker has several threads or no
            tmsopt.
    """
    return Executor(address, _DaskPool(address, note), note)


class _Died(Exception):
    """A worker ended while it had a call; its argument is the cause."""


def _batch_size(recent: Sequence[float], most: int) -> int:
    """Number of items for `_BATCH` seconds at the recent rate; few near the end, so that all workers end together."""
    wanted = math.ceil(_BATCH * len(recent) / max(sum(recent), 1e-9))
    return max(1, min(wanted, 2 * len(recent), most))


# In a worker


@lru_cache(maxsize=4)
def _load(blob: bytes) -> Callable[[Any], Any]:
    """Unpickle a function once, so that it keeps its caches."""
    try:
        function: Callable[[Any], Any] = pickle.loads(blob)
    except Exception as error:
        raise EngineError(f"workers cannot load the work: {error!r}") from error
    return function


def _call(blob: bytes, items: bytes) -> bytes:
    """Pickled results of items, their time in s, and the exception that ended them, if any."""
    import cloudpickle

    results, error, began = list[Any](), None, time.perf_counter()
    try:
        function = _load(blob)
        results.extend(map(function, pickle.loads(items)))
    except Exception as raised:
        error = raised
    pickled: bytes = cloudpickle.dumps((results, time.perf_counter() - began, error))
    return pickled


# Processes of this machine


class _ProcessPool:
    """Processes that threads of this one talk to, one each; a process that ends is replaced.

    `submit` gives the future of a call in a worker; `result` its result or exception, or `_Died` if its worker ended;
    `look` checks the workers about once a second, and `end` ends all calls and workers. `workers` is their number.
    """

    def __init__(self, workers: int) -> None:
        self.workers, self._lock = workers, threading.Lock()
        self._threads: ThreadPoolExecutor | None = None
        self._running, self._idle = list[Killable](), list[Killable]()

    def submit(self, *call: Any) -> Any:
        self._threads = self._threads or ThreadPoolExecutor(self.workers)
        return self._threads.submit(self._answer, *call)

    def result(self, future: Any) -> Any:
        return future.result()

    def look(self) -> None: ...

    def end(self) -> None:
        with self._lock:
            threads, self._threads = self._threads, None
            running, self._running, self._idle = self._running, [], []
        if threads is not None:
            threads.shutdown(wait=False, cancel_futures=True)
        for process in running:
            process.end()

    def _answer(self, *call: Any) -> Any:
        try:
            process = self._idle.pop()
        except IndexError:
            process = self._start()
        try:
            answer = process.answer(_call, *call)
        except ProcessEnded as error:
            raise _Died(process.end()) from error
        self._idle.append(process)
        return answer

    def _start(self) -> Killable:
        """A process that has answered."""
        cause = ""
        for _ in range(_START_TRIES):
            with self._lock:
                if self._threads is None:  # nobody waits for the answer
                    raise _Died(cause)
                process = Killable()
                self._running.append(process)
            try:
                process.answer(os.getpid)
                return process
            except ProcessEnded:
                cause = process.end()
        raise EngineError(f"worker processes end before they start ({cause})")


# A Dask cluster


class _DaskPool:
    """A client of a Dask scheduler, which itself repeats the calls of a worker that ended."""

    def __init__(self, address: str, note: Note) -> None:
        self._address, self._note = address, note
        self._client: Any = None
        self._checked = frozenset[str]()
        self.workers, self._last_check = -1, 0.0

    def submit(self, *call: Any) -> Any:
        self.look()
        return self._client.submit(_call, *call, pure=False)

    def result(self, future: Any) -> Any:
        from distributed import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise _Died("") from error
        except (CancelledError, OSError) as error:
            raise self._lost_error() from error

    def look(self) -> None:
        now, self._client = time.monotonic(), self._client or _connect(self._address)
        if self._client.status != "running":
            raise self._lost_error()
        if now - self._last_check < _CHECK:
            return
        self._last_check = now
        try:
            threads = self._client.nthreads()
        except OSError as error:
            raise self._lost_error() from error
        wrong = [f"{place} has {count}" for place, count in threads.items() if count != 1]
        if wrong:
            reason = f"workers need one thread each, two in one IPOPT crash the process; {', '.join(wrong)}"
            raise input_error(f"{reason}: start every worker with {_WORKER}", "scheduler")
        for place in threads.keys() - self._checked:
            _check_tmsopt(self._client, place)
        self._checked = frozenset(threads)
        if not threads and self.workers:
            self._note(f"no workers at {self._address}; rows wait until one joins")
        self.workers = len(threads)

    def end(self) -> None:
        client, self._client = self._client, None
        if client is not None:
            with suppress(Exception):  # the scheduler may be gone; if not, it drops calls not yet started
                client.close(timeout=PATIENCE)

    def _lost_error(self) -> EngineError:
        return EngineError(
            f"the Dask scheduler at {self._address} is lost; finished rows are kept; run again for the others"
        )


def _connect(address: str) -> Any:
    """A client of the scheduler at an address.

    The address is probed first, because a `Client` that cannot connect retries and logs for long.
    """
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        message = 'a Dask cluster needs a package that is not installed: pip install "tmsopt[cluster]"'
        raise input_error(message, "scheduler") from None
    try:
        with ThreadPoolExecutor(1) as thread:  # notebooks already run an event loop in this thread
            kind = thread.submit(asyncio.run, _server_kind(distributed, address)).result()
        reason = "" if kind == "Scheduler" else f"a Dask {kind.lower()} does"
    except Exception as error:  # any program may listen there
        reason = str(error) or type(error).__name__
    if reason:
        advice = "start one with 'dask scheduler', which prints its address, tcp://HOST:8786, and workers with"
        raise input_error(f"no Dask scheduler answers at '{address}' ({reason}); {advice} {_WORKER}", "scheduler")
    return distributed.Client(address, timeout=PATIENCE, set_as_default=False)


async def _server_kind(distributed: Any, address: str) -> str:
    arguments = distributed.Security().get_connection_args("client")
    with suppress(TimeoutError):
        async with asyncio.timeout(PATIENCE), distributed.rpc(address, connection_args=arguments) as server:
            return str((await server.identity())["type"])
    raise OSError(f"nothing within {PATIENCE:.0f} s")


def _check_tmsopt(client: Any, place: str) -> None:
    def has_tmsopt() -> bool:  # pickled by value, so it runs without tmsopt
        from importlib.util import find_spec

        return find_spec("tmsopt") is not None

    answer = client.run(has_tmsopt, workers=[place], on_error="return").get(place, OSError(place))
    if isinstance(answer, Exception) and not isinstance(answer, OSError):  # OSError: the worker has left
        message = f"worker {place} does not answer: {answer!r}; it needs the same Python and packages"
        raise input_error(message, "scheduler")
    if answer is False:
        message = f"worker {place} has no tmsopt: install the same version there and start it again"
        raise input_error(message, "scheduler")
