"""All solutions of a square system that Newton's method finds, box or no box: the algebraic branches."""

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.design.problem import Problem
from tmsopt.design.solution import Branch
from tmsopt.formulation.nlp import NLP
from tmsopt.formulation.starts import complete, designs
from tmsopt.records import Table

_STEPS = 60
_STALLS = 3  # steps that may lead nowhere: some way on, a solution may still be met
_SAME = 1e-6
_ISOLATED = 1e-9  # ratio of singular values below which a solution is one of a continuum, such as p = 0
_STARTS = 12


def other_branches(problem: Problem, nlp: NLP, found: Mapping[str, float]) -> tuple[Branch, ...]:
    """Solutions of the equations other than the one found, each with the bounds and rows that it violates.

    Damped Newton from a few designs and their mirror images outside the box: what it finds exists, but more may.
    """
    of = problem.parameter_set
    system = square_system(nlp)
    if system is None:
        return ()
    branches: list[Branch] = []
    known = [np.array([found[n] for n in problem.free])]
    for start in designs(problem, 0, _STARTS):
        origin = complete(nlp, problem, start)
        # The start, and with one free parameter at a time of the other sign, where its physical range would forbid it.
        images = (np.where(np.arange(len(origin)) == k, -origin, origin) for k in range(len(problem.free)))
        for mirrored in (origin, *images):
            ended = newton(system, mirrored)
            if ended is None or not ended.isolated:
                continue
            end = ended.x
            values = np.array([np.arctan(v) if of[n].tangent else v for n, v in zip(problem.free, end, strict=False)])
            if any(np.abs(values - k).max() <= _SAME * (1 + np.abs(k).max()) for k in known):
                continue
            known.append(values)
            parameters = problem.ordered(dict(zip(problem.free, values.tolist(), strict=True)))
            branches.append(Branch(Table(parameters), _excluded(problem, nlp, end, system)))
    return tuple(sorted(branches, key=lambda b: len(b.excluded_by)))


def square_system(nlp: NLP) -> ca.Function | None:
    """x → the equations of an NLP, their Jacobian and all rows; None unless there are as many as variables."""
    x = ca.SX.sym("x", len(nlp.variables))
    g = nlp.at(x)[1]
    equalities = [k for k in range(len(nlp.rows)) if nlp.row_lower[k] == nlp.row_upper[k]]
    if len(equalities) != len(nlp.variables):
        return None
    equations = ca.vertcat(*[g[k] for k in equalities])
    return ca.Function("system", [x], [equations, ca.jacobian(equations, x), g])


@dataclass(frozen=True)
class End:
    """A solution of the equations.

    Attributes:
        isolated: whether their Jacobian is regular there; else it may be one of a continuum, or of two that meet.
    """

    x: NDArray[np.float64]
    isolated: bool


def newton(system: ca.Function, x: NDArray[np.float64]) -> End | None:
    """A solution of the equations near a point, by damped steps, or None."""
    residual, stalls = np.inf, 0
    for _ in range(_STEPS):
        value, jacobian, _ = (np.array(part) for part in system(x))
        if not (np.all(np.isfinite(value)) and np.all(np.isfinite(jacobian))):
            return None
        residual = float(np.abs(value).max())
        step = np.linalg.lstsq(jacobian, -value.ravel(), rcond=None)[0]
        if np.abs(step).max() <= 1e-14 * (1 + np.abs(x).max()):
            break
        damping = 1.0
        while damping > 1e-3:
            trial = np.array(system(x + damping * step)[0])
            if np.all(np.isfinite(trial)) and np.abs(trial).max() < residual:
                break
            damping /= 2
        else:
            stalls += 1
            if stalls >= _STALLS:
                return None
        x = x + damping * step
    spread = np.linalg.svd(jacobian, compute_uv=False)
    isolated = spread[-1] > _ISOLATED * spread[0]
    return End(x, bool(isolated)) if residual <= 1e-11 * (1 + np.abs(x).max()) else None


def _excluded(problem: Problem, nlp: NLP, x: NDArray[np.float64], system: ca.Function) -> tuple[str, ...]:
    """Names of the bounds and inequality rows that a solution violates."""
    g = np.array(system(x)[2]).ravel()
    names = []
    for k, name in enumerate(problem.free):
        if x[k] < nlp.lower[k] - 1e-9:
            names.append(f"{name}.min")
        if x[k] > nlp.upper[k] + 1e-9:
            names.append(f"{name}.max")
    for k in range(len(problem.free), len(nlp.variables)):
        if x[k] < nlp.lower[k] - 1e-9 or x[k] > nlp.upper[k] + 1e-9:
            names.append(nlp.variables[k])
    for k, name in enumerate(nlp.rows):
        if g[k] < nlp.row_lower[k] - 1e-9 or g[k] > nlp.row_upper[k] + 1e-9:
            names.append(name)
    return tuple(dict.fromkeys(names))
