"""Sub-problems of a front side by side: each knows what was met before its round, wherever it is solved."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from tmsopt.executor import Crash, EngineError, Executor, here, processes
from tmsopt.fronts.subproblems import FrontSolver, Workshop
from tmsopt.search.sample import REMEMBERED, SampleCache

AT_ONCE = 4
"""Sub-problems set at a time, at most, however many processes there are: what is asked next depends on them all."""

T = TypeVar("T")
R = TypeVar("R")


class Team:
    """Workers that solve sub-problems; to be closed.

    What comes out is the same for any number of them: each sub-problem starts from what was known when its round began,
    and what a round has met is put together in the order of its items.
    """

    def __init__(self, workers: int) -> None:
        self._executor: Executor = processes(workers) if workers > 1 else here()
        self._carry, self._known = _Carrier(), SampleCache()

    def __enter__(self) -> "Team":
        return self

    def __exit__(self, *error: object) -> None:
        self._executor.__exit__(*error)

    def each(
        self, function: Callable[[FrontSolver, T], R], ask: FrontSolver, items: Sequence[T]
    ) -> Iterator[tuple[int, R]]:
        """Places of the items with what the function makes of each, as they come.

        Raises:
            EngineError: an item ends every process that tries it.
        """
        met = dict[int, SampleCache]()
        tasks = [(function, ask, self._known, item) for item in items]
        with closing(self._executor.map(self._carry, tasks)) as answers:
            for place, answer in answers:
                if isinstance(answer, Crash):
                    raise EngineError(f"a sub-problem of the front ends its process ({answer.cause})")
                result, met[place] = answer
                yield place, result
        self._known = _joined(self._known, [met[place] for place in sorted(met)])


@dataclass(frozen=True)
class _Carrier:
    """What a process keeps from one sub-problem to the next, and how it solves one."""

    shop: Workshop = field(default_factory=Workshop)

    def __call__(
        self, task: tuple[Callable[[FrontSolver, T], R], FrontSolver, SampleCache, T]
    ) -> tuple[R, SampleCache]:
        """What comes of an item, and what was met on the way."""
        function, ask, known, item = task
        self.shop.know(known)
        result = function(replace(ask, shop=self.shop), item)
        return result, SampleCache(self.shop.known.refined, self.shop.known.leads)


def can_send(thing: Any) -> bool:
    """Whether another process can have it; a model of the user's own may be nothing that can be sent."""
    import cloudpickle

    try:
        cloudpickle.dumps(thing)
    except Exception:
        return False
    return True


def _joined(before: SampleCache, after: Sequence[SampleCache]) -> SampleCache:
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
    return SampleCache(refined, leads)
