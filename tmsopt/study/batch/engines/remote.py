"""The engine of many machines: a Dask cluster that somebody has started."""

import asyncio
import hashlib
import pickle
import time
import uuid
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from queue import Empty, SimpleQueue
from typing import Any

from tmsopt.design.errors import Fault, InputError
from tmsopt.study.batch.engines.ledger import Ledger
from tmsopt.study.batch.engines.member import TOPIC, receive, solve, versions
from tmsopt.study.batch.engines.work import EngineError, Note, Unit, Work, pickled, silent
from tmsopt.study.batch.row import Row

_PATIENCE = 10.0  # s for a scheduler to answer
_LOOK = 2.0  # s between looks at who is there; news of it comes sooner as a rule
_LATE = 2.0  # s that finished units may come after word that their batch is done
_SENT = 0.05  # s in which a client has sent what it was told to; it complains if it is closed before
_FAILURES = 3  # batches in a row that fail by something else than a row


def cluster(work: Work, units: Sequence[Unit], address: str, note: Note = silent) -> Generator[Row]:
    """Rows of the units as they come, solved by the workers of the Dask scheduler at an address.

    Every batch is sent to one worker by name and started once, whatever the scheduler's settings: which units are tried
    again, and where, is decided here, by the same rules as for processes. Workers may come and go; with none left,
    rows wait.

    Raises:
        InputError: `distributed` is not installed, there is no scheduler at the address, a worker has more than one
            thread or other versions.
        EngineError: the scheduler is lost, or workers cannot load the work.
    """
    blob = pickled(work)
    client = _client(address)
    engine = _Engine(client, address, Ledger(work, units, note), note, blob)
    try:
        client.subscribe_topic(TOPIC, lambda event: engine.inbox.put(("rows", event[1])))
        client.subscribe_topic("all", lambda event: engine.inbox.put(("news", event[1])))
        while engine.ledger.unfinished:
            engine.look()
            engine.send()
            yield from engine.hear()
    finally:
        with suppress(Exception):  # the scheduler may be gone; where it is not, it forgets what is not started yet
            engine.batches.clear()
            client.unsubscribe_topic(TOPIC)
            client.unsubscribe_topic("all")
            time.sleep(_SENT)
        with suppress(Exception):
            client.close(timeout=_PATIENCE)


@dataclass
class _Batch:
    """Units on their way.

    Attributes:
        worker: id of the process that is to solve them.
        missing: those that have not come back.
        future: of the task; it has no result, but may have an error.
        over: when the task was heard to be over; 0 before.
    """

    worker: str
    missing: set[Unit]
    future: Any
    over: float = 0.0


@dataclass
class _Engine:
    """A client of the scheduler, and what it hears. Workers go by the ids of their processes: addresses come back."""

    client: Any
    address: str
    ledger: Ledger
    note: Note
    blob: bytes
    run: str = field(default_factory=lambda: uuid.uuid4().hex)
    inbox: SimpleQueue[tuple[str, Any]] = field(default_factory=SimpleQueue)
    places: dict[str, str] = field(default_factory=dict)  # id of a process → address
    batches: dict[int, _Batch] = field(default_factory=dict)
    sent: int = 0
    failures: int = 0
    looked: float = -_LOOK
    alone: bool = False

    @cached_property
    def digest(self) -> str:
        return hashlib.sha256(self.blob).hexdigest()

    def look(self) -> None:
        """Once in a while: take in workers that have come, and recall what was lost on the way."""
        if self.client.status != "running":
            raise EngineError(self._lost)
        now = time.monotonic()
        if now - self.looked < _LOOK:
            return
        self.looked = now
        try:
            threads: Mapping[str, int] = self.client.nthreads()
            _one_thread(threads)
            self._admit([place for place in threads if place not in self.places.values()])
        except OSError as error:
            raise EngineError(self._lost) from error
        for worker, place in self.places.items():
            if place not in threads:  # the news of it, which say why, are on their way
                self.inbox.put(("gone", worker))
        for worker in {batch.worker for batch in self.batches.values() if batch.over and now - batch.over > _LATE}:
            self._recall(worker)
        if not self.places and not self.alone:
            self.note(f"no workers at {self.address}; rows wait until one joins")
        self.alone = not self.places

    def send(self) -> None:
        """Give every worker what it should have."""
        for worker, place in self.places.items():
            units = self.ledger.batch(worker)
            if not units:
                continue
            self.sent += 1
            future = self.client.submit(
                solve,
                self.run,
                self.sent,
                self.digest,
                worker,
                units,
                key=f"tmsopt-{self.run}-{self.sent}",
                pure=False,
                workers=[place],
                allow_other_workers=False,
                fifo_timeout=0,
            )
            self.batches[self.sent] = _Batch(worker, set(units), future)
            future.add_done_callback(lambda _, number=self.sent: self.inbox.put(("over", number)))

    def hear(self) -> Iterator[Row]:
        """Rows that have come, after a while at most."""
        with suppress(Empty):
            kind, what = self.inbox.get(timeout=_LOOK / 4)
            while True:
                if kind == "rows" and what["run"] == self.run:
                    yield from self._finished(what["batch"], what["done"])
                elif kind == "over" and what in self.batches:
                    self._over(self.batches[what])
                elif kind == "news":
                    yield from self._news(what)
                elif kind == "gone" and what in self.places:
                    yield from self._died(what)
                kind, what = self.inbox.get_nowait()

    def _finished(self, number: int, done: bytes) -> Iterator[Row]:
        batch = self.batches.get(number)
        if batch is None:
            return
        for unit, rows, seconds in pickle.loads(done):
            if self.ledger.delivered(batch.worker, unit, seconds):
                self.failures = 0
                batch.missing.discard(unit)
                yield from rows
        if not batch.missing:
            self.batches.pop(number, None)

    def _over(self, batch: _Batch) -> None:
        """A task is over though not all of its units have come back."""
        from distributed import KilledWorker

        batch.over = time.monotonic()
        error = batch.future.exception() if batch.future.status == "error" else None
        if error is None or isinstance(error, KilledWorker):
            return  # news of the worker, or the next look, says what became of the units
        self.failures += 1
        if self.failures == _FAILURES:
            raise EngineError(f"worker {self.places.get(batch.worker)}: {error!r}") from error
        self._recall(batch.worker)

    def _news(self, event: Mapping[str, Any]) -> Iterator[Row]:
        """Workers that come and go."""
        action, place = event.get("action"), event.get("worker")
        if action == "add-worker":
            self.looked = -_LOOK
        for worker in [w for w, p in self.places.items() if action == "remove-worker" and p == place]:
            if event.get("expected"):
                self.note(f"worker {place} left")
                self._recall(worker)
            else:
                yield from self._died(worker)

    def _died(self, worker: str) -> Sequence[Row]:
        place = self._forget(worker)
        return self.ledger.ended(worker, f"worker {place} died", "")

    def _recall(self, worker: str) -> None:
        """Nobody is to blame: what the worker holds waits again; if it is still there, the next look takes it in."""
        self._forget(worker)
        self.ledger.returned(worker)

    def _forget(self, worker: str) -> str:
        place = self.places.pop(worker)
        self.batches = {n: batch for n, batch in self.batches.items() if batch.worker != worker}
        self.looked = -_LOOK
        return place

    def _admit(self, places: Sequence[str]) -> None:
        """Take in new workers: compare versions, send the work. Who ends meanwhile is left out."""
        if not places:
            return
        mine = versions()()
        found = self.client.run(versions(), workers=list(places), on_error="return")
        alike = []
        for place, theirs in found.items():
            if isinstance(theirs, OSError):
                continue
            if isinstance(theirs, Exception):
                raise _refused(f"worker {place} does not answer: {theirs!r}; it needs the same Python and packages")
            other = [
                f"{name} {theirs.get(name)} instead of {version}"
                for name, version in mine.items()
                if theirs.get(name) != version and "unknown" not in (version, theirs.get(name))
            ]
            if other:
                raise _refused(
                    f"worker {place} has {', '.join(other)}; rows are the same bits only with the same versions: "
                    "install them there and start it again"
                )
            alike.append(place)
        taken = self.client.run(receive, self.digest, self.blob, workers=alike, on_error="return")
        for place, process in taken.items():
            if isinstance(process, OSError):
                continue
            if isinstance(process, Exception):
                raise EngineError(f"worker {place} cannot load the study: {process!r}") from process
            self.places[process] = place
            self.ledger.join(process)

    @property
    def _lost(self) -> str:
        return f"the Dask scheduler at {self.address} is lost; rows that have come are kept, run again for the others"


def _client(address: str) -> Any:
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
    return connect(address, timeout=_PATIENCE, set_as_default=False)


async def _what_answers(address: str) -> str:
    from distributed import Security, rpc

    security: Any = Security
    connect: Any = rpc
    with suppress(TimeoutError):
        async with asyncio.timeout(_PATIENCE):
            async with connect(address, connection_args=security().get_connection_args("client")) as server:
                return str((await server.identity())["type"])
    raise OSError(f"nothing within {_PATIENCE:.0f} s")


def _one_thread(threads: Mapping[str, int]) -> None:
    wrong = [f"{place} has {count}" for place, count in threads.items() if count != 1]
    if wrong:
        raise _refused(
            f"workers need one thread each, two in one IPOPT crash the process; {', '.join(wrong)}: "
            "start every worker with 'dask worker ADDRESS --nthreads 1'"
        )


def _refused(message: str) -> InputError:
    return InputError([Fault(message, ("scheduler",))])
