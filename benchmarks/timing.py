"""Times taken side by side, how they grow, the runs of IPOPT in them, and work over processes."""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any
from unittest.mock import patch

import casadi as ca
import numpy as np

from tmsopt.executor import in_process, processes
from tmsopt.program import forget_solvers


def best(works: Mapping[str, Callable[[], Any]], repeats: int) -> dict[str, float]:
    """Least seconds of each work over some rounds; all take turns, so that what slows one down slows all of them."""
    seconds = dict.fromkeys(works, math.inf)
    for _ in range(repeats):
        for name, work in works.items():
            began = time.perf_counter()
            work()
            seconds[name] = min(seconds[name], time.perf_counter() - began)
    return seconds


def over_processes(work: Callable[[Any], Any], items: Sequence[Any], workers: int) -> Iterator[Any]:
    """The answers in order, from processes that end when this one is interrupted; of one worker from this one."""
    # Processes take a second to begin.
    with in_process() if workers == 1 or not items else processes(workers) as executor:
        answers, ready = executor.map(work, items), dict[int, Any]()
        for place in range(len(items)):
            while place not in ready:
                ready.update([next(answers)])
            yield ready.pop(place)


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """p of the least-squares fit seconds ~ size^p; nan for fewer than two sizes."""
    known = [(n, s) for n, s in zip(sizes, seconds, strict=True) if math.isfinite(s)]
    if len(known) < 2:
        return math.nan
    n, s = np.log(np.array(known)).T
    return float(np.polyfit(n, s, 1)[0])


def quantile(numbers: Iterable[float], q: float = 0.5) -> float:
    """By default the median; nan of none."""
    found = list(numbers)
    return float(np.quantile(found, q)) if found else math.nan


@dataclass(frozen=True)
class IpoptRun:
    """A run of IPOPT that was made.

    Attributes:
        evaluations: of the objective.
        again: makes the same run once more, and nothing else.
    """

    seconds: float
    evaluations: int
    again: Callable[[], Any]


@contextmanager
def ipopt_runs() -> Iterator[list[IpoptRun]]:
    """Note every run of IPOPT in this thread; solvers are built anew."""
    runs: list[IpoptRun] = []
    forget_solvers()
    made_by: Any = ca.nlpsol

    class Noted:
        def __init__(self, *given: Any) -> None:
            self._solver = made_by(*given)

        def __call__(self, **given: Any) -> Any:
            began = time.perf_counter()
            answer = self._solver(**given)
            seconds = time.perf_counter() - began
            evaluations = int(self._solver.stats().get("n_call_nlp_f", 0))
            runs.append(IpoptRun(seconds, evaluations, partial(self._solver, **given)))
            return answer

        def __getattr__(self, name: str) -> Any:
            return getattr(self._solver, name)

    with patch.object(ca, "nlpsol", Noted):
        yield runs
    forget_solvers()
