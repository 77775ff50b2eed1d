"""Decides tasks by spatial branch and bound with SCIP; no other module calls SCIP."""

import math
import time

import numpy as np

from tmsopt.global_search.tasks import FOUND, INFEASIBLE, UNDECIDED, Decision, GlobalSolver, Task
from tmsopt.global_search.translation import FEASIBILITY, Translation

_MIN_SECONDS = 0.01  # least time limit
_MARGIN = 1e-6  # relative to a bound: error of the bound that the tolerances may cause


def prepare() -> None:
    """Load SCIP before the first task."""
    import pyscipopt  # noqa: F401


def decide(task: Task) -> Decision:
    """Decide a task.

    Raises:
        UnsupportedOperation: for an operation that SCIP does not support.
    """
    began = time.perf_counter()
    translation = Translation(task.nlp)
    if translation.is_impossible:
        return Decision(INFEASIBLE, bound=math.inf)
    model = translation.model
    for x, (lower, upper) in zip(translation.x, task.box, strict=False):
        model.chgVarLb(x.symbol, lower / x.scale)
        model.chgVarUb(x.symbol, upper / x.scale)
    if task.minimise:
        model.setObjective(translation.objective)
    else:
        model.setParam("limits/solutions", 1)
    model.setParam("limits/time", max(task.seconds - (time.perf_counter() - began), _MIN_SECONDS))
    model.setParam("numerics/feastol", FEASIBILITY)
    model.optimizeNogil()  # lets other threads notice that the parent process has ended
    status, has_point = model.getStatus(), model.getNSols() > 0
    point = np.array([model.getVal(x.symbol) * x.scale for x in translation.x]) if has_point else None
    bound = float(model.getDualbound())
    return Decision(
        verdict=INFEASIBLE if status == "infeasible" else FOUND if has_point else UNDECIDED,
        point=point,
        bound=math.inf if status == "infeasible" else bound - FEASIBILITY - _MARGIN * abs(bound),
        nodes=int(model.getNTotalNodes()),
    )


SCIP = GlobalSolver(
    name="SCIP",
    module="pyscipopt",
    install_message="PySCIPOpt is not installed; pip install 'tmsopt[certify]', "
    "from a checkout pip install '.[certify]'",
    tolerance=FEASIBILITY,
    prepare=prepare,
    decide=decide,
)
