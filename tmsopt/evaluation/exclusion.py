"""Proves by interval arithmetic that no design in the box satisfies the limits."""

import math

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.evaluation.bound import instant_bound
from tmsopt.evaluation.recheck import FEASIBLE
from tmsopt.problem.limit import limit_side, limit_value
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Bound
from tmsopt.program.formulate import Builder

_MARGIN = 10 * FEASIBLE
"""Relative amount by which every design must miss a limit, so that no design within tolerance is excluded."""


def bound_without_search(problem: Posed, status: str = "infeasible", value: float = math.nan) -> Bound:
    """The bound on an optimum by `instant_bound`, or the proof that some limit is met nowhere in the box.

    Limits on single parameters first narrow the box, so that two contradictory limits are also found. Limits on the
    roots are ignored.
    """
    if status == "optimal":
        return instant_bound(problem, value)
    if status != "infeasible" or not problem.free or problem.locate or not _is_box_excluded(problem):
        return Bound()
    return Bound(-math.inf if problem.sense == "maximize" else math.inf, 0.0, True, "interval")


def _is_box_excluded(problem: Posed) -> bool:
    free = dict(problem.free)
    for name, condition in problem.conditions.items():
        text, parameter = problem.constraints[name], condition.names[0]
        if len(condition.names) > 1 or parameter not in free or condition.equality:
            continue
        (low, high), limit, side = free[parameter], limit_value(text), limit_side(text, parameter)
        if limit is not None and side:
            tolerance = problem.tolerances.get(parameter, 0.0)
            below = side * condition.sign > 0
            free[parameter] = (low, min(high, limit - tolerance)) if below else (max(low, limit + tolerance), high)
    if any(low > high + _MARGIN * max(1.0, abs(low), abs(high)) for low, high in free.values()):
        return True
    box = {n: (min(ends), max(ends)) for n, ends in free.items()}
    free_ranges = {n: ends for n, ends in box.items() if ends[0] < ends[1]}
    fixed = {**problem.fixed, **{n: ends[0] for n, ends in box.items() if n not in free_ranges}}
    build = Builder(problem.derive(free=free_ranges, fixed=fixed, start={}), problem.cases[:1])
    build.add_constraints(without=problem.asked_of_roots)
    if not build.rows:
        return False
    try:
        row_ranges = build.enclose([row[1] for row in build.rows])
    except UnsupportedOperation:
        return False
    return any(
        least > high + _MARGIN * max(1.0, abs(high)) or greatest < low - _MARGIN * max(1.0, abs(low))
        for (least, greatest), (_, _, low, high) in zip(row_ranges, build.rows, strict=True)
    )
