"""What happens along a traced curve: events found by sign changes, located on the curve itself, put in as points."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.design.frozen import Table
from tmsopt.design.problem import ROOT_QUANTITIES, Problem
from tmsopt.models import Values
from tmsopt.roots import PATTERNS, Pattern, lienard_chipart, roots
from tmsopt.study.branch import Branch, Event
from tmsopt.study.continuation import CLOSED, Curve, End, Walk, between, crossing, project

Array = NDArray[np.float64]
Truth = NDArray[np.bool_]
Function = Callable[[Array, Array], Array]

_TOGETHER = 1e-6
"""Distance, in units of the scale, within which events are one: each is located to 1e-12 or better."""

_NEAR = 1e-3
"""Distance within which an EP4 is looked for beside an EP3 and a 2EP2."""

_SAME_DESIGN = 1e-6
"""Likewise in the free parameters alone: where the traced equations are singular, the unknowns scatter."""

_NOTHING = 1e-9  # a function smaller than this all along the curve is 0 on it, not an event of it

_LEVEL = 1e-7  # a parameter that changes less per arclength stays level: its slope has no sign

_REAL = 1e-6  # of |s|: a factor with a double root has coefficients right to 1e-15 and roots to the root of that

_RANK = ("EP4", "EP3", "2EP2", "double zero", "weave", "capsize", "constraint", "fold")


@dataclass(frozen=True)
class _Mark:
    """A function of points x and tangents t, both of shape (n, variables), whose zeros are events."""

    name: str
    detail: str
    value: Function


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
    found = list(_events(problem, pattern, on, unknowns, walked))
    merged = _merged(_with_EP4(problem, pattern, on, found), len(problem.free))
    rows, y, t = _inserted(walked, merged)
    x = y * on.scale
    columns = parameters_of(problem, x)
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    kinds = pattern.kind(u)
    special = [m for m in pattern.marks if _vanishes(pattern.marks[m](u), u)]
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
        heavily_damped=_all_real(pattern.remaining(u), len(x)) & (pattern.name not in ("weave", "resonance")),
        satisfied=_satisfied(problem, values, len(x)),
        abscissa=np.broadcast_to(values["abscissa"], len(x)),
        events=tuple(sorted(events, key=lambda e: e.index)),
        closed=walked.closed,
        residual=_residual(values, pattern.monic(u), u),
    )


def parameters_of(problem: Problem, x: Array) -> dict[str, Array]:
    """Every parameter of the problem along traced variables, shape (n,) each."""
    of = problem.parameter_set
    free = {n: np.arctan(v) if of[n].tangent else v for n, v in zip(problem.free, x.T, strict=False)}
    return {n: np.array(np.broadcast_to(v, len(x)), dtype=float) for n, v in problem.ordered(free).items()}


def values_of(problem: Problem, pattern: Pattern, columns: Mapping[str, Array], u: list[Array]) -> Values:
    """Quantities along a curve; those of the roots come from the factors, where multiple roots are exact."""

    def factor_roots(_: Any) -> NDArray[np.complex128]:
        parts = [np.stack(np.broadcast_arrays(*f, u[0]), axis=-1)[:, :-1] for f in pattern.factors(u)]
        return np.concatenate([roots(part) for part in parts], axis=-1)

    def abscissa(_: Any) -> Array:
        return np.asarray(factor_roots(_).real.max(axis=-1))

    def damping_ratio(_: Any) -> Array:
        z = factor_roots(_)
        return np.asarray(np.min(-z.real / (np.abs(z) + 1e-300), axis=-1))

    formulas = {"abscissa": abscissa, "damping_ratio": damping_ratio}
    extra = [replace(q, value=formulas[q.name]) for q in ROOT_QUANTITIES]
    return Values(problem.model, problem.parameter_set, columns, extra=extra)


def stability(factors: list[list[Any]], count: int) -> Truth:
    """Where every factor has its roots left of the imaginary axis, from coefficients; no factor counts as stable."""
    stable = np.ones(count, dtype=bool)
    for factor in factors:
        for quantity in lienard_chipart(factor):
            stable &= np.broadcast_to(np.asarray(quantity, dtype=float) > 0, count)
    return stable


def _all_real(factors: list[list[Any]], count: int) -> Truth:
    """Where every root of the factors is real and negative."""
    real = stability(factors, count)
    for factor in factors:
        rows = np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in factor), np.zeros(count)), axis=-1)
        z = roots(rows[:, :-1])
        real &= np.all(np.abs(z.imag) <= _REAL * np.abs(z), axis=-1)
    return real


def _events(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Iterator[_Found]:
    x = walked.y * on.scale
    u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
    stable = stability(pattern.remaining(u), len(x))
    within = [name for name, special in pattern.marks.items() if _vanishes(special(u), u)]
    for mark in _marks(problem, pattern, unknowns, within):
        value = np.broadcast_to(mark.value(x, walked.t), len(x))
        if mark.name in within:
            continue
        if mark.name == "fold" and np.abs(value).max() <= _NOTHING:
            continue
        sign = np.sign(value)
        for k in range(1, len(sign)):
            sign[k] = sign[k] or sign[k - 1]
        changes = np.flatnonzero(sign[1:] * sign[:-1] < 0)
        for i in changes:
            if mark.name == "fold" and np.abs(value[i : i + 2]).max() <= _LEVEL:
                continue
            if mark.name in ("weave", "capsize") and stable[i] == stable[i + 1]:
                continue
            end = float(walked.t[i] @ (walked.y[i + 1] - walked.y[i]))

            def at(s: float, i: int = int(i), mark: _Mark = mark) -> float:
                y, t = between(on, walked.y[i], walked.t[i], s)
                return float(np.broadcast_to(mark.value((y * on.scale)[None], t[None]), 1)[0])

            if not at(0.0) * at(end) <= 0:
                continue  # a jump through infinity, or nan
            s = crossing(at, end)
            y, t = between(on, walked.y[i], walked.t[i], s)
            yield _Found(mark.name, mark.detail, y, t, int(i), s)


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
    start = event.y * on.scale
    u = list(start[free : free + len(pattern.unknowns)])
    mean = float(np.concatenate([roots(f) for f in pattern.factors(u)]).real.mean())
    end = project(ca.Function("EP4", [x], [equations, ca.jacobian(equations, x)]), np.append(start[:free], mean))
    if end is None or np.abs((end[:free] - start[:free]) / on.scale[:free]).max() > _NEAR:
        return None
    y = event.y.copy()
    y[:free] = end[:free] / on.scale[:free]
    fourfold = np.full(4, end[free], dtype=complex)
    y[free : free + len(u)] = np.array(pattern.guesses(fourfold)[0]) / on.scale[free : free + len(u)]
    return replace(event, name="EP4", detail="", y=y)


def _marks(problem: Problem, pattern: Pattern, unknowns: slice, within: Sequence[str]) -> Iterator[_Mark]:
    def of_unknowns(function: Callable[[list[Array]], Any]) -> Function:
        return lambda x, t: np.asarray(function([x[:, k] for k in range(unknowns.start, unknowns.stop)]))

    def of_factor(number: int, k: int) -> Function:
        return of_unknowns(lambda u: lienard_chipart(pattern.remaining(u)[number])[k])

    def of_tangent(k: int) -> Function:
        return lambda x, t: t[:, k]

    for name, special in pattern.marks.items():
        yield _Mark(name, "", of_unknowns(special))
    if pattern.name == "EP2" and "2EP2" in within:
        yield _Mark("EP4", "", of_unknowns(lambda u: 2 * u[0] + u[1]))  # q(r) has a double zero here
    example = [np.ones(1)] * len(pattern.unknowns)
    for number, factor in enumerate(pattern.remaining(example)):
        for k in range(len(lienard_chipart(factor))):
            name = "capsize" if k == 0 else "weave"  # the first quantity is the constant term
            yield _Mark(name, "stability changes", of_factor(number, k))
    for k, parameter in enumerate(problem.free):
        yield _Mark("fold", parameter, of_tangent(k))
    for name, condition in problem.conditions.items():
        if condition.comparison != "==":
            yield _Mark("constraint", name, _condition(problem, pattern, unknowns, condition))


def _condition(problem: Problem, pattern: Pattern, unknowns: slice, condition: Callable[[Values], Any]) -> Function:
    def value(x: Array, t: Array) -> Array:
        u = [x[:, k] for k in range(unknowns.start, unknowns.stop)]
        return np.asarray(condition(values_of(problem, pattern, parameters_of(problem, x), u)), dtype=float)

    return value


def _vanishes(value: Any, u: list[Array]) -> bool:
    """Whether a function is 0 along the whole curve, up to rounding."""
    size = np.max(np.abs(u), axis=0)
    return bool(np.median(np.abs(value) / (1 + size * size)) <= _NOTHING)


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
    folds = [e.detail for e in group if e.name == "fold"]
    others = [
        e.detail if e.name == name else f"{e.name} {e.detail}".strip() for e in group if e.name not in ("fold", "")
    ]
    others = [text for text in others if text]
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


def _satisfied(problem: Problem, values: Values, count: int) -> Truth:
    inside = np.ones(count, dtype=bool)
    for condition in problem.conditions.values():
        difference = np.broadcast_to(np.asarray(condition(values), dtype=float), count)
        if condition.comparison == "<=":
            inside &= difference <= 0
        elif condition.comparison == ">=":
            inside &= difference >= 0
    return inside


def _residual(values: Values, monic: list[Any], u: list[Array]) -> float:
    a0 = np.asarray(values.coefficients[0], dtype=float)
    worst = 0.0
    for a, c in zip(values.coefficients, monic, strict=True):
        size = np.abs(a) + np.abs(a0 * c) + np.abs(a0)
        worst = max(worst, float(np.max(np.abs(a - a0 * c) / size)))
    return worst


def _end_words(problem: Problem, pattern: Pattern, end: End) -> str:
    if end.limit is None:
        return end.reason if end.reason != CLOSED else ""
    free = list(problem.free)
    if end.limit < len(free):
        return f"{free[end.limit]}.{end.reason}"
    name = pattern.unknowns[end.limit - len(free)]
    return pattern.ends.get(name, f"{name} reaches its limit")
