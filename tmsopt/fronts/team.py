"""Sub-problems of a front side by side: in this process, and in others that know what this one knows."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

import numpy as np

from tmsopt.fronts.subproblems import Asker, Workshop
from tmsopt.processes import Inbox, Worker
from tmsopt.solver.sample import REMEMBERED, Met

AT_ONCE = 4
"""Sub-problems set at a time, at most, however many processes there are: what is asked next depends on them all."""

_UNBEGUN = 2  # answers that a process owes which has not begun to work: that it has, and one more
_LOOK = 1.0  # s; some systems do not hear Ctrl-C while they wait

T = TypeVar("T")
R = TypeVar("R")


@dataclass(eq=False)
class _Beside:
    """A process beside this one.

    Attributes:
        queue: the places of what it is to answer, in its order; None for what is not waited for any more.
        ready: whether it has begun to work.
    """

    worker: Worker
    queue: list[int | None]
    ready: bool = False


class Team:
    """This process and others beside it; to be closed.

    What comes out is the same for any number of them: each sub-problem starts from what was known when its round began,
    and what a round has met is put together in the order of its items.
    """

    def __init__(self, processes: int) -> None:
        self._inbox: Inbox = SimpleQueue()
        self._beside = [_Beside(Worker(self._inbox, apart=True), [None]) for _ in range(processes - 1)]
        self._shop, self._known = Workshop(), Met()
        for other in self._beside:
            other.worker.send(_begun)

    def __enter__(self) -> "Team":
        return self

    def __exit__(self, *_: object) -> None:
        while self._beside:
            self._beside.pop().worker.end()

    def each(self, function: Callable[[Asker, T], R], ask: Asker, items: Sequence[T]) -> Generator[tuple[int, R]]:
        """Places of the items with what the function makes of each, as they come."""
        left, met = list(range(len(items))), dict[int, Met]()
        share = max(1, len(items) // (1 + len(self._beside)))
        for other in self._beside:  # of a round that was not ended
            other.queue = [None] * len(other.queue)
        while len(met) < len(items):
            for other in self._beside:
                while len(left) > 1 and len(other.queue) < (share if other.ready else _UNBEGUN):
                    if not self._told(other, left[-1], function, ask, self._known, items[left[-1]]):
                        left += self._given_up()
                        break
                    left.pop()
            if not left and not self._working():
                for other in self._beside:  # what has not even begun to work is not waited for
                    left += [k for k in other.queue if k is not None]
                    other.queue = [None] * len(other.queue)
            if left:
                k = left.pop(0)
                result, met[k] = _carried(function, ask, self._known, items[k], self._shop)
                yield k, result
            for place, answer in self._heard(wait=not left and self._working()):
                if place is None:
                    continue
                if answer is None:  # the process has ended; what it was to do is done here
                    left.append(place)
                else:
                    result, met[place] = answer
                    yield place, result
        self._known = _joined(self._known, [met[k] for k in sorted(met)])

    def _working(self) -> bool:
        return any(other.ready and any(k is not None for k in other.queue) for other in self._beside)

    def _told(self, other: _Beside, place: int, *task: Any) -> bool:
        try:
            other.worker.send(_carried, *task)
        except Exception:  # a model of the user's own may be nothing that can be sent
            return False
        other.queue.append(place)
        return True

    def _given_up(self) -> list[int]:
        """End the processes beside this one; the places of what they owed."""
        owed = [k for other in self._beside for k in other.queue if k is not None]
        self.__exit__()
        return owed

    def _heard(self, wait: bool) -> Generator[tuple[int | None, Any]]:
        """Places with the answers that have come; at least one, where there is one to wait for."""
        while True:
            try:
                worker, answer = self._inbox.get(wait, _LOOK)
            except Empty:
                if wait:
                    continue
                return
            other = next((other for other in self._beside if other.worker is worker), None)
            if other is None:
                continue
            other.ready, wait = True, False
            if answer is None:
                self._beside.remove(other)
                worker.end()
                yield from ((place, None) for place in other.queue)
            else:
                yield other.queue.pop(0), answer


_SHOP = Workshop()  # of a process beside


def _begun() -> bool:
    return True


def _joined(before: Met, after: Sequence[Met]) -> Met:
    """What was met before a round and in it: new designs first; of new leads those that were found first."""
    refined = dict(before.refined)
    for place in dict.fromkeys(place for met in after for place in met.refined):
        old = {u.tobytes(): u for u in before.refined.get(place, ())}
        every = {u.tobytes(): u for met in after for u in met.refined.get(place, ())}
        refined[place] = np.array([*(u for key, u in every.items() if key not in old), *old.values()][:REMEMBERED])
    leads = {box: dict(found) for box, found in before.leads.items()}
    for box, pattern in ((box, pattern) for met in after for box, found in met.leads.items() for pattern in found):
        every_lead = (met.leads.get(box, {}).get(pattern, []) for met in (before, *after))
        leads.setdefault(box, {})[pattern] = max(every_lead, key=len)
    return Met(refined, leads)


def _carried(
    function: Callable[[Asker, T], R], ask: Asker, known: Met, item: T, shop: Workshop = _SHOP
) -> tuple[R, Met]:
    """What comes of an item, and what was met on the way."""
    shop.know(known)
    result = function(replace(ask, shop=shop), item)
    return result, Met(shop.known.refined, shop.known.leads)
