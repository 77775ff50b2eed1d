"""Trace a root pattern through parameter space: every branch in the box, with its events."""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.design.problem import Problem, checked, freedom
from tmsopt.errors import Fault, InputError, suggest
from tmsopt.formulation.formulate import matching, variables_of
from tmsopt.formulation.nlp import NLP
from tmsopt.formulation.starts import spread
from tmsopt.records import Array
from tmsopt.roots import Pattern, roots
from tmsopt.roots import pattern as pattern_of
from tmsopt.roots.patterns.composed import pattern_names
from tmsopt.tracing.branch import Branch, Event, Trace
from tmsopt.tracing.continuation import INFINITE, SINGULAR, Curve, Walk, both_ways, contains, curve, project, same
from tmsopt.tracing.equations import Sizes, sizes
from tmsopt.tracing.events import describe
from tmsopt.tracing.seeds import unexplained

Report = Callable[[int, int], None]

STARTS = 48
STEP = 0.005
MOST = 200_000


@dataclass(frozen=True)
class Traced:
    """A problem made ready for tracing one pattern.

    Attributes:
        problem: with the pattern to locate and every constraint.
        unknowns: where the unknowns of the pattern stand among the variables.
        size: of the coefficients over the box.
    """

    problem: Problem
    pattern: Pattern
    nlp: NLP
    on: Curve
    unknowns: slice
    size: Sizes


def trace(
    problem: Problem,
    pattern: str | None = None,
    *,
    step: float = STEP,
    starts: int = STARTS,
    seed: int = 0,
    most: int = MOST,
    through: Sequence[Mapping[str, float]] = (),
    progress: Report | None = None,
) -> Trace:
    """Every branch of a pattern in the box of the free parameters, one more of which is free than the pattern ties.

    Args:
        pattern: name; by default the one that the problem locates.
        step: longest step, in widths of the box.
        starts: designs from which branches are looked for. With two free parameters and one condition (EP2, weave,
            capsize) a grid of 256 × 256 designs, of 96 × 96 above degree 4, shows what they missed; otherwise the
            search ends when so many in a row find nothing new, and a branch far from all of them can be missed.
        most: points of a branch in one direction.
        through: designs (values of every free parameter, in the box) to begin at, before the others.
        progress: called with the number of starts done and in all.

    Raises:
        InputError: for an unknown pattern, when the equations do not leave a curve, or for options out of range.
    """
    began = time.perf_counter()
    problem = _asked(checked(problem), pattern)
    _check(problem, step, starts, most, through)
    ready = prepare(problem)
    walks: list[Walk] = []
    lines: list[dict[str, Array]] = []
    walking = 0.0
    tried = 0
    sources = (_seeds(ready, starts, seed, through, lines), _missed(ready, lines), _beyond(ready, walks))
    for count, y in chain.from_iterable(sources):
        tried = max(tried, count)
        if progress:
            progress(tried, max(tried, starts))
        if y is None or any(contains(ready.on, w, y) for w in walks):
            continue
        before = time.perf_counter()
        found = both_ways(ready.on, y, step, most)
        walking += time.perf_counter() - before
        if found is not None and not any(same(found, w) for w in walks):
            walks.append(found)
            lines.append(design_at(problem, found.y * ready.on.scale))
    branches = (b for b in (branch_of(ready, w) for w in walks) if b.residual <= _MET)  # not where it is nan
    ordered = _meeting(sorted(branches, key=lambda b: -float(b.arclength[-1])), problem)
    return Trace(problem, str(problem.locate), ordered, tried, time.perf_counter() - began, walking)


def _meeting(branches: Sequence[Branch], problem: Problem) -> tuple[Branch, ...]:
    """The branches, with a word at singular ends that lie together: cusps or crossings, known to fewer digits."""
    widths = {n: high - low for n, (low, high) in problem.free.items()}
    ends = [e for b in branches for e in b.events if e.name == "end" and e.detail == SINGULAR]

    def said(event: Event) -> Event:
        if not any(event is e for e in ends):
            return event
        apart = [max(abs(event.parameters[n] - e.parameters[n]) / w for n, w in widths.items()) for e in ends]
        near = min((d for d, e in zip(apart, ends, strict=True) if e is not event), default=math.inf)
        if near > _NEAR:
            return event
        words = f"{SINGULAR}; {near:.0e} of the box from another such end: most likely one point, its last digits wrong"
        return replace(event, detail=words)

    return tuple(replace(b, events=tuple(said(e) for e in b.events)) for b in branches)


def prepare(problem: Problem) -> Traced:
    """The equations of a pattern problem, compiled for tracing."""
    pattern = pattern_of(str(problem.locate), problem.model.degree)
    equalities = {n: c for n, c in problem.constraints.items() if problem.conditions[n].comparison == "=="}
    nlp = matching(replace(problem, constraints=equalities))
    free = len(problem.free)
    unknowns = slice(free, free + len(pattern.unknowns))
    unit = np.ones(len(nlp.variables))
    unit[unknowns] = np.array([nlp.unit**power for power in pattern.powers])  # of the NLP; x has natural units
    x = ca.SX.sym("x", len(nlp.variables))
    g = nlp.at(x / ca.DM(unit))[1]
    rows = [k for k in range(len(nlp.rows)) if nlp.row_lower[k] == nlp.row_upper[k]]
    if len(rows) != len(nlp.variables) - 1:
        names = ", ".join(equalities)
        message = f"an equality of a root quantity cannot be traced along {pattern.name}; leave out {names}"
        raise InputError([Fault(message, ("constraints",))])
    lower, upper = np.array(nlp.lower), np.array(nlp.upper)
    for k, name in enumerate(pattern.unknowns):
        if name in pattern.ends:
            lower[free + k] = 0.0
    scale = unit.copy()
    scale[:free] = upper[:free] - lower[:free]
    sample = [_variables(nlp, problem, d, 1) for d, _ in zip(spread(problem, 0), range(_SAMPLE), strict=False)]
    known = np.array([s[0] for s in sample if s]).reshape(-1, len(nlp.variables))
    if known.size:
        scale[free:] = np.clip(np.median(np.abs(known[:, free:]), axis=0), 0.1 * unit[free:], 1e3 * unit[free:])
    on = curve(x, ca.vertcat(*[g[k] for k in rows]), scale, lower, upper)
    return Traced(problem, pattern, nlp, on, unknowns, sizes(problem))


def branch_of(ready: Traced, walked: Walk) -> Branch:
    """A walked curve with its events, in the parameters of the problem."""
    with np.errstate(all="ignore"):  # beside infinity and roots 0: what is not finite there is no event
        return describe(ready.problem, ready.pattern, ready.on, ready.unknowns, walked)


def _asked(problem: Problem, name: str | None) -> Problem:
    """The problem with the pattern as its only question, checked to leave a curve."""
    name = name or problem.locate
    names = pattern_names(problem.model.degree)
    if name is None:
        message = f"no pattern to trace; write locate = 'EP2' or another, or name one. accepted: {' '.join(names)}"
        raise InputError([Fault(message, ("objective", "locate"))])
    try:
        name = pattern_of(str(name), problem.model.degree).name
    except ValueError as error:
        why = "" if str(error).endswith("is no pattern") else f": {error}"
        message = f"unknown pattern '{name}'{why}; {suggest(str(name), names)}"
        raise InputError([Fault(message, ("objective", "locate"))]) from error
    asked = replace(problem, locate=name, minimize=None, maximize=None)
    count = freedom(asked)
    if count.count != 1:
        free, needed = ", ".join(problem.free) or "none", count.conditions + 1
        advice = (
            f"free {needed - count.free} more"
            if count.count < 1
            else f"fix {count.count - 1} of them, or add as many == constraints"
        )
        conditions = f"{count.conditions} condition{'s' if count.conditions != 1 else ''}"
        message = (
            f"a curve of {name} takes {needed} free parameters ({conditions} and one to move along), "
            f"and {count.free} {'is' if count.free == 1 else 'are'} free ({free}); {advice}"
        )
        raise InputError([Fault(message, ("parameters",))])
    return asked


def _check(problem: Problem, step: float, starts: int, most: int, through: Sequence[Mapping[str, float]]) -> None:
    faults = [
        Fault(f"found {value!r}; accepted: {accepted}", (name,))
        for name, value, holds, accepted in (
            ("step", step, STEPS[0] <= step <= STEPS[1], f"a number from {STEPS[0]:g} to {STEPS[1]:g}"),
            ("starts", starts, starts >= 0, "a whole number, 0 or more"),
            ("most", most, most >= _FEWEST, f"a whole number, {_FEWEST} or more"),
        )
        if not holds
    ]
    for design in through:
        if set(design) != set(problem.free):
            names = ", ".join(problem.free)
            faults.append(Fault(f"found {', '.join(design) or 'nothing'}; accepted: each of {names}", ("through",)))
            continue
        for n, value in design.items():
            low, high = problem.free[n]
            if not low <= value <= high:
                message = f"{n} = {value!r} lies outside the box; accepted: {low:g} to {high:g}"
                faults.append(Fault(message, ("through",)))
    if faults:
        raise InputError(faults)


STEPS = (1e-6, 0.1)
"""Least and greatest longest step."""

_FEWEST = 4  # points that make a curve with tangents

_BACK = 300.0  # size of an unknown from which a curve is looked for on the other side of infinity

_FAR = 1e5  # unknowns of a seed, in units of their scale: beyond, a0 all but vanishes

_MET = 1e-3  # mismatch of the coefficients beyond which a curve is none of the pattern
_NEAR = 1e-3  # widths of the box between ends that are one singular point: the equations lose digits there
_SAMPLE = 32  # designs by which sizes are judged

_PATIENCE = 8  # times the starts asked for, at most

_GUESSES = 4  # starting values of the unknowns tried at each design


def _seeds(
    ready: Traced,
    starts: int,
    seed: int,
    through: Sequence[Mapping[str, float]],
    lines: Sequence[Mapping[str, Array]],
) -> Iterator[tuple[int, Array | None]]:
    """Points of the pattern's curve in the box, found from many designs, and the number of these; None where one fails.

    Where no grid shows what they missed, the search goes on until as many starts in a row find nothing new: `lines`
    grows meanwhile.
    """
    problem = ready.problem
    free = len(problem.free)
    given = [*through, *([problem.start] if set(problem.start) == set(problem.free) else [])]
    for design in given:
        for guess in range(_GUESSES):
            yield 0, _seed(ready, design, guess, None)
    vain, known = 0, len(lines)
    for count, design in enumerate(spread(problem, seed)):
        if vain >= starts or count >= _PATIENCE * starts or (count >= starts and _swept(ready)):
            return
        held = [None, *range(free)][count % (free + 1)]
        for guess in range(_GUESSES):
            yield count + 1, _seed(ready, design, guess, held)
        vain, known = (vain + 1 if len(lines) == known else 0), len(lines)


def _swept(ready: Traced) -> bool:
    """Whether a grid over two free parameters shows every branch that is not too short for it."""
    return ready.pattern.test is not None and len(ready.problem.free) == 2


def _missed(ready: Traced, lines: Sequence[Mapping[str, Array]]) -> Iterator[tuple[int, Array | None]]:
    """Points of the curve where a test function of the pattern changes sign over a grid, off the lines so far."""
    if ready.pattern.test is not None and _swept(ready):
        for design in unexplained(ready.problem, ready.pattern.test, lines):
            yield 0, _seed(ready, design, None, None)


def _beyond(ready: Traced, walks: Sequence[Walk]) -> Iterator[tuple[int, Array | None]]:
    """Points where a curve may come back from infinity: there a root changes sides, and the parameters go on.

    They approach a0 = 0 with the inverse of the unknown that grows, so two points give the limit, and a point beyond
    it.
    """
    free = len(ready.problem.free)
    done = 0
    while done < len(walks):
        walked = walks[done]
        done += 1
        for end, y in zip(walked.ends, (walked.y[::-1], walked.y), strict=True):
            if end.reason != INFINITE:
                continue
            size = np.abs(y[:, free:]).max(axis=1)
            begin = int(np.flatnonzero(size < _BACK)[-1]) if np.any(size < _BACK) else 0
            if begin < len(y) - 2:
                (here, far), weight = (y[begin, :free], y[-1, :free]), size[begin] / size[-1]
                limit = (far - weight * here) / (1 - weight)
                x = (2 * limit - here) * ready.on.scale[:free]
                yield 0, _seed(ready, _floats(design_at(ready.problem, x)), None, None)


def _floats(design: Mapping[str, Any]) -> dict[str, float]:
    return {n: float(v) for n, v in design.items()}


def _seed(ready: Traced, design: Mapping[str, float], guess: int | None, held: int | None) -> Array | None:
    """A point of the curve near a design, from a guess of that number, or the best guess."""
    on, free = ready.on, len(ready.problem.free)
    tried = _variables(ready.nlp, ready.problem, design, None if guess is None else guess + 1)
    x = min(tried, key=lambda t: _mismatch(on, t), default=None) if guess is None else next(iter(tried[guess:]), None)
    if x is None:
        return None
    y = project(on.evaluate, x / on.scale, held)
    if y is None or not np.all((y >= on.lower - 1e-12) & (y <= on.upper + 1e-12)) or np.abs(y[free:]).max() > _FAR:
        return None
    y = np.clip(y, on.lower, on.upper)
    a = ready.problem.values(ready.problem.ordered(design_at(ready.problem, y * on.scale))).coefficients
    return y if ready.size.leads(np.array([float(c) for c in a])) else None


def _mismatch(on: Curve, x: Array) -> float:
    return float(np.abs(np.array(on.evaluate(x / on.scale)[0])).max())


def design_at(problem: Problem, x: Array) -> dict[str, Any]:
    """Free parameters for traced variables, floats or columns."""
    of = problem.parameter_set
    return {n: np.arctan(v) if of[n].tangent else v for n, v in zip(problem.free, x.T, strict=False)}


def _variables(nlp: NLP, problem: Problem, design: Mapping[str, float], count: int | None) -> list[Array]:
    """All variables for a design, for the first guesses of the pattern's unknowns, as many as asked for, or all."""
    values = problem.values(problem.ordered(design))
    a = np.array([float(c) for c in values.coefficients])
    if a[0] == 0 or not np.all(np.isfinite(a)):
        return []
    z = roots(a)
    guesses = [
        lift.guess([values], [z / nlp.unit if k else z]) for k, lift in enumerate(nlp.lifts)
    ]  # those in its unit
    if not all(guesses):
        return []
    others = [c for guess in guesses[1:] for c in guess[0]]
    x = variables_of(problem, design)
    return [np.array([*x, *first, *others]) for first in guesses[0][:count]]
