"""Converts a walked curve to branches in the parameters of the problem, with the events among their points."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from tmsopt.problem.verdict.meetings import is_crossing
from tmsopt.problem.verdict.stability import CROSSING
from tmsopt.records import Array
from tmsopt.roots import Pattern, pattern as pattern_of
from tmsopt.tracing.branch import Branch, EventPoint, table_at
from tmsopt.tracing.continuation import CLOSED, SINGULAR, End, Walk
from tmsopt.tracing.equations import TracedProblem, prepare_tracing
from tmsopt.tracing.events import SAME_PLACE, Event, LocatedEvent, insert_events, locate_events, refine_walk
from tmsopt.tracing.points import Points, roots_along
from tmsopt.tracing.solving import project_rows

_EP4_DISTANCE = 1e-3  # distance within which an EP4 is searched near an EP3 and a 2EP2
_LOW_MARK = 1e-2  # mark below which the marks may touch 0 nearby, because they grow with the square of a step of 0.1
_EP4_RESIDUAL = 1e-13  # relative mismatch of a coefficient at an EP4: a few roundings
_SAME_DESIGN = 1e-6
"""Like `SAME_PLACE`, but for the free parameters only. Where the equations are singular, the unknowns are inexact."""
_MAX_RESIDUAL = 1e-6  # largest mismatch of a coefficient at a point of a branch

_SQUARE_TOLERANCE = 1e-9  # relative difference of c from b²/4 below which a quadratic factor has a double root

_EP4 = Event("EP4", lambda points: points.residual)  # located by equations of its own

RowEvent = tuple[int, Event]
"""A row of a walk, and the event at this row."""


def make_branches(traced: TracedProblem, walk: Walk, events: Sequence[Event] = ()) -> Iterator[Branch]:
    """A walked curve as a branch, with its events among its points; as several branches if events stop the curve."""
    walk, row_events = find_events(traced, _trim_inexact_ends(traced, walk), events)
    if walk.closed and (stops := [row for row, event in row_events if event.stop]):
        first, around = stops[0], len(walk.y) - 1
        y, t = (np.concatenate([column[first:], column[1 : first + 1]]) for column in (walk.y, walk.t))
        walk = replace(walk, y=y, t=t)
        row_events = [((row - first) % around, event) for row, event in row_events]
        row_events += [(around, event) for row, event in row_events if row == 0]
    stops_at = {row: End(event.name) for row, event in row_events if event.stop}
    for first_row, last_row in pairwise(sorted({0, len(walk.y) - 1, *stops_at})):
        ends = stops_at.get(first_row, walk.ends[0]), stops_at.get(last_row, walk.ends[1])
        part = Walk(walk.y[first_row : last_row + 1], walk.t[first_row : last_row + 1], ends)
        yield make_branch(
            traced, part, [(row - first_row, event) for row, event in row_events if first_row <= row <= last_row]
        )


def find_events(traced: TracedProblem, walk: Walk, events: Sequence[Event]) -> tuple[Walk, list[RowEvent]]:
    """The walk with its events among its points, and the rows of the events."""
    walk = refine_walk(traced, walk, events)
    groups = _group_events(
        _add_exact_EP4(traced, walk, [*locate_events(traced, walk, events)]), len(traced.problem.free)
    )
    rows, walk = insert_events(walk, [group[0] for group in groups])
    return walk, [
        (row, event) for row, group in zip(rows, groups, strict=True) for event in _merge_events(group, events)
    ]


def make_branch(traced: TracedProblem, walk: Walk, row_events: Sequence[RowEvent]) -> Branch:
    """A walk as a branch in the parameters of the problem."""
    problem, pattern, points = traced.problem, traced.pattern, Points(traced, walk.y, walk.t)
    if pattern.unknowns[-2:] == ("b", "c"):  # rounding would move a double root of a factor by 1e-8
        b, c = (points.x[:, traced.unknowns.stop - k] for k in (2, 1))
        for row in {row for row, event in row_events if "EP" in event.name}:
            c[row] = b[row] ** 2 / 4 if abs(b[row] ** 2 / 4 - c[row]) <= _SQUARE_TOLERANCE * abs(c[row]) else c[row]
    kinds = pattern.kind(points.unknowns)
    for name in points.special:
        kinds[:] = name
    for row, event in row_events:
        if event.name in pattern.marks or event.name == "EP4":
            kinds[row] = event.name
    residual, columns = points.residual, points.parameters
    event_rows = [(row, event.name, event.detail) for row, event in row_events]
    for row, end in () if walk.closed else zip((0, len(points) - 1), walk.ends, strict=True):
        # where roots coincide but eigenvectors do not, the curve is singular
        is_crossed = end.reason == SINGULAR and is_crossing(problem, pattern, table_at(columns, row))
        event_rows.append((row, "end", CROSSING if is_crossed else describe_end(traced, end)))
    event_points = [
        EventPoint(name, detail, table_at(columns, row), row, float(residual[row]))
        for row, name, detail in sorted(event_rows, key=lambda n: n[0])
    ]
    steps = np.diff(walk.y, axis=0)[:, : len(problem.free)]
    return Branch(
        pattern=str(problem.locate),
        parameters=columns,
        unknowns=dict(zip(pattern.unknowns, points.unknowns, strict=True)),
        tangent=_compute_natural_tangent(points),
        arclength=np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))]),
        kinds=kinds,
        stable=points.stable,
        heavily_damped=points.heavily_damped,
        satisfied=points.satisfied,
        abscissa=points["abscissa"],
        events=tuple(event_points),
        closed=walk.closed,
        residual=float(np.max(residual)),
        eigenfrequency=_compute_eigenfrequency(points),
    )


def _compute_eigenfrequency(points: Points) -> dict[str, Array] | None:
    """The multiple eigenfrequency ω = i s minus the carrier of a complex system; None for a real system."""
    carrier, pattern = points.traced.problem.model.carrier, points.traced.pattern
    if carrier is None:
        return None
    if not pattern.form.startswith("CEP") or pattern.unknowns[:2] != ("b", "c"):
        return {}
    b, c = points.unknowns[:2]
    return {"omega_re": np.sqrt(c - b * b / 4) - carrier, "omega_im": -b / 2}


def _group_events(located: Sequence[LocatedEvent], free: int) -> list[list[LocatedEvent]]:
    """Events in the order of the curve, in groups at one place. In a group, the events keep the order of the list."""
    groups: list[list[int]] = []
    for k in sorted(range(len(located)), key=lambda k: (located[k].row, located[k].s)):
        distance = np.abs(located[k].y - located[groups[-1][-1]].y) if groups else np.array([np.inf])
        if distance.max() > SAME_PLACE * (1 + np.abs(located[k].y).max()) and distance[:free].max() > _SAME_DESIGN:
            groups.append([])
        groups[-1].append(k)
    return [[located[k] for k in sorted(group)] for group in groups]


def _merge_events(group: Sequence[LocatedEvent], events: Sequence[Event]) -> Iterator[Event]:
    """The events at one place: the most special package event, whose detail has the others; then the user's events."""
    package_events = [f.event for f in group if f.event not in events]
    if package_events:
        names = {e.name for e in package_events}
        name = "double zero" if {"weave", "capsize"} <= names else package_events[0].name
        folds = dict.fromkeys(e.detail for e in package_events if e.name == "fold")
        words = [f"next to an {higher_point}"] if (higher_point := _find_higher_order(name, names)) else []
        for e in package_events:
            if e.name != "fold" and ("EP" not in e.name or e.name == "EP2"):
                words.append(e.detail if e.name == name else f"{e.name} {e.detail}".strip())
        if name == "EP3" and len(folds) > 1:
            words.append("cusp")
        elif folds:
            words.append(("" if name == "fold" else "fold in ") + ", ".join(folds))
        yield replace(package_events[0], name=name, detail="; ".join(filter(None, dict.fromkeys(words))))
    yield from (f.event for f in group if f.event in events)


def _find_higher_order(name: str, names: set[str]) -> str:
    """EP(k+1) if EPk and EP(k−1)+EP2 are at one place, since both end in it; empty otherwise."""
    match = re.fullmatch(r"EP(\d+)", name)
    order = int(match[1]) if match else 0
    return f"EP{order + 1}" if ("2EP2" if order == 3 else f"EP{order - 1}+EP2") in names else ""


def _compute_natural_tangent(points: Points) -> dict[str, Array]:
    """Derivatives of the free parameters with respect to the arclength, which is in widths of the ranges."""
    problem, speeds = points.traced.problem, points.t * points.traced.curve.scale / (points.speed[:, None] + 1e-300)
    parameter_set = problem.parameter_set
    columns = zip(problem.free, speeds.T, points.x.T, strict=False)
    return {n: dv / (1 + v**2) if parameter_set[n].tangent else dv for n, dv, v in columns}


def _trim_inexact_ends(traced: TracedProblem, walk: Walk) -> Walk:
    """The walk without its first and last points, near infinity, whose parameters do not fit the unknowns."""
    with np.errstate(all="ignore"):
        good_rows = np.flatnonzero(Points(traced, walk.y, walk.t).residual <= _MAX_RESIDUAL)
    if walk.closed or not good_rows.size:
        return walk
    kept_rows = slice(int(good_rows[0]), int(good_rows[-1]) + 1)
    return replace(walk, y=walk.y[kept_rows], t=walk.t[kept_rows])


def describe_end(traced: TracedProblem, end: End) -> str:
    """Why a curve ends, in words."""
    if end.limit is None:
        return end.reason if end.reason != CLOSED else ""
    free = list(traced.problem.free)
    if end.limit < len(free):
        return f"{free[end.limit]}.{end.reason}"
    name = traced.pattern.unknowns[end.limit - len(free)]
    return traced.pattern.ends.get(name, "the other roots reach a limit of the search")


def _add_exact_EP4(traced: TracedProblem, walk: Walk, located: list[LocatedEvent]) -> list[LocatedEvent]:
    """The events, in which each EP4 is exact and comes first.

    On a curve of EP2, the marks of EP3 and 2EP2 both vanish at an EP4. If the section is symmetric, they only touch 0,
    and locate the EP4 to 1e-6 only.
    """
    candidates = [f for f in located if f.event.name == "EP4"]
    if traced.pattern.form == "EP2" and {"EP3", "2EP2"} <= {*traced.pattern.marks}:
        _, refined_walk = insert_events(walk, located)
        points = Points(traced, refined_walk.y, refined_walk.t)
        height = np.abs(points.mark("EP3")) + np.abs(points.mark("2EP2"))
        is_minimum = (height[1:-1] <= height[:-2]) & (height[1:-1] <= height[2:]) & (height[1:-1] < _LOW_MARK)
        candidates += [
            LocatedEvent(_EP4, refined_walk.y[k], refined_walk.t[k], k, 0.0)
            for k in (np.flatnonzero(is_minimum) + 1).tolist()
        ]
    return [*filter(None, (_solve_EP4(traced, walk, f) for f in candidates)), *located]


def _solve_EP4(traced: TracedProblem, walk: Walk, located: LocatedEvent) -> LocatedEvent | None:
    """The EP4 next to an event, computed from the equations of an EP4; None without an EP4."""
    problem, pattern, scale = traced.problem, traced.pattern, traced.curve.scale
    free, EP4 = len(problem.free), pattern_of("EP4", problem.model.degree)
    at_EP4 = prepare_tracing(problem.derive(constraints={}), EP4)
    start, unit = located.y * scale, at_EP4.curve.scale
    guess = _convert_unknowns(pattern, start[traced.unknowns], at_EP4.pattern)
    (end,) = project_rows(at_EP4.curve.evaluate, np.array([[*start[:free], *guess]]) / unit, [None])
    if not np.abs(end[:free] - located.y[:free]).max() <= _EP4_DISTANCE:  # nan where nothing is found
        return None
    if Points(at_EP4, end[None], located.t[None]).residual[0] > _EP4_RESIDUAL:
        return None  # the section lies next to an EP4, not through it
    exact = located.y.copy()
    exact[:free] = end[:free]
    exact[traced.unknowns] = _convert_unknowns(at_EP4.pattern, (end * unit)[free:], pattern) / scale[traced.unknowns]
    k = int(np.argmin(np.abs(walk.y - exact).max(axis=1)))
    row = k if walk.t[k] @ (exact - walk.y[k]) >= 0 else max(k - 1, 0)
    return LocatedEvent(_EP4, exact, located.t, row, float(walk.t[row] @ (exact - walk.y[row])))


def _convert_unknowns(pattern: Pattern, unknowns: Array, target: Pattern) -> Array:
    """The unknowns of another pattern, for the same roots."""
    return np.array(target.guesses(roots_along(pattern.factors(list(unknowns)), 1)[0])[0])
