"""Factors of the quartics that the closed form does not give: roots far apart, tiny or huge, or several at 0.

Each is taken in a unit near its largest root, by every way in turn until one is accepted: the closed form, the same
on the polynomial of 1/s, the splits that suit roots of very different size, and last companion eigenvalues. Monic
coefficients b1 … b4 and factors p1, q1, p2, q2 stand in arrays of shape (4, quartics).
"""

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Array
from tmsopt.roots.numeric import roots
from tmsopt.roots.quartics import factors

Rows = NDArray[np.int_]
Step = Callable[[Array, Array], Array]

GOOD = 4e-15
"""Backward error below which a Newton step is not worth its time."""
ACCEPTED = 5e-14
"""Backward error above which the next way to factor is tried."""
STEPS = 4
"""Newton steps on the closed form, of which one nearly always does."""

_LATE_STEPS = 10  # of Newton: the start need not be near
_SWEEPS = 5  # each gains as many digits as lie between the sizes of the roots
_NEAR = 1e-2  # backward error of a start that is worth the slow step


def hard_factors(c: Array) -> tuple[Array, Rows, int]:
    """Factors p1, q1, p2, q2 of quartics with coefficients of shape (5, quartics).

    Returns:
        The factors in units of 2^unit each, nan for coefficients that are not finite or a leading 0; the units; the
        number of quartics that took companion eigenvalues.
    """
    if not c.size:
        return np.empty((4, 0)), np.empty(0, dtype=int), 0
    with np.errstate(all="ignore"):
        regular = np.flatnonzero(np.all(np.isfinite(c), axis=0) & (c[0] != 0))
        unit = np.zeros(c.shape[1], dtype=int)
        monic, unit[regular] = in_unit(c[:, regular])
        found, error = np.full((4, regular.size), np.nan), np.full(regular.size, np.inf)
        for (take, most), way in product(((_newton_step, np.inf), (_balanced_step, _NEAR)), _WAYS):
            left = _not_accepted(error)
            if left.size:
                trial = way(monic[:, left])
                trial_error = factors.error(*monic[:, left], *trial)
                polish(monic[:, left], trial, trial_error, _LATE_STEPS, take, most)
                _keep(left, found, error, trial, trial_error)
        left = _not_accepted(error)
        if left.size:
            trial = _by_eigenvalues(monic[:, left])
            _keep(left, found, error, trial, factors.error(*monic[:, left], *trial))
        result = np.full((4, c.shape[1]), np.nan)
        result[:, regular] = found
    return result, unit, left.size


def in_unit(c: Array) -> tuple[Array, Rows]:
    """Monic coefficients in a unit 2^m near the largest root (Fujiwara), without rounding but for the division."""
    _, exponent = np.frexp(c)
    power = np.arange(1, 5)[:, None]
    above = np.where(c[1:] != 0, (exponent[1:] - exponent[0]) / power, -np.inf).max(axis=0)
    unit = np.where(np.isfinite(above), np.ceil(above), 0).astype(int)
    lead = np.ldexp(c[0], -exponent[0])
    return np.ldexp(c[1:], -exponent[0] - unit * power) / lead, unit


def _newton_step(monic: Array, found: Array) -> Array:
    return np.stack(factors.newton(*monic, *found))


def polish(
    monic: Array, found: Array, error: Array, steps: int, take: Step = _newton_step, most: float = np.inf
) -> None:
    """Newton steps, in place, on the columns that need them and whose error is not more than `most`, while it falls."""
    rows = np.flatnonzero((error > GOOD) & (error <= most))
    for _ in range(steps):
        if rows.size:
            trial = take(monic[:, rows], found[:, rows])
            left = factors.error(*monic[:, rows], *trial)
            better = left < error[rows]
            rows, left = rows[better], left[better]
            found[:, rows], error[rows] = trial[:, better], left
            rows = rows[left > GOOD]


def _balanced_step(monic: Array, found: Array) -> Array:
    """The shortest Newton step, slower: it keeps its digits where roots of one factor are far apart.

    Every coefficient is in units of its terms and every unknown in units of its own size.
    """
    p1, q1, p2, q2 = found
    one, zero = np.ones_like(p1), np.zeros_like(p1)
    jacobian = np.array([[one, zero, one, zero], [p2, one, p1, one], [q2, p2, q1, p1], [zero, q2, zero, q1]])
    residual = monic - np.stack([p1 + p2, q1 + q2 + p1 * p2, p1 * q2 + p2 * q1, q1 * q2])
    Q1, Q2 = np.abs(q1), np.abs(q2)
    P1, P2 = np.maximum(np.abs(p1), 2 * np.sqrt(Q1)), np.maximum(np.abs(p2), 2 * np.sqrt(Q2))
    unknown = np.stack([P1, Q1, P2, Q2])
    size = np.stack([P1 + P2, Q1 + Q2 + P1 * P2, P1 * Q2 + P2 * Q1, Q1 * Q2])
    size[size == 0] = 1.0
    balanced, target = jacobian * unknown / size[:, None], residual / size
    regular = np.all(np.isfinite(balanced), axis=(0, 1)) & np.all(np.isfinite(target), axis=0)
    balanced, target = np.where(regular, balanced, 0.0), np.where(regular, target, 0.0)
    step = np.linalg.pinv(np.moveaxis(balanced, -1, 0)) @ target.T[:, :, None]
    return np.asarray(found + step[:, :, 0].T * unknown)


def _not_accepted(error: Array) -> Rows:
    return np.flatnonzero(~(error <= ACCEPTED))


def _keep(rows: Rows, found: Array, error: Array, trial: Array, trial_error: Array) -> None:
    better = trial_error < error[rows]
    found[:, rows[better]], error[rows[better]] = trial[:, better], trial_error[better]


def _closed(b: Array) -> Array:
    """The closed form, and s² as a factor where it is one."""
    square = (b[2] == 0) & (b[3] == 0)
    zero = np.zeros_like(b[0])
    return np.where(square, np.stack([b[0], b[1], zero, zero]), np.stack(factors.start(*b)))


def _refitted(b: Array) -> Array:
    """The closed form, with the factor of the smaller roots refitted to the last coefficients."""
    p1, q1, p2, q2 = factors.start(*b)
    first = np.abs(q1) >= np.abs(q2)
    large = np.where(first, np.stack([p1, q1]), np.stack([p2, q2]))
    small = np.where(first, q2, q1)
    return np.stack([large[0], large[1], (b[2] - large[0] * small) / large[1], small])


def _reversed(b: Array) -> Array:
    """The closed form of the polynomial of 1/s, in a unit of its own: small roots are then large ones."""
    c, unit = in_unit(np.concatenate([b[::-1], np.ones_like(b[:1])]))
    p1, q1, p2, q2 = factors.start(*c)
    smaller, larger = factors.ordered(np.ldexp(1 / q1, -2 * unit), np.ldexp(1 / q2, -2 * unit), b[3])
    return np.stack([np.ldexp(p1 / q1, -unit), smaller, np.ldexp(p2 / q2, -unit), larger])


def _two_and_two(b: Array) -> Array:
    """Two large roots and two small ones: each coefficient is nearly one product, and gives one unknown at a time."""
    p1, q1, p2, q2 = b[0], b[1], b[2] / b[1], b[3] / b[1]
    for _ in range(_SWEEPS):
        p1 = b[0] - p2
        q1 = b[1] - q2 - p1 * p2
        q2 = b[3] / q1
        p2 = (b[2] - p1 * q2) / q1
    return np.stack([p1, q1, p2, q2])


def _one_two_one(b: Array) -> Array:
    """A large root and a small one, and two between them; likewise."""
    p1, q1, p2, q2 = b[0], b[0] * b[3] / b[2], b[1] / b[0], b[2] / b[0]
    for _ in range(_SWEEPS):
        p1 = b[0] - p2
        p2 = (b[1] - q1 - q2) / p1
        q2 = (b[2] - p2 * q1) / p1
        q1 = b[3] / q2
    return np.stack([p1, q1, p2, q2])


_WAYS: tuple[Callable[[Array], Array], ...] = (_closed, _refitted, _reversed, _two_and_two, _one_two_one)


def _by_eigenvalues(b: Array) -> Array:
    z = roots(np.concatenate([np.ones_like(b[:1]), b]).T).reshape(-1, 2, 2)
    p, q = -z.sum(axis=2).real, z.prod(axis=2).real
    return np.stack([p[:, 0], q[:, 0], p[:, 1], q[:, 1]])
