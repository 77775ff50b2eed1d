"""Where marks vanish along a walked curve: sign changes, located on the curve itself, two within a step included."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tmsopt.records import Array
from tmsopt.tracing.continuation import Walk, between
from tmsopt.tracing.equations import Traced
from tmsopt.tracing.monitors import CHANGES, NOTHING, Mark, Points, marks, sign_changes
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


def points_of(ready: Traced, walked: Walk) -> Points:
    """The points of a walk."""
    return Points(ready, walked.y * ready.on.scale, walked.t)


def refined(ready: Traced, walked: Walk) -> Walk:
    """The walk with a point wherever a mark comes nearest to 0 between two steps, so that two zeros show two signs."""
    steps = np.sum(walked.t[:-1] * np.diff(walked.y, axis=0), axis=1)
    added: list[Found] = []
    for mark, value in _live(points_of(ready, walked)):
        side = np.sign(value[1:-1])
        left, here, right = side * value[:-2], side * value[1:-1], side * value[2:]
        with np.errstate(all="ignore"):
            slope, bend = _parabola(left, here, right, steps[:-1], steps[1:])
            forward = (steps[:-1] > 0) & (steps[1:] > 0)
            dips = forward & (here <= left) & (here <= right) & (bend > 0) & (slope**2 / (2 * bend) > _DIP * here)
        for k in (np.flatnonzero(dips & (here > 0)) + 1).tolist():
            at = walked.y[[k]], walked.t[[k]]

            def height(s: float, mark: Mark = mark, at: tuple[Array, Array] = at, sign: float = side[k - 1]) -> float:
                return sign * float(_at(ready, mark, *at, np.array([s]))[0])

            from scipy.optimize import minimize_scalar  # a fifth of a second, paid only where it is needed

            ends = (-steps[k - 1], steps[k])
            s = float(minimize_scalar(height, bounds=ends, method="bounded", options={"xatol": 1e-14}).x)
            beside = between(ready.on, *at, np.array([s]))
            (y,), (t,) = between(ready.on, *beside, np.zeros(1))  # once more: beside a singular point Newton is slow
            if np.abs(y - walked.y[k]).max() <= _ASTRAY * abs(s) and t @ walked.t[k] > 0:
                place = (k, s) if s >= 0 else (k - 1, steps[k - 1] + s)
                if all((f.after, f.s) != place for f in added):
                    added.append(Found(mark.name, "", y, t, *place))
    return inserted(walked, sorted(added, key=lambda f: (f.after, f.s)))[1]


def inserted(walked: Walk, found: list[Found]) -> tuple[list[int], Walk]:
    """Rows of what was found, in order, and the walk with it among its points."""
    y, t, rows = list(walked.y), list(walked.t), []
    for shift, event in enumerate(found):
        row = event.after + 1 + shift
        y.insert(row, event.y)
        t.insert(row, event.t)
        rows.append(row)
    return rows, replace(walked, y=np.array(y), t=np.array(t))


def located(ready: Traced, walked: Walk) -> Iterator[Found]:
    """Every zero of a mark along a walk, between the rows that show its change of sign."""
    points = points_of(ready, walked)
    for mark, value in _live(points):
        rows = np.flatnonzero(sign_changes(value))
        if mark.detail == CHANGES:
            rows = rows[points.stable[rows] != points.stable[rows + 1]]
        here, along = walked.y[rows], walked.t[rows]
        ends = np.sum(along * (walked.y[rows + 1] - here), axis=1)

        def at(s: Array, mark: Mark = mark, here: Array = here, along: Array = along) -> Array:
            return _at(ready, mark, here, along, s)

        if rows.size:
            every = crossings(at, ends)
            real = np.isfinite(every)  # else a jump through infinity, noise, or nan
            y, t = between(ready.on, here[real], along[real], every[real])
            for i, s, y_at, t_at in zip(rows[real].tolist(), every[real].tolist(), y, t, strict=True):
                if np.abs(y_at - walked.y[i]).max() > _ASTRAY * s + TOGETHER:
                    continue  # on another curve
                if mark.name != "fold" or _turns(walked, i, y_at, list(ready.problem.free).index(mark.detail)):
                    yield Found(mark.name, mark.detail, y_at, t_at, i, s)


def _live(points: Points) -> Iterator[tuple[Mark, Array]]:
    """The marks that are not 0 all along the curve, with their values."""
    special = points.special
    for mark in marks(points):
        value = points.column(mark.value(points))
        if mark.name not in special and (mark.name != "fold" or np.abs(value).max() > NOTHING):
            yield mark, value


def _at(ready: Traced, mark: Mark, y: Array, t: Array, s: Array) -> Array:
    """A mark at arclengths s from points of the curve."""
    new, tangent = between(ready.on, y, t, s)
    points = Points(ready, new * ready.on.scale, tangent)
    return np.array(points.column(mark.value(points)))


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
