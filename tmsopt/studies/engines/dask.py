"""The engine of many machines: a Dask cluster that somebody has started."""

import hashlib
import pickle
import threading
import time
import uuid
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from queue import Empty, SimpleQueue
from typing import Any

from tmsopt.studies.engines.dask_workers import PATIENCE, TOPIC, admitted, check_threads, connected, solve
from tmsopt.studies.engines.dispatch import Assignments
from tmsopt.studies.engines.work import EngineError, Note, Unit, Work, pickled, silent
from tmsopt.studies.row import Row

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
    client = connected(address)
    engine = _Engine(client, address, Assignments(work, units, note), note, blob)
    try:
        client.subscribe_topic(TOPIC, lambda event: engine.inbox.put(("rows", event[1])))
        client.subscribe_topic("all", lambda event: engine.inbox.put(("news", event[1])))
        while engine.assignments.unfinished:
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
            client.close(timeout=PATIENCE)


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
    assignments: Assignments
    note: Note
    blob: bytes
    run: str = field(default_factory=lambda: uuid.uuid4().hex)
    inbox: SimpleQueue[tuple[str, Any]] = field(default_factory=SimpleQueue)
    places: dict[str, str] = field(default_factory=dict)  # id of a process → address
    asked: set[str] = field(default_factory=set)  # addresses of workers that have not said yet who they are
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
            check_threads(threads)
        except OSError as error:
            raise EngineError(self._lost) from error
        for place in threads.keys() - {*self.places.values(), *self.asked}:
            self._ask(place)
        for worker, place in self.places.items():
            if place not in threads:  # the news of it, which say why, are on their way
                self.inbox.put(("gone", worker))
        for worker in {batch.worker for batch in self.batches.values() if batch.over and now - batch.over > _LATE}:
            self._recall(worker)
        if not self.places and not self.asked and not self.alone:
            self.note(f"no workers at {self.address}; rows wait until one joins")
        self.alone = not self.places and not self.asked

    def send(self) -> None:
        """Give every worker what it should have."""
        for worker, place in self.places.items():
            units = self.assignments.batch(worker)
            if not units:
                continue
            self.sent += 1
            future = self.client.submit(
                solve, self.run, self.sent, self.digest, worker, units, key=f"tmsopt-{self.run}-{self.sent}",
                pure=False, workers=[place], allow_other_workers=False, fifo_timeout=0,
            )  # fmt: skip
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
                elif kind == "asked":
                    self._answered(*what)
                kind, what = self.inbox.get_nowait()

    def _finished(self, number: int, done: bytes) -> Iterator[Row]:
        batch = self.batches.get(number)
        if batch is None:
            return
        for unit, rows, seconds in pickle.loads(done):
            if self.assignments.delivered(batch.worker, unit, seconds):
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
        return self.assignments.ended(worker, f"worker {place} died", "")

    def _recall(self, worker: str) -> None:
        """Nobody is to blame: what the worker holds waits again; if it is still there, the next look takes it in."""
        self._forget(worker)
        self.assignments.returned(worker)

    def _forget(self, worker: str) -> str:
        place = self.places.pop(worker)
        self.batches = {n: batch for n, batch in self.batches.items() if batch.worker != worker}
        self.looked = -_LOOK
        return place

    def _ask(self, place: str) -> None:
        """Ask a new worker who it is, on a thread of its own: one that ends just then takes half a minute to say so."""
        self.asked.add(place)

        def ask() -> None:
            answer: object
            try:
                answer = admitted(self.client, place, self.digest, self.blob)
            except Exception as error:  # told where it is heard
                answer = error
            self.inbox.put(("asked", (place, answer)))

        threading.Thread(target=ask, daemon=True).start()

    def _answered(self, place: str, answer: object) -> None:
        self.asked.discard(place)
        match answer:
            case str():
                self.places[answer] = place
                self.assignments.join(answer)
            case OSError():
                self.looked = -_LOOK  # it is gone, or the next look asks again
            case Exception():
                raise answer

    @property
    def _lost(self) -> str:
        return f"the Dask scheduler at {self.address} is lost; rows that have come are kept, run again for the others"
