"""Zeros of equations and functions, for many starts at once; each row of an array is independent."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Array

_SOLVED = 1e-10  # largest relative residual of a solution; excludes stationary points of the residual
_DAMPING = 0.5 ** np.arange(10)  # shares of a Gauss–Newton step; the first that reduces the residual is taken
_STEPS = 40  # of Gauss–Newton at most
_FINE = 1e-17  # absolute accuracy, of the interval, for a zero near 0
_AT_END = 1e-6  # an end is a zero if its value is below this share of the value at the other end
_EPS = 4 * np.finfo(float).eps
_HALVINGS = 100  # steps towards a zero at most


@np.errstate(over="ignore")
def project_rows(system: ca.Function, y: Array, held: Sequence[int | None]) -> Array:
    """Solutions near the rows of y by damped Gauss–Newton, with one variable per row held or none; nan if none exists.

    `system` gives the equations, any number of them, and their Jacobian.
    """
    y, found = y.copy(), np.full(y.shape, np.nan)
    is_free = np.array([[k != h for k in range(y.shape[1])] for h in held], dtype=float)
    rows: NDArray[np.intp] = np.arange(len(y))
    for _ in range(_STEPS):
        value, jacobian = evaluate_rows(system, y[rows])
        proper = np.all(np.isfinite(value), axis=1) & np.all(np.isfinite(jacobian), axis=(1, 2))
        rows, value, jacobian = rows[proper], value[proper], jacobian[proper]
        if not rows.size:
            break
        here, size = y[rows], np.abs(value).max(axis=1)
        size_of_point = 1 + np.abs(here).max(axis=1)
        step = -np.linalg.pinv(jacobian * is_free[rows, None], rcond=1e-12) @ value[..., None]
        step = step[..., 0] * is_free[rows]
        has_stopped = np.abs(step).max(axis=1) <= 1e-13 * size_of_point
        is_solved = has_stopped & (size <= _SOLVED * np.abs(jacobian).max(axis=(1, 2)) * size_of_point)
        found[rows[is_solved]] = (here + step)[is_solved]
        left = np.flatnonzero(~has_stopped)
        for share in _DAMPING:
            if left.size:
                trial = here[left] + share * step[left]
                value = evaluate_rows(system, trial)[0]
                lower = np.all(np.isfinite(trial), axis=1) & (np.abs(value).max(axis=1) < size[left])
                y[rows[left[lower]]] = trial[lower]
                left = left[~lower]
        converged = left[size[left] <= 1e-13]
        found[rows[converged]] = here[converged]
        rows = np.delete(rows, [*np.flatnonzero(has_stopped), *left])
    return found


def find_zeros(function: Callable[[Array], Array], ends: Array) -> Array:
    """Zeros in many intervals [0, end] at once, by Chandrupatla's method; nan without a change of sign."""
    a, b = ends.astype(float), np.zeros(len(ends))
    fa, fb = function(a), function(b)
    found = np.where(np.abs(fa) < np.abs(fb), a, b)
    small, large = np.sort(np.abs([fa, fb]), axis=0)
    found = np.where(small <= _AT_END * large, found, np.nan)  # rounding may hide a zero at an end
    active = np.sign(fa) * np.sign(fb) < 0
    share = np.full(len(ends), 0.5)
    for _ in range(_HALVINGS):
        if not np.any(active):
            break
        x = a + share * (b - a)
        fx = function(x)
        kept = np.sign(fx) == np.sign(fa)  # a is the newest point, c the one before it
        c, fc = np.where(kept, a, b), np.where(kept, fa, fb)
        b, fb = np.where(kept, b, a), np.where(kept, fb, fa)
        a, fa = x, fx
        found = np.where(active, np.where(np.abs(fa) < np.abs(fb), a, b), found)
        with np.errstate(all="ignore"):
            limit = (_FINE * np.abs(ends) + _EPS * np.abs(found)) / (2 * np.abs(b - a))
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            inverse = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            share = np.where((phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi), inverse, 0.5)
        active &= (limit <= 0.5) & (fa != 0) & (fb != 0) & np.isfinite(share)
        share = np.where(active, np.clip(share, limit, 1 - limit), 0.0)
    return found


def evaluate_rows(system: ca.Function, y: Array) -> tuple[Array, Array]:
    """Equations and Jacobians at the rows of y, shapes (rows, m) and (rows, m, n)."""
    value, jacobian = map_rows(system, y)
    return value, jacobian.reshape(*y.shape, value.shape[1]).transpose(0, 2, 1)


def map_rows(function: ca.Function, *arguments: Array) -> list[Array]:
    """A function of dense columns at every row of its arguments."""
    room = 1 << max(len(arguments[0]) - 1, 0).bit_length()  # few sizes, since making a map is costly
    return MappedFunction(function, room)(*arguments)


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
        """One array of results per output, a row per row of the arguments."""
        count = len(arguments[0])
        for memory, a in zip(self._inputs, arguments, strict=True):
            memory[:count] = a
        self._call()
        return [memory[:count].copy() for memory in self._outputs]


@lru_cache(maxsize=64)
def _map_function(function: ca.Function, count: int) -> ca.Function:
    return function.map(count) if count > 1 else function
