"""What happens along a traced curve: its events, those at one place as one, put in among its points."""

import re
from collections.abc import Iterator
from dataclasses import replace

import casadi as ca
import numpy as np

from tmsopt.models import Values
from tmsopt.records import Array, Table
from tmsopt.roots import Pattern, pattern as pattern_of, roots
from tmsopt.roots.patterns.pattern import mean_size
from tmsopt.tracing.branch import Branch, Event
from tmsopt.tracing.continuation import CLOSED, End, Walk
from tmsopt.tracing.equations import Traced, symbols_of
from tmsopt.tracing.monitors import Points
from tmsopt.tracing.solving import project
from tmsopt.tracing.zeros import TOGETHER, Found, inserted, located, points_of, refined

_NEAR = 1e-3  # distance within which an EP4 is looked for beside an EP3 and a 2EP2
_TOUCHING = {"EP3", "2EP2"}  # what a double root meets at an EP4, a triple root and a second double one
_LOW = 1e-2  # of the marks beside a place where they may touch 0: they grow with the square of a step of 0.1
_EXACT = 1e-13  # mismatch of a coefficient of an EP4, relative to its terms: some roundings
_SAME_DESIGN = 1e-6
"""Like `TOGETHER`, in the free parameters alone: where the traced equations are singular, the unknowns scatter."""
_FITTING = 1e-6  # mismatch of a coefficient beyond which a point does not belong to its branch

_KINDS = ("EP", "several", "zero", "weave", "capsize", "EP2", "constraint", "fold")
"""Kinds of events of one codimension, the most telling first."""


def describe(ready: Traced, walked: Walk) -> Branch:
    """A walked curve in the parameters of the problem, with its events among its points."""
    problem, pattern, free = ready.problem, ready.pattern, len(ready.problem.free)
    walked = refined(ready, _trimmed(ready, walked))
    found = with_EP4(ready, [*located(ready, walked), *touched(ready, walked)])
    merged = _merged(found, free)
    rows, walked = inserted(walked, merged)
    points = points_of(ready, walked)
    square, doubled = _doubled(pattern)
    for event, row in zip(merged, rows, strict=True):
        if event.name in doubled:  # a double root of a quadratic factor: exact, or it scatters by 1e-8
            b, c = ready.unknowns.start + square, ready.unknowns.start + square + 1
            points.x[row, c] = points.x[row, b] ** 2 / 4
    kinds = pattern.kind(points.unknowns)
    for name in points.special:
        kinds[:] = name
    for event, row in zip(merged, rows, strict=True):
        if event.name in pattern.marks or event.name == "EP4":
            kinds[row] = event.name
    named = [(e.name, e.detail, row) for e, row in zip(merged, rows, strict=True)]
    if not walked.closed:
        ends = zip(walked.ends, (0, len(points) - 1), strict=True)
        named += [("end", _end_words(ready, end), row) for end, row in ends]
    off, columns = points.residual, points.parameters
    events = [
        Event(name, detail, Table({n: float(c[row]) for n, c in columns.items()}), row, float(off[row]))
        for name, detail, row in named
    ]
    steps = np.diff(walked.y, axis=0)[:, :free]
    return Branch(
        pattern=str(problem.locate),
        parameters=columns,
        unknowns=dict(zip(pattern.unknowns, points.unknowns, strict=True)),
        tangent=dict(zip(problem.free, _natural_tangent(points).T, strict=True)),
        arclength=np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))]),
        kinds=kinds,
        stable=points.stable,
        heavily_damped=points.heavily_damped,
        satisfied=points.satisfied,
        abscissa=points.column(points.values["abscissa"]),
        events=tuple(sorted(events, key=lambda e: e.index)),
        closed=walked.closed,
        residual=float(np.max(off)),
        eigenfrequency=_eigenfrequency(points),
    )


def _eigenfrequency(points: Points) -> dict[str, Array] | None:
    """Of a complex system ω = i s of a multiple root, of s² + bs + c less the carrier; None of a real one."""
    carrier, pattern = points.ready.problem.model.carrier, points.ready.pattern
    if carrier is None:
        return None
    if not pattern.form.startswith("CEP") or pattern.unknowns[:2] != ("b", "c"):
        return {}
    b, c = points.unknowns[:2]
    return {"omega_re": np.sqrt(c - b * b / 4) - carrier, "omega_im": -b / 2}


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


def _natural_tangent(points: Points) -> Array:
    """Derivative of the free parameters by the arclength in widths of the box."""
    problem, t, scale = points.ready.problem, points.t, points.ready.on.scale
    of = problem.parameter_set
    slopes = [1 / (1 + v**2) if of[n].tangent else 1.0 + 0 * v for n, v in zip(problem.free, points.x.T, strict=False)]
    along = t[:, : len(slopes)]
    size = np.linalg.norm(along, axis=1, keepdims=True)
    return np.asarray(along * scale[: len(slopes)] * np.transpose(slopes) / (size + 1e-300))


def _trimmed(ready: Traced, walked: Walk) -> Walk:
    """Without the points beside infinity that have lost their digits: their parameters do not fit the unknowns."""
    with np.errstate(all="ignore"):
        good = np.flatnonzero(points_of(ready, walked).residual <= _FITTING)
    if walked.closed or not good.size:
        return walked
    inside = slice(int(good[0]), int(good[-1]) + 1)
    return replace(walked, y=walked.y[inside], t=walked.t[inside])


def _end_words(ready: Traced, end: End) -> str:
    if end.limit is None:
        return end.reason if end.reason != CLOSED else ""
    free = list(ready.problem.free)
    if end.limit < len(free):
        return f"{free[end.limit]}.{end.reason}"
    name = ready.pattern.unknowns[end.limit - len(free)]
    return ready.pattern.ends.get(name, "the other roots reach a limit of the search")


def touched(ready: Traced, walked: Walk) -> Iterator[Found]:
    """EP4 where a curve of EP2 passes through it in a section: EP3 and 2EP2 touch 0 there, and keep their signs."""
    if ready.pattern.form != "EP2" or not {*ready.pattern.marks} >= _TOUCHING:
        return
    points = points_of(ready, walked)
    value = np.asarray(sum(np.abs(points.mark(name)) for name in _TOUCHING))
    least = (value[1:-1] <= value[:-2]) & (value[1:-1] <= value[2:]) & (value[1:-1] < _LOW)
    for k in (np.flatnonzero(least) + 1).tolist():
        exact = _exact_EP4(ready, Found("EP4", "", walked.y[k], walked.t[k], k, 0.0))
        if exact is not None:
            s = float(walked.t[k] @ (exact.y - walked.y[k]))
            yield replace(exact, after=k if s >= 0 else k - 1, s=s)


def with_EP4(ready: Traced, found: list[Found]) -> list[Found]:
    """Events in order; EP3 and 2EP2 side by side are one EP4 where there is one, and each EP4 is made exact.

    Where symmetry takes a curve through EP4, the traced equations are singular there, and locate it to 1e-6 only.
    """
    result: list[Found] = []
    for event in sorted(found, key=lambda e: (e.after, e.s)):
        before = result[-1] if result else event
        pair = {event.name, before.name} == {"EP3", "2EP2"}
        if event.name == "EP4" or (pair and np.abs(event.y - before.y).max() <= _NEAR):
            exact = _exact_EP4(ready, event)
            if exact is not None:
                result = [*(result[:-1] if pair else result), exact]
                continue
        result.append(event)
    return result


def _exact_EP4(ready: Traced, event: Found) -> Found | None:
    """The EP4 beside an event, by its own equations; None if there is none."""
    problem, pattern, scale = ready.problem, ready.pattern, ready.on.scale
    free = len(problem.free)
    special = pattern_of("EP4", problem.model.degree)
    start = event.y * scale
    factors = pattern.factors(list(start[ready.unknowns]))
    guess = special.guesses(np.concatenate([roots(np.array(f, dtype=float)) for f in factors]))[0]
    size = float(mean_size(special.monic(guess))) or 1.0
    unit = np.array([*scale[:free], *(size**power for power in special.powers)])
    y = ca.SX.sym("y", len(unit))
    x = ca.vertsplit(y * ca.DM(unit))
    a = Values(problem.model, problem.parameter_set, problem.ordered(symbols_of(problem, x))).coefficients
    pairs = [(p / size**k, a[0] * c / size**k) for k, (p, c) in enumerate(zip(a, special.monic(x[free:]), strict=True))]
    equations = ca.vertcat(*(p - q for p, q in pairs[1:]))
    terms = ca.vertcat(*(ca.fabs(p) + ca.fabs(q) for p, q in pairs[1:]))
    system = ca.Function("EP4", [y], [ca.densify(equations), ca.densify(ca.jacobian(equations, y))])
    end = project(system, np.array([*start[:free], *guess]) / unit)
    if end is None or np.abs(end[:free] - event.y[:free]).max() > _NEAR:
        return None
    if np.any(np.abs(ca.Function("mismatch", [y], [equations / terms])(end).full()) > _EXACT):
        return None  # a section beside an EP4, not through it
    exact = event.y.copy()
    exact[:free] = end[:free]
    fourfold = [roots(np.array(f, dtype=float)) for f in special.factors((end * unit)[free:].tolist())]
    exact[ready.unknowns] = np.array(pattern.guesses(np.concatenate(fourfold))[0]) / scale[ready.unknowns]
    return replace(event, name="EP4", detail="", y=exact)
