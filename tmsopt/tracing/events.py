"""What happens along a traced curve: its events, those at one place as one, put in among its points."""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.models import Values
from tmsopt.problem.problem import Problem
from tmsopt.records import Array, Table
from tmsopt.roots import Pattern, pattern as pattern_of, roots
from tmsopt.roots.patterns.pattern import mean_size
from tmsopt.tracing.branch import Branch, Event
from tmsopt.tracing.continuation import CLOSED, Curve, End, Walk
from tmsopt.tracing.monitors import all_real, parameters_of, satisfied, stability, values_of, vanishes
from tmsopt.tracing.solving import project
from tmsopt.tracing.zeros import TOGETHER, Found, located, refined

_NEAR = 1e-3  # distance within which an EP4 is looked for beside an EP3 and a 2EP2
_TOUCHING = {"EP3", "2EP2"}  # what a double root meets at an EP4, a triple root and a second double one
_LOW = 1e-2  # of the marks beside a place where they may touch 0: they grow with the square of a step of 0.1
_EXACT = 1e-13  # mismatch of a coefficient of an EP4, relative to its terms: some roundings
_SAME_DESIGN = 1e-6
"""Like `TOGETHER`, in the free parameters alone: where the traced equations are singular, the unknowns scatter."""
_FITTING = 1e-6  # mismatch of a coefficient beyond which a point does not belong to its branch

_KINDS = ("EP", "several", "zero", "weave", "capsize", "EP2", "constraint", "fold")
"""Kinds of events of one codimension, the most telling first."""


def describe(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Branch:
    """A walked curve in the parameters of the problem, with its events among its points."""
    walked = refined(problem, pattern, on, unknowns, _trimmed(problem, pattern, on, unknowns, walked))
    found = [*located(problem, pattern, on, unknowns, walked), *touched(problem, pattern, on, unknowns, walked)]
    merged = _merged(with_EP4(problem, pattern, on, found), len(problem.free))
    rows, y, t = _inserted(walked, merged)
    x = y * on.scale
    square, doubled = _doubled(pattern)
    for event, row in zip(merged, rows, strict=True):
        if event.name in doubled:  # a double root of a quadratic factor: exact, or it scatters by 1e-8
            x[row, unknowns.start + square + 1] = x[row, unknowns.start + square] ** 2 / 4
    columns = parameters_of(problem, x)
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    kinds = pattern.kind(u)
    for name in (m for m, mark in pattern.marks.items() if vanishes(mark, pattern, u)):
        kinds[:] = name
    for event, row in zip(merged, rows, strict=True):
        if event.name in pattern.marks or event.name == "EP4":
            kinds[row] = event.name
    free = list(problem.free)
    width = np.diff(x, axis=0)[:, : len(free)] / on.scale[: len(free)]
    values = values_of(problem, pattern, columns, u)
    named = [(e.name, e.detail, row) for e, row in zip(merged, rows, strict=True)]
    if not walked.closed:
        ends = zip(walked.ends, (0, len(x) - 1), strict=True)
        named += [("end", _end_words(problem, pattern, end), row) for end, row in ends]
    at = [Table({n: float(c[row]) for n, c in columns.items()}) for *_, row in named]
    met = np.broadcast_to(_residual(values, pattern.monic(u), u), len(x))
    each = zip(named, at, strict=True)
    events = [Event(name, detail, place, row, float(met[row])) for (name, detail, row), place in each]
    return Branch(
        pattern=str(problem.locate),
        parameters=columns,
        unknowns=dict(zip(pattern.unknowns, u, strict=True)),
        tangent=dict(zip(free, _natural_tangent(problem, on, x, t).T, strict=True)),
        arclength=np.concatenate([[0.0], np.cumsum(np.linalg.norm(width, axis=1))]),
        kinds=kinds,
        stable=stability(pattern.remaining(u), len(x)),
        heavily_damped=all_real(pattern.remaining(u), len(x)) & ("W" not in pattern.unknowns),
        satisfied=satisfied(problem, values, len(x)),
        abscissa=np.broadcast_to(values["abscissa"], len(x)),
        events=tuple(sorted(events, key=lambda e: e.index)),
        closed=walked.closed,
        residual=float(np.max(met)),
        eigenfrequency=_eigenfrequency(problem, pattern, u),
    )


def _eigenfrequency(problem: Problem, pattern: Pattern, u: list[Array]) -> dict[str, Array] | None:
    """Of a complex system ω = i s of a multiple root, of s² + bs + c less the carrier; None of a real one."""
    if problem.model.carrier is None:
        return None
    if not pattern.form.startswith("CEP") or pattern.unknowns[:2] != ("b", "c"):
        return {}
    b, c = u[:2]
    return {"omega_re": np.sqrt(c - b * b / 4) - problem.model.carrier, "omega_im": -b / 2}


def _doubled(pattern: Pattern) -> tuple[int, tuple[str, ...]]:
    """Where b of a factor s² + bs + c stands among the unknowns, and the events at which it is a square."""
    if pattern.form.lstrip("2C") != pattern.form and pattern.unknowns[:2] == ("b", "c"):
        return 0, tuple(m for m in pattern.marks if re.fullmatch(r"EP\d+", m))
    if pattern.form == "EP2" and pattern.unknowns[-2:] == ("b", "c"):
        return len(pattern.unknowns) - 2, ("EP4", "2EP2")
    return 0, ()


def _merged(found: list[Found], free: int) -> list[Found]:
    """Events in order, those at one place as one: the most special names it, the others stand in its detail."""
    groups: list[list[Found]] = []
    for event in found:
        apart = np.abs(event.y - groups[-1][-1].y) if groups else np.array([np.inf])
        if apart.max() <= TOGETHER * (1 + np.abs(event.y).max()) or apart[:free].max() <= _SAME_DESIGN:
            groups[-1].append(event)
        else:
            groups.append([event])
    return [_one(group) for group in groups]


def _one(group: list[Found]) -> Found:
    group = sorted(group, key=lambda e: _rank(e.name))
    names = {e.name for e in group}
    name = "double zero" if {"weave", "capsize"} <= names else group[0].name
    folds = dict.fromkeys(e.detail for e in group if e.name == "fold")
    special = [m for m in names if "EP" in m and _rank(m)[0] < -1]
    higher = _beside(name, names)
    others = [f"beside an {higher}"] if higher else []
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


def _beside(name: str, names: set[str]) -> str:
    """EP(k+1) where EPk and EP(k−1)+EP2, the two ways in which EP(k−1) comes near it, are at one place; else empty."""
    match = re.fullmatch(r"EP(\d+)", name)
    order = int(match[1]) if match else 0
    return f"EP{order + 1}" if ("2EP2" if order == 3 else f"EP{order - 1}+EP2") in names else ""


def _rank(name: str) -> tuple[int, int]:
    """The most special first: by conditions that the event takes, then by kind."""
    parts = [re.fullmatch(r"(\d*)(C?)EP(\d+)", part) for part in name.split("+")]
    if all(parts):
        numbers = [(int(m[1] or 1), bool(m[2]), int(m[3])) for m in parts if m]
        taken = sum(count * (order - 1) * (2 if pair else 1) for count, pair, order in numbers)
        kind = "EP2" if name == "EP2" else "EP" if name.startswith("EP") and len(parts) == 1 else "several"
        return -taken, _KINDS.index(kind)
    if zero := re.fullmatch(r"(double|(\d+)-fold) zero", name):
        return -int(zero[2] or 2), _KINDS.index("zero")
    return -int(name in ("weave", "capsize")), _KINDS.index(name)


def _inserted(walked: Walk, events: list[Found]) -> tuple[list[int], Array, Array]:
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
    unit = np.broadcast_to(mean_size(monic), np.shape(u[0]))
    unit = np.maximum(unit, np.median(unit)) + 1e-300  # where all roots come to 0, that of the curve
    worst = np.zeros(np.shape(u[0]))
    for k, (a, c) in enumerate(zip(values.coefficients, monic, strict=True)):
        size = np.abs(a) + np.abs(a0 * c) + np.abs(a0) * unit**k
        worst = np.maximum(worst, np.abs(a - a0 * c) / np.where(size == 0, 1.0, size))  # 0 with roots that are all 0
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
    return pattern.ends.get(name, "the other roots reach a limit of the search")


def touched(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Iterator[Found]:
    """EP4 where a curve of EP2 passes through it in a section: EP3 and 2EP2 touch 0 there, and keep their signs."""
    if pattern.form != "EP2" or not {*pattern.marks} >= _TOUCHING:
        return
    x = walked.y * on.scale
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    value = np.asarray(sum(np.abs(pattern.marks[name](pattern.reduced(u))) for name in _TOUCHING))
    least = (value[1:-1] <= value[:-2]) & (value[1:-1] <= value[2:]) & (value[1:-1] < _LOW)
    for k in np.flatnonzero(least) + 1:
        beside = Found("EP4", "", walked.y[k], walked.t[k], int(k), 0.0)
        exact = _exact_EP4(problem, pattern, on, beside)
        if exact is not None:
            s = float(walked.t[k] @ (exact.y - walked.y[k]))
            yield replace(exact, after=int(k) if s >= 0 else int(k) - 1, s=s)


def with_EP4(problem: Problem, pattern: Pattern, on: Curve, found: list[Found]) -> list[Found]:
    """Events in order; EP3 and 2EP2 side by side are one EP4 where there is one, and each EP4 is made exact.

    Where symmetry takes a curve through EP4, the traced equations are singular there, and locate it to 1e-6 only.
    """
    result: list[Found] = []
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


def _exact_EP4(problem: Problem, pattern: Pattern, on: Curve, event: Found) -> Found | None:
    """The EP4 beside an event, by its own equations; None if there is none."""
    free = len(problem.free)
    special = pattern_of("EP4", problem.model.degree)
    start = event.y * on.scale
    u = list(start[free : free + len(pattern.unknowns)])
    z = np.concatenate([roots(np.array(f, dtype=float)) for f in pattern.factors(u)])
    guess = special.guesses(z)[0]
    size = float(mean_size(special.monic(guess))) or 1.0
    scale = np.array([*on.scale[:free], *(size**power for power in special.powers)])
    y = ca.SX.sym("y", free + len(special.unknowns))
    x = y * ca.DM(scale)
    symbols = {n: ca.atan(x[k]) if problem.parameter_set[n].tangent else x[k] for k, n in enumerate(problem.free)}
    a = Values(problem.model, problem.parameter_set, problem.ordered(symbols)).coefficients
    matched = [a[0] * c for c in special.monic(ca.vertsplit(x[free:]))]
    rows = [(p - q) / size**k for k, (p, q) in enumerate(zip(a, matched, strict=True))][1:]
    terms = [(ca.fabs(p) + ca.fabs(q)) / size**k for k, (p, q) in enumerate(zip(a, matched, strict=True))][1:]
    equations = ca.vertcat(*rows)
    mismatch = ca.Function("mismatch", [y], [equations / ca.vertcat(*terms)])
    system = ca.Function("EP4", [y], [ca.densify(equations), ca.densify(ca.jacobian(equations, y))])
    end = project(system, np.array([*start[:free], *guess]) / scale)
    if end is None or np.abs(end[:free] - event.y[:free]).max() > _NEAR:
        return None
    if np.any(np.abs(np.array(mismatch(end)).ravel()) > _EXACT):
        return None  # a section beside an EP4, not through it
    exact = event.y.copy()
    exact[:free] = end[:free]
    factors = special.factors([float(v) for v in (end * scale)[free:]])
    fourfold = np.concatenate([roots(np.array(f, dtype=float)) for f in factors])
    exact[free : free + len(u)] = np.array(pattern.guesses(fourfold)[0]) / on.scale[free : free + len(u)]
    return replace(event, name="EP4", detail="", y=exact)
