"""Executors call a function for many items: in this process, in processes of this machine or on a Dask cluster.

The result of an item that ends its worker is a `Crash`, and no other item is lost. The workers end at once when the
iterator is closed, on Ctrl-C, and when this process ends, even by kill -9.
"""

import asyncio
import math
import os
import pickle
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from queue import Empty, SimpleQueue
from typing import Any, Self

from tmsopt.errors import input_error
from tmsopt.killable import KillableProcess, ProcessEnded

PATIENCE = 10.0
"""Longest time in s to wait for an answer of a Dask scheduler."""

Note = Callable[[str], None]
"""A callback for one line about workers that join, leave or crash."""

_BATCH_SECONDS = 0.2  # a batch of items should take this time in s
_RECENT_BATCHES = 64  # the mean time for an item in so many batches predicts the time of the next batch
_BATCHES_PER_WORKER = 2  # batches for a worker that are sent but not answered: it computes one, the other one waits
_CHECK_SECONDS = 1.0  # time between checks of the workers; a longer wait would ignore Ctrl-C on some systems
_MAX_CRASHES = 2  # an item is given up after so many crashes while no other item was computed
_WORKER_COMMAND = "'dask worker ADDRESS --nthreads 1'"
_START_TRIES = 3  # attempts to start a process that ends at once


@dataclass(frozen=True)
class Crash:
    """The result of an item that ended its workers.

    Attributes:
        cause: why the worker ended, such as ``signal 9``; empty if unknown.
    """

    cause: str


class EngineError(RuntimeError):
    """The executor cannot continue. The results that it has yielded are valid; the other items can be sent again."""


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

        Batches of items are sent to the workers. If a worker ends, the batches that are not answered are sent again,
        one after another. If a worker ends again, the items of this batch are sent one after another.

        Raises:
            Exception: any exception that the function raises.
            EngineError: if the workers cannot continue.
        """
        if self._pool is None:
            yield from enumerate(map(function, items))
            return
        try:
            yield from self._results(self._pool, function, list(items))
        except BaseException:  # the iterator was interrupted or closed, or it failed: the caller reads no more results
            self._pool.end()
            raise

    def _results(
        self, pool: "_ProcessPool | _DaskPool", function: Callable[[Any], Any], items: Sequence[Any]
    ) -> Generator[tuple[int, Any]]:
        import cloudpickle

        pickled_function, inbox = cloudpickle.dumps(function), SimpleQueue[Any]()
        unanswered, crashes = dict[Any, Sequence[int]](), Counter[int]()
        suspects = deque[Sequence[int]]()  # batches that were not answered when a worker ended; each is sent alone
        recent_times, next_item, is_sent_alone = deque[float](maxlen=_RECENT_BATCHES), 0, False

        def send(batch: Sequence[int]) -> None:
            future = pool.submit(pickled_function, cloudpickle.dumps([items[index] for index in batch]))
            unanswered[future] = batch
            future.add_done_callback(inbox.put)

        while unanswered or suspects or next_item < len(items):
            if suspects and not unanswered:
                is_sent_alone = True
                send(suspects.popleft())
            while not (suspects or is_sent_alone) and next_item < len(items):
                max_batches = _BATCHES_PER_WORKER * max(1, pool.workers)
                if len(unanswered) >= max_batches:
                    break
                size = _batch_size(recent_times, (len(items) - next_item) // max_batches)
                send(range(next_item, next_item + size))
                next_item += size
            try:
                future = inbox.get(timeout=_CHECK_SECONDS)
            except Empty:
                pool.check_workers()
                continue
            batch, was_sent_alone, is_sent_alone = unanswered.pop(future), is_sent_alone, False
            try:
                results, seconds, error = pickle.loads(pool.result(future))
            except _WorkerEnded as worker_end:
                cause, is_given_up = str(worker_end), False
                if not was_sent_alone:
                    suspects.append(batch)
                elif len(batch) == 1:
                    crashes.update(batch)
                    is_given_up = crashes[batch[0]] == _MAX_CRASHES
                if was_sent_alone and not is_given_up:
                    suspects.extendleft((index,) for index in reversed(batch))
                action = "given up" if is_given_up else "tried again, alone"
                self._note(f"worker died{f' ({cause})' if cause else ''}; its item is {action}")
                if is_given_up:
                    yield batch[0], Crash(cause)
                continue
            yield from zip(batch, results, strict=False)  # there are fewer results if an item raised an exception
            if error is not None:
                raise error
            recent_times.append(seconds / len(batch))


def cores() -> int:
    """Number of cores that this process may use, by its affinity, quotas and LOKY_MAX_CPU_COUNT."""
    import loky

    return int(loky.cpu_count())


def in_process() -> Executor:
    """An executor that calls the function in this process. A crash ends the process."""
    return Executor("in process")


def processes(workers: int, note: Note = ignore_note) -> Executor:
    """An executor with processes of this machine, each with one thread.

    Raises:
        InputError: if `workers` is less than 1.
    """
    if workers < 1:
        message = f"found {workers}; accepted: 1 or more; this machine has {cores()} cores"
        raise input_error(message, "workers")
    return Executor(f"{workers} processes", _ProcessPool(workers), note)


def cluster(address: str, note: Note = ignore_note) -> Executor:
    """An executor with the workers of a Dask scheduler. Workers may join and leave; if there is no worker, items wait.

    Raises:
        InputError: if `distributed` is not installed, no scheduler answers, or a worker has several threads or does not
            have tmsopt.
    """
    return Executor(address, _DaskPool(address, note), note)


class _WorkerEnded(Exception):
    """A worker ended during a call; the argument of this exception is the cause."""


def _batch_size(recent_times: Sequence[float], max_items: int) -> int:
    """Number of items that take `_BATCH_SECONDS` at the recent rate, or fewer, so that all workers end together."""
    size = math.ceil(_BATCH_SECONDS * len(recent_times) / max(sum(recent_times), 1e-9))
    return max(1, min(size, 2 * len(recent_times), max_items))


# Functions that run in a worker


@lru_cache(maxsize=4)
def _load_function(pickled_function: bytes) -> Callable[[Any], Any]:
    """Unpickle a function, once for all its calls, so that it keeps its caches."""
    try:
        function: Callable[[Any], Any] = pickle.loads(pickled_function)
    except Exception as error:
        raise EngineError(f"workers cannot load the work: {error!r}") from error
    return function


def _call(pickled_function: bytes, items: bytes) -> bytes:
    """Pickled results of items, their time in s, and the exception that ended the batch, or None."""
    import cloudpickle

    results, error, start_time = list[Any](), None, time.perf_counter()
    try:
        function = _load_function(pickled_function)
        results.extend(map(function, pickle.loads(items)))
    except Exception as exception:
        error = exception
    pickled: bytes = cloudpickle.dumps((results, time.perf_counter() - start_time, error))
    return pickled


# Processes of this machine


class _ProcessPool:
    """Processes of this machine. A thread of this process sends calls to each of them. A process that ends is replaced.

    The threads are daemons: Ctrl-C within a lock of Python's library leaves it locked, and a thread may wait for it.

    `submit` gives the future of a call in a worker. `result` gives its result, or raises its exception or
    `_WorkerEnded`. `check_workers` is called about once a second, and `end` ends all calls and workers. `workers` is
    the number of workers.
    """

    def __init__(self, workers: int) -> None:
        self.workers, self._lock = workers, threading.Lock()
        self._calls: SimpleQueue[Any] | None = None
        self._running, self._idle = list[KillableProcess](), list[KillableProcess]()

    def submit(self, *call: Any) -> Any:
        if self._calls is None:
            self._calls = SimpleQueue()
            for _ in range(self.workers):
                threading.Thread(target=self._serve, args=(self._calls,), daemon=True).start()
        future = Future[Any]()
        self._calls.put((future, call))
        return future

    def result(self, future: Any) -> Any:
        return future.result()

    def check_workers(self) -> None: ...

    def end(self) -> None:
        with self._lock:
            calls, self._calls = self._calls, None
            running, self._running, self._idle = self._running, [], []
        if calls is not None:
            with suppress(Empty):
                while True:
                    calls.get_nowait()
            for _ in range(self.workers):
                calls.put(None)
        for process in running:
            process.end()

    def _serve(self, calls: SimpleQueue[Any]) -> None:
        """Answer calls until the pool ends."""
        for future, call in iter(calls.get, None):
            try:
                future.set_result(self._answer(*call))
            except Exception as error:
                future.set_exception(error)

    def _answer(self, *call: Any) -> Any:
        try:
            process = self._idle.pop()
        except IndexError:
            process = self._start()
        try:
            answer = process.answer(_call, *call)
        except ProcessEnded as error:
            raise _WorkerEnded(process.end()) from error
        self._idle.append(process)
        return answer

    def _start(self) -> KillableProcess:
        """Start a process, and wait for its first answer."""
        cause = ""
        for _ in range(_START_TRIES):
            with self._lock:
                if self._calls is None:  # the pool has ended
                    raise _WorkerEnded(cause)
                process = KillableProcess()
                self._running.append(process)
            try:
                process.answer(os.getpid)
                return process
            except ProcessEnded:
                cause = process.end()
        raise EngineError(f"worker processes end before they start ({cause})")


# A Dask cluster


class _DaskPool:
    """A client of a Dask scheduler, with the methods of `_ProcessPool`. It repeats calls of ended workers."""

    def __init__(self, address: str, note: Note) -> None:
        self._address, self._note = address, note
        self._client: Any = None
        self._checked = frozenset[str]()
        self.workers, self._last_check = -1, 0.0

    def submit(self, *call: Any) -> Any:
        self.check_workers()
        return self._client.submit(_call, *call, pure=False)

    def result(self, future: Any) -> Any:
        from distributed import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise _WorkerEnded("") from error
        except (CancelledError, OSError) as error:
            raise self._lost_error() from error

    def check_workers(self) -> None:
        now, self._client = time.monotonic(), self._client or _connect(self._address)
        if self._client.status != "running":
            raise self._lost_error()
        if now - self._last_check < _CHECK_SECONDS:
            return
        self._last_check = now
        try:
            threads = self._client.nthreads()
        except OSError as error:
            raise self._lost_error() from error
        bad_workers = [f"{worker} has {count}" for worker, count in threads.items() if count != 1]
        if bad_workers:
            reason = f"a worker needs exactly one thread, because two threads crash IPOPT; {', '.join(bad_workers)}"
            raise input_error(f"{reason}: start every worker with {_WORKER_COMMAND}", "scheduler")
        for worker in threads.keys() - self._checked:
            _check_tmsopt(self._client, worker)
        self._checked = frozenset(threads)
        if not threads and self.workers:
            self._note(f"no workers at {self._address}; rows wait until one joins")
        self.workers = len(threads)

    def end(self) -> None:
        client, self._client = self._client, None
        if client is not None:
            with suppress(Exception):  # the scheduler may have ended; if not, it drops calls that have not begun
                client.close(timeout=PATIENCE)

    def _lost_error(self) -> EngineError:
        return EngineError(
            f"the Dask scheduler at {self._address} is lost; finished rows are kept; run again for the others"
        )


def _connect(address: str) -> Any:
    """A client of the scheduler at an address.

    The address is checked first, because a `Client` that cannot connect tries again and logs for a long time.
    """
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        message = 'a Dask cluster needs a package that is not installed: pip install "tmsopt[cluster]"'
        raise input_error(message, "scheduler") from None
    try:
        with ThreadPoolExecutor(1) as thread:  # notebooks already run an event loop in this thread
            kind = thread.submit(asyncio.run, _server_kind(distributed, address)).result()
        reason = "" if kind == "Scheduler" else f"a Dask {kind.lower()} answers there"
    except Exception as error:  # any program may listen at this address
        reason = str(error) or type(error).__name__
    if reason:
        advice = "start one with 'dask scheduler', which prints its address, tcp://HOST:8786, and workers with"
        message = f"no Dask scheduler answers at '{address}' ({reason}); {advice} {_WORKER_COMMAND}"
        raise input_error(message, "scheduler")
    return distributed.Client(address, timeout=PATIENCE, set_as_default=False)


async def _server_kind(distributed: Any, address: str) -> str:
    """The kind of Dask server at an address: ``Scheduler``, ``Worker`` or ``Nanny``."""
    arguments = distributed.Security().get_connection_args("client")
    with suppress(TimeoutError):
        async with asyncio.timeout(PATIENCE), distributed.rpc(address, connection_args=arguments) as server:
            return str((await server.identity())["type"])
    raise OSError(f"no answer within {PATIENCE:.0f} s")


def _check_tmsopt(client: Any, worker: str) -> None:
    """Check that tmsopt is installed where a worker runs."""

    def has_tmsopt() -> bool:  # it is pickled by value, so it runs without tmsopt
        from importlib.util import find_spec

        return find_spec("tmsopt") is not None

    answer = client.run(has_tmsopt, workers=[worker], on_error="return").get(worker, OSError(worker))
    if isinstance(answer, Exception) and not isinstance(answer, OSError):  # OSError: the worker has left
        message = f"worker {worker} does not answer: {answer!r}; it needs the same Python and packages"
        raise input_error(message, "scheduler")
    if answer is False:
        message = f"worker {worker} has no tmsopt: install the same version there and start it again"
        raise input_error(message, "scheduler")
