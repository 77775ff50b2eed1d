"""Finds the worst case of a design within its scenarios and tolerances, and proves that no case is worse."""

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
"""Margin of a proof above the worst abscissa, relative to 1 + |abscissa|, because equality cannot be proved."""

BOXES = 4000
"""Boxes before a proof gives up, after about a second; fewer from degree 5 on, where a box takes longer."""

_LINE_POINTS = 1025  # points along a band if nothing else varies
_INNER_POINTS = 2048  # points inside a box of several dimensions
_EDGE_POINTS = 8192  # points on the edges of the box, where most worst cases lie
_MAX_PEAKS = 4  # worst points to refine
_POINTS_AROUND = 48  # points around each peak in each round
_SHRINK = 0.25  # ratio of the neighbourhoods of successive rounds
_ROUNDS = 14  # rounds, after which the value at a smooth maximum is exact
_MIN_BOXES = 32  # boxes of a proof
_DIGITS = 30


@dataclass(frozen=True)
class Worst:
    """The worst case of one root quantity, objective or constraint.

    Attributes:
        value: its value in the case; for a constraint, left side minus right side.
    """

    case: Case
    value: float


def find_worst_cases(problem: Posed, parameters: Numbers) -> dict[str, Worst]:
    """Find the worst case of everything that depends on the case, over whole bands and tolerance boxes.

    The function searches a grid and refines its worst points. The value in the case found is exact, and multiple roots
    are recognised. The grid can miss a peak that is narrower than its spacing; `prove_worst_case` excludes this.
    """
    expressions = [e for e in (problem.objective, *problem.conditions.values()) if e]
    targets: dict[str, tuple[float, Expression | str]] = {"abscissa": (1.0, "abscissa")}  # with the sign of the worst
    targets |= {n: (sign, n) for n, sign in WORSE_DIRECTION.items() if any(n in e.names for e in expressions)}
    if problem.objective and depends_on_case(problem, problem.objective, problem.cases):
        targets["objective"] = (problem.sign, problem.objective)
    for name, condition in problem.conditions.items():
        if depends_on_case(problem, condition, problem.cases):
            targets[f"constraint {name}"] = (condition.sign, condition)
    worst_of: dict[str, Worst] = {}
    for name, (sign, target) in targets.items():
        shared = {n: worst_of[n].value for n in worst_of if isinstance(target, Expression) and n in target.names}
        measured = []
        for case in _find_peaks(problem, parameters, sign, target, shared):
            values = problem.values(case.applied(parameters)).with_known(shared)
            measured.append(Worst(case, float(values[target] if isinstance(target, str) else target(values))))
        worst_of[name] = max(measured, key=lambda w: sign * w.value if np.isfinite(w.value) else np.inf)
    return worst_of


def _find_peaks(
    problem: Posed, parameters: Numbers, sign: float, target: Expression | str, shared: Numbers
) -> Iterator[Case]:
    """The refined worst points of a grid, for every choice of separate scenario values."""
    bands = {n: s for n, s in problem.scenarios.items() if isinstance(s, Band)}
    separate_values = {n: s for n, s in problem.scenarios.items() if not isinstance(s, Band)}
    size = len(bands) + len(problem.tolerances)

    def case_at(u: Array) -> Case:
        """The case at a point of the unit cube, or the cases at several points, as arrays."""
        columns = list(u.T) if u.ndim > 1 else u.tolist()
        at = {n: band.min + (band.max - band.min) * columns.pop(0) for n, band in bands.items()}
        return Case({**fixed, **at}, {n: t * (2 * columns.pop(0) - 1) for n, t in problem.tolerances.items()})

    def badness(u: Array) -> Array:
        [values] = evaluate(problem, [target], {**case_at(u).applied(parameters), **shared})
        return np.where(np.isfinite(values), sign * values, np.inf) * np.ones(len(u))

    for choice in product(*separate_values.values()):
        fixed = dict(zip(separate_values, choice, strict=True))
        if size == 0:
            yield Case(Table(fixed))
            continue
        u = _list_start_points(size)
        heights = badness(u)
        step = 1 / (_LINE_POINTS - 1) if size == 1 else 0.5 * len(u) ** (-1 / size)
        rows = _select_peaks(u, heights, 4 * step)
        best_points, value, indices = u[rows], heights[rows], np.arange(len(rows))
        moves = _draw_steps(len(rows), size)
        for look in range(_ROUNDS):  # all peaks at once, since calls cost more than points
            reach = step * (_SHRINK if size == 1 else _SHRINK ** (1 / 2)) ** look
            around = np.clip(best_points[:, None] + reach * moves[:, look], 0, 1)
            trial = badness(around.reshape(-1, size)).reshape(len(rows), _POINTS_AROUND)
            top_indices = np.argmax(trial, axis=1)
            is_higher = trial[indices, top_indices] > value
            best_points = np.where(is_higher[:, None], around[indices, top_indices], best_points)
            value = np.where(is_higher, trial[indices, top_indices], value)
        for case in map(case_at, best_points):
            yield Case(Table(case.at), Table(case.offset))


def _list_start_points(size: int) -> Array:
    """Points of the unit cube: evenly along a line, or corners, edges, midpoints and a quasi-random sequence."""
    if size == 1:
        return np.linspace(0, 1, _LINE_POINTS)[:, None]
    corners = np.array(list(product((0.0, 1.0), repeat=size)))
    positions = np.linspace(0, 1, max(17, min(_LINE_POINTS, _EDGE_POINTS // (size * len(corners)))))
    edges = [
        np.insert(np.repeat(other_coordinates[None, :], len(positions), axis=0), k, positions, axis=1)
        for k in range(size)
        for other_coordinates in np.unique(np.delete(corners, k, axis=1), axis=0)
    ]
    middles = np.array(list(product((0.0, 0.5, 1.0), repeat=size))) if size <= 5 else corners
    steps = np.arange(1, _INNER_POINTS + 1)[:, None] * golden_steps(size)
    return np.concatenate([corners, middles, *edges, (0.5 + steps) % 1.0])


@lru_cache(maxsize=64)
def _draw_steps(peaks: int, size: int) -> Array:
    """Random steps around each peak in each round; every second step is along one axis, so that it stays on an edge."""
    rng = np.random.default_rng(0)
    steps = np.empty((peaks, _ROUNDS, _POINTS_AROUND, size))
    for moves in steps.reshape(-1, _POINTS_AROUND, size):
        moves[:] = rng.uniform(-1, 1, (_POINTS_AROUND, size))
        moves[::2] *= np.arange(size) == rng.integers(0, size, (len(moves[::2]), 1))
    steps.flags.writeable = False
    return steps


def _select_peaks(u: Array, heights: Array, distance: float) -> list[int]:
    """Indices of the highest points at least a distance apart."""
    peaks: list[int] = []
    for k in np.argsort(-heights, kind="stable"):
        if all(np.abs(u[k] - u[c]).max() > distance for c in peaks):
            peaks.append(int(k))
        if len(peaks) == _MAX_PEAKS:
            break
    return peaks


_Box = dict[tuple[bool, str], Interval]
"""(whether it is an offset, parameter) → interval. The side that was halved last comes last."""


def prove_worst_case(problem: Posed, parameters: Numbers, worst: float, boxes: int | None = None) -> Cover:
    """Prove that no case has a root right of `worst` plus SLACK, by the Liénard–Chipart conditions of p(t + limit).

    Interval arithmetic decides the conditions for a whole box of cases. Undecided boxes are halved until none is left;
    the side that was halved longest ago is halved first.
    """
    if boxes is None:
        boxes = max(BOXES >> max(problem.model.degree - 4, 0), _MIN_BOXES)
    limit, box_count = worst + SLACK * (1 + abs(worst)), 0
    choices = [[(s.min, s.max)] if isinstance(s, Band) else [(v, v) for v in s] for s in problem.scenarios.values()]
    offset: _Box = {(True, n): round_outwards(-t, t) for n, t in problem.tolerances.items()}
    open_boxes = deque[_Box]()
    for ranges in product(*choices):  # bands and tolerances whole
        at = zip(problem.scenarios, ranges, strict=True)
        open_boxes.append({(False, n): round_outwards(*ends) for n, ends in at} | offset)
    with flint.ctx.workdps(_DIGITS):
        while open_boxes and box_count < boxes:
            box = open_boxes.popleft()
            box_count += 1
            if not _is_left_of(problem, parameters, box, flint.arb(limit)):
                side = next((side for side, (lower, upper) in box.items() if lower < (lower + upper) / 2 < upper), None)
                if side is None:
                    return Cover(limit, False, box_count)
                lower, upper = box.pop(side)
                middle = (lower + upper) / 2
                open_boxes += [{**box, side: half} for half in ((lower, middle), (middle, upper))]
    return Cover(limit, not open_boxes, box_count)


def _is_left_of(problem: Posed, parameters: Numbers, box: _Box, gamma: Any) -> bool:
    """Whether every design in a box certainly has all roots left of the line Re s = γ."""

    def tests(box: _Box, series_name: str = "") -> list[Any]:
        """Numbers that are all positive exactly if every root is left of the line.

        Args:
            series_name: a parameter that becomes a power series, which gives the slopes.
        """
        at: dict[str, Any] = {n: flint.arb(x) for n, x in parameters.items()}
        for (added, n), ends in sorted(box.items()):  # a parameter may have both; the scenario comes first
            at[n] = ball(ends) + (at[n] if added else 0)
        if series_name:
            at[series_name] = flint.arb_series([at[series_name], 1], prec=2)
        a = problem.model.coefficients(at, problem.parameter_set)
        sign = -1 if _get_series_term(a[0], 0) < 0 else 1
        shifted = [sign * c for c in shift(a, gamma)]
        return [shifted[0], *lienard_chipart(shifted)]

    if all(test > 0 for test in tests(box)):
        return True
    middle: _Box = {side: ((lower + upper) / 2,) * 2 for side, (lower, upper) in box.items()}
    at_middle = tests(middle)
    if not all(test > 0 for test in at_middle):
        return False
    # The error of the mean value form f(m) + Σ ∂f/∂x (x − m) is the width squared; the error of f(x) is the width.
    for side, ends in box.items():
        if ends[0] < ends[1]:
            move = ball(ends) - middle[side][0]
            slopes = (_get_series_term(test, 1) for test in tests(box, side[1]))
            at_middle = [test + slope * move for test, slope in zip(at_middle, slopes, strict=True)]
    return all(test > 0 for test in at_middle)


def _get_series_term(test: Any, order: int) -> Any:
    """The value (order 0) or slope (order 1) of a series; the slope of an interval is 0."""
    return test[order] if isinstance(test, flint.arb_series) else flint.arb(0) if order else test
