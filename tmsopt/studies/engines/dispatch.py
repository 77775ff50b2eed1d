"""Who solves what: units that wait, units that are out, and what becomes of those that end their worker."""

import math
from collections import deque
from collections.abc import Sequence

from tmsopt.studies.engines.work import Note, Unit, Work, called
from tmsopt.studies.row import Row

_BATCH = 0.2  # s of work in one message
_LOW = 0.1  # s of work left at a worker, below which it is sent more before it asks
_LONG = 0.5  # s; units longer than this are not sent ahead: waiting for them costs more than the message
_RECENT = 64  # units whose mean time says how long the next ones take
_KILLS = 2  # workers that a row may end


class Assignments:
    """The units of a study between those who solve them.

    A worker holds its units first in, first out, and hands over each as it is finished. So when it ends, the first one
    it holds was being solved: that one is tried again by a worker that holds nothing else, and the others simply wait
    again. Nothing here changes what a unit comes to.
    """

    def __init__(self, work: Work, units: Sequence[Unit], note: Note) -> None:
        self._work = work
        self._note = note
        self._waiting = deque(units)
        self._suspects: deque[Unit] = deque()
        self._kills: dict[Unit, int] = {}
        self._held: dict[str, deque[Unit]] = {}
        self._fresh: set[str] = set()  # their first unit also pays for what is built once
        self._recent: deque[float] = deque(maxlen=_RECENT)
        self.unfinished = len(self._waiting)

    @property
    def workers(self) -> list[str]:
        """Names of those who are there."""
        return list(self._held)

    def join(self, worker: str) -> None:
        """A worker is there and holds nothing, whatever one of the same name held before."""
        self.returned(worker)
        self._held[worker] = deque()
        self._fresh.add(worker)

    def batch(self, worker: str) -> tuple[Unit, ...]:
        """The units to send to a worker now; none if it has enough, or others should have them."""
        held = self._held[worker]
        if self._suspects and not held:
            return self._hand(worker, [self._suspects.popleft()])
        if not self._waiting or self._enough(held):
            return ()
        return self._hand(worker, [self._waiting.popleft() for _ in range(self._size())])

    def delivered(self, worker: str, unit: Unit, seconds: float) -> bool:
        """Whether a finished unit is to be kept: not if it came from a worker that was given up."""
        held = self._held.get(worker, deque())
        if unit not in held:
            return False
        held.remove(unit)
        self.unfinished -= 1
        if worker not in self._fresh:
            self._recent.append(seconds)
        self._fresh.discard(worker)
        return True

    def returned(self, worker: str) -> None:
        """A worker is gone and no unit of its is to blame; all wait again."""
        for unit in reversed(self._held.pop(worker, deque())):
            (self._suspects if unit in self._kills else self._waiting).appendleft(unit)

    def ended(self, worker: str, told: str, cause: str) -> list[Row]:
        """A worker ended while it solved the first of its units; rows that are given up for it.

        Args:
            told: for the note, "worker 1234 died (signal 9)".
            cause: where it is known, "signal 9".
        """
        held = self._held.get(worker)
        if not held:
            self.returned(worker)
            self._note(f"{told} between rows")
            return []
        unit = held.popleft()
        self.returned(worker)
        told = f"{told} while solving {called(unit)}"
        kills = self._kills[unit] = self._kills.get(unit, 0) + 1
        if kills < _KILLS:
            self._suspects.append(unit)
            self._note(f"{told}; {called(unit)} will be tried again, alone")
            return []
        self.unfinished -= 1
        if len(unit) > 1:
            singles: list[Unit] = [(number,) for number in unit]
            self._kills.update(dict.fromkeys(singles, 0))  # known here, so each is sent alone
            self._suspects.extend(singles)
            self.unfinished += len(singles)
            self._note(f"{told}, for the second time; each of its rows will be tried alone")
            return []
        self._note(f"{told}, for the second time; {called(unit)} is quarantined")
        return [self._work.lost(unit[0], f"ended its worker twice{f' ({cause})' if cause else ''}")]

    def _hand(self, worker: str, units: list[Unit]) -> tuple[Unit, ...]:
        self._held[worker].extend(units)
        return tuple(units)

    def _enough(self, held: deque[Unit]) -> bool:
        if not held:
            return False
        if held[0] in self._kills or not self._recent or len(self._waiting) < len(self._held):
            return True
        mean = self._mean()
        return mean * len(held) > _LOW and (len(held) > 1 or mean > _LONG)

    def _size(self) -> int:
        """Units that take long enough, as far as is known; fewer towards the end, so that all workers end together."""
        if not self._recent:
            return 1
        wanted = math.ceil(_BATCH / max(self._mean(), 1e-9))
        return max(1, min(wanted, 2 * len(self._recent), len(self._waiting) // (2 * len(self._held))))

    def _mean(self) -> float:
        return sum(self._recent) / len(self._recent)
