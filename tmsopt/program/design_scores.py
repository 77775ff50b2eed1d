"""Scores many designs at once, with arrays: the objective and the violation of each limit in the worst case."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.models.expression import Expression
from tmsopt.problem.dependence import WORSE_DIRECTION
from tmsopt.problem.evaluate import evaluate, find_root_quantities
from tmsopt.problem.problem import Posed
from tmsopt.records import Array

_RATIO = "damping_ratio"


@dataclass(frozen=True)
class DesignScores:
    """Worst-case values of designs, from numeric roots; near multiple roots they are approximate.

    Attributes:
        objective: the objective with its sign, so that smaller is better; nan for a design with a singular mass matrix
            or coefficients that are not finite; None for a problem without objective.
        signed_excess: excess over each limit, negative if the limit holds; for an equality, the left side minus the
            right side. Shape (limits, …).
        is_equality: whether a limit is an equality, shape (limits,).
    """

    objective: Array | None
    signed_excess: Array
    is_equality: NDArray[np.bool_]

    @property
    def excess(self) -> Array:
        """Violation of each limit, ≥ 0; inf for a limit whose value is not a number."""
        is_equality = self.is_equality.reshape(-1, *[1] * (self.signed_excess.ndim - 1))
        amount = np.where(is_equality, np.abs(self.signed_excess), np.maximum(self.signed_excess, 0.0))
        return np.where(np.isnan(amount), np.inf, amount)


def score_designs(problem: Posed, columns: Mapping[str, Array]) -> DesignScores:
    """Score designs by their worst cases.

    Args:
        columns: free parameter → values of the designs; all arrays have one shape.
    """
    shape = next(iter(columns.values())).shape
    nominal = problem.ordered(columns)
    cases = [case.applied(nominal) for case in problem.cases if not case.direction]
    parameters = nominal
    if cases:  # all cases are computed together, since small arrays cost as much as large ones
        varied_names = {n for p in cases for n in p if p[n] is not nominal[n]}
        parameters = nominal | {n: _stack_cases([p[n] for p in cases], len(shape)) for n in varied_names}
    shape_of_cases = (len(cases) or 1, *shape)
    conditions = list(problem.conditions.values())
    expressions = [e for e in (problem.objective, *conditions) if e]
    names = {n for e in expressions for n in e.names}
    has_roots, quantities = find_root_quantities(
        problem, parameters, {*names, "abscissa"} if _RATIO in names else names
    )
    has_dynamics, worst_values = np.broadcast_to(has_roots, shape_of_cases), {}
    for name, x in ((n, quantities[n]) for n in WORSE_DIRECTION if n in quantities):
        sign = WORSE_DIRECTION[name]
        worst_values[name] = sign * np.broadcast_to(sign * x, shape_of_cases).max(axis=0)
    values = dict(zip(expressions, evaluate(problem, expressions, parameters | worst_values), strict=True))
    equalities = [c for c in conditions if c.equality]
    if cases and equalities:  # an equality is required of the nominal design only
        values |= zip(equalities, evaluate(problem, equalities, nominal | worst_values), strict=True)

    def grade(e: Expression, sign: float) -> Array:
        return np.asarray(np.where(has_dynamics, _grade(e, sign, values[e], worst_values), np.nan).max(axis=0))

    return DesignScores(
        None if problem.objective is None else grade(problem.objective, problem.sign),
        np.array([grade(c, c.sign) for c in conditions]).reshape(len(conditions), *shape),
        np.array([c.equality for c in conditions], dtype=bool),
    )


def _grade(expression: Expression, sign: float, value: Array, worst_values: Mapping[str, Array]) -> Array:
    """The value with its sign, so that smaller is better, plus the abscissa for a damping ratio of −1.

    Every design with a positive real root has the damping ratio −1, so that only the abscissa can compare such designs.
    """
    grade = sign * value
    if expression.names != (_RATIO,) or expression.equality:
        return grade
    lowest, next_lowest = (sign * float(expression({_RATIO: ratio})) for ratio in (-1.0, -0.9))
    if next_lowest >= lowest or (expression.comparison and lowest <= 0):
        return grade
    return np.where(worst_values[_RATIO] <= -1, grade + worst_values["abscissa"], grade)


def _stack_cases(case_values: Sequence[Any], axis_count: int) -> Array:
    """The values of one parameter in all cases, stacked along a first axis."""
    return np.stack([x.reshape(x.shape or (1,) * axis_count) for x in np.broadcast_arrays(*case_values)])
