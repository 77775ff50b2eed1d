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

POINTS_PER_PERIOD = 24  # number of points in a period of the fastest oscillation
_MIN_GRID_POINTS = 1024  # smallest number of points of the grid
MAX_GRID_POINTS = 2**19  # largest number of points of the grid
_EARLY_POINTS = 256  # number of additional points in the first step, in which fast roots decay
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
    """A motion at dense times: about 24 in each period of the fastest oscillation, and more in the first step."""

    A: Array
    times: Array
    states: Array


def sample_grid(A: Array, x: Array, end: float, max_frequency: float, max_root_size: float) -> SampledMotion:
    """Sample the motion up to a time.

    Args:
        max_frequency: largest |Im s|.
        max_root_size: largest |s|.
    """
    step_count = POINTS_PER_PERIOD * max_frequency * end / (2 * math.pi)
    count = int(min(max(step_count, _MIN_GRID_POINTS), MAX_GRID_POINTS)) + 1
    step = end / (count - 1)
    times, states = np.linspace(0.0, end, count), sample_motion(A, x, step, count)
    if max_root_size * step > 0.1:
        early_times = np.geomspace(0.01 / max_root_size, step, _EARLY_POINTS, endpoint=False)
        times = np.concatenate([times[:1], early_times, times[1:]])
        states = np.concatenate([states[:1], evaluate_motion(A, x, early_times), states[1:]])
    return SampledMotion(A, times, states)


def measure_output(name: str, row: Array, motion: SampledMotion, has_died_out: bool) -> Measure:
    """The measures of the output c x, by Brent's method on the exact motion between two points of the grid.

    Args:
        has_died_out: whether the motion has died out when the grid ends.
    """
    slopes = motion.states @ motion.A.T @ row
    output = _Output(motion, row, motion.states @ row, np.flatnonzero(slopes[:-1] * slopes[1:] < 0))
    peak_time, peak = max((output.find_largest(sign) for sign in (1.0, -1.0)), key=lambda extremum: abs(extremum[1]))
    overshoot = max(0.0, -output.find_largest(-math.copysign(1.0, peak), peak_time)[1] / peak) if peak else 0.0
    return Measure(
        name, peak, peak_time, overshoot, output.settling_time(SETTLED * abs(peak)) if has_died_out else math.nan
    )


@dataclass(frozen=True)
class _Output:
    """An output c x on a grid; `extrema`: indices of the points after which the output has an extremum."""

    motion: SampledMotion
    row: Array
    values: Array
    extrema: NDArray[np.intp]

    def find_largest(self, sign: float, since: float = 0.0) -> tuple[float, float]:
        """Time and value of the largest sign · c x, at a point of the grid or at an exact extremum."""
        motion, indices = self.motion, self.extrema[self.motion.times[self.extrema + 1] > since]
        values = sign * np.where(motion.times >= since, self.values, 0.0)
        best_row = int(np.argmax(values))
        candidates = [(float(motion.times[best_row]), sign * float(values[best_row]))]
        is_near = np.maximum(values[indices], values[indices + 1]) >= _NEAR_PEAK * values[best_row]
        candidates += [self.locate_extremum(k) for k in indices[is_near] if values[best_row] > 0]
        return max(candidates, key=lambda extremum: sign * extremum[1])

    def locate_extremum(self, k: int) -> tuple[float, float]:
        """Time and value of the extremum of c x after point k of the grid."""
        A, state, time = self.motion.A, self.motion.states[k], self.motion.times[k]
        delay = _find_zero(partial(_evaluate_output, A, state, A.T @ self.row), self.motion.times[k + 1] - time)
        return float(time + delay), _evaluate_output(A, state, self.row, delay)

    def settling_time(self, limit: float) -> float:
        """Time at which |c x| is above the limit for the last time; nan if it is above the limit at the end."""
        motion, sizes = self.motion, np.abs(self.values)
        rows_above = np.flatnonzero(sizes > limit)
        if not rows_above.size:
            return 0.0
        last_row = int(rows_above[-1])
        if last_row == len(sizes) - 1:
            return math.nan
        begin, state, end = motion.times[last_row], motion.states[last_row], motion.times[last_row + 1]
        for k in (k for k in self.extrema if k >= last_row and max(sizes[k : k + 2]) > _NEAR_PEAK * limit):
            time, value = self.locate_extremum(k)
            if abs(value) > limit:
                begin, end = time, motion.times[k + 1]
                state = expm(motion.A * (time - motion.times[k])) @ motion.states[k]
        sign = math.copysign(1.0, float(self.row @ state))
        return float(
            begin + _find_zero(lambda s: sign * _evaluate_output(motion.A, state, self.row, s) - limit, end - begin)
        )


def _evaluate_output(A: Array, x: Array, row: Array, time: float) -> float:
    return float(row @ (expm(A * time) @ x))


def _find_zero(function: Any, end: float) -> float:
    """Zero of a function that changes sign between 0 and `end`.

    If rounding errors hide the change of sign, return the end of the interval at which the function is smaller.
    """
    value_at_0, value_at_end = function(0.0), function(end)
    if value_at_0 * value_at_end >= 0:
        return 0.0 if abs(value_at_0) <= abs(value_at_end) else end
    return float(brentq(function, 0.0, end, xtol=1e-15 * end, rtol=8.9e-16))
