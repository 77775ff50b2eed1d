"""Where a root goes through infinity: the curves a0 = 0 in a plane, and what the other roots do along them.

On one side of such a curve a large root is negative, on the other positive: it bounds stability where the other
roots are stable, and heavy damping where they are real and negative.
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
from tmsopt.program.starts import spread
from tmsopt.records import Array, Truth
from tmsopt.roots import is_stable, real_roots
from tmsopt.roots.sign_tests import double_root_test
from tmsopt.tracing.continuation import Curve, Walk, curve
from tmsopt.tracing.equations import design_at, limits_of
from tmsopt.tracing.events import Event, Found, insert, locate_zeros
from tmsopt.tracing.points import margins
from tmsopt.tracing.seeds import unexplained, walk_new
from tmsopt.tracing.solving import projected, rows_of

_NOTHING = 1e-12  # of the largest coefficient: a constant term this small all along the curve vanishes with a0
_MOST = 10**6


@dataclass(frozen=True)
class Infinity:
    """A curve a0 = 0 in the plane of two free parameters.

    Attributes:
        parameters: free parameter → values at n points.
        stable: where it bounds stability, for each of the n - 1 segments.
        heavily_damped: where it bounds heavy damping, likewise.
        parting: where it parts capsize from weave.
        changes: row → what the other roots do there, ``capsize``, ``weave``, ``EP2`` or a second ``infinity``.
    """

    parameters: dict[str, Array]
    stable: Truth
    heavily_damped: Truth
    parting: Truth
    changes: dict[int, str]


def through_infinity(problem: Posed, step: float, starts: int, seed: int) -> Iterator[Infinity]:
    """Every curve a0 = 0 found in the box of a problem with two free parameters."""
    x, of = ca.SX.sym("x", 2), problem.parameter_set
    design = {n: ca.atan(v) if of[n].tangent else v for n, v in zip(problem.free, ca.vertsplit(x), strict=True)}
    a = scale_of(problem).scaled(Values(problem.model, of, problem.ordered(design)).coefficients)
    if ca.SX(a[0]).is_constant() or not ca.depends_on(a[0], x):
        return
    lower, upper = limits_of(problem)
    on = curve(x, ca.SX(a[0]), upper - lower, lower, upper)
    along = ca.dot(ca.gradient(a[0], x), ca.gradient(ca.SX(a[-1]), x))
    rest = ca.Function("rest", [x], [ca.densify(ca.vertcat(*a[1:], along))])
    walks: list[Walk] = []
    walk_new(on, _points(problem, on, starts, seed, walks), (step, _MOST), walks)
    yield from (_judged(problem, on, walked, rest) for walked in walks)


def _points(problem: Posed, on: Curve, starts: int, seed: int, walks: Sequence[Walk]) -> Iterator[Array]:
    """Points of the curve in the box, from designs spread over it, then from a grid where no line is yet."""
    spots = list(islice(spread(problem, seed), starts))
    missed = ([d] for d in unexplained(problem, on, lambda a: a[0], walks))
    for designs in chain([spots] if spots else [], missed):
        at = np.array([variables_of(problem, d) for d in designs]) / on.scale
        y = projected(on.evaluate, at, [k % 2 for k in range(len(at))])
        yield y[np.all((on.lower <= y) & (y <= on.upper), axis=1)]  # not where it is nan


def _judged(problem: Posed, on: Curve, walked: Walk, rest: ca.Function) -> Infinity:
    """The curve with every change among its points."""

    def values(y: Array) -> Array:
        return rows_of(rest, y * on.scale)[0]

    def tests(y: Array) -> list[tuple[str, Array]]:
        """Functions without a zero wherever the other roots keep their class, and what a zero means."""
        v = values(y)
        c = list(v[:, : -2 if vanishing else -1].T)
        found = [("weave" if k else "capsize", value) for k, value in enumerate(margins(c))]
        found += [("EP2", double_root_test(c))] if len(c) > 2 else []
        return [("infinity", c[0]), *found, *([("capsize", v[:, -1])] if vanishing else [])]

    size = np.abs(values(walked.y)[:, :-1])
    vanishing = bool(np.all(size[:, -1] <= _NOTHING * size.max(axis=1)))
    found: list[Found] = []
    for k, (name, column) in enumerate(tests(walked.y)):
        event = Event(name, partial(lambda k, tested: tested[k][1], k))
        found += locate_zeros(on, walked, lambda y, t: tests(y), event, column)
    found.sort(key=lambda f: (f.after, f.s, f.event.name))
    rows, walked = insert(walked, found)
    apart = np.append(True, np.any(np.diff(walked.y, axis=0) != 0, axis=1))  # else a zero at a point that was there
    points, numbers = walked.y[apart], (np.cumsum(apart) - 1)[rows].tolist()
    bounds = _classes(values((points[1:] + points[:-1]) / 2), vanishing)
    named = zip(numbers, [f.event.name for f in found], strict=True)
    changes = {row: name for row, name in named if any(b[row - 1] != b[row] for b in bounds)}
    return Infinity(design_at(problem, points * on.scale), *bounds, changes)


def _classes(v: Array, vanishing: bool) -> tuple[Truth, Truth, Truth]:
    """Whether a crossing bounds stability, bounds heavy damping, and parts capsize from weave.

    Where the constant term vanishes with a0, another root goes through 0: to the same side only if both change
    sign alike.
    """
    c = v[:, : -2 if vanishing else -1]
    stable, damped, parting = np.zeros((3, len(c)), dtype=bool)
    proper = c[:, 0] != 0
    if vanishing:
        proper &= v[:, -1] > 0
    stable[proper] = is_stable(c[proper])
    negative, positive = real_roots(c[proper])
    damped[proper] = stable[proper] & (negative == c.shape[1] - 1)
    parting[proper] = ~stable[proper] & (positive == 0)
    return stable, damped, parting
