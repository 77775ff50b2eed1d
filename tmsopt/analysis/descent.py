"""Finds a better design near a design that is not minimal, along a feasible direction of descent.

A straight line in the parameters is not enough. Near a root of multiplicity m, a step ε along the line violates the
equations of the factors by ε², which moves a root by ε^(2/m). Newton's method on the active rows follows the curve on
which they hold.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tmsopt.analysis.conditions import Conditions, curvature_sign
from tmsopt.analysis.program import LocalProgram
from tmsopt.evaluation.bound import minimizes_abscissa
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem.solution import Solution
from tmsopt.program.formulate import design_of
from tmsopt.records import Array, Table

_LONGEST_STEP = 0.05  # longest step, relative to the sizes of the variables
_STEP_RATIO = 4.0  # ratio of successive steps
_STEP_COUNT = 9  # number of steps; the shortest is 7e-7 of the sizes
_MAX_ITERATIONS = 12  # largest number of iterations of Newton's method
_MIN_IMPROVEMENT = 1e-9  # smallest improvement, relative to the objective, that is larger than rounding errors


@dataclass(frozen=True)
class BetterDesign:
    """A rechecked design with a better objective.

    Attributes:
        order: 1 if the objective improves to first order, 2 if it improves by its curvature.
    """

    parameters: Table[float]
    value: float
    order: int


def find_better_design(program: LocalProgram, conditions: Conditions, solution: Solution) -> BetterDesign | None:
    """The design after the longest step of descent that improves the objective; None if no step improves it."""
    problem, order = program.problem, 2 if curvature_sign(conditions.curvature) < 0 else 1
    reference = solution.abscissa if minimizes_abscissa(problem) else solution.value
    for x in _list_descent_points(program, conditions, has_both_signs=order == 2):
        values = dict(zip(program.variables, x.tolist(), strict=True))
        design = design_of(problem, [values.get(n, 0.0) for n in problem.free])
        design |= {n: solution.parameters[n] for n in problem.free if n not in values}
        checked = recheck(problem, parameters := problem.ordered(design))
        # the design must be better also with its parameters in double precision
        value = max(checked.objective, checked.abscissa_realised) if minimizes_abscissa(problem) else checked.objective
        if not checked.violations and problem.sign * (reference - value) > _MIN_IMPROVEMENT * (1 + abs(reference)):
            return BetterDesign(Table(parameters), value, order)
    return None


def _list_descent_points(program: LocalProgram, conditions: Conditions, has_both_signs: bool) -> Iterator[Array]:
    """Points along the direction of descent; the farthest point comes first."""
    jacobian = program.evaluate(program.x)[2]
    is_inequality = np.array([row.is_inequality for row in program.rows])
    direction = conditions.descent_direction / np.abs(conditions.descent_direction / program.sizes).max()
    for k in range(_STEP_COUNT):
        for sign in (1.0, -1.0) if has_both_signs else (1.0,):
            step = _LONGEST_STEP / _STEP_RATIO**k * sign * direction
            target = np.where(is_inequality, np.maximum(jacobian @ step, 0.0), 0.0)
            x = _restore_rows(program, program.x + step, target)
            if x is not None:
                yield x


def _restore_rows(program: LocalProgram, x: Array, target: Array) -> Array | None:
    """The nearest point at which the active rows have the target values, by Newton's method; None if it fails."""
    start = x
    for _ in range(_MAX_ITERATIONS):
        _, h, jacobian, _ = program.evaluate(x)
        if not np.all(np.isfinite(jacobian)):
            return None
        step = np.linalg.lstsq(jacobian * program.sizes, target - h, rcond=1e-12)[0] * program.sizes
        x = x + step
        if np.abs(step / program.sizes).max() <= 1e-15:
            break
    is_near = np.abs((x - start) / program.sizes).max() <= 2 * _LONGEST_STEP
    return x if is_near and np.all(np.isfinite(x)) else None
