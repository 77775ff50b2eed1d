"""Solutions of a square system of equations that Newton's method finds, box or no box."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tmsopt.program.nlp import NLP
from tmsopt.records import Array

_STEPS = 60
_STALLS = 3  # steps that may lead nowhere: some way on, a solution may still be met
_ULPS, _MOVES = 4, 8  # units in the last place, and how often, by which rounding is seen
_ISOLATED = 1e-9  # ratio of singular values below which a solution is one of a continuum, such as p = 0


def solutions(nlp: NLP, starts: Iterable[Array], mirrored: int) -> Iterator[Array]:
    """Isolated solutions of an NLP's equations, by damped Newton: what is found exists, but more may.

    From each start, and from its images with one of the first `mirrored` variables at a time of the other sign, where
    its physical range would forbid it. The same solution may come again. None unless the equations are square.
    """
    system = square_system(nlp)
    if system is None:
        return
    for start in starts:
        images = (np.where(np.arange(len(start)) == k, -start, start) for k in range(mirrored))
        for image in (start, *images):
            ended = newton(system, image)
            if ended is not None and ended.isolated:
                yield ended.x


def square_system(nlp: NLP) -> ca.Function | None:
    """x → the equations of an NLP, and their Jacobian; None unless there are as many as variables."""
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
        isolated: whether their Jacobian is regular there; else it may be one of a continuum, or of two that meet.
    """

    x: Array
    isolated: bool


def newton(system: ca.Function, x: Array) -> Zero | None:
    """A solution of the equations near a point, by damped steps, or None."""
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
            if stalls >= _STALLS:  # beside many factors, rounding of the residual is reached before that of x
                break
        x = x + damping * step
    return Zero(x, _regular(jacobian)) if residual <= 1e-11 * (1 + np.abs(x).max()) else None


def newton_step(system: ca.Function, x: Array) -> Zero:
    """A point that another method calls a solution, as it is."""
    return Zero(x, _regular(np.array(system(x)[1])))


def error(system: ca.Function, x: Array) -> Array:
    """How far each variable of a solution may be off: by what is left of the equations, and by their own rounding.

    The rounding is seen where the solution is moved by units in the last place, beside what slopes say; that of sums
    that swallow a small term is not, so one unit of the terms is counted besides.
    """
    value, jacobian = (np.array(part) for part in system(x))
    moves = np.random.default_rng(0).choice([-_ULPS, _ULPS], (_MOVES, len(x))) * np.finfo(float).eps * np.abs(x)
    noise = [np.abs(np.array(system(x + d)[0]) - value - jacobian @ d[:, None]) for d in moves]
    terms = np.finfo(float).eps * np.abs(jacobian) @ np.abs(x)[:, None]
    left = np.abs(value) + 2 * np.max(noise, axis=0) + terms
    off = np.abs(np.linalg.pinv(jacobian)) @ left
    return np.asarray(off.ravel() + np.finfo(float).eps * np.abs(x))


def _regular(jacobian: Array) -> bool:
    spread = np.linalg.svd(jacobian, compute_uv=False)
    return bool(spread[-1] > _ISOLATED * spread[0])
