"""The interface of a global solver: its tasks, its decisions and its name.

`scip` implements it; `stability.SOLVER` selects the solver in use.
"""

import importlib.util
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tmsopt.program.nlp import NLP

INFEASIBLE, FOUND, UNDECIDED = "infeasible", "found", "undecided"


class SolverFailed(RuntimeError):
    """A global solver, or its installation, raised an error and decided nothing; the message is one line."""


@dataclass(frozen=True)
class Decision:
    """The outcome of branch and bound.

    Attributes:
        verdict: ``infeasible``, ``found``, or ``undecided`` if time ran out.
        point: a feasible point of the NLP, if one was found.
        bound: lower bound on the objective, if the task minimises.
        nodes: number of nodes of the search tree.
    """

    verdict: str
    point: NDArray[np.float64] | None = None
    bound: float = -math.inf
    nodes: int = 0


@dataclass(frozen=True)
class Task:
    """A task for a global solver.

    Attributes:
        nlp: only its functions, and the ranges of its variables and rows, are used.
        seconds: time limit.
        minimise: whether to find the least objective; otherwise any feasible point is enough.
        box: narrower ranges for the first variables.
    """

    nlp: NLP
    seconds: float
    minimise: bool = False
    box: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class GlobalSolver:
    """A solver that decides tasks by branch and bound in a separate process.

    Attributes:
        name: its name in reports; in lower case, the `method` of its bounds.
        module: the Python module that it needs.
        install_message: the message if that module is not installed.
        tolerance: feasibility tolerance of a row; 0 for exact arithmetic.
        prepare: called once in the process, before the first task.
        decide: decides a task; raises UnsupportedOperation for an unsupported operation.
    """

    name: str
    module: str
    install_message: str
    tolerance: float
    prepare: Callable[[], None]
    decide: Callable[[Task], Decision]

    @property
    def is_available(self) -> bool:
        """Whether its module is installed."""
        return importlib.util.find_spec(self.module) is not None


def make_task(nlp: NLP, seconds: float, *, minimise: bool = False, box: tuple[tuple[float, float], ...] = ()) -> Task:
    """Make a task from the parts of an NLP that a solver reads; these can always be pickled."""
    return Task(replace(nlp, lifts=(), contacts={}, products=(), cases=()), seconds, minimise, box)
