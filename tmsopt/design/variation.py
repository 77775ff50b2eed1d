"""Whether an expression differs between the cases of a problem."""

from collections.abc import Sequence

import numpy as np

from tmsopt.design.cases import Case
from tmsopt.design.expression import Expression
from tmsopt.design.problem import Problem
from tmsopt.design.quantities import ROOT_NAMES

_DESIGNS = 4


def varies(problem: Problem, expression: Expression, cases: Sequence[Case]) -> bool:
    """Whether the value of an expression changes with the case, its root quantities aside; equalities do not count.

    Those are shared by all cases, as the worst of them; an equality is one of the nominal design, for it cannot hold
    at two corners of a box. Decided by numbers: a quantity that no case changes is the same to the last bit.
    """
    varied = [case for case in cases if not case.direction]
    if not varied or expression.comparison == "==" or not set(expression.names) - set(ROOT_NAMES):
        return False
    rng = np.random.default_rng(0)
    ends = np.array([problem.free[n] for n in problem.free]).reshape(-1, 2)
    for _ in range(_DESIGNS):
        drawn = dict(zip(problem.free, rng.uniform(*ends.T).tolist(), strict=True))
        parameters = problem.ordered(drawn)
        values = [problem.values(p) for p in (parameters, *(c.applied(parameters) for c in varied))]
        for value in values:
            for name in ROOT_NAMES:
                value.define(name, -1.0)
        found = np.array([float(expression(v)) for v in values])
        if np.any((found != found[0]) & ~(np.isnan(found) & np.isnan(found[0]))):
            return True
    return False
