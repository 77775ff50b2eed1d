"""Newton's method for square systems of equations; solutions may lie outside the box."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tmsopt.program import NLP
from tmsopt.records import Array

_MAX_STEPS = 60
_MAX_STALLED_STEPS = 3  # steps without progress, after which the iteration stops
_MOVE_ULPS = 4  # size of the moves that measure rounding errors, in units in the last place
_MOVE_COUNT = 8  # number of these moves
_SINGULAR = 1e-9  # the Jacobian counts as singular if smallest/largest singular value is below this


def find_solutions(nlp: NLP, starts: Iterable[Array], mirrored_count: int) -> Iterator[Array]:
    """Yield isolated solutions of an NLP's equations, found by damped Newton steps; it may miss solutions.

    The steps begin at each start, and at its images with the sign of one of the first `mirrored_count` variables
    changed. A solution may be yielded more than once. Unless there are as many equations as variables, nothing is
    yielded.
    """
    system = build_square_system(nlp)
    if system is None:
        return
    for start in starts:
        images = (np.where(np.arange(len(start)) == k, -start, start) for k in range(mirrored_count))
        for image in (start, *images):
            zero = find_zero(system, image)
            if zero is not None and zero.is_isolated:
                yield zero.x


def build_square_system(nlp: NLP) -> ca.Function | None:
    """Return a function x → (equations of an NLP, their Jacobian); None unless there is one equation per variable."""
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
        is_isolated: whether the Jacobian is regular there; if not, solutions may form a continuum, or two may coincide.
    """

    x: Array
    is_isolated: bool


def find_zero(system: ca.Function, x: Array) -> Zero | None:
    """Find a solution of the equations near a point by damped Newton steps; None if they do not converge."""
    residual, stalled_steps = np.inf, 0
    for _ in range(_MAX_STEPS):
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
            stalled_steps += 1
            if (
                stalled_steps >= _MAX_STALLED_STEPS
            ):  # with many factors, the residual reaches its rounding error before x does
                break
        x = x + damping * step
    return Zero(x, _is_regular(jacobian)) if residual <= 1e-11 * (1 + np.abs(x).max()) else None


def make_zero(system: ca.Function, x: Array) -> Zero:
    """A `Zero` at a point that another method found."""
    return Zero(x, _is_regular(np.array(system(x)[1])))


def estimate_error(system: ca.Function, x: Array) -> Array:
    """Estimate the error of each variable of a solution from the residual of the equations and their rounding error.

    The solution is moved by a few units in the last place. The change of the equations minus the linear change is their
    rounding error. This shows no error where a large term absorbs a small one, so one unit of each term is added.
    """
    value, jacobian = (np.array(part) for part in system(x))
    units = np.random.default_rng(0).choice([-_MOVE_ULPS, _MOVE_ULPS], (_MOVE_COUNT, len(x)))
    moves = units * np.finfo(float).eps * np.abs(x)
    noise = [np.abs(np.array(system(x + d)[0]) - value - jacobian @ d[:, None]) for d in moves]
    terms = np.finfo(float).eps * np.abs(jacobian) @ np.abs(x)[:, None]
    residual = np.abs(value) + 2 * np.max(noise, axis=0) + terms
    errors = np.abs(np.linalg.pinv(jacobian)) @ residual
    return np.asarray(errors.ravel() + np.finfo(float).eps * np.abs(x))


def _is_regular(jacobian: Array) -> bool:
    singular_values = np.linalg.svd(jacobian, compute_uv=False)
    return bool(singular_values[-1] > _SINGULAR * singular_values[0])
