"""Finds the curves a0 = 0 in a plane, where a root goes through infinity, and the other roots along these curves.

On one side of such a curve a large root is negative, on the other side it is positive. The curve bounds stability where
the other roots are stable. It bounds heavy damping where they are real and negative.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice

import casadi as ca
import numpy as np

from tmsopt.models import Values
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import variables_of
from tmsopt.program.nlp import scale_of
from tmsopt.program.starts import sample_box
from tmsopt.records import Array, Truth
from tmsopt.roots import is_stable, real_roots
from tmsopt.roots.sign_tests import double_root_test
from tmsopt.tracing.continuation import Curve, Walk, compile_curve
from tmsopt.tracing.equations import design_at, limits_of
from tmsopt.tracing.events import Event, LocatedEvent, insert_events, locate_zeros
from tmsopt.tracing.points import axis_functions
from tmsopt.tracing.seeds import find_missed_designs, walk_new_curves
from tmsopt.tracing.solving import map_rows, project_rows

_ZERO_TERM = 1e-12  # largest constant term, as a share of the largest coefficient, that vanishes together with a0
_MAX_POINTS = 10**6  # largest number of points of a curve in one direction


@dataclass(frozen=True)
class InfinityCurve:
    """A curve a0 = 0 in the plane of two free parameters.

    Attributes:
        parameters: free parameter → values at n points.
        stable: for each of the n - 1 segments, whether it bounds stability.
        heavily_damped: whether the segment bounds heavy damping.
        parting: whether the segment separates capsize from weave.
        changes: row → the change of the other roots at this row: ``capsize``, ``weave``, ``EP2`` or ``infinity``.
    """

    parameters: dict[str, Array]
    stable: Truth
    heavily_damped: Truth
    parting: Truth
    changes: dict[int, str]


def find_infinity_curves(problem: Posed, step: float, starts: int, seed: int) -> Iterator[InfinityCurve]:
    """Every curve a0 = 0 found in the box of a problem with two free parameters."""
    x, parameter_set = ca.SX.sym("x", 2), problem.parameter_set
    design = {
        n: ca.atan(v) if parameter_set[n].tangent else v for n, v in zip(problem.free, ca.vertsplit(x), strict=True)
    }
    a = scale_of(problem).scale_coefficients(Values(problem.model, parameter_set, problem.ordered(design)).coefficients)
    if ca.SX(a[0]).is_constant() or not ca.depends_on(a[0], x):
        return
    lower, upper = limits_of(problem)
    curve = compile_curve(x, ca.SX(a[0]), upper - lower, lower, upper)
    alignment = ca.dot(ca.gradient(a[0], x), ca.gradient(ca.SX(a[-1]), x))
    other_coefficients = ca.Function("rest", [x], [ca.densify(ca.vertcat(*a[1:], alignment))])
    walks: list[Walk] = []
    walk_new_curves(curve, _find_points(problem, curve, starts, seed, walks), step, _MAX_POINTS, walks)
    yield from (_describe_curve(problem, curve, walk, other_coefficients) for walk in walks)


def _find_points(problem: Posed, curve: Curve, starts: int, seed: int, walks: Sequence[Walk]) -> Iterator[Array]:
    """Points of the curve in the box: first from designs all over the box, then from a grid, away from known curves."""
    sample = list(islice(sample_box(problem, seed), starts))
    missed = ([d] for d in find_missed_designs(problem, curve, lambda a: a[0], walks))
    for designs in chain([sample] if sample else [], missed):
        points = np.array([variables_of(problem, d) for d in designs]) / curve.scale
        y = project_rows(curve.evaluate, points, [k % 2 for k in range(len(points))])
        yield y[np.all((curve.lower <= y) & (y <= curve.upper), axis=1)]  # false for nan


def _describe_curve(problem: Posed, curve: Curve, walk: Walk, other_coefficients: ca.Function) -> InfinityCurve:
    """Describe a walk along a0 = 0, with every change of the other roots among its points."""

    def values(y: Array) -> Array:
        return map_rows(other_coefficients, y * curve.scale)[0]

    def tests(y: Array) -> list[tuple[str, Array]]:
        """Functions that are 0 where the other roots change, each with the name of the change."""
        v = values(y)
        c = list(v[:, : -2 if constant_vanishes else -1].T)
        named_functions = [("weave" if k else "capsize", value) for k, value in enumerate(axis_functions(c))]
        named_functions += [("EP2", double_root_test(c))] if len(c) > 2 else []
        return [("infinity", c[0]), *named_functions, *([("capsize", v[:, -1])] if constant_vanishes else [])]

    size = np.abs(values(walk.y)[:, :-1])
    constant_vanishes = bool(np.all(size[:, -1] <= _ZERO_TERM * size.max(axis=1)))
    located_events: list[LocatedEvent] = []
    for k, (name, column) in enumerate(tests(walk.y)):
        event = Event(name, partial(lambda k, tested: tested[k][1], k))
        located_events += locate_zeros(curve, walk, lambda y, t: tests(y), event, column)
    located_events.sort(key=lambda f: (f.row, f.s, f.event.name))
    rows, walk = insert_events(walk, located_events)
    is_distinct = np.append(True, np.any(np.diff(walk.y, axis=0) != 0, axis=1))  # a zero may be at a point of the walk
    points, event_rows = walk.y[is_distinct], (np.cumsum(is_distinct) - 1)[rows].tolist()
    bounds = _classify_segments(values((points[1:] + points[:-1]) / 2), constant_vanishes)
    row_events = zip(event_rows, [f.event.name for f in located_events], strict=True)
    changes = {row: name for row, name in row_events if any(b[row - 1] != b[row] for b in bounds)}
    return InfinityCurve(design_at(problem, points * curve.scale), *bounds, changes)


def _classify_segments(v: Array, constant_vanishes: bool) -> tuple[Truth, Truth, Truth]:
    """Whether each segment bounds stability, bounds heavy damping, or separates capsize from weave.

    If the constant term vanishes with a0, another root goes through 0. Both roots go to the same side only if both
    coefficients change their signs in the same direction.
    """
    c = v[:, : -2 if constant_vanishes else -1]
    stable, damped, parting = np.zeros((3, len(c)), dtype=bool)
    is_proper = c[:, 0] != 0
    if constant_vanishes:
        is_proper &= v[:, -1] > 0
    stable[is_proper] = is_stable(c[is_proper])
    negative_count, positive_count = real_roots(c[is_proper])
    damped[is_proper] = stable[is_proper] & (negative_count == c.shape[1] - 1)
    parting[is_proper] = ~stable[is_proper] & (positive_count == 0)
    return stable, damped, parting
