"""What happens along a traced curve: events found by sign changes, located on the curve itself, put in as points."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from tmsopt.design.frozen import Table
from tmsopt.design.problem import Problem
from tmsopt.models import Values
from tmsopt.roots import PATTERNS, Pattern, roots
from tmsopt.study.branch import Branch, Event
from tmsopt.study.continuation import CLOSED, Curve, End, Walk, between, crossing, project
from tmsopt.study.marks import (
    CHANGES,
    NOTHING,
    Mark,
    all_real,
    marks,
    parameters_of,
    satisfied,
    sign_changes,
    stability,
    values_of,
    vanishes,
)

Array = NDArray[np.float64]
Truth = NDArray[np.bool_]

_TOGETHER = 1e-6
"""Distance, in units of the scale, within which events are one: each is located to 1e-12 or better."""

_NEAR = 1e-3
"""Distance within which an EP4 is looked for beside an EP3 and a 2EP2."""

_SAME_DESIGN = 1e-6
"""Likewise in the free parameters alone: where the traced equations are singular, the unknowns scatter."""

_LOW = 1e-2
"""Relative size of the marks beside a place where they may touch 0: they grow with the square of a step of 0.1."""

_DIP = 0.5
"""Share of a small value that a parabola must fall further by, for its least to be looked for between the steps."""

_ASTRAY = 2.0  # arclengths: a point further off lies on another curve, as beside a singular point it may

_FITTING = 1e-6  # mismatch of a coefficient beyond which a point does not belong to its branch

_EXACT = 1e-13  # mismatch of a coefficient of an EP4, relative to its terms: some roundings

_ROUNDING = 1e-14  # of a variable of order 1

_RANK = ("EP4", "EP3", "2EP2", "double zero", "weave", "capsize", "EP2", "constraint", "fold")


@dataclass(frozen=True)
class _Found:
    name: str
    detail: str
    y: Array
    t: Array
    after: int  # row of the walk that it follows
    s: float


def describe(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Branch:
    """A walked curve in the parameters of the problem, with its events among its points."""
    walked = _refined(problem, pattern, on, unknowns, _trimmed(problem, pattern, on, unknowns, walked))
    found = [*_events(problem, pattern, on, unknowns, walked), *_touched(problem, pattern, on, unknowns, walked)]
    merged = _merged(_with_EP4(problem, pattern, on, found), len(problem.free))
    rows, y, t = _inserted(walked, merged)
    x = y * on.scale
    if pattern.unknowns[-2:] == ("b", "c"):
        for event, row in zip(merged, rows, strict=True):
            if event.name in ("EP4", "2EP2"):  # a double root of the last factor: exact, or it scatters by 1e-8
                x[row, unknowns.stop - 1] = x[row, unknowns.stop - 2] ** 2 / 4
    columns = parameters_of(problem, x)
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    kinds = pattern.kind(u)
    special = [m for m in pattern.marks if vanishes(pattern.marks[m](u), u)]
    for name in special:
        kinds[:] = name
    for event, row in zip(merged, rows, strict=True):
        if event.name in pattern.marks or event.name == "EP4":
            kinds[row] = event.name
    free = list(problem.free)
    width = np.diff(x, axis=0)[:, : len(free)] / on.scale[: len(free)]
    values = values_of(problem, pattern, columns, u)
    events = [
        Event(e.name, e.detail, Table({n: float(c[row]) for n, c in columns.items()}), row)
        for e, row in zip(merged, rows, strict=True)
    ]
    ends = () if walked.closed else ((walked.ends[0], 0), (walked.ends[1], len(x) - 1))
    events += [
        Event("end", _end_words(problem, pattern, end), Table({n: float(c[row]) for n, c in columns.items()}), row)
        for end, row in ends
    ]
    return Branch(
        pattern=str(problem.locate),
        parameters=columns,
        unknowns=dict(zip(pattern.unknowns, u, strict=True)),
        tangent=dict(zip(free, _natural_tangent(problem, on, x, t).T, strict=True)),
        arclength=np.concatenate([[0.0], np.cumsum(np.linalg.norm(width, axis=1))]),
        kinds=kinds,
        stable=stability(pattern.remaining(u), len(x)),
        heavily_damped=all_real(pattern.remaining(u), len(x)) & (pattern.name not in ("weave", "resonance")),
        satisfied=satisfied(problem, values, len(x)),
        abscissa=np.broadcast_to(values["abscissa"], len(x)),
        events=tuple(sorted(events, key=lambda e: e.index)),
        closed=walked.closed,
        residual=float(np.max(_residual(values, pattern.monic(u), u))),
    )


def _at(on: Curve, walked: Walk, k: int, mark: Mark, s: float) -> float:
    """A mark at arclength s from a row of the walk."""
    y, t = between(on, walked.y[k], walked.t[k], s)
    return float(np.broadcast_to(mark.value((y * on.scale)[None], t[None]), 1)[0])


def _live(problem: Problem, pattern: Pattern, unknowns: slice, x: Array, t: Array) -> Iterator[tuple[Mark, Array]]:
    """The marks that are not 0 all along the curve, with their values."""
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    within = [name for name, special in pattern.marks.items() if vanishes(special(u), u)]
    for mark in marks(problem, pattern, unknowns, within):
        value = np.broadcast_to(mark.value(x, t), len(x))
        if mark.name not in within and (mark.name != "fold" or np.abs(value).max() > NOTHING):
            yield mark, value


def _refined(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Walk:
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
                return sign * _at(on, walked, k, mark, s)

            found = minimize_scalar(
                height, bounds=(-steps[k - 1], steps[k]), method="bounded", options={"xatol": 1e-14}
            )
            s = float(found.x)
            y, t = between(on, walked.y[k], walked.t[k], s)
            if np.abs(y - walked.y[k]).max() <= _ASTRAY * abs(s) and t @ walked.t[k] > 0:
                added[(k, s) if s >= 0 else (k - 1, steps[k - 1] + s)] = y, t
    ys, ts = list(walked.y), list(walked.t)
    for shift, (after, s) in enumerate(sorted(added)):
        ys.insert(after + 1 + shift, added[after, s][0])
        ts.insert(after + 1 + shift, added[after, s][1])
    return replace(walked, y=np.array(ys), t=np.array(ts))


def _parabola(left: Array, here: Array, right: Array, before: Array, after: Array) -> tuple[Array, Array]:
    """Slope and second derivative, in the middle, of the parabolas through three values."""
    back, ahead = (here - left) / before, (right - here) / after
    return (back * after + ahead * before) / (before + after), 2 * (ahead - back) / (before + after)


def _events(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Iterator[_Found]:
    x = walked.y * on.scale
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    stable = stability(pattern.remaining(u), len(x))
    for mark, value in _live(problem, pattern, unknowns, x, walked.t):
        for i in np.flatnonzero(sign_changes(value)):
            if mark.detail == CHANGES and stable[i] == stable[i + 1]:
                continue
            end = float(walked.t[i] @ (walked.y[i + 1] - walked.y[i]))

            def at(s: float, i: int = int(i), mark: Mark = mark) -> float:
                return _at(on, walked, i, mark, s)

            if not at(0.0) * at(end) <= 0:
                continue  # a jump through infinity, or nan
            s = crossing(at, end)
            y, t = between(on, walked.y[i], walked.t[i], s)
            if not np.abs(y - walked.y[i]).max() <= _ASTRAY * s + _TOGETHER:
                continue
            if mark.name == "fold" and not _turns(walked, int(i), y, list(problem.free).index(mark.detail)):
                continue
            yield _Found(mark.name, mark.detail, y, t, int(i), s)


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


def _touched(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Iterator[_Found]:
    """EP4 where a curve of EP2 passes through it in a section: EP3 and 2EP2 touch 0 there, and keep their signs."""
    if pattern.name != "EP2":
        return
    x = walked.y * on.scale
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    value = sum(np.abs(mark(u)) for mark in pattern.marks.values()) / (1 + np.max(np.abs(u), axis=0) ** 2)
    least = (value[1:-1] <= value[:-2]) & (value[1:-1] <= value[2:]) & (value[1:-1] < _LOW)
    for k in np.flatnonzero(least) + 1:
        beside = _Found("EP4", "", walked.y[k], walked.t[k], int(k), 0.0)
        exact = _exact_EP4(problem, pattern, on, beside)
        if exact is not None:
            s = float(walked.t[k] @ (exact.y - walked.y[k]))
            yield replace(exact, after=int(k) if s >= 0 else int(k) - 1, s=s)


def _with_EP4(problem: Problem, pattern: Pattern, on: Curve, found: list[_Found]) -> list[_Found]:
    """Events in order; EP3 and 2EP2 side by side are one EP4 where there is one, and each EP4 is made exact.

    Where symmetry takes a curve through EP4, the traced equations are singular there, and locate it to 1e-6 only.
    """
    result: list[_Found] = []
    for event in sorted(found, key=lambda e: (e.after, e.s)):
        before = result[-1] if result else event
        pair = {event.name, before.name} == {"EP3", "2EP2"}
        if event.name == "EP4" or (pair and np.abs(event.y - before.y).max() <= _NEAR):
            exact = _exact_EP4(problem, pattern, on, event)
            if exact is not None:
                result = [*(result[:-1] if pair else result), exact]
                continue
        result.append(event)
    return result


def _exact_EP4(problem: Problem, pattern: Pattern, on: Curve, event: _Found) -> _Found | None:
    """The EP4 beside an event, by its own equations; None if there is none."""
    free = len(problem.free)
    x = ca.SX.sym("x", free + 1)
    symbols = {n: ca.atan(x[k]) if problem.parameter_set[n].tangent else x[k] for k, n in enumerate(problem.free)}
    a = Values(problem.model, problem.parameter_set, problem.ordered(symbols)).coefficients
    matched = [a[0] * c for c in PATTERNS["EP4"].monic([x[free]])]
    equations = ca.vertcat(*[p - q for p, q in zip(a[1:], matched[1:], strict=True)])
    mismatch = ca.Function(
        "mismatch",
        [x],
        [equations / ca.vertcat(*[ca.fabs(p) + ca.fabs(q) for p, q in zip(a[1:], matched[1:], strict=True)])],
    )
    start = event.y * on.scale
    u = list(start[free : free + len(pattern.unknowns)])
    mean = float(np.concatenate([roots(f) for f in pattern.factors(u)]).real.mean())
    end = project(ca.Function("EP4", [x], [equations, ca.jacobian(equations, x)]), np.append(start[:free], mean))
    if end is None or np.abs((end[:free] - start[:free]) / on.scale[:free]).max() > _NEAR:
        return None
    if np.any(np.abs(np.array(mismatch(end)).ravel()) > _EXACT):
        return None  # a section beside an EP4, not through it
    y = event.y.copy()
    y[:free] = end[:free] / on.scale[:free]
    fourfold = np.full(4, end[free], dtype=complex)
    y[free : free + len(u)] = np.array(pattern.guesses(fourfold)[0]) / on.scale[free : free + len(u)]
    return replace(event, name="EP4", detail="", y=y)


def _merged(found: list[_Found], free: int) -> list[_Found]:
    """Events in order, those at one place as one: the most special names it, the others stand in its detail."""
    groups: list[list[_Found]] = []
    for event in found:
        apart = np.abs(event.y - groups[-1][-1].y) if groups else np.array([np.inf])
        if apart.max() <= _TOGETHER * (1 + np.abs(event.y).max()) or apart[:free].max() <= _SAME_DESIGN:
            groups[-1].append(event)
        else:
            groups.append([event])
    return [_one(group) for group in groups]


def _one(group: list[_Found]) -> _Found:
    group = sorted(group, key=lambda e: _RANK.index(e.name))
    names = {e.name for e in group}
    name = "double zero" if {"weave", "capsize"} <= names else group[0].name
    folds = dict.fromkeys(e.detail for e in group if e.name == "fold")
    special = [m for m in ("EP3", "2EP2") if m in names]
    others = ["beside an EP4"] if name == "EP3" and len(special) == 2 else []
    others += [
        e.detail if e.name == name else f"{e.name} {e.detail}".strip()
        for e in group
        if e.name not in ("fold", *special)
    ]
    others = [text for text in dict.fromkeys(others) if text]
    if name == "EP3" and len(folds) > 1:
        others.append("cusp")
    elif folds:
        others.append(("" if name == "fold" else "fold in ") + ", ".join(folds))
    return replace(group[0], name=name, detail="; ".join(others))


def _inserted(walked: Walk, events: list[_Found]) -> tuple[list[int], Array, Array]:
    """Rows of the events, and points and tangents with the events among them."""
    y, t, rows = list(walked.y), list(walked.t), []
    for shift, event in enumerate(events):
        row = event.after + 1 + shift
        y.insert(row, event.y)
        t.insert(row, event.t)
        rows.append(row)
    return rows, np.array(y), np.array(t)


def _natural_tangent(problem: Problem, on: Curve, x: Array, t: Array) -> Array:
    """Derivative of the free parameters by the arclength in widths of the box."""
    of = problem.parameter_set
    columns = [t[:, k] * on.scale[k] / (1 + x[:, k] ** 2 if of[n].tangent else 1.0) for k, n in enumerate(problem.free)]
    size = np.linalg.norm(t[:, : len(columns)], axis=1)
    return np.asarray(np.stack(columns, axis=-1) / (size + 1e-300)[:, None])


def _residual(values: Values, monic: list[Any], u: list[Array]) -> Array:
    """Largest mismatch of a coefficient at each point, relative to the terms that it is made of."""
    a0 = np.asarray(values.coefficients[0], dtype=float)
    worst = np.zeros(np.shape(u[0]))
    for a, c in zip(values.coefficients, monic, strict=True):
        size = np.abs(a) + np.abs(a0 * c) + np.abs(a0)
        worst = np.maximum(worst, np.abs(a - a0 * c) / size)
    return worst


def _trimmed(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Walk:
    """Without the points beside infinity that have lost their digits: their parameters do not fit the unknowns."""
    x = walked.y * on.scale
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    with np.errstate(all="ignore"):
        values = values_of(problem, pattern, parameters_of(problem, x), u)
        good = np.flatnonzero(_residual(values, pattern.monic(u), u) <= _FITTING)
    if walked.closed or not good.size:
        return walked
    inside = slice(int(good[0]), int(good[-1]) + 1)
    return replace(walked, y=walked.y[inside], t=walked.t[inside])


def _end_words(problem: Problem, pattern: Pattern, end: End) -> str:
    if end.limit is None:
        return end.reason if end.reason != CLOSED else ""
    free = list(problem.free)
    if end.limit < len(free):
        return f"{free[end.limit]}.{end.reason}"
    name = pattern.unknowns[end.limit - len(free)]
    return pattern.ends.get(name, f"{name} reaches its limit")
