"""Whether limits alone exclude every design of a box: by interval arithmetic, in no time and without a tolerance."""

import math

from tmsopt.algebra.formula import NotAccepted
from tmsopt.evaluation.bound import instant_bound
from tmsopt.evaluation.recheck import FEASIBLE
from tmsopt.problem.limit import limit_of, limit_side
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Bound
from tmsopt.program.formulate import Builder

_BEYOND = 10 * FEASIBLE
"""Relative to a limit, by which every design must miss it: what counts as met is never excluded."""


def known_bound(problem: Posed, status: str = "infeasible", value: float = math.nan) -> Bound:
    """What needs no search: how good an optimum is at best, or that some limit is met nowhere in the box.

    The box is what limits on parameters alone leave of the ranges, so two of these that exclude each other do, too.
    Limits on the roots are left aside.
    """
    if status == "optimal":
        return instant_bound(problem, value)
    if status != "infeasible" or not problem.free or problem.locate or not _excluded(problem):
        return Bound()
    return Bound(-math.inf if problem.sense == "maximize" else math.inf, 0.0, True, "interval")


def _excluded(problem: Posed) -> bool:
    free = dict(problem.free)
    for name, condition in problem.conditions.items():
        text, parameter = problem.constraints[name], condition.names[0]
        if len(condition.names) > 1 or parameter not in free or condition.equality:
            continue
        (low, high), limit, side = free[parameter], limit_of(text), limit_side(text, parameter)
        if limit is not None and side:
            off = problem.tolerances.get(parameter, 0.0)
            below = side * condition.sign > 0
            free[parameter] = (low, min(high, limit - off)) if below else (max(low, limit + off), high)
    if any(low > high + _BEYOND * max(1.0, abs(low), abs(high)) for low, high in free.values()):
        return True
    box = {n: (min(ends), max(ends)) for n, ends in free.items()}
    inside = {n: ends for n, ends in box.items() if ends[0] < ends[1]}
    fixed = {**problem.fixed, **{n: ends[0] for n, ends in box.items() if n not in inside}}
    build = Builder(problem.derive(free=inside, fixed=fixed, start={}), problem.cases[:1])
    build.add_constraints(without=problem.asked_of_roots)
    if not build.rows:
        return False
    try:
        found = build.enclose([row[1] for row in build.rows])
    except NotAccepted:
        return False
    return any(
        least > high + _BEYOND * max(1.0, abs(high)) or most < low - _BEYOND * max(1.0, abs(low))
        for (least, most), (_, _, low, high) in zip(found, build.rows, strict=True)
    )
