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

_PROOF_MARGIN = 1e-6
"""Margin of a proof above the worst abscissa, relative to 1 + |abscissa|, because equality cannot be proved."""

_MAX_BOXES = 4000
"""Greatest number of boxes of a proof, about a second. From degree 5 on it is smaller, because a box takes longer."""

_MIN_BOXES = 32  # the greatest number of boxes is never smaller than this
_LINE_POINTS = 1025  # number of points along a band if nothing else varies
_INNER_POINTS = 2048  # number of points inside a box of several dimensions
_EDGE_POINTS = 8192  # number of points on the edges of the box, where most worst cases lie
_MAX_PEAKS = 4  # greatest number of worst points to refine
_POINTS_PER_ROUND = 48  # number of points around each peak in each round
_SHRINKAGE = 0.25  # ratio of the neighbourhoods of successive rounds
_ROUND_COUNT = 14  # number of rounds, after which the value at a smooth maximum is exact
_DIGITS = 30  # decimal digits of a proof


@dataclass(frozen=True)
class WorstCase:
    """The worst case of one root quantity, objective or constraint.

    Attributes:
        value: value of the quantity or objective in the case; for a constraint, left side minus right side.
    """

    case: Case
    value: float


def find_worst_cases(problem: Posed, parameters: Numbers) -> dict[str, WorstCase]:
    """Find the worst case of everything that depends on the case, over whole bands and tolerance boxes.

    The function searches a grid and refines its worst points. The value in the case found is exact, and multiple roots
    are recognised. The grid can miss a peak that is narrower than the spacing of the grid; `prove_worst_case` excludes
    this.

    Returns:
        Name of a root quantity, ``objective``, or ``constraint`` and its name → worst case.
    """
    expressions = [e for e in (problem.objective, *problem.conditions.values()) if e]
    # name → sign of a change for the worse, and the quantity or expression
    targets: dict[str, tuple[float, Expression | str]] = {"abscissa": (1.0, "abscissa")}
    targets |= {n: (sign, n) for n, sign in WORSE_DIRECTION.items() if any(n in e.names for e in expressions)}
    if problem.objective and depends_on_case(problem, problem.objective, problem.cases):
        targets["objective"] = (problem.sign, problem.objective)
    for name, condition in problem.conditions.items():
        if depends_on_case(problem, condition, problem.cases):
            targets[f"constraint {name}"] = (condition.sign, condition)
    worst_cases: dict[str, WorstCase] = {}
    for name, (sign, target) in targets.items():
        names = target.names if isinstance(target, Expression) else ()
        root_values = {n: worst.value for n, worst in worst_cases.items() if n in names}
        peaks = []
        for case in _find_peaks(problem, parameters, sign, target, root_values):
            values = problem.values(case.applied(parameters)).with_known(root_values)
            peaks.append(WorstCase(case, float(values[target] if isinstance(target, str) else target(values))))
        worst_cases[name] = max(peaks, key=lambda peak: sign * peak.value if np.isfinite(peak.value) else np.inf)
    return worst_cases


def _find_peaks(
    problem: Posed, parameters: Numbers, sign: float, target: Expression | str, root_values: Numbers
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
        [values] = evaluate(problem, [target], {**case_at(u).applied(parameters), **root_values})
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
        directions = _draw_steps(len(rows), size)
        for k in range(_ROUND_COUNT):  # all peaks together, since calls cost more than points
            radius = step * (_SHRINKAGE if size == 1 else _SHRINKAGE ** (1 / 2)) ** k
            around = np.clip(best_points[:, None] + radius * directions[:, k], 0, 1)
            trial = badness(around.reshape(-1, size)).reshape(len(rows), _POINTS_PER_ROUND)
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
def _draw_steps(peak_count: int, size: int) -> Array:
    """Random steps around each peak in each round; every second step is along one axis, so that it stays on an edge."""
    rng = np.random.default_rng(0)
    steps = np.empty((peak_count, _ROUND_COUNT, _POINTS_PER_ROUND, size))
    for moves in steps.reshape(-1, _POINTS_PER_ROUND, size):
        moves[:] = rng.uniform(-1, 1, (_POINTS_PER_ROUND, size))
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
"""(is_offset, parameter) → interval of its values or offsets. The interval that was halved last comes last."""


def prove_worst_case(problem: Posed, parameters: Numbers, worst: float, max_boxes: int | None = None) -> Cover:
    """Prove that no root in any case is right of the limit, which is the abscissa `worst` plus a small margin.

    Interval arithmetic decides the Liénard–Chipart conditions of p(t + limit) for a whole box of cases. Undecided boxes
    are halved until none is left; the side that was halved longest ago is halved first.
    """
    if max_boxes is None:
        max_boxes = max(_MAX_BOXES >> max(problem.model.degree - 4, 0), _MIN_BOXES)
    limit, box_count = worst + _PROOF_MARGIN * (1 + abs(worst)), 0
    choices = [[(s.min, s.max)] if isinstance(s, Band) else [(v, v) for v in s] for s in problem.scenarios.values()]
    offsets: _Box = {(True, n): round_outwards(-t, t) for n, t in problem.tolerances.items()}
    open_boxes = deque[_Box]()
    for ranges in product(*choices):  # whole bands and tolerances
        ranges_by_name = zip(problem.scenarios, ranges, strict=True)
        open_boxes.append({(False, n): round_outwards(*ends) for n, ends in ranges_by_name} | offsets)
    with flint.ctx.workdps(_DIGITS):
        while open_boxes and box_count < max_boxes:
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

    def compute_tests(box: _Box, series_name: str = "") -> list[Any]:
        """Numbers that are all positive exactly if every root is left of the line.

        Args:
            series_name: a parameter that becomes a power series, which gives the slopes.
        """
        design: dict[str, Any] = {n: flint.arb(x) for n, x in parameters.items()}
        for (is_offset, n), ends in sorted(box.items()):  # first the values of scenarios, then the offsets
            design[n] = ball(ends) + (design[n] if is_offset else 0)
        if series_name:
            design[series_name] = flint.arb_series([design[series_name], 1], prec=2)
        a = problem.model.coefficients(design, problem.parameter_set)
        sign = -1 if _get_series_term(a[0], 0) < 0 else 1
        shifted = [sign * c for c in shift(a, gamma)]
        return [shifted[0], *lienard_chipart(shifted)]

    if all(test > 0 for test in compute_tests(box)):
        return True
    middle: _Box = {side: ((lower + upper) / 2,) * 2 for side, (lower, upper) in box.items()}
    tests = compute_tests(middle)
    if not all(test > 0 for test in tests):
        return False
    # The error of the mean value form f(m) + Σ ∂f/∂x (x − m) is the width squared; the error of f(x) is the width.
    for side, (lower, upper) in box.items():
        if lower < upper:
            _, name = side
            change = ball((lower, upper)) - (lower + upper) / 2
            slopes = (_get_series_term(test, 1) for test in compute_tests(box, name))
            tests = [test + slope * change for test, slope in zip(tests, slopes, strict=True)]
    return all(test > 0 for test in tests)


def _get_series_term(test: Any, order: int) -> Any:
    """The value (order 0) or slope (order 1) of a series; the slope of an interval is 0."""
    return test[order] if isinstance(test, flint.arb_series) else flint.arb(0) if order else test
