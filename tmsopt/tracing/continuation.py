"""Pseudo-arclength continuation of a smooth curve F(x) = 0, n equations in n + 1 variables.

Keller's method: predict along the tangent, correct by Newton's method on F = 0 and a fixed arclength. Predictor,
three corrections and the new tangent are one CasADi function of scalar operations, so that a point costs one call.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.records import Array, Truth
from tmsopt.tracing.solving import Rows, crossing, evaluated, rows_of

_CONVERGED = 1e-8  # last Newton step, relative to the point: the error left is its square
_CONTRACTION = 0.1  # of the second Newton step against the first: slower means that the prediction was too far
_COSINE = np.cos(0.15)  # of the angle between tangents: a sharper turn takes a smaller step
_SMALLEST = 1e-12
_GROWTH = 1.5
_ROOM = 4.0  # steps of variables without a box, against those with one: nobody looks at their spacing
_REMOTE = 100.0  # units of the scale beyond which points lie ever further apart, towards infinity
_FAR = 1e6  # in units of the scale; further out the equations lose their digits
_FADING = 1e5  # there a step that fails has lost them already: which one does is up to rounding, the limit is not
_SAME = 1e-7
_EDGE = 1e-12  # of a variable of order 1: rounding beside a limit that a curve lies in
CLOSED = "closed"
SINGULAR = "singular: the curve branches or has no direction here"
INFINITE = "a root goes to infinity: a0 vanishes"
_ISOLATED = 1e-6  # singular values, relative to the largest, below which an equation has no influence


@dataclass(frozen=True)
class Curve:
    """A compiled system; its variables y = x / scale are of order 1.

    Attributes:
        scale: units of the variables.
        lower, upper: limits of y, infinite where there are none.
        evaluate: y → F and its Jacobian in y.
        advance: (y, t, s, origin) → next y, next t, and the numbers of `_Check`.
    """

    scale: Array
    lower: Array
    upper: Array
    evaluate: ca.Function = field(repr=False)
    advance: ca.Function = field(repr=False)


@dataclass(frozen=True)
class End:
    """Why a walk ended; `limit` is the variable that reached a limit."""

    reason: str
    limit: int | None = None


@dataclass(frozen=True)
class Walk:
    """Points y and unit tangents t of a curve, shape (points, n + 1), and why it ends at either side."""

    y: Array
    t: Array
    ends: tuple[End, End]

    @property
    def closed(self) -> bool:
        """Whether the curve returns to its first point, which is then also the last."""
        return self.ends[1].reason == CLOSED


def curve(x: Any, equations: Any, scale: Array, lower: Array, upper: Array) -> Curve:
    """Compile the curve equations(x) = 0 of a CasADi symbol x of n + 1 entries; limits are of x."""
    size = x.numel()
    unit = ca.DM(scale)
    system = ca.Function("system", [x], [equations, ca.jacobian(equations, x)])
    y, t, s, origin = ca.SX.sym("y", size), ca.SX.sym("t", size), ca.SX.sym("s"), ca.SX.sym("origin", size)

    def scaled(at: Any) -> tuple[Any, Any]:
        value, jacobian = system(at * unit)
        return ca.densify(value), ca.densify(ca.densify(jacobian) @ ca.diag(unit))

    z, sizes = y + s * t, []
    for _ in range(3):
        value, jacobian = scaled(z)
        correction = ca.solve(ca.vertcat(jacobian, t.T), ca.vertcat(value, ca.dot(t, z - y) - s))
        z = z - correction
        sizes.append(ca.norm_2(correction) / (1 + ca.norm_inf(z)))
    value, jacobian = scaled(z)
    tangent = ca.solve(ca.vertcat(jacobian, t.T), ca.vertcat(ca.DM.zeros(size - 1), 1))
    tangent = tangent / ca.norm_2(tangent)

    boxed = [k for k in range(size) if np.isfinite(lower[k]) and np.isfinite(upper[k])]
    reach = ca.SX(np.inf)
    for k in range(size):
        room = 1.0 if k in boxed else _ROOM * (1 + ca.fabs(z[k])) * ca.sqrt(ca.fmax(1, ca.fabs(z[k]) / _REMOTE))
        reach = ca.fmin(reach, room / (ca.fabs(tangent[k]) + 1e-300))
    slack = ca.SX(np.inf)
    for k in range(size):
        if np.isfinite(lower[k]):
            slack = ca.fmin(slack, z[k] - lower[k] / scale[k])
        if np.isfinite(upper[k]):
            slack = ca.fmin(slack, upper[k] / scale[k] - z[k])
    checks = ca.vertcat(
        *sizes, ca.dot(t, tangent), reach, slack, ca.norm_inf(z), ca.norm_2(origin - y), ca.dot(t, origin - y)
    )
    return Curve(
        scale=scale,
        lower=lower / scale,
        upper=upper / scale,
        evaluate=ca.Function("evaluate", [y], list(scaled(y))),
        advance=ca.Function("advance", [y, t, s, origin], [z, tangent, checks]),
    )


def tangent_at(on: Curve, y: Array) -> Array:
    """Unit tangent at a point of the curve.

    Raises:
        ValueError: where the equations do not determine a direction.
    """
    jacobian = evaluated(on.evaluate, y[None])[1][0]
    singular = np.linalg.svd(_even(_even(jacobian, 0), 1), compute_uv=False)
    rows = np.linalg.svd(jacobian)[2]
    if singular[-1] <= _ISOLATED * singular[0]:
        raise ValueError("the equations leave more than a curve here")
    return np.asarray(rows[-1])


def _even(matrix: Array, axis: int) -> Array:
    """Columns or rows of norm 1, so that units, which differ by much beside infinity, do not make it look singular."""
    norm = np.linalg.norm(matrix, axis=axis, keepdims=True)
    return np.asarray(matrix / np.where(norm > 0, norm, 1.0))


def walk(on: Curve, y: Array, t: Array, step: float, most: int) -> Walk:
    """Follow the curve from y in the direction t until a limit, a closed loop, infinity, or `most` points."""

    def advance(y: Array, t: Array, s: float) -> tuple[Any, ...]:
        new, tangent, checks = step_from(y[None], t[None], np.array([[s]]), origin[None])
        return new[0], tangent[0], *checks[0].tolist()

    origin, ys, ts, step_from = y, [y], [t], Rows(on.advance, 1)
    s, reach = step / 4, advance(y, t, 0.0)[6]
    while len(ys) < most:
        s = min(s, step * reach)
        while True:
            new, tangent, first, second, third, cosine, reach, slack, largest, far, ahead = advance(y, t, s)
            if third <= _CONVERGED and cosine >= _COSINE and (second <= _CONTRACTION * first or first < 1e-6):
                break  # nan does not come here
            s /= 2
            if s < _SMALLEST:
                return _ended(ys, ts, End(INFINITE if np.abs(y).max() > _FADING else SINGULAR))
        if len(ys) > 2 and 0 < ahead <= s and far <= 2 * s and _alike(advance(y, t, ahead)[0], origin):
            return _ended([*ys, ys[0]], [*ts, ts[0]], End(CLOSED))
        if slack < 0 and not _along(on, new, tangent):
            last, direction, end = _at_limit(on, y, t, s)
            return _ended([*ys, last], [*ts, direction], end)
        ys.append(new)
        ts.append(tangent)
        if largest > _FAR:
            return _ended(ys, ts, End(INFINITE))
        y, t, s = new, tangent, s * _GROWTH
    return _ended(ys, ts, End(f"stopped after {most} points"))


def both_ways(on: Curve, y: Array, step: float, most: int) -> Walk | None:
    """The whole curve through a point; None where it is no regular point of one."""
    try:
        t = tangent_at(on, y)
    except ValueError:
        return None
    ahead = walk(on, y, t, step, most)
    if ahead.closed:
        return ahead
    back = walk(on, y, -t, step, most)
    if len(ahead.y) + len(back.y) < 4:
        return None
    points, tangents = np.concatenate([back.y[::-1], ahead.y[1:]]), np.concatenate([-back.t[::-1], ahead.t[1:]])
    return Walk(points, tangents, (back.ends[1], ahead.ends[1]))


def between(on: Curve, y: Array, t: Array, s: Array) -> tuple[Array, Array]:
    """Points and tangents at arclengths s beyond points of the curve, a row each, s no more than a step."""
    new, tangent, _ = rows_of(on.advance, y, t, s[:, None], y)
    return new, tangent


def contains(on: Curve, walked: Walk, y: Array) -> Truth:
    """Which of some points, shape (points, n + 1), lie on a curve already walked."""
    apart = np.linalg.norm(y[:, None] - walked.y, axis=2)
    k = np.argmin(apart, axis=1)
    gaps = np.linalg.norm(np.diff(walked.y, axis=0), axis=1)
    gaps = np.maximum(np.append(gaps, 0.0)[k], np.insert(gaps, 0, 0.0)[k])
    there = apart[np.arange(len(k)), k] <= 2 * gaps
    if np.any(there):
        k, y = k[there], y[there]
        new, _ = between(on, walked.y[k], walked.t[k], np.sum(walked.t[k] * (y - walked.y[k]), axis=1))
        there[there] = _alike(new, y)
    return np.asarray(there)


def same(one: Walk, other: Walk) -> bool:
    """Whether both ends of a walk are ends of another, at limits: through a regular point goes one curve only."""
    if one.closed or other.closed or any(end.limit is None for walked in (one, other) for end in walked.ends):
        return False

    def shared(row: int) -> bool:
        near = (k for k in (0, -1) if _alike(other.y[k], one.y[row]))
        return any(abs(one.t[row] @ other.t[k]) >= _COSINE for k in near)

    return shared(0) and shared(-1)


def _alike(y: Array, other: Array) -> Truth:
    """Whether points are one."""
    return np.asarray(np.abs(y - other).max(axis=-1) <= _SAME * (1 + np.abs(other).max(axis=-1)))


def _along(on: Curve, y: Array, t: Array) -> bool:
    """Whether a curve that is beyond limits runs along them: it lies in an edge of the box, up to rounding."""
    beyond = np.maximum(on.lower - y, y - on.upper)
    over = beyond > 0
    return bool(np.all(beyond[over] <= _EDGE) and np.all(np.abs(t[over]) <= _EDGE))


def _at_limit(on: Curve, y: Array, t: Array, s: float) -> tuple[Array, Array, End]:
    """The first point within a step that lies on a limit, on it exactly."""

    def point(r: float) -> Array:
        return np.asarray(between(on, y[None], t[None], np.array([r]))[0][0])

    beyond, found = point(s), []
    for k in range(y.size):
        for side, limit in (("min", on.lower[k]), ("max", on.upper[k])):
            if beyond[k] < limit if side == "min" else beyond[k] > limit:

                def excess(r: float, k: int = k, limit: float = float(limit)) -> float:
                    return float(point(r)[k]) - limit

                share = crossing(excess, s) if excess(0.0) * excess(s) < 0 else 0.0
                found.append((share, k, side, limit))
    share, k, side, limit = min(found)
    (last,), (direction,) = between(on, y[None], t[None], np.array([share]))
    last[k] = limit
    return last, direction, End(side, k)


def _ended(ys: Sequence[Array], ts: Sequence[Array], end: End) -> Walk:
    return Walk(np.array(ys), np.array(ts), (End("start"), end))
