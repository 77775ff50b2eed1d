"""The one caller of SCIP: tasks in, decisions by spatial branch and bound out."""

import importlib.util
import math
import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tmsopt.certificates.translation import FEASIBILITY, translate
from tmsopt.formulation.nlp import NLP

_LEAST = 0.01  # seconds
_MARGIN = 1e-6  # relative, for what tolerances do to a bound

INFEASIBLE, FOUND, UNDECIDED = "infeasible", "found", "undecided"


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
    """What SCIP is asked.

    Attributes:
        least: whether for the least objective; else for any feasible point.
        within: limits for the first variables, narrower than their ranges.
    """

    nlp: NLP
    seconds: float
    least: bool = False
    within: tuple[tuple[float, float], ...] = ()


def available() -> bool:
    """Whether SCIP is installed."""
    return importlib.util.find_spec("pyscipopt") is not None


def prepare() -> None:
    """Load SCIP before the first task."""
    import pyscipopt  # noqa: F401


def task(nlp: NLP, seconds: float, *, least: bool = False, within: tuple[tuple[float, float], ...] = ()) -> Task:
    """An NLP for SCIP: whether it has any feasible point, or a bound on its objective."""
    bare = replace(nlp, lifts=(), touches={}, products=(), cases=())  # what SCIP does not need cannot always be pickled
    return Task(bare, seconds, least, within)


def decide(asked: Task) -> Decision:
    """Branch and bound.

    Raises:
        NotAccepted: for an operation that cannot be written for SCIP.
    """
    began = time.perf_counter()
    translated = translate(asked.nlp)
    if translated.impossible:
        return Decision(INFEASIBLE, bound=math.inf)
    model = translated.model
    for (symbol, scale), (lower, upper) in zip(translated.variables, asked.within, strict=False):
        model.chgVarLb(symbol, lower / scale)
        model.chgVarUb(symbol, upper / scale)
    if asked.least:
        model.setObjective(translated.objective)
    else:
        model.setParam("limits/solutions", 1)
    model.setParam("limits/time", max(asked.seconds - (time.perf_counter() - began), _LEAST))
    model.setParam("numerics/feastol", FEASIBILITY)
    model.optimizeNogil()  # other threads of the process may see that there is nobody left to answer to
    status, found = model.getStatus(), model.getNSols() > 0
    point = np.array([model.getVal(symbol) * scale for symbol, scale in translated.variables]) if found else None
    bound = float(model.getDualbound())
    return Decision(
        verdict=INFEASIBLE if status == "infeasible" else FOUND if found else UNDECIDED,
        point=point,
        bound=math.inf if status == "infeasible" else bound - FEASIBILITY - _MARGIN * abs(bound),
        nodes=int(model.getNTotalNodes()),
    )
