"""Where, within its scenarios and tolerances, a design does worst, and the proof that it does no worse anywhere."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.intervals import Interval, ball, round_outwards
from tmsopt.algebra.sequence import golden_steps
from tmsopt.models.expression import Expression
from tmsopt.problem.cases import Band, Case, Cover
from tmsopt.problem.dependence import WORSE_DIRECTION, depends_on_case
from tmsopt.problem.evaluate import evaluate
from tmsopt.problem.problem import Posed
from tmsopt.records import Array, Numbers, Table
from tmsopt.roots import lienard_chipart, shift

SLACK = 1e-6
"""Above the worst abscissa found, relative to 1 + |abscissa|: a bound that is met with equality cannot be proved."""

BOXES = 4000
"""Boxes looked at before the proof is given up, a second or so; from degree 5 on ever fewer, for each takes longer."""

_LINE = 1025  # points looked at along a band when nothing else varies
_PLANE = 2048  # points, besides the corners, where more varies
_EDGES = 8192  # points on the edges of the box, where most worst cases lie
_PEAKS = 4  # worst points that are looked at closely
_AROUND = 48  # points of each closer look
_SHRINK = 0.25
_LOOKS = 14  # times that the look closes in: at a smooth maximum the value is then exact
_FEWEST = 32  # boxes of a proof
_DIGITS = 30


@dataclass(frozen=True)
class Worst:
    """The worst case for one thing that is asked of a design.

    Attributes:
        value: of a root quantity, objective or left minus right of a constraint, in the case.
    """

    case: Case
    value: float


def worst_cases(problem: Posed, parameters: Numbers) -> dict[str, Worst]:
    """The worst case of everything that differs between cases, over whole bands and tolerance boxes.

    A grid with a closer look at its worst points; the value in the case found is exact, with multiple roots
    recognised, but a peak narrower than the grid can escape: `prove` excludes that.
    """
    asked = [e for e in (problem.objective, *problem.conditions.values()) if e]
    targets: dict[str, tuple[float, Expression | str]] = {"abscissa": (1.0, "abscissa")}  # with the sign of the worst
    targets |= {n: (sign, n) for n, sign in WORSE_DIRECTION.items() if any(n in e.names for e in asked)}
    if problem.objective and depends_on_case(problem, problem.objective, problem.cases):
        targets["objective"] = (problem.sign, problem.objective)
    for name, condition in problem.conditions.items():
        if depends_on_case(problem, condition, problem.cases):
            targets[f"constraint {name}"] = (condition.sign, condition)
    found: dict[str, Worst] = {}
    for name, (sign, what) in targets.items():
        shared = {n: found[n].value for n in found if isinstance(what, Expression) and n in what.names}
        measured = []
        for case in _peaks(problem, parameters, sign, what, shared):
            values = problem.values(case.applied(parameters)).with_known(shared)
            measured.append(Worst(case, float(values[what] if isinstance(what, str) else what(values))))
        found[name] = max(measured, key=lambda w: sign * w.value if np.isfinite(w.value) else np.inf)
    return found


def _peaks(problem: Posed, parameters: Numbers, sign: float, what: Expression | str, shared: Numbers) -> Iterator[Case]:
    """For every choice of separate scenario values, the worst few points of a grid, moved to where it is worst."""
    bands = {n: s for n, s in problem.scenarios.items() if isinstance(s, Band)}
    separate = {n: s for n, s in problem.scenarios.items() if not isinstance(s, Band)}
    size = len(bands) + len(problem.tolerances)

    def varied(u: Array) -> Case:
        """The case, or the cases as arrays, at points of the unit cube."""
        columns = list(u.T) if u.ndim > 1 else u.tolist()
        at = {n: band.min + (band.max - band.min) * columns.pop(0) for n, band in bands.items()}
        return Case({**fixed, **at}, {n: t * (2 * columns.pop(0) - 1) for n, t in problem.tolerances.items()})

    def badness(u: Array) -> Array:
        [values] = evaluate(problem, [what], {**varied(u).applied(parameters), **shared})
        return np.where(np.isfinite(values), sign * values, np.inf) * np.ones(len(u))

    for chosen in product(*separate.values()):
        fixed = dict(zip(separate, chosen, strict=True))
        if size == 0:
            yield Case(Table(fixed))
            continue
        u = _grid(size)
        high = badness(u)
        step = 1 / (_LINE - 1) if size == 1 else 0.5 * len(u) ** (-1 / size)
        rows = _apart(u, high, 4 * step)
        best, value, every = u[rows], high[rows], np.arange(len(rows))
        moves = _moves(len(rows), size)
        for look in range(_LOOKS):  # all peaks at once: calls cost more than points
            reach = step * (_SHRINK if size == 1 else _SHRINK ** (1 / 2)) ** look
            around = np.clip(best[:, None] + reach * moves[:, look], 0, 1)
            trial = badness(around.reshape(-1, size)).reshape(len(rows), _AROUND)
            top = np.argmax(trial, axis=1)
            higher = trial[every, top] > value
            best = np.where(higher[:, None], around[every, top], best)
            value = np.where(higher, trial[every, top], value)
        for case in map(varied, best):
            yield Case(Table(case.at), Table(case.offset))


def _grid(size: int) -> Array:
    """Points of the unit cube, corners included: even along a line, else corners and a quasi-random sequence."""
    if size == 1:
        return np.linspace(0, 1, _LINE)[:, None]
    corners = np.array(list(product((0.0, 1.0), repeat=size)))
    along = np.linspace(0, 1, max(17, min(_LINE, _EDGES // (size * len(corners)))))
    edges = [
        np.insert(np.repeat(rest[None, :], len(along), axis=0), k, along, axis=1)
        for k in range(size)
        for rest in np.unique(np.delete(corners, k, axis=1), axis=0)
    ]
    middles = np.array(list(product((0.0, 0.5, 1.0), repeat=size))) if size <= 5 else corners
    steps = np.arange(1, _PLANE + 1)[:, None] * golden_steps(size)
    return np.concatenate([corners, middles, *edges, (0.5 + steps) % 1.0])


@lru_cache(maxsize=64)
def _moves(peaks: int, size: int) -> Array:
    """Steps about each of some points in look after look, every other one along one side: edges stay."""
    rng = np.random.default_rng(0)
    every = np.empty((peaks, _LOOKS, _AROUND, size))
    for moves in every.reshape(-1, _AROUND, size):
        moves[:] = rng.uniform(-1, 1, (_AROUND, size))
        moves[::2] *= np.arange(size) == rng.integers(0, size, (len(moves[::2]), 1))
    every.flags.writeable = False
    return every


def _apart(u: Array, high: Array, distance: float) -> list[int]:
    """The highest points that are a distance from one another."""
    chosen: list[int] = []
    for k in np.argsort(-high, kind="stable"):
        if all(np.abs(u[k] - u[c]).max() > distance for c in chosen):
            chosen.append(int(k))
        if len(chosen) == _PEAKS:
            break
    return chosen


_Box = dict[tuple[bool, str], Interval]
"""(Whether it is added to the stored number, parameter) → interval; the side that was halved last is the last."""


def cover(problem: Posed, parameters: Numbers, worst: float, boxes: int | None = None) -> Cover:
    """Prove that no case has a root right of `worst` plus SLACK: Liénard–Chipart signs of p(t + limit) in balls.

    Boxes whose signs are undecided are halved, widest first, until none is left.
    """
    if boxes is None:
        boxes = max(BOXES >> max(problem.model.degree - 4, 0), _FEWEST)
    limit, done = worst + SLACK * (1 + abs(worst)), 0
    choices = [[(s.min, s.max)] if isinstance(s, Band) else [(v, v) for v in s] for s in problem.scenarios.values()]
    offset: _Box = {(True, n): round_outwards(-t, t) for n, t in problem.tolerances.items()}
    waiting = deque[_Box]()
    for each in product(*choices):  # bands and tolerances whole
        at = zip(problem.scenarios, each, strict=True)
        waiting.append({(False, n): round_outwards(*ends) for n, ends in at} | offset)
    with flint.ctx.workdps(_DIGITS):
        while waiting and done < boxes:
            box = waiting.popleft()
            done += 1
            if not _left_of(problem, parameters, box, flint.arb(limit)):
                side = next((side for side, (lower, upper) in box.items() if lower < (lower + upper) / 2 < upper), None)
                if side is None:
                    return Cover(limit, False, done)
                lower, upper = box.pop(side)
                middle = (lower + upper) / 2
                waiting += [{**box, side: half} for half in ((lower, middle), (middle, upper))]
    return Cover(limit, not waiting, done)


def _left_of(problem: Posed, parameters: Numbers, box: _Box, gamma: Any) -> bool:
    """Whether every design of a box certainly has all roots left of a vertical line."""

    def tests(box: _Box, moving: str = "") -> list[Any]:
        """Positive exactly when every root is left of the line; a0 first, by its sign. `moving` is a series."""
        at: dict[str, Any] = {n: flint.arb(x) for n, x in parameters.items()}
        for (added, n), ends in sorted(box.items()):  # a parameter may have both: the scenario comes first
            at[n] = ball(ends) + (at[n] if added else 0)
        if moving:
            at[moving] = flint.arb_series([at[moving], 1], prec=2)
        a = problem.model.coefficients(at, problem.parameter_set)
        sign = -1 if _term(a[0], 0) < 0 else 1
        shifted = [sign * c for c in shift(a, gamma)]
        return [shifted[0], *lienard_chipart(shifted)]

    if all(test > 0 for test in tests(box)):
        return True
    middle: _Box = {side: ((lower + upper) / 2,) * 2 for side, (lower, upper) in box.items()}
    at_middle = tests(middle)
    if not all(test > 0 for test in at_middle):
        return False
    # The mean value form, f(m) + Σ ∂f/∂x (x − m), is off by the square of the width, the plain one by the width.
    for side, ends in box.items():
        if ends[0] < ends[1]:
            move = ball(ends) - middle[side][0]
            slopes = (_term(test, 1) for test in tests(box, side[1]))
            at_middle = [test + slope * move for test, slope in zip(at_middle, slopes, strict=True)]
    return all(test > 0 for test in at_middle)


def _term(test: Any, order: int) -> Any:
    """The value (0) or the slope (1) of a series; a ball has no slope."""
    return test[order] if isinstance(test, flint.arb_series) else flint.arb(0) if order else test
