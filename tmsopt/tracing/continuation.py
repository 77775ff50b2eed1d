"""Pseudo-arclength continuation of a smooth curve F(x) = 0, n equations in n + 1 variables.

Keller's method: predict along the tangent, then correct by Newton's method on F = 0 at a fixed arclength. One CasADi
function of scalar operations holds the predictor, three corrections and the new tangent, so a point costs one call.

`follow` yields the points one by one; `walk` collects them.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import islice
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from tmsopt.records import Array
from tmsopt.tracing.solving import MappedFunction, evaluate_rows, find_zeros, map_rows

_NEWTON_TOLERANCE = 1e-8  # largest last Newton step, relative to the size of the point; its square is the error
_MAX_CONTRACTION = 0.1  # largest ratio of the second Newton step to the first; otherwise the step was too long
_MIN_COSINE = np.cos(0.15)  # cosine of the largest angle between successive tangents
_MIN_STEP = 1e-12  # the curve ends where even a step of this length fails
_STEP_GROWTH = 1.5  # ratio of successive steps
_UNBOUNDED_RATIO = 4.0
"""Steps of variables without limits are this many times longer, since their spacing does not matter."""
_REMOTE_SIZE = 100.0  # size of a variable, in units of the scale, above which the steps grow
_MAX_SIZE = 1e6  # size above which the equations lose their digits, so that the curve ends
_INFINITE_SIZE = 1e5  # size above which a failed step means infinity; rounding may end the curve before `_MAX_SIZE`
_KNOWN_STEPS = 1024  # steps that are kept, since `find_zeros` asks for the same ones again
_SAME_POINT = 1e-7  # relative distance up to which two points count as one
_LIMIT_ROUNDING = 1e-12  # rounding error of a variable of order 1 on a curve along which it stays at its limit
CLOSED = "closed"
SINGULAR = "singular: the curve branches or has no direction here"
INFINITE = "a root goes to infinity: a0 vanishes"
_MIN_SINGULAR_VALUE = 1e-6  # relative singular value below which the equations do not determine a direction


@dataclass(frozen=True)
class Curve:
    """A compiled system; its variables y = x / scale are of order 1.

    Attributes:
        scale: units of the variables.
        lower, upper: limits of y; infinite without a limit.
        evaluate: y → F and its Jacobian in y.
        advance: (point y, tangent t, arclength s, first point of the curve) → next y, next t, and the numbers of
            `_StepChecks`. None for more than n equations.
    """

    scale: Array
    lower: Array
    upper: Array
    evaluate: Any = field(repr=False)
    advance: Any = field(repr=False)


class _StepChecks(NamedTuple):
    """The numbers by which `follow` accepts a step.

    Attributes:
        correction_1, correction_2, correction_3: sizes of the three Newton corrections, relative to the point.
        cosine: cosine of the angle between the tangents before and after the step.
        step_factor: arclength that the next step may have, in units of the longest step.
        slack: least distance to a limit; negative outside the limits.
        size: largest absolute value of a variable.
        first_distance: distance between the point before the step and the first point of the curve.
        first_arclength: this distance along the tangent; positive if the first point lies ahead.
    """

    correction_1: float
    correction_2: float
    correction_3: float
    cosine: float
    step_factor: float
    slack: float
    size: float
    first_distance: float
    first_arclength: float


@dataclass(frozen=True)
class CurvePoint:
    """A point y of a curve, in units of the scale, and the unit tangent t at the point, both of shape (n + 1,)."""

    y: Array
    t: Array


@dataclass(frozen=True)
class End:
    """Why a walk ended; `variable` is the index of the variable that reached a limit, if one did."""

    reason: str
    variable: int | None = None


@dataclass(frozen=True)
class Walk:
    """Points y and unit tangents t along a curve, shape (points, n + 1).

    Attributes:
        ends: why the walk ends before its first point and after its last point.
        seconds: the time that the walk took.
    """

    y: Array
    t: Array
    ends: tuple[End, End]
    seconds: float = 0.0

    @property
    def closed(self) -> bool:
        """Whether the curve returns to its first point, which is then also the last."""
        return self.ends[1].reason == CLOSED


def compile_curve(x: Any, equations: Any, scale: Array, lower: Array, upper: Array) -> Curve:
    """Compile the curve equations(x) = 0, where x is a CasADi symbol with n + 1 entries.

    `lower` and `upper` are limits of x, not of y. The zeros of more than n equations are isolated points. To find them,
    `Curve.evaluate` is enough.
    """
    variable_count, unit = x.numel(), ca.DM(scale)
    system = ca.Function("system", [x], [equations, ca.jacobian(equations, x)])
    y, t, s, origin = (
        ca.SX.sym("y", variable_count),
        ca.SX.sym("t", variable_count),
        ca.SX.sym("s"),
        ca.SX.sym("origin", variable_count),
    )
    value, jacobian = system(y * unit)
    scaled_system = ca.Function("scaled", [y], [ca.densify(value), ca.densify(ca.densify(jacobian) @ ca.diag(unit))])
    low, high = lower / scale, upper / scale
    if equations.numel() != variable_count - 1:
        return Curve(scale, low, high, scaled_system, None)
    z, sizes = y + s * t, []
    for _ in range(3):
        value, jacobian = scaled_system(z)
        correction = ca.solve(ca.vertcat(jacobian, t.T), ca.vertcat(value, ca.dot(t, z - y) - s))
        z = z - correction
        sizes.append(ca.norm_2(correction) / (1 + ca.norm_inf(z)))
    value, jacobian = scaled_system(z)
    tangent = ca.solve(ca.vertcat(jacobian, t.T), ca.vertcat(ca.DM.zeros(variable_count - 1), 1))
    tangent = tangent / ca.norm_2(tangent)

    is_bounded = np.isfinite(low) & np.isfinite(high)
    unbounded_room = _UNBOUNDED_RATIO * (1 + ca.fabs(z)) * ca.sqrt(ca.fmax(1, ca.fabs(z) / _REMOTE_SIZE))
    room = ca.vertcat(*(1 if is_bounded[k] else unbounded_room[k] for k in range(variable_count)))
    step_factor = ca.mmin(room / (ca.fabs(tangent) + 1e-300))
    slack = ca.mmin(ca.vertcat(z - low, high - z))
    checks = ca.vertcat(
        *sizes, ca.dot(t, tangent), step_factor, slack, ca.norm_inf(z), ca.norm_2(origin - y), ca.dot(t, origin - y)
    )
    return Curve(scale, low, high, scaled_system, ca.Function("advance", [y, t, s, origin], [z, tangent, checks]))


def make_curve(
    evaluate: Callable[[Array], tuple[Array, Array]], count: int, scale: Array, lower: Array, upper: Array
) -> Curve:
    """The curve F(y) = 0 for a function of one point y that gives F and its Jacobian.

    There may be more equations than n if some follow from the others. `lower` and `upper` are limits of y. Where the
    function raises a LinAlgError, results are nan.

    Args:
        count: number of equations.
    """
    size, room = len(scale), np.where(np.isfinite(lower) & np.isfinite(upper), 1.0, np.inf)

    def evaluate_all(y: Array) -> list[Array]:
        values, jacobians = np.full((len(y), count), np.nan), np.full((len(y), size, count), np.nan)
        for k, point in enumerate(y):
            with suppress(np.linalg.LinAlgError):
                values[k], jacobian = evaluate(point)
                jacobians[k] = jacobian.T
        return [values, jacobians]

    @lru_cache(maxsize=_KNOWN_STEPS)
    def step(data: bytes) -> tuple[Array, Array, list[float]]:
        y, t, origin, (s,) = np.split(np.frombuffer(data), [size, 2 * size, 3 * size])
        z, sizes = y + s * t, list[float]()
        for _ in range(3):
            value, jacobian = evaluate(z)
            sides = np.append(value, t @ (z - y) - s)
            correction = np.linalg.lstsq(np.vstack([jacobian, t]), sides, rcond=None)[0]
            z = z - correction
            sizes.append(float(np.linalg.norm(correction) / (1 + np.abs(z).max())))
        value, jacobian = evaluate(z)
        sizes[-1] += float(np.linalg.norm(value) / np.linalg.norm(jacobian))  # dependent equations may contradict
        tangent = np.linalg.lstsq(np.vstack([jacobian, t]), np.append(np.zeros(count), 1.0), rcond=None)[0]
        tangent /= np.linalg.norm(tangent)
        unbounded_room = _UNBOUNDED_RATIO * (1 + np.abs(z)) * np.sqrt(np.maximum(1, np.abs(z) / _REMOTE_SIZE))
        step_factor = np.min(np.minimum(room, unbounded_room) / (np.abs(tangent) + 1e-300))
        slack, offset = np.min([z - lower, upper - z]), origin - y
        checks = [t @ tangent, step_factor, slack, np.abs(z).max(), np.linalg.norm(offset), t @ offset]
        return z, tangent, [*sizes, *map(float, checks)]

    def advance(y: Array, t: Array, s: Array, origin: Array) -> list[Array]:
        columns = [np.full((len(y), width), np.nan) for width in (size, size, len(_StepChecks._fields))]
        for k in range(len(y)):
            with suppress(np.linalg.LinAlgError):
                data = np.concatenate([y[k], t[k], origin[k], s[k]]).tobytes()
                columns[0][k], columns[1][k], columns[2][k] = step(data)
        return columns

    return Curve(scale, lower, upper, evaluate_all, advance)


def compute_tangent(curve: Curve, y: Array) -> Array:
    """Unit tangent at a point of the curve.

    Raises:
        ValueError: where the equations do not determine a direction.
    """
    jacobian = balanced = evaluate_rows(curve.evaluate, y[None])[1][0]
    for axis in (0, 1):  # rows and columns of norm 1, since units differ much near infinity
        norm = np.linalg.norm(balanced, axis=axis, keepdims=True)
        balanced = balanced / np.where(norm > 0, norm, 1.0)
    singular = np.linalg.svd(balanced, compute_uv=False)
    size = jacobian.shape[1]
    _, values, V = np.linalg.svd(jacobian)
    is_isolated = len(values) == size and values[-1] > _MIN_SINGULAR_VALUE * values[0]
    if is_isolated or singular[size - 2] <= _MIN_SINGULAR_VALUE * singular[0]:
        raise ValueError("the equations do not determine a direction here")
    return np.asarray(V[-1])


def follow(curve: Curve, start: CurvePoint, step: float) -> Iterator[Any]:
    """Yield the points after a start, in the direction of its tangent, and finally an `End`.

    The curve ends at a limit, at its first point (it is closed), at a singular point, or near infinity.
    """

    def advance(y: Array, t: Array, s: float) -> tuple[Array, Array, _StepChecks]:
        next_y, tangent, checks = step_from(y[None], t[None], np.array([[s]]), start.y[None])
        return next_y[0], tangent[0], _StepChecks(*checks[0].tolist())

    y, t, count, step_from = start.y, start.t, 1, curve.advance
    if isinstance(step_from, ca.Function):
        step_from = MappedFunction(step_from, 1)
    s, (*_, checks) = step / 4, advance(y, t, 0.0)
    while True:
        s = min(s, step * checks.step_factor)
        while True:
            next_y, tangent, checks = advance(y, t, s)
            if (
                checks.correction_3 <= _NEWTON_TOLERANCE
                and checks.cosine >= _MIN_COSINE
                and (checks.correction_2 <= _MAX_CONTRACTION * checks.correction_1 or checks.correction_1 < 1e-6)
            ):
                break  # a step with nan is never accepted
            s /= 2
            if s < _MIN_STEP:
                yield End(INFINITE if np.abs(y).max() > _INFINITE_SIZE else SINGULAR)
                return
        if (
            count > 2
            and 0 < checks.first_arclength <= s
            and checks.first_distance <= 2 * s
            and _is_same_point(advance(y, t, checks.first_arclength)[0], start.y)
        ):
            yield from (start, End(CLOSED))
            return
        if checks.slack < 0 and not _runs_along_limit(curve, next_y, tangent):
            yield from _stop_at_limit(curve, y, t, s, next_y)
            return
        yield CurvePoint(next_y, tangent)
        if checks.size > _MAX_SIZE:
            yield End(INFINITE)
            return
        y, t, s, count = next_y, tangent, s * _STEP_GROWTH, count + 1


def walk(curve: Curve, y: Array, t: Array, step: float, max_points: int) -> Walk:
    """Follow the curve from y in the direction t until it ends or has `max_points` points."""
    start = CurvePoint(y, t)
    points: list[Any] = [start, *islice(follow(curve, start, step), max_points - 1)]
    end = points.pop() if isinstance(points[-1], End) else End(f"stopped after {max_points} points")
    return Walk(np.array([p.y for p in points]), np.array([p.t for p in points]), (End("start"), end))


def walk_both_ways(curve: Curve, y: Array, step: float, max_points: int) -> Walk | None:
    """Return the whole curve through a point.

    Return None if the point is not a regular point of a curve, or if the curve has two points or fewer.
    """
    started = time.perf_counter()
    try:
        t = compute_tangent(curve, y)
    except ValueError:
        return None
    whole_walk = walk(curve, y, t, step, max_points)
    if not whole_walk.closed:
        backward_walk = walk(curve, y, -t, step, max_points)
        points, tangents = (
            np.concatenate(x) for x in ([backward_walk.y[:0:-1], whole_walk.y], [-backward_walk.t[:0:-1], whole_walk.t])
        )
        whole_walk = Walk(points, tangents, (backward_walk.ends[1], whole_walk.ends[1]))
    return replace(whole_walk, seconds=time.perf_counter() - started) if len(whole_walk.y) > 2 else None


def step_along(curve: Curve, y: Array, t: Array, s: Array) -> tuple[Array, Array]:
    """Points and tangents at arclengths s from the points y, row by row; |s| is at most the length of a step."""
    new_points, tangent, _ = map_rows(curve.advance, y, t, s[:, None], y)
    return new_points, tangent


def is_on_walk(curve: Curve, walk: Walk, y: Array) -> bool:
    """Whether a point lies on the curve of a walk."""
    distances = np.linalg.norm(walk.y - y, axis=1)
    k = int(np.argmin(distances))
    if distances[k] > 2 * np.linalg.norm(np.diff(walk.y[max(k - 1, 0) : k + 2], axis=0), axis=1).max(initial=0.0):
        return False
    new_points, _ = step_along(curve, walk.y[[k]], walk.t[[k]], np.array([walk.t[k] @ (y - walk.y[k])]))
    return _is_same_point(new_points[0], y)


def _is_same_point(y: Array, reference: Array) -> bool:
    """Whether two points are equal up to rounding errors."""
    return bool(np.abs(y - reference).max() <= _SAME_POINT * (1 + np.abs(reference).max()))


def _runs_along_limit(curve: Curve, y: Array, t: Array) -> bool:
    """Whether a point is outside a limit only by rounding, because the curve runs along this limit."""
    excess = np.maximum(curve.lower - y, y - curve.upper)
    is_violated = excess > 0
    return bool(np.all(excess[is_violated] <= _LIMIT_ROUNDING) and np.all(np.abs(t[is_violated]) <= _LIMIT_ROUNDING))


def _stop_at_limit(curve: Curve, y: Array, t: Array, s: float, outer_point: Array) -> tuple[CurvePoint, End]:
    """The first point, exactly on a limit, of a step s from y to a point outside the limits; and the `End` there."""
    limits = np.clip(outer_point, curve.lower, curve.upper)
    crossed = np.flatnonzero(limits != outer_point)
    points, tangents = np.tile(y, (len(crossed), 1)), np.tile(t, (len(crossed), 1))
    lengths = find_zeros(
        lambda r: step_along(curve, points, tangents, r)[0][range(len(crossed)), crossed] - limits[crossed],
        np.full(len(crossed), s),
    )
    lengths = np.nan_to_num(lengths)  # a nan means that y is already outside
    variable = crossed[np.argmin(lengths)]
    (end_point,), (tangent,) = step_along(curve, y[None], t[None], lengths.min(keepdims=True))
    end_point[variable] = limits[variable]
    return CurvePoint(end_point, tangent), End(
        "max" if outer_point[variable] > limits[variable] else "min", int(variable)
    )
