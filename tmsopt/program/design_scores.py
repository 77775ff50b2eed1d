"""Scores many designs at once, by arrays: the objective and the violation of each limit in the worst case."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.models.expression import Expression
from tmsopt.problem.dependence import WORSE_DIRECTION
from tmsopt.problem.evaluate import coefficients_of, evaluate, roots_of
from tmsopt.problem.problem import Posed
from tmsopt.records import Array

_FLAT = "damping_ratio"


@dataclass(frozen=True)
class DesignScores:
    """Worst-case values of designs, from numeric roots; near multiple roots they are approximate.

    Attributes:
        worth: the objective, larger is worse, nan for a design without dynamics; None for a problem without objective.
        beyond: excess over each limit, negative if it holds; for an equality, left minus right. Shape (limits, …).
        equal: which limits are equalities.
    """

    worth: Array | None
    beyond: Array
    equal: NDArray[np.bool_]

    @property
    def excess(self) -> Array:
        """Violation of each limit; inf where the limit has no value."""
        equal = self.equal.reshape(-1, *[1] * (self.beyond.ndim - 1))
        amount = np.where(equal, np.abs(self.beyond), np.maximum(self.beyond, 0.0))
        return np.where(np.isnan(amount), np.inf, amount)


def score_designs(problem: Posed, columns: Mapping[str, Array]) -> DesignScores:
    """Score designs.

    Args:
        columns: free parameter → values, all of one shape.
    """
    shape = next(iter(columns.values())).shape
    nominal = problem.ordered(columns)
    listed = [case.applied(nominal) for case in problem.cases if not case.direction]
    varied = nominal
    if listed:  # all cases at once, since small arrays cost as much as large ones
        moved = {n for p in listed for n in p if p[n] is not nominal[n]}
        varied = nominal | {n: _stack_cases([p[n] for p in listed], len(shape)) for n in moved}
    every = (len(listed) or 1, *shape)
    conditions = list(problem.conditions.values())
    expressions = [e for e in (problem.objective, *conditions) if e]
    a, names = coefficients_of(problem, varied), {n for e in expressions for n in e.names}
    # As in the recheck, all coefficients must be finite and the mass matrix nonsingular.
    moves = np.broadcast_to(reduce(np.logical_and, map(np.isfinite, a), a[0] != 0), every)
    worst = {}
    for name, x in roots_of(a, {*names, "abscissa"} if _FLAT in names else names).items():
        sign = WORSE_DIRECTION[name]
        worst[name] = sign * np.broadcast_to(sign * x, every).max(axis=0)
    found = dict(zip(expressions, evaluate(problem, expressions, varied | worst), strict=True))
    equal = [c for c in conditions if c.equality]
    if listed and equal:  # an equality holds for the nominal design
        found |= zip(equal, evaluate(problem, equal, nominal | worst), strict=True)

    def grade(e: Expression, sign: float) -> Array:
        return np.asarray(np.where(moves, _grade(e, sign, found[e], worst), np.nan).max(axis=0))

    return DesignScores(
        None if problem.objective is None else grade(problem.objective, problem.sign),
        np.array([grade(c, c.sign) for c in conditions]).reshape(len(conditions), *shape),
        np.array([c.equality for c in conditions], dtype=bool),
    )


def _grade(expressions: Expression, sign: float, value: Array, worst: Mapping[str, Array]) -> Array:
    """The signed value, less is better; the abscissa is added where a damping ratio alone is −1.

    The ratio is −1 for every design with a positive real root, so only the abscissa then tells designs apart.
    """
    found = sign * value
    if expressions.names != (_FLAT,) or expressions.equality:
        return found
    at, above = (sign * float(expressions({_FLAT: ratio})) for ratio in (-1.0, -0.9))
    if above >= at or (expressions.comparison and at <= 0):
        return found
    return np.where(worst[_FLAT] <= -1, found + worst["abscissa"], found)


def _stack_cases(each: Sequence[Any], axes: int) -> Array:
    """A parameter in all cases, along a first axis."""
    return np.stack([x.reshape(x.shape or (1,) * axes) for x in np.broadcast_arrays(*each)])
