"""Many designs judged at once, by arrays: what they are worth and what they violate in their worst cases."""

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


def judge(problem: Posed, columns: Mapping[str, Array]) -> Judged:
    """Judge designs.

    Args:
        columns: free parameter → values, all of one shape.
    """
    shape = next(iter(columns.values())).shape
    nominal = problem.ordered(columns)
    listed = [case.applied(nominal) for case in problem.cases if not case.direction]
    varied = nominal
    if listed:  # all cases at once: one by one takes as often the time of small arrays
        moved = {n for p in listed for n in p if p[n] is not nominal[n]}
        varied = nominal | {n: _stacked([p[n] for p in listed], len(shape)) for n in moved}
    every = (len(listed) or 1, *shape)
    conditions = list(problem.conditions.values())
    asked = [e for e in (problem.objective, *conditions) if e]
    a, names = coefficients_of(problem, varied), {n for e in asked for n in e.names}
    # All coefficients exist, and the mass matrix is not singular: the recheck takes no other design.
    moves = np.broadcast_to(reduce(np.logical_and, map(np.isfinite, a), a[0] != 0), every)
    worst = {}
    for name, x in roots_of(a, {*names, "abscissa"} if _FLAT in names else names).items():
        sign = WORSE_DIRECTION[name]
        worst[name] = sign * np.broadcast_to(sign * x, every).max(axis=0)
    found = dict(zip(asked, evaluate(problem, asked, varied | worst), strict=True))
    equal = [c for c in conditions if c.equality]
    if listed and equal:  # an equality is one of the nominal design
        found |= zip(equal, evaluate(problem, equal, nominal | worst), strict=True)

    def graded(e: Expression, sign: float) -> Array:
        return np.asarray(np.where(moves, _graded(e, sign, found[e], worst), np.nan).max(axis=0))

    return Judged(
        None if problem.objective is None else graded(problem.objective, problem.sign),
        np.array([graded(c, c.sign) for c in conditions]).reshape(len(conditions), *shape),
        np.array([c.equality for c in conditions], dtype=bool),
    )


def _graded(asked: Expression, sign: float, value: Array, worst: Mapping[str, Array]) -> Array:
    """What is asked, less is better; of the damping ratio alone, where that is −1, with the abscissa added.

    The ratio is −1 wherever a root is real and positive, so that nothing else tells how far a design is from better.
    """
    found = sign * value
    if asked.names != (_FLAT,) or asked.equality:
        return found
    at, above = (sign * float(asked({_FLAT: ratio})) for ratio in (-1.0, -0.9))
    if above >= at or (asked.comparison and at <= 0):
        return found
    return np.where(worst[_FLAT] <= -1, found + worst["abscissa"], found)


def _stacked(each: Sequence[Any], axes: int) -> Array:
    """A parameter in all cases, along a first axis; broadcast together these give all designs."""
    return np.stack([x.reshape(x.shape or (1,) * axes) for x in np.broadcast_arrays(*each)])
