"""EP4 along traced curves of EP2: exact by its own equations, for the traced ones are singular there."""

from collections.abc import Iterator
from dataclasses import replace

import casadi as ca
import numpy as np

from tmsopt.design.problem import Problem
from tmsopt.models import Values
from tmsopt.roots import Pattern, roots
from tmsopt.roots import pattern as pattern_of
from tmsopt.roots.patterns.pattern import mean_size
from tmsopt.study.continuation import Curve, Walk, project
from tmsopt.study.locate import Found

_NEAR = 1e-3
"""Distance within which an EP4 is looked for beside an EP3 and a 2EP2."""

_TOUCHING = {"EP3", "2EP2"}
"""What a double root meets at an EP4, a triple root and a second double one."""

_LOW = 1e-2
"""Relative size of the marks beside a place where they may touch 0: they grow with the square of a step of 0.1."""

_EXACT = 1e-13  # mismatch of a coefficient of an EP4, relative to its terms: some roundings


def touched(problem: Problem, pattern: Pattern, on: Curve, unknowns: slice, walked: Walk) -> Iterator[Found]:
    """EP4 where a curve of EP2 passes through it in a section: EP3 and 2EP2 touch 0 there, and keep their signs."""
    if pattern.name != "EP2" or not {*pattern.marks} >= _TOUCHING:
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
    system = ca.Function("EP4", [y], [equations, ca.densify(ca.jacobian(equations, y))])
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
