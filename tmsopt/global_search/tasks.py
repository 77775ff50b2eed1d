"""What a global solver is: the tasks that it is given, what it decides, and what it is called.

`scip` is one; another stands beside it, and `certify` says who is asked.
"""

import importlib.util
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tmsopt.program.nlp import NLP

INFEASIBLE, FOUND, UNDECIDED = "infeasible", "found", "undecided"


class Failed(RuntimeError):
    """What a global solver raised, in one line: an error of the solver or of its installation, and no decision."""


@dataclass(frozen=True)
class Decision:
    """What branch and bound came to.

    Attributes:
        verdict: ``infeasible``, ``found``, or ``undecided`` when time ran out.
        point: of the NLP, where one was found.
        bound: no feasible point has a lesser objective, if that was asked.
    """

    verdict: str
    point: NDArray[np.float64] | None = None
    bound: float = -math.inf
    nodes: int = 0


@dataclass(frozen=True)
class Task:
    """What a global solver is asked.

    Attributes:
        nlp: its functions, and the ranges of variables and rows; nothing else of it is to be read.
        least: whether for the least objective; else for any feasible point.
        within: limits for the first variables, narrower than their ranges.
    """

    nlp: NLP
    seconds: float
    least: bool = False
    within: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class GlobalSolver:
    """A solver that decides tasks by branch and bound, in a process of its own.

    Attributes:
        name: in reports, and in small letters the method of its bounds.
        module: to be imported.
        missing: what to say where that is not there.
        tolerance: by which it may be off in a row; 0 for exact arithmetic.
        prepare: called once in its process, before the first task.
        decide: raises UnsupportedOperation for an operation that it cannot take.
    """

    name: str
    module: str
    missing: str
    tolerance: float
    prepare: Callable[[], None]
    decide: Callable[[Task], Decision]

    @property
    def available(self) -> bool:
        """Whether it is installed."""
        return importlib.util.find_spec(self.module) is not None


def task(nlp: NLP, seconds: float, *, least: bool = False, within: tuple[tuple[float, float], ...] = ()) -> Task:
    """An NLP as a task: whether it has any feasible point, or a bound on its objective."""
    bare = replace(nlp, lifts=(), contacts={}, products=(), cases=())  # the rest cannot always be pickled
    return Task(bare, seconds, least, within)
