"""Solves sub-problems of a front in parallel; each is independent of the others."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from functools import partial
from typing import Any, TypeVar

from tmsopt.executor import Crash, EngineError, Executor
from tmsopt.fronts.subproblems import FrontSolver

MAX_PARALLEL = 4
"""Most sub-problems at a time, for any number of processes, since the next ones depend on all results."""

T = TypeVar("T")
R = TypeVar("R")


def map_items(
    executor: Executor, function: Callable[[FrontSolver, T], R], solver: FrontSolver, items: Sequence[T]
) -> Iterator[tuple[int, R]]:
    """Yield the index of each item with its result, as they finish; the same for any number of workers.

    Raises:
        EngineError: if an item ends every process that tries it.
    """
    with closing(executor.map(partial(function, solver), items)) as answers:
        for place, answer in answers:
            if isinstance(answer, Crash):
                raise EngineError(f"a sub-problem of the front ends its process ({answer.cause})")
            yield place, answer


def can_pickle(thing: Any) -> bool:
    """Whether an object can be sent to another process; a user's model may not."""
    import cloudpickle

    try:
        cloudpickle.dumps(thing)
    except Exception:
        return False
    return True
