"""Newton's method for the square systems of equations of a problem, inside the box or outside."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tmsopt.program import NLP
from tmsopt.records import Array

_STEPS = 60
_STALLS = 3  # steps without progress before Newton gives up
_ULPS, _MOVES = 4, 8  # size, in units in the last place, and number of the moves that measure rounding
_ISOLATED = 1e-9  # ratio of singular values below which the Jacobian counts as singular


def find_solutions(nlp: NLP, starts: Iterable[Array], mirrored: int) -> Iterator[Array]:
    """Isolated solutions of an NLP's equations, by damped Newton; there may be more.

    Newton starts from each start, and from its images with the sign of one of the first `mirrored` variables changed.
    The same solution may come again. Yields nothing unless the equations are square.
    """
    system = build_square_system(nlp)
    if system is None:
        return
    for start in starts:
        images = (np.where(np.arange(len(start)) == k, -start, start) for k in range(mirrored))
        for image in (start, *images):
            zero = find_zero(system, image)
            if zero is not None and zero.isolated:
                yield zero.x


def build_square_system(nlp: NLP) -> ca.Function | None:
    """A function x → equations of an NLP and their Jacobian; None unless there are as many as variables."""
    x = ca.SX.sym("x", len(nlp.variables))
    g = nlp.symbolic(x)[1]
    equalities = [k for k in range(len(nlp.rows)) if nlp.row_lower[k] == nlp.row_upper[k]]
    if len(equalities) != len(nlp.variables):
        return None
    equations = ca.vertcat(*[g[k] for k in equalities])
    return ca.Function("system", [x], [equations, ca.jacobian(equations, x)])


@dataclass(frozen=True)
class Zero:
    """A solution of the equations.

    Attributes:
        isolated: whether their Jacobian is regular there; else there may be a continuum, or two solutions that meet.
    """

    x: Array
    isolated: bool


def find_zero(system: ca.Function, x: Array) -> Zero | None:
    """A solution of the equations near a point, by damped Newton steps; None if it does not converge."""
    residual, stalls = np.inf, 0
    for _ in range(_STEPS):
        value, jacobian = (np.array(part) for part in system(x))
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
            if stalls >= _STALLS:  # with many factors, the residual reaches its rounding before x does
                break
        x = x + damping * step
    return Zero(x, _is_regular(jacobian)) if residual <= 1e-11 * (1 + np.abs(x).max()) else None


def make_zero(system: ca.Function, x: Array) -> Zero:
    """A `Zero` at a point that another method found."""
    return Zero(x, _is_regular(np.array(system(x)[1])))


def estimate_error(system: ca.Function, x: Array) -> Array:
    """Error of each variable of a solution: from the residual of the equations and from their rounding.

    The rounding is measured by moving the solution by a few units in the last place and subtracting the linear change.
    Sums that swallow a small term hide it, so one unit of the terms is added.
    """
    value, jacobian = (np.array(part) for part in system(x))
    moves = np.random.default_rng(0).choice([-_ULPS, _ULPS], (_MOVES, len(x))) * np.finfo(float).eps * np.abs(x)
    noise = [np.abs(np.array(system(x + d)[0]) - value - jacobian @ d[:, None]) for d in moves]
    terms = np.finfo(float).eps * np.abs(jacobian) @ np.abs(x)[:, None]
    residual = np.abs(value) + 2 * np.max(noise, axis=0) + terms
    errors = np.abs(np.linalg.pinv(jacobian)) @ residual
    return np.asarray(errors.ravel() + np.finfo(float).eps * np.abs(x))


def _is_regular(jacobian: Array) -> bool:
    singular_values = np.linalg.svd(jacobian, compute_uv=False)
    return bool(singular_values[-1] > _ISOLATED * singular_values[0])
