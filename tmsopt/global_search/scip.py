"""The one caller of SCIP: tasks in, decisions by spatial branch and bound out."""

import math
import time

import numpy as np

from tmsopt.global_search.tasks import FOUND, INFEASIBLE, UNDECIDED, Decision, GlobalSolver, Task
from tmsopt.global_search.translation import FEASIBILITY, Translation

_LEAST = 0.01  # seconds
_MARGIN = 1e-6  # relative, for what tolerances do to a bound


def prepare() -> None:
    """Load SCIP before the first task."""
    import pyscipopt  # noqa: F401


def decide(asked: Task) -> Decision:
    """Branch and bound.

    Raises:
        UnsupportedOperation: for an operation that cannot be written for SCIP.
    """
    began = time.perf_counter()
    translated = Translation(asked.nlp)
    if translated.impossible:
        return Decision(INFEASIBLE, bound=math.inf)
    model = translated.model
    for x, (lower, upper) in zip(translated.x, asked.within, strict=False):
        model.chgVarLb(x.symbol, lower / x.scale)
        model.chgVarUb(x.symbol, upper / x.scale)
    if asked.least:
        model.setObjective(translated.objective)
    else:
        model.setParam("limits/solutions", 1)
    model.setParam("limits/time", max(asked.seconds - (time.perf_counter() - began), _LEAST))
    model.setParam("numerics/feastol", FEASIBILITY)
    model.optimizeNogil()  # other threads of the process may see that there is nobody left to answer to
    status, found = model.getStatus(), model.getNSols() > 0
    point = np.array([model.getVal(x.symbol) * x.scale for x in translated.x]) if found else None
    bound = float(model.getDualbound())
    return Decision(
        verdict=INFEASIBLE if status == "infeasible" else FOUND if found else UNDECIDED,
        point=point,
        bound=math.inf if status == "infeasible" else bound - FEASIBILITY - _MARGIN * abs(bound),
        nodes=int(model.getNTotalNodes()),
    )


SCIP = GlobalSolver(
    name="SCIP",
    module="pyscipopt",
    missing="PySCIPOpt is not installed; pip install 'tmsopt[certify]', from a checkout pip install '.[certify]'",
    tolerance=FEASIBILITY,
    prepare=prepare,
    decide=decide,
)
