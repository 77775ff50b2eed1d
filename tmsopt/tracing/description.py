"""Converts a walked curve to branches in the parameters of the problem, with the events among their points.

A mark of a pattern is a function that vanishes at a special case of the pattern. For example, a mark of the pattern
EP2 vanishes at an EP3.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from tmsopt.chains.meetings import is_crossing
from tmsopt.problem.verdict.stability import CROSSING
from tmsopt.records import Array
from tmsopt.roots import Pattern, pattern as pattern_of
from tmsopt.tracing.branch import Branch, EventPoint, table_at
from tmsopt.tracing.chain_curve import ChainSetup
from tmsopt.tracing.continuation import CLOSED, SINGULAR, End, Walk, step_along
from tmsopt.tracing.equations import Setup, TracingSetup, prepare_factors
from tmsopt.tracing.events import SAME_PLACE, Event, LocatedEvent, insert_events, locate_events, refine_walk
from tmsopt.tracing.points import Points, roots_along
from tmsopt.tracing.solving import project_rows

_EP4_DISTANCE = 1e-3  # distance within which an EP4 is searched near an EP3 and a 2EP2
_LOW_MARK = 1e-2  # a mark below this value may touch 0 nearby: it grows with the square of the distance, here 0.1
_EP4_RESIDUAL = 1e-13  # largest relative mismatch of a coefficient at an EP4: a few rounding errors
_SAME_DESIGN = 1e-6
"""Like `SAME_PLACE`, but for the free parameters only. Where the equations are singular, the unknowns are inexact."""
_MAX_RESIDUAL = 1e-6  # largest mismatch of a coefficient at a point of a branch

_SQUARE_TOLERANCE = 1e-9  # relative difference of c from b²/4 below which a quadratic factor has a double root

_EP4 = Event("EP4", lambda points: points.residual)  # an EP4 is located by equations of its own

RowEvent = tuple[int, Event]
"""A row of a walk, and the event at this row."""


def make_branches(setup: Setup, walk: Walk, events: Sequence[Event] = ()) -> Iterator[Branch]:
    """Convert a walk to branches, with the events among their points. Events that stop the curve divide it."""
    walk, row_events = find_events(setup, _trim_inexact_ends(setup, walk), events)
    if walk.closed and (stops := [row for row, event in row_events if event.stop]):
        first_stop, row_count = stops[0], len(walk.y) - 1
        y, t = (np.concatenate([column[first_stop:], column[1 : first_stop + 1]]) for column in (walk.y, walk.t))
        walk = replace(walk, y=y, t=t)
        row_events = [((row - first_stop) % row_count, event) for row, event in row_events]
        row_events += [(row_count, event) for row, event in row_events if row == 0]
    stops_at = {row: End(event.name) for row, event in row_events if event.stop}
    for first_row, last_row in pairwise(sorted({0, len(walk.y) - 1, *stops_at})):
        ends = stops_at.get(first_row, walk.ends[0]), stops_at.get(last_row, walk.ends[1])
        part = Walk(walk.y[first_row : last_row + 1], walk.t[first_row : last_row + 1], ends)
        yield make_branch(
            setup, part, [(row - first_row, event) for row, event in row_events if first_row <= row <= last_row]
        )


def find_events(setup: Setup, walk: Walk, events: Sequence[Event]) -> tuple[Walk, list[RowEvent]]:
    """The walk with its events among its points, and the rows of the events."""
    walk = refine_walk(setup, walk, events)
    groups = _group_events(
        _add_special_points(setup, walk, [*locate_events(setup, walk, events)]), len(setup.problem.free)
    )
    rows, walk = insert_events(walk, [group[0] for group in groups])
    return walk, [
        (row, event) for row, group in zip(rows, groups, strict=True) for event in _merge_events(group, events)
    ]


def make_branch(setup: Setup, walk: Walk, row_events: Sequence[RowEvent]) -> Branch:
    """A walk as a branch in the parameters of the problem."""
    problem, pattern, points = setup.problem, setup.pattern, Points(setup, walk.y, walk.t)
    if isinstance(setup, TracingSetup) and pattern.unknowns[-2:] == (
        "b",
        "c",
    ):  # rounding would move a double root of a factor by 1e-8
        b, c = (points.x[:, setup.unknown_columns.stop - k] for k in (2, 1))
        for row in {row for row, event in row_events if "EP" in event.name}:
            c[row] = b[row] ** 2 / 4 if abs(b[row] ** 2 / 4 - c[row]) <= _SQUARE_TOLERANCE * abs(c[row]) else c[row]
    kinds = pattern.kind([points.column(0.0), *points.unknowns][-len(pattern.unknowns) :])
    for name in points.special_cases:
        kinds[:] = name
    for row, event in row_events:
        if event.name in pattern.marks or re.fullmatch(r"C?EP\d+", event.name):
            kinds[row] = event.name
    residual, columns = points.residual, points.parameters
    event_rows = [(row, event.name, event.detail) for row, event in row_events]
    for row, end in () if walk.closed else zip((0, len(points) - 1), walk.ends, strict=True):
        # where roots coincide but eigenvectors do not, the curve is singular
        is_crossed = end.reason == SINGULAR and is_crossing(problem, pattern, table_at(columns, row))
        event_rows.append((row, "end", CROSSING if is_crossed else describe_end(setup, end)))
    event_points = [
        EventPoint(name, detail, table_at(columns, row), row, float(residual[row]))
        for row, name, detail in sorted(event_rows, key=lambda n: n[0])
    ]
    steps = np.diff(walk.y, axis=0)[:, : len(problem.free)]
    unknowns = dict(zip(pattern.unknowns, points.unknowns, strict=True))
    frequencies = {name: column for name, column in unknowns.items() if name.startswith("omega")}
    return Branch(
        pattern=str(problem.locate),
        parameters=columns,
        unknowns=unknowns,
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
        eigenfrequency=frequencies if problem.model.is_complex else None,
    )


def _group_events(located_events: Sequence[LocatedEvent], free_count: int) -> list[list[LocatedEvent]]:
    """Events in the order of the curve, in groups at one place. In a group, the events keep the order of the list."""
    groups: list[list[int]] = []
    for k in sorted(range(len(located_events)), key=lambda k: (located_events[k].row, located_events[k].s)):
        distance = np.abs(located_events[k].y - located_events[groups[-1][-1]].y) if groups else np.array([np.inf])
        if (
            distance.max() > SAME_PLACE * (1 + np.abs(located_events[k].y).max())
            and distance[:free_count].max() > _SAME_DESIGN
        ):
            groups.append([])
        groups[-1].append(k)
    return [[located_events[k] for k in sorted(group)] for group in groups]


def _merge_events(group: Sequence[LocatedEvent], events: Sequence[Event]) -> Iterator[Event]:
    """One event of the package, the most special one, whose detail names the others; then the events of the user."""
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
    """EP(k+1) if EPk and EP(k−1)+EP2 are at one place, because curves of both end at an EP(k+1); empty otherwise."""
    match = re.fullmatch(r"EP(\d+)", name)
    order = int(match[1]) if match else 0
    return f"EP{order + 1}" if ("2EP2" if order == 3 else f"EP{order - 1}+EP2") in names else ""


def _compute_natural_tangent(points: Points) -> dict[str, Array]:
    """Derivatives of the free parameters with respect to the arclength, which is in widths of the ranges."""
    problem, speeds = points.setup.problem, points.t * points.setup.curve.scale / (points.speed[:, None] + 1e-300)
    parameter_set = problem.parameter_set
    columns = zip(problem.free, speeds.T, points.x.T, strict=False)
    return {n: dv / (1 + v**2) if parameter_set[n].tangent else dv for n, dv, v in columns}


def _trim_inexact_ends(setup: Setup, walk: Walk) -> Walk:
    """The walk without the points at its ends whose parameters do not fit the unknowns, as happens near infinity."""
    with np.errstate(all="ignore"):
        good_rows = np.flatnonzero(Points(setup, walk.y, walk.t).residual <= _MAX_RESIDUAL)
    if walk.closed or not good_rows.size:
        return walk
    kept_rows = slice(int(good_rows[0]), int(good_rows[-1]) + 1)
    return replace(walk, y=walk.y[kept_rows], t=walk.t[kept_rows])


def describe_end(setup: Setup, end: End) -> str:
    """Why a curve ends, in words."""
    if end.variable is None:
        return end.reason if end.reason != CLOSED else ""
    free_names = list(setup.problem.free)
    if end.variable < len(free_names):
        return f"{free_names[end.variable]}.{end.reason}"
    name = setup.pattern.unknowns[end.variable - len(free_names)]
    return setup.pattern.ends.get(name, "the other roots reach a limit of the search")


def _add_special_points(setup: Setup, walk: Walk, located_events: list[LocatedEvent]) -> list[LocatedEvent]:
    """The special points of a curve of chains, or the exact EP4s of a curve of factors, and then all events.

    On a curve of EP2, the marks of EP3 and 2EP2 both vanish at an EP4. If the curve is symmetric about the EP4, the
    marks touch 0 without a change of sign, and so they give the EP4 only to 1e-6.
    """
    if isinstance(setup, ChainSetup):
        details = {"crossing": CROSSING}
        return [
            *(
                _place_event(setup, Event(n, lambda p: p.residual, detail=details.get(n, "")), walk, y)
                for n, y in setup.special_points(walk.y)
            ),
            *located_events,
        ]
    candidates = [f for f in located_events if f.event.name == "EP4"]
    if setup.pattern.form == "EP2" and {"EP3", "2EP2"} <= {*setup.pattern.marks}:
        _, refined_walk = insert_events(walk, located_events)
        points = Points(setup, refined_walk.y, refined_walk.t)
        height = np.abs(points.mark("EP3")) + np.abs(points.mark("2EP2"))
        is_minimum = (height[1:-1] <= height[:-2]) & (height[1:-1] <= height[2:]) & (height[1:-1] < _LOW_MARK)
        candidates += [
            LocatedEvent(_EP4, refined_walk.y[k], refined_walk.t[k], k, 0.0)
            for k in (np.flatnonzero(is_minimum) + 1).tolist()
        ]
    return [*filter(None, (_solve_EP4(setup, walk, f) for f in candidates)), *located_events]


def _solve_EP4(setup: TracingSetup, walk: Walk, located_event: LocatedEvent) -> LocatedEvent | None:
    """The EP4 next to an event, computed from the equations of an EP4; None if there is no EP4."""
    problem, pattern, scale = setup.problem, setup.pattern, setup.curve.scale
    free_count, EP4 = len(problem.free), pattern_of("EP4", problem.model.degree)
    EP4_problem = prepare_factors(problem.derive(constraints={}), EP4)
    x, unit = located_event.y * scale, EP4_problem.curve.scale
    guess = _convert_unknowns(pattern, x[setup.unknown_columns], EP4_problem.pattern)
    (solution,) = project_rows(EP4_problem.curve.evaluate, np.array([[*x[:free_count], *guess]]) / unit, [None])
    if (
        not np.abs(solution[:free_count] - located_event.y[:free_count]).max() <= _EP4_DISTANCE
    ):  # nan if no solution is found
        return None
    if Points(EP4_problem, solution[None], located_event.t[None]).residual[0] > _EP4_RESIDUAL:
        return None  # the curve passes next to an EP4, not through it
    exact_point = located_event.y.copy()
    exact_point[:free_count] = solution[:free_count]
    exact_point[setup.unknown_columns] = (
        _convert_unknowns(EP4_problem.pattern, (solution * unit)[free_count:], pattern) / scale[setup.unknown_columns]
    )
    return replace(_place_event(setup, _EP4, walk, exact_point), t=located_event.t)


def _place_event(setup: Setup, event: Event, walk: Walk, y: Array) -> LocatedEvent:
    """An event at a point next to a walk."""
    k = int(np.argmin(np.abs(walk.y - y).max(axis=1)))
    row = k if walk.t[k] @ (y - walk.y[k]) >= 0 else max(k - 1, 0)
    (t,) = step_along(setup.curve, y[None], walk.t[[k]], np.zeros(1))[1]
    return LocatedEvent(event, y, t if np.isfinite(t).all() else walk.t[k], row, float(walk.t[row] @ (y - walk.y[row])))


def _convert_unknowns(pattern: Pattern, unknowns: Array, target: Pattern) -> Array:
    """Convert the unknowns of a pattern to the unknowns of `target` that give the same roots."""
    return np.array(target.guesses(roots_along(pattern.factors(list(unknowns)), 1)[0])[0])
