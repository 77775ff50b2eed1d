"""Where a root goes through infinity: the curves a0 = 0 in a plane, and what the other roots do along them.

On one side of such a curve a large root is negative, on the other positive: it bounds stability where the other
roots are stable, and heavy damping where they are real and negative.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, islice

import casadi as ca
import numpy as np

from tmsopt.models import Values
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import variables_of
from tmsopt.program.starts import spread
from tmsopt.records import Array, Truth
from tmsopt.roots import is_stable, real_roots
from tmsopt.roots.meetings import meeting
from tmsopt.tracing.continuation import Curve, Walk, between, both_ways, contains, curve
from tmsopt.tracing.equations import design_at, sizes, symbols_of
from tmsopt.tracing.monitors import margins, sign_changes
from tmsopt.tracing.seeds import unexplained
from tmsopt.tracing.solving import crossing, projected, rows_of

_NOTHING = 1e-12  # of its size over the box: a constant term this small all along the curve vanishes with a0
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
    x = ca.SX.sym("x", 2)
    of = problem.parameter_set
    a = Values(problem.model, of, problem.ordered(symbols_of(problem, ca.vertsplit(x)))).coefficients
    if ca.SX(a[0]).is_constant() or not ca.depends_on(a[0], x):
        return
    ends = (dict(zip(problem.free, side, strict=True)) for side in zip(*problem.free.values(), strict=True))
    lower, upper = (np.array(variables_of(problem, end)) for end in ends)
    on = curve(x, ca.SX(a[0]), upper - lower, lower, upper)
    along = ca.dot(ca.gradient(a[0], x), ca.gradient(ca.SX(a[-1]), x))
    rest = ca.Function("rest", [x], [ca.densify(ca.vertcat(*a[1:], along))])
    usual = float(sizes(problem)[-1])
    for walked in _walks(problem, on, step, starts, seed):
        x_on, bounds, changes = _judged(on, walked, rest, usual)
        yield Infinity(design_at(problem, x_on), *bounds, changes)


def _walks(problem: Posed, on: Curve, step: float, starts: int, seed: int) -> Iterator[Walk]:
    walks: list[Walk] = []
    lines: list[dict[str, Array]] = []

    def found(designs: Sequence[Mapping[str, float]], first: int) -> Array:
        at = np.array([variables_of(problem, d) for d in designs]) / on.scale
        return projected(on.evaluate, at, [(first + k) % 2 for k in range(len(designs))])

    spots = list(islice(spread(problem, seed), starts))
    missed = (found([d], k)[0] for k, d in enumerate(unexplained(problem, lambda a: a[0], lines), starts))
    for y in chain(found(spots, 0) if spots else (), missed):
        inside = np.all((on.lower <= y) & (y <= on.upper))  # not where it is nan
        if not inside or any(contains(on, w, y[None])[0] for w in walks):
            continue
        walked = both_ways(on, y, step, _MOST)
        if walked is not None:
            walks.append(walked)
            lines.append(design_at(problem, walked.y * on.scale))
            yield walked


def _judged(
    on: Curve, walked: Walk, rest: ca.Function, usual: float
) -> tuple[Array, tuple[Truth, Truth, Truth], dict[int, str]]:
    """Points with every change among them, and what each segment between them bounds."""

    def values(y: Array) -> Array:
        return rows_of(rest, y * on.scale)[0]

    known = values(walked.y)
    vanishing = bool(np.all(np.abs(known[:, -2]) <= _NOTHING * usual))

    def quantities(v: Array) -> tuple[Array, list[str]]:
        """Columns without a zero wherever the other roots keep their class, and what a zero means."""
        c = v[:, : -2 if vanishing else -1]
        tests = margins(list(c.T))
        named = [(c[:, 0], "infinity"), *zip(tests, ["capsize"] + ["weave"] * len(tests), strict=False)]
        if c.shape[1] > 2:
            named.append((meeting(list(c.T)), "EP2"))
        if vanishing:
            named.append((v[:, -1], "capsize"))
        return np.stack([q for q, _ in named], axis=-1), [name for _, name in named]

    def beyond(i: int, s: float) -> Array:
        return between(on, walked.y[[i]], walked.t[[i]], np.array([s]))[0]

    columns, names = quantities(known)
    found: list[tuple[int, float, str]] = []
    for k, name in enumerate(names):
        for i in np.flatnonzero(sign_changes(columns[:, k])):

            def at(s: float, i: int = int(i), k: int = k) -> float:
                return float(quantities(values(beyond(i, s)))[0][0, k])

            end = float(walked.t[i] @ (walked.y[i + 1] - walked.y[i]))
            if at(0.0) * at(end) <= 0:
                found.append((int(i), crossing(at, end), name))
    y = list(walked.y)
    rows: dict[int, str] = {}
    shift = 0
    for before, s, name in sorted(found):
        if s > 0:
            shift += 1
            y.insert(before + shift, beyond(before, s)[0])
        rows[before + shift] = name
    points = np.array(y)
    bounds = _classes(values((points[1:] + points[:-1]) / 2), vanishing)
    changes = {row: name for row, name in rows.items() if any(b[row - 1] != b[row] for b in bounds)}
    return points * on.scale, bounds, changes


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
