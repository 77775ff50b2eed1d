"""A better design beside one that is not minimal: along the way that its conditions leave open, kept to exactly.

A straight line in the parameters will not do: beside a root of multiplicity m it strays from the factors by ε², which
throws a root off by ε^(2/m). The way is followed by Newton's method on what is held.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tmsopt.analysis.conditions import Conditions, curved
from tmsopt.analysis.program import LocalProgram
from tmsopt.evaluation.bound import minimizes_abscissa
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem.solution import Solution
from tmsopt.program.formulate import design_of
from tmsopt.records import Array, Table

_FIRST = 0.05  # of the sizes of the variables: the longest step
_SHORTER = 4.0
_STEPS = 9  # the shortest is 7e-7 of the sizes
_NEWTON = 12
_BETTER = 1e-9  # of the objective: what a feasible point may owe to rounding


@dataclass(frozen=True)
class Better:
    """A design with a better objective, rechecked.

    Attributes:
        order: whether the way falls to first order, or by its curvature.
    """

    parameters: Table[float]
    value: float
    order: int


def better(program: LocalProgram, found: Conditions, solution: Solution) -> Better | None:
    """The design after the longest step downhill that improves; None where none does."""
    problem, order = program.problem, 2 if curved(found.curvature) < 0 else 1
    judged = solution.abscissa if minimizes_abscissa(problem) else solution.value
    for x in _along(program, found, both=order == 2):
        at = dict(zip(program.variables, x.tolist(), strict=True))
        moved = design_of(problem, [at.get(n, 0.0) for n in problem.free])
        moved |= {n: solution.parameters[n] for n in problem.free if n not in at}
        checked = recheck(problem, parameters := problem.ordered(moved))
        value = (
            max(checked.objective, checked.realised) if minimizes_abscissa(problem) else checked.objective
        )  # true as stored, too
        if not checked.violations and problem.sign * (judged - value) > _BETTER * (1 + abs(judged)):
            return Better(Table(parameters), value, order)
    return None


def _along(program: LocalProgram, found: Conditions, both: bool) -> Iterator[Array]:
    """Points on the way, the farthest first."""
    jacobian = program.at(program.x)[2]
    signed = np.array([held.signed for held in program.held])
    direction = found.downhill / np.abs(found.downhill / program.sizes).max()
    for k in range(_STEPS):
        for side in (1.0, -1.0) if both else (1.0,):
            step = _FIRST / _SHORTER**k * side * direction
            target = np.where(signed, np.maximum(jacobian @ step, 0.0), 0.0)
            x = _corrected(program, program.x + step, target)
            if x is not None:
                yield x


def _corrected(program: LocalProgram, x: Array, target: Array) -> Array | None:
    """The nearest point at which what is held has given values, by Newton's method; None where it fails."""
    start = x
    for _ in range(_NEWTON):
        _, h, jacobian, _ = program.at(x)
        if not np.all(np.isfinite(jacobian)):
            return None
        step = np.linalg.lstsq(jacobian * program.sizes, target - h, rcond=1e-12)[0] * program.sizes
        x = x + step
        if np.abs(step / program.sizes).max() <= 1e-15:
            break
    near = np.abs((x - start) / program.sizes).max() <= 2 * _FIRST
    return x if near and np.all(np.isfinite(x)) else None
