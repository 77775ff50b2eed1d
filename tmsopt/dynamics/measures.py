"""What an engineer reads off a motion: peak, overshoot, settling time, refined so that no step of a grid is in them."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from tmsopt.dynamics.flow import at_times, sampled
from tmsopt.records import Array, plain

SETTLED = 0.02
"""Share of the peak within which a motion counts as settled."""

FINEST, _LEAST, MOST = 24, 1024, 2**19  # points of a period of the fastest oscillation; points of a grid
_EARLY = 256  # further points before the first of the grid, where fast roots die out
_NEAR = 0.95  # of the largest sample: a peak between samples may be that much larger


@dataclass(frozen=True)
class Measure:
    """Of one coordinate or torque over a whole motion; nan where there is no such number.

    Attributes:
        name: such as ``delta``.
        peak: the value that is largest in size, with its sign.
        at: when that is.
        overshoot: after it, the largest excursion to the other side of 0, as a share of the peak; 0 if none.
        settling: from when on it stays within 2 % of its peak; nan where it does not, as of a design that is not
            stable.
    """

    name: str
    peak: float
    at: float
    overshoot: float
    settling: float

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        return plain(self)


@dataclass(frozen=True)
class Watched:
    """A motion at times that miss nothing: 24 in a period of the fastest oscillation, and closer ones at the start."""

    A: Array
    times: Array
    states: Array


def grid(A: Array, x: Array, end: float, fastest: float, largest: float) -> Watched:
    """The motion up to a time.

    Args:
        fastest: greatest |Im s|.
        largest: greatest |s|.
    """
    count = int(min(max(FINEST * fastest * end / (2 * math.pi), _LEAST), MOST)) + 1
    step = end / (count - 1)
    times, states = np.linspace(0.0, end, count), sampled(A, x, step, count)
    if largest * step > 0.1:
        early = np.geomspace(0.01 / largest, step, _EARLY, endpoint=False)
        times = np.concatenate([times[:1], early, times[1:]])
        states = np.concatenate([states[:1], at_times(A, x, early), states[1:]])
    return Watched(A, times, states)


def measured(name: str, row: Array, on: Watched, settles: bool) -> Measure:
    """The measures of the output c x; Brent's method on the exact motion between two points of the grid.

    Args:
        settles: whether the motion dies out within the grid.
    """
    slopes = on.states @ on.A.T @ row
    output = _Output(on, row, on.states @ row, np.flatnonzero(slopes[:-1] * slopes[1:] < 0))
    at, peak = max((output.largest(sign) for sign in (1.0, -1.0)), key=lambda each: abs(each[1]))
    overshoot = max(0.0, -output.largest(-math.copysign(1.0, peak), at)[1] / peak) if peak else 0.0
    return Measure(name, peak, at, overshoot, output.settling(SETTLED * abs(peak)) if settles else math.nan)


@dataclass(frozen=True)
class _Output:
    """An output c x at the points of a grid, and the points between which and the next it turns."""

    on: Watched
    row: Array
    values: Array
    turns: NDArray[np.intp]

    def largest(self, sign: float, since: float = 0.0) -> tuple[float, float]:
        """Time and value of the greatest sign · c x: at a point of the grid, or at a turn, found exactly."""
        on, turns = self.on, self.turns[self.on.times[self.turns + 1] > since]
        values = sign * np.where(on.times >= since, self.values, 0.0)
        best = int(np.argmax(values))
        found = [(float(on.times[best]), sign * float(values[best]))]
        near = np.maximum(values[turns], values[turns + 1]) >= _NEAR * values[best]
        found += [self.turn(k) for k in turns[near] if values[best] > 0]
        return max(found, key=lambda each: sign * each[1])

    def turn(self, k: int) -> tuple[float, float]:
        """Time and value where c x turns between two points of the grid."""
        A, state, time = self.on.A, self.on.states[k], self.on.times[k]
        own = _zero(partial(_after, A, state, A.T @ self.row), self.on.times[k + 1] - time)
        return float(time + own), _after(A, state, self.row, own)

    def settling(self, within: float) -> float:
        """When |c x| was above the limit for the last time; nan where it still is at the end."""
        on, sizes = self.on, np.abs(self.values)
        above = np.flatnonzero(sizes > within)
        if not above.size:
            return 0.0
        last = int(above[-1])
        if last == len(sizes) - 1:
            return math.nan
        begin, state, end = on.times[last], on.states[last], on.times[last + 1]
        for k in (k for k in self.turns if k >= last and max(sizes[k : k + 2]) > _NEAR * within):
            at, value = self.turn(k)
            if abs(value) > within:
                begin, state, end = at, expm(on.A * (at - on.times[k])) @ on.states[k], on.times[k + 1]
        sign = math.copysign(1.0, float(self.row @ state))
        return float(begin + _zero(lambda s: sign * _after(on.A, state, self.row, s) - within, end - begin))


def _after(A: Array, x: Array, row: Array, time: float) -> float:
    return float(row @ (expm(A * time) @ x))


def _zero(function: Any, end: float) -> float:
    """Of a function that changes its sign between 0 and `end`; the end that is nearer 0 where rounding hides that."""
    first, last = function(0.0), function(end)
    if first * last >= 0:
        return 0.0 if abs(first) <= abs(last) else end
    return float(brentq(function, 0.0, end, xtol=1e-15 * end, rtol=8.9e-16))
