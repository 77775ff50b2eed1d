"""Many designs judged at once, by arrays: what they are worth and what they violate in their worst cases."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.design.dependence import WORSE
from tmsopt.design.expression import Expression
from tmsopt.design.problem import Problem
from tmsopt.design.quantities import ARRAY_ROOT_QUANTITIES
from tmsopt.models import Values
from tmsopt.records import Array

_FLAT = "damping_ratio"


@dataclass(frozen=True)
class Judged:
    """What designs are in their worst cases; numeric roots, so beside multiple ones a hint.

    Attributes:
        worth: the objective, larger is worse, nan where there is no motion to speak of; None without one.
        beyond: by how much each limit is passed, negative inside; of an equality, left minus right. Shape (limits, …).
        equal: which limits are equalities.
    """

    worth: Array | None
    beyond: Array
    equal: NDArray[np.bool_]

    @property
    def excess(self) -> Array:
        """By how much each limit is violated; inf where that does not exist."""
        equal = self.equal.reshape(-1, *[1] * (self.beyond.ndim - 1))
        amount = np.where(equal, np.abs(self.beyond), np.maximum(self.beyond, 0.0))
        return np.where(np.isnan(amount), np.inf, amount)


def judged(problem: Problem, columns: Mapping[str, Array]) -> Judged:
    """Judge designs.

    Args:
        columns: free parameter → values, all of one shape.
    """
    shape = next(iter(columns.values())).shape
    nominal = problem.ordered(columns)
    applied = [case.applied(nominal) for case in problem.cases if not case.direction]
    own, every = values_of(problem, nominal, shape), (len(applied) or 1, *shape)
    stacked = {n: np.stack([np.broadcast_to(p[n], shape) for p in applied or [nominal]]) for n in nominal}
    values = values_of(problem, stacked, every)  # all cases at once: one by one takes as often the time of small arrays
    conditions = list(problem.conditions.values())
    asked = [e for e in (problem.objective, *conditions) if e]
    for name, worst in WORSE.items():
        if len(applied) > 1 and any(name in e.names for e in asked):
            found = values[name].max(axis=0) if worst > 0 else values[name].min(axis=0)
            own.define(name, found)
            values.define(name, np.broadcast_to(found, every))
    moves = _moves(values, every).all(axis=0)
    worth = None
    if problem.objective is not None:
        goal = _graded(problem.objective, problem.sign, values, every)
        worth = np.where(moves, goal.max(axis=0), np.nan)
    beyond = [  # an equality is one of the nominal design
        c.sign * _evaluated(c, own, shape) if c.equality else _graded(c, c.sign, values, every).max(axis=0)
        for c in conditions
    ]
    equal = np.array([c.equality for c in conditions], dtype=bool)
    return Judged(worth, np.where(moves, np.stack(beyond), np.nan) if beyond else np.empty((0, *shape)), equal)


def _graded(asked: Expression, sign: float, values: Values, shape: tuple[int, ...]) -> Array:
    """What is asked, less is better; of the damping ratio alone, where that is −1, with the abscissa added.

    The ratio is −1 wherever a root is real and positive, so that nothing else tells how far a design is from better.
    """
    found = sign * _evaluated(asked, values, shape)
    if asked.names != (_FLAT,):
        return found
    at, above = (sign * float(asked({_FLAT: ratio})) for ratio in (-1.0, -0.9))
    if above >= at or (asked.comparison and at <= 0):
        return found
    return np.where(values[_FLAT] <= -1, found + values["abscissa"], found)


def values_of(problem: Problem, parameters: Mapping[str, Any], shape: tuple[int, ...]) -> Values:
    """Everything derived from designs, as arrays of one shape."""
    arrays = {name: np.broadcast_to(np.asarray(value, dtype=float), shape) for name, value in parameters.items()}
    return Values(problem.model, problem.parameter_set, arrays, extra=ARRAY_ROOT_QUANTITIES)


def _moves(values: Values, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Whether all coefficients exist, and the mass matrix is not singular: the recheck takes no other design."""
    a = [np.broadcast_to(np.asarray(c, dtype=float), shape) for c in values.coefficients]
    return np.asarray(np.isfinite(a).all(axis=0) & (a[0] != 0))


def _evaluated(expression: Expression, values: Values, shape: tuple[int, ...]) -> Array:
    return np.broadcast_to(np.asarray(expression(values), dtype=float), shape)
