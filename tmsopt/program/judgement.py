"""Many designs judged at once, by arrays: what they are worth and what they violate in their worst cases."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.models import Values
from tmsopt.problem.dependence import WORSE_DIRECTION
from tmsopt.problem.expression import Expression
from tmsopt.problem.problem import Posed
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


def evaluate(problem: Posed, columns: Mapping[str, Array]) -> Judged:
    """Judge designs.

    Args:
        columns: free parameter → values, all of one shape.
    """
    shape = next(iter(columns.values())).shape
    nominal = problem.ordered(columns)
    applied = [case.applied(nominal) for case in problem.cases if not case.direction] or [nominal]
    every = (len(applied), *shape)
    # All cases at once: one by one takes as often the time of small arrays. What is one number stays one.
    values = problem.columns({n: _stacked([p[n] for p in applied], len(shape)) for n in nominal})
    conditions = list(problem.conditions.values())
    asked = [e for e in (problem.objective, *conditions) if e]
    worst_of: dict[str, Array] = {}
    for name, worst in WORSE_DIRECTION.items():
        if len(applied) > 1 and any(name in e.names for e in asked):
            found = np.broadcast_to(values[name], every)
            worst_of[name] = found.max(axis=0) if worst > 0 else found.min(axis=0)
    values = values.with_known({n: np.broadcast_to(worst, every) for n, worst in worst_of.items()})
    moves = _moves(values, every).all(axis=0)
    worth = None
    if problem.objective is not None:
        goal = _graded(problem.objective, problem.sign, values, every)
        worth = np.where(moves, goal.max(axis=0), np.nan)
    equal = np.array([c.equality for c in conditions], dtype=bool)
    own = values_of(problem, nominal, shape) if equal.any() else values  # an equality is one of the nominal design
    own = own.with_known(worst_of) if own is not values else values
    beyond = [
        c.sign * _evaluated(c, own, shape) if c.equality else _graded(c, c.sign, values, every).max(axis=0)
        for c in conditions
    ]
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


def values_of(problem: Posed, parameters: Mapping[str, Any], shape: tuple[int, ...]) -> Values:
    """Everything derived from designs, as arrays of one shape."""
    return problem.columns({n: np.broadcast_to(np.asarray(x, dtype=float), shape) for n, x in parameters.items()})


def _stacked(each: Sequence[Any], axes: int) -> Array:
    """A parameter in all cases, along a first axis, as far as it differs; broadcast together these give all designs."""
    first = np.asarray(each[0], dtype=float)
    if all(x is each[0] for x in each):
        return first.reshape(1, *(first.shape or (1,) * axes))
    return np.stack([x.reshape(x.shape or (1,) * axes) for x in np.broadcast_arrays(first, *each[1:])])


def _moves(values: Values, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Whether all coefficients exist, and the mass matrix is not singular: the recheck takes no other design."""
    a = [np.broadcast_to(np.asarray(c, dtype=float), shape) for c in values.coefficients]
    return np.asarray(np.isfinite(a).all(axis=0) & (a[0] != 0))


def _evaluated(expression: Expression, values: Values, shape: tuple[int, ...]) -> Array:
    return np.broadcast_to(np.asarray(expression(values), dtype=float), shape)
