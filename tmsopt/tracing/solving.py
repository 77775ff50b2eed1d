"""Finds zeros of equations and functions from many starts at once. The rows of an array are independent."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Array

_MAX_RESIDUAL = 1e-10  # largest relative residual of a solution; it excludes stationary points of the residual
_STEP_SHARES = 0.5 ** np.arange(10)  # shares of a Gauss–Newton step; the first share that reduces the residual is used
_MAX_STEPS = 40  # largest number of Gauss–Newton steps
_ZERO_ACCURACY = 1e-17  # accuracy of a zero near 0, relative to the interval
_END_RATIO = 1e-6  # an end is a zero if its value is below this share of the value at the opposite end
_EPS = 4 * np.finfo(float).eps  # accuracy of a zero, relative to its size
_MAX_HALVINGS = 100  # largest number of steps towards a zero


@np.errstate(over="ignore")
def project_rows(system: Any, y: Array, held_variables: Sequence[int | None]) -> Array:
    """Solutions near the rows of y by the damped Gauss–Newton method; nan where there is no solution.

    Args:
        system: y → any number of equations and their Jacobian.
        held_variables: for each row, the index of a variable that is held constant, or None.
    """
    y, solutions = y.copy(), np.full(y.shape, np.nan)
    is_free = np.array([[k != h for k in range(y.shape[1])] for h in held_variables], dtype=float)
    rows: NDArray[np.intp] = np.arange(len(y))
    for _ in range(_MAX_STEPS):
        value, jacobian = evaluate_rows(system, y[rows])
        is_finite = np.all(np.isfinite(value), axis=1) & np.all(np.isfinite(jacobian), axis=(1, 2))
        rows, value, jacobian = rows[is_finite], value[is_finite], jacobian[is_finite]
        if not rows.size:
            break
        points, size = y[rows], np.abs(value).max(axis=1)
        size_of_point = 1 + np.abs(points).max(axis=1)
        step = -np.linalg.pinv(jacobian * is_free[rows, None], rcond=1e-12) @ value[..., None]
        step = step[..., 0] * is_free[rows]
        has_stopped = np.abs(step).max(axis=1) <= 1e-13 * size_of_point
        is_solved = has_stopped & (size <= _MAX_RESIDUAL * np.abs(jacobian).max(axis=(1, 2)) * size_of_point)
        solutions[rows[is_solved]] = (points + step)[is_solved]
        undecided = np.flatnonzero(~has_stopped)
        for share in _STEP_SHARES:
            if undecided.size:
                trial = points[undecided] + share * step[undecided]
                value = evaluate_rows(system, trial)[0]
                is_lower = np.all(np.isfinite(trial), axis=1) & (np.abs(value).max(axis=1) < size[undecided])
                y[rows[undecided[is_lower]]] = trial[is_lower]
                undecided = undecided[~is_lower]
        solved_rows = undecided[size[undecided] <= 1e-13]
        solutions[rows[solved_rows]] = points[solved_rows]
        rows = np.delete(rows, [*np.flatnonzero(has_stopped), *undecided])
    return solutions


def find_zeros(function: Callable[[Array], Array], ends: Array) -> Array:
    """Zeros in many intervals [0, end] at once, by Chandrupatla's method; nan without a change of sign."""
    a, b = ends.astype(float), np.zeros(len(ends))
    fa, fb = function(a), function(b)
    zeros = np.where(np.abs(fa) < np.abs(fb), a, b)
    smaller_value, larger_value = np.sort(np.abs([fa, fb]), axis=0)
    zeros = np.where(smaller_value <= _END_RATIO * larger_value, zeros, np.nan)  # rounding may hide a zero at an end
    is_active = np.sign(fa) * np.sign(fb) < 0
    share = np.full(len(ends), 0.5)
    for _ in range(_MAX_HALVINGS):
        if not np.any(is_active):
            break
        x = a + share * (b - a)
        fx = function(x)
        has_same_sign = np.sign(fx) == np.sign(fa)  # a is the newest point, c the point before it
        c, fc = np.where(has_same_sign, a, b), np.where(has_same_sign, fa, fb)
        b, fb = np.where(has_same_sign, b, a), np.where(has_same_sign, fb, fa)
        a, fa = x, fx
        zeros = np.where(is_active, np.where(np.abs(fa) < np.abs(fb), a, b), zeros)
        with np.errstate(all="ignore"):
            min_share = (_ZERO_ACCURACY * np.abs(ends) + _EPS * np.abs(zeros)) / (2 * np.abs(b - a))
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            inverse = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            share = np.where((phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi), inverse, 0.5)
        is_active &= (min_share <= 0.5) & (fa != 0) & (fb != 0) & np.isfinite(share)
        share = np.where(is_active, np.clip(share, min_share, 1 - min_share), 0.0)
    return zeros


def evaluate_rows(system: Any, y: Array) -> tuple[Array, Array]:
    """Equations and Jacobians at the rows of y, shapes (rows, m) and (rows, m, n)."""
    value, jacobian = map_rows(system, y)
    return value, jacobian.reshape(*y.shape, value.shape[1]).transpose(0, 2, 1)


def map_rows(function: Any, *arguments: Array) -> list[Array]:
    """Evaluate a function of dense columns, or a Python function of arrays of rows, at every row of its arguments."""
    if not isinstance(function, ca.Function):
        rows: list[Array] = function(*arguments)
        return rows
    # a power of 2, so that few maps are made, since making one takes long
    count = 1 << max(len(arguments[0]) - 1, 0).bit_length()
    return MappedFunction(function, count)(*arguments)


class MappedFunction:
    """A function of dense columns at up to `count` rows, without the cost of converting its arguments."""

    def __init__(self, function: ca.Function, count: int) -> None:
        self._inputs = [np.zeros((count, function.numel_in(k))) for k in range(function.n_in())]
        self._outputs = [np.empty((count, function.numel_out(k))) for k in range(function.n_out())]
        buffer: Any
        buffer, self._call = _map_function(function, count).buffer()
        self._buffer = buffer  # keeps the memory alive
        for k, memory in enumerate(self._inputs):
            buffer.set_arg(k, memory.data)
        for k, memory in enumerate(self._outputs):
            buffer.set_res(k, memory.data)

    def __call__(self, *arguments: Array) -> list[Array]:
        """One array of results per output, with one row for each row of the arguments."""
        count = len(arguments[0])
        for memory, a in zip(self._inputs, arguments, strict=True):
            memory[:count] = a
        self._call()
        return [memory[:count].copy() for memory in self._outputs]


@lru_cache(maxsize=64)
def _map_function(function: ca.Function, count: int) -> ca.Function:
    return function.map(count) if count > 1 else function
