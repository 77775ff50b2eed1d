"""Where marks vanish along a walked curve: sign changes, located on the curve itself, two within a step included."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tmsopt.problem.problem import Problem
from tmsopt.records import Array
from tmsopt.roots import Pattern
from tmsopt.tracing.continuation import Curve, Walk, between
from tmsopt.tracing.monitors import CHANGES, NOTHING, Mark, marks, sign_changes, stability, vanishes
from tmsopt.tracing.solving import crossings

TOGETHER = 1e-6
"""Distance, in units of the scale, within which events are one: each is located to 1e-12 or better."""

_DIP = 0.5
"""Share of a small value that a parabola must fall further by, for its least to be looked for between the steps."""
_ASTRAY = 2.0  # arclengths: a point further off lies on another curve, as beside a singular point it may
_ROUNDING = 1e-14  # of a variable of order 1


@dataclass(frozen=True)
class Found:
    """An event between two rows of a walk."""

    name: str
    detail: str
    y: Array
    t: Array
    after: int  # row of the walk that it follows
    s: float


def refined(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Walk:
    """The walk with a point wherever a mark comes nearest to 0 between two steps, so that two zeros show two signs."""
    x = walked.y * on.scale
    steps = np.sum(walked.t[:-1] * np.diff(walked.y, axis=0), axis=1)
    added: dict[tuple[int, float], tuple[Array, Array]] = {}
    for mark, value in _live(problem, pattern, unknowns, x, walked.t):
        side = np.sign(value[1:-1])
        left, here, right = side * value[:-2], side * value[1:-1], side * value[2:]
        with np.errstate(all="ignore"):
            slope, bend = _parabola(left, here, right, steps[:-1], steps[1:])
            forward = (steps[:-1] > 0) & (steps[1:] > 0)
            dips = forward & (here <= left) & (here <= right) & (bend > 0) & (slope**2 / (2 * bend) > _DIP * here)
        for k in (np.flatnonzero(dips & (here > 0)) + 1).tolist():

            def height(s: float, k: int = k, mark: Mark = mark, sign: float = float(side[k - 1])) -> float:
                return sign * float(_at(on, mark, walked.y[[k]], walked.t[[k]], np.array([s]))[0])

            ends = (-steps[k - 1], steps[k])
            from scipy.optimize import minimize_scalar  # a fifth of a second, paid only where it is needed

            s = float(minimize_scalar(height, bounds=ends, method="bounded", options={"xatol": 1e-14}).x)
            beside = between(on, walked.y[[k]], walked.t[[k]], np.array([s]))
            (y,), (t,) = between(on, *beside, np.zeros(1))  # once more: beside a singular point Newton is slow
            if np.abs(y - walked.y[k]).max() <= _ASTRAY * abs(s) and t @ walked.t[k] > 0:
                added[(k, s) if s >= 0 else (k - 1, steps[k - 1] + s)] = y, t
    ys, ts = list(walked.y), list(walked.t)
    for shift, (after, s) in enumerate(sorted(added)):
        ys.insert(after + 1 + shift, added[after, s][0])
        ts.insert(after + 1 + shift, added[after, s][1])
    return replace(walked, y=np.array(ys), t=np.array(ts))


def located(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Iterator[Found]:
    """Every zero of a mark along a walk, between the rows that show its change of sign."""
    x = walked.y * on.scale
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    stable = stability(pattern.remaining(u), len(x))
    for mark, value in _live(problem, pattern, unknowns, x, walked.t):
        rows = np.flatnonzero(sign_changes(value))
        if mark.detail == CHANGES:
            rows = rows[stable[rows] != stable[rows + 1]]
        here, along = walked.y[rows], walked.t[rows]

        def at(s: Array, k: NDArray[np.intp], mark: Mark = mark, here: Array = here, along: Array = along) -> Array:
            return _at(on, mark, here[k], along[k], s)

        if rows.size:
            s = crossings(at, np.sum(along * (walked.y[rows + 1] - here), axis=1))
            real = np.isfinite(s)  # else a jump through infinity, noise, or nan
            yield from _true(problem, walked, mark, rows[real], s[real], *between(on, here[real], along[real], s[real]))


def _true(
    problem: Problem, walked: Walk, mark: Mark, rows: NDArray[np.intp], s: Array, y: Array, t: Array
) -> Iterator[Found]:
    """Zeros of a mark without those that lie on another curve, and folds that are none."""
    astray = np.abs(y - walked.y[rows]).max(axis=1) > _ASTRAY * s + TOGETHER
    for k in np.flatnonzero(~astray):
        i = int(rows[k])
        if mark.name != "fold" or _turns(walked, i, y[k], list(problem.free).index(mark.detail)):
            yield Found(mark.name, mark.detail, y[k], t[k], i, float(s[k]))


def _live(problem: Problem, pattern: Pattern, unknowns: slice, x: Array, t: Array) -> Iterator[tuple[Mark, Array]]:
    """The marks that are not 0 all along the curve, with their values."""
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    within = [name for name, special in pattern.marks.items() if vanishes(special, pattern, u)]
    for mark in marks(problem, pattern, unknowns, within):
        value = np.broadcast_to(mark.value(x, t), len(x))
        if mark.name not in within and (mark.name != "fold" or np.abs(value).max() > NOTHING):
            yield mark, value


def _at(on: Curve, mark: Mark, y: Array, t: Array, s: Array) -> Array:
    """A mark at arclengths s from points of the curve."""
    new, tangent = between(on, y, t, s)
    return np.array(np.broadcast_to(mark.value(new * on.scale, tangent), len(s)))


def _parabola(left: Array, here: Array, right: Array, before: Array, after: Array) -> tuple[Array, Array]:
    """Slope and second derivative, in the middle, of the parabolas through three values."""
    back, ahead = (here - left) / before, (right - here) / after
    return (back * after + ahead * before) / (before + after), 2 * (ahead - back) / (before + after)


def _turns(walked: Walk, i: int, y: Array, k: int) -> bool:
    """Whether a variable has its neighbours, next or next but one, on one side of it by more than rounding.

    Where the equations are singular the tangent alone may say so.
    """
    last = len(walked.y) - 1
    for before, after in ((i, i + 1), (max(i - 1, 0), min(i + 2, last))):
        back, ahead = walked.y[before, k] - y[k], walked.y[after, k] - y[k]
        if back * ahead > 0 and min(abs(back), abs(ahead)) > _ROUNDING * (1 + abs(y[k])):
            return True
    return False
