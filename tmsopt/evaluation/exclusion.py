"""Proves by interval arithmetic that no design in the box satisfies the limits."""

import math

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.evaluation.bound import instant_bound
from tmsopt.evaluation.recheck import FEASIBILITY_TOLERANCE
from tmsopt.problem.limit import limit_side, limit_value
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Bound
from tmsopt.program.formulate import Builder

_MARGIN = 10 * FEASIBILITY_TOLERANCE
"""Relative amount by which every design must violate a limit, so that no design within tolerance is excluded."""


def bound_without_search(problem: Posed, status: str = "infeasible", value: float = math.nan) -> Bound:
    """The bound on an optimum by `instant_bound`, or the proof that no design in the box meets all limits.

    Limits on single parameters first narrow the box, so that two contradictory limits are also found. Limits on the
    roots are ignored. The bound is empty without a proof.
    """
    if status == "optimal":
        return instant_bound(problem, value)
    if status != "infeasible" or not problem.free or problem.locate or not _is_box_excluded(problem):
        return Bound()
    return Bound(-math.inf if problem.sense == "maximize" else math.inf, 0.0, True, "interval")


def _is_box_excluded(problem: Posed) -> bool:
    """Whether some limit is certainly violated everywhere in the box."""
    free = dict(problem.free)
    for name, condition in problem.conditions.items():
        text, parameter = problem.constraints[name], condition.names[0]
        if len(condition.names) > 1 or parameter not in free or condition.equality:
            continue
        (low, high), limit, side = free[parameter], limit_value(text), limit_side(text, parameter)
        if limit is not None and side:
            tolerance = problem.tolerances.get(parameter, 0.0)
            is_upper = side * condition.sign > 0
            free[parameter] = (low, min(high, limit - tolerance)) if is_upper else (max(low, limit + tolerance), high)
    if any(low > high + _MARGIN * max(1.0, abs(low), abs(high)) for low, high in free.values()):
        return True
    box = {n: (min(ends), max(ends)) for n, ends in free.items()}
    free_ranges = {n: ends for n, ends in box.items() if ends[0] < ends[1]}
    fixed = {**problem.fixed, **{n: ends[0] for n, ends in box.items() if n not in free_ranges}}
    build = Builder(problem.derive(free=free_ranges, fixed=fixed, start={}), problem.cases[:1])
    build.add_constraints(excluded=problem.asked_of_roots)
    if not build.rows:
        return False
    try:
        row_ranges = build.enclose([expression for _, expression, *_ in build.rows])
    except UnsupportedOperation:
        return False
    return any(
        least > upper + _MARGIN * max(1.0, abs(upper)) or greatest < lower - _MARGIN * max(1.0, abs(lower))
        for (least, greatest), (_, _, lower, upper) in zip(row_ranges, build.rows, strict=True)
    )
