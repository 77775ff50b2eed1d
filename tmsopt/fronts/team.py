"""Sub-problems of a front side by side: each is solved as if it were the only one, wherever it is solved."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from functools import partial
from typing import Any, TypeVar

from tmsopt.executor import Crash, EngineError, Executor
from tmsopt.fronts.subproblems import FrontSolver

AT_ONCE = 4
"""Sub-problems set at a time, at most, however many processes there are: what is asked next depends on them all."""

T = TypeVar("T")
R = TypeVar("R")


def each(
    team: Executor, function: Callable[[FrontSolver, T], R], ask: FrontSolver, items: Sequence[T]
) -> Iterator[tuple[int, R]]:
    """Places of the items with what the function makes of each, as they come.

    They are the same for any number of workers: no sub-problem knows what another has met.

    Raises:
        EngineError: an item ends every process that tries it.
    """
    with closing(team.map(partial(function, ask), items)) as answers:
        for place, answer in answers:
            if isinstance(answer, Crash):
                raise EngineError(f"a sub-problem of the front ends its process ({answer.cause})")
            yield place, answer


def can_send(thing: Any) -> bool:
    """Whether another process can have it; a model of the user's own may be nothing that can be sent."""
    import cloudpickle

    try:
        cloudpickle.dumps(thing)
    except Exception:
        return False
    return True
