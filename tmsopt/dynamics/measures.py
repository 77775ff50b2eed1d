"""Peak, overshoot and settling time of a motion, refined between the points of the grid."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from tmsopt.dynamics.flow import evaluate_motion, sample_motion
from tmsopt.records import Array, plain

SETTLED = 0.02
"""Share of the peak within which a motion counts as settled."""

FINEST = 24  # points in a period of the fastest oscillation
_MIN_POINTS, MOST = 1024, 2**19  # fewest and most points of the grid
_EARLY_POINTS = 256  # additional points in the first step, in which fast roots decay
_NEAR_PEAK = 0.95  # share of the largest sample that a sample near the true peak exceeds


@dataclass(frozen=True)
class Measure:
    """Measures of one coordinate or torque over a whole motion; nan where a number does not exist.

    Attributes:
        name: such as ``delta``.
        peak: the value with the largest absolute value, with its sign.
        at: time of the peak.
        overshoot: largest later value with the opposite sign, as a share of the peak; 0 without such a value.
        settling: time after which the output stays within 2 % of the peak; nan if it never does, as for an unstable
            design.
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
class SampledMotion:
    """A motion at dense times: 24 in each period of the fastest oscillation, and more in the first step."""

    A: Array
    times: Array
    states: Array


def sample_grid(A: Array, x: Array, end: float, fastest: float, largest: float) -> SampledMotion:
    """Sample the motion up to a time.

    Args:
        fastest: greatest |Im s|.
        largest: greatest |s|.
    """
    count = int(min(max(FINEST * fastest * end / (2 * math.pi), _MIN_POINTS), MOST)) + 1
    step = end / (count - 1)
    times, states = np.linspace(0.0, end, count), sample_motion(A, x, step, count)
    if largest * step > 0.1:
        early = np.geomspace(0.01 / largest, step, _EARLY_POINTS, endpoint=False)
        times = np.concatenate([times[:1], early, times[1:]])
        states = np.concatenate([states[:1], evaluate_motion(A, x, early), states[1:]])
    return SampledMotion(A, times, states)


def measure_output(name: str, row: Array, motion: SampledMotion, settles: bool) -> Measure:
    """The measures of the output c x, by Brent's method on the exact motion between two points of the grid.

    Args:
        settles: whether the motion dies out within the grid.
    """
    slopes = motion.states @ motion.A.T @ row
    output = _Output(motion, row, motion.states @ row, np.flatnonzero(slopes[:-1] * slopes[1:] < 0))
    at, peak = max((output.find_extreme(sign) for sign in (1.0, -1.0)), key=lambda each: abs(each[1]))
    overshoot = max(0.0, -output.find_extreme(-math.copysign(1.0, peak), at)[1] / peak) if peak else 0.0
    return Measure(name, peak, at, overshoot, output.settling_time(SETTLED * abs(peak)) if settles else math.nan)


@dataclass(frozen=True)
class _Output:
    """An output c x on a grid; `turns` are the indices of points after which it has an extremum."""

    motion: SampledMotion
    row: Array
    values: Array
    turns: NDArray[np.intp]

    def find_extreme(self, sign: float, since: float = 0.0) -> tuple[float, float]:
        """Time and value of the largest sign · c x, at a point of the grid or at an exact extremum."""
        motion, turns = self.motion, self.turns[self.motion.times[self.turns + 1] > since]
        values = sign * np.where(motion.times >= since, self.values, 0.0)
        best_row = int(np.argmax(values))
        extremes = [(float(motion.times[best_row]), sign * float(values[best_row]))]
        is_near = np.maximum(values[turns], values[turns + 1]) >= _NEAR_PEAK * values[best_row]
        extremes += [self.find_turn(k) for k in turns[is_near] if values[best_row] > 0]
        return max(extremes, key=lambda each: sign * each[1])

    def find_turn(self, k: int) -> tuple[float, float]:
        """Time and value of the extremum of c x after point k of the grid."""
        A, state, time = self.motion.A, self.motion.states[k], self.motion.times[k]
        delay = _find_zero(partial(_evaluate_output, A, state, A.T @ self.row), self.motion.times[k + 1] - time)
        return float(time + delay), _evaluate_output(A, state, self.row, delay)

    def settling_time(self, limit: float) -> float:
        """Time at which |c x| is above the limit for the last time; nan if it is above the limit at the end."""
        motion, sizes = self.motion, np.abs(self.values)
        above = np.flatnonzero(sizes > limit)
        if not above.size:
            return 0.0
        last = int(above[-1])
        if last == len(sizes) - 1:
            return math.nan
        begin, state, end = motion.times[last], motion.states[last], motion.times[last + 1]
        for k in (k for k in self.turns if k >= last and max(sizes[k : k + 2]) > _NEAR_PEAK * limit):
            at, value = self.find_turn(k)
            if abs(value) > limit:
                begin, state, end = at, expm(motion.A * (at - motion.times[k])) @ motion.states[k], motion.times[k + 1]
        sign = math.copysign(1.0, float(self.row @ state))
        return float(
            begin + _find_zero(lambda s: sign * _evaluate_output(motion.A, state, self.row, s) - limit, end - begin)
        )


def _evaluate_output(A: Array, x: Array, row: Array, time: float) -> float:
    return float(row @ (expm(A * time) @ x))


def _find_zero(function: Any, end: float) -> float:
    """Zero of a function that changes sign between 0 and `end`.

    If rounding errors hide the change of sign, it is the end at which the function is smaller.
    """
    first, last = function(0.0), function(end)
    if first * last >= 0:
        return 0.0 if abs(first) <= abs(last) else end
    return float(brentq(function, 0.0, end, xtol=1e-15 * end, rtol=8.9e-16))
