"""Where, within its scenarios and tolerances, a design does worst, and the proof that it does no worse anywhere."""

import heapq
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import count, product
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from tmsopt.algebra.intervals import Interval, outwards
from tmsopt.algebra.sequence import golden_steps
from tmsopt.models import Values
from tmsopt.problem.cases import Band, Case, Cover
from tmsopt.problem.dependence import WORSE_DIRECTION, depends_on_case
from tmsopt.problem.evaluate import evaluate
from tmsopt.problem.expression import Expression
from tmsopt.problem.problem import Posed
from tmsopt.records import Array, Table
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


def worst_case_targets(problem: Posed, cases: Sequence[Case]) -> dict[str, tuple[float, Expression | str]]:
    """What may differ between cases: name → sign that makes the worst the greatest, and what it is."""
    found: dict[str, tuple[float, Expression | str]] = {"abscissa": (1.0, "abscissa")}
    asked = [e for e in (problem.objective, *problem.conditions.values()) if e]
    found |= {n: (sign, n) for n, sign in WORSE_DIRECTION.items() if any(n in e.names for e in asked)}
    if problem.objective and depends_on_case(problem, problem.objective, cases):
        found["objective"] = (problem.sign, problem.objective)
    for name, condition in problem.conditions.items():
        if depends_on_case(problem, condition, cases):
            found[f"constraint {name}"] = (condition.sign, condition)
    return found


def worst_cases(problem: Posed, parameters: Mapping[str, float]) -> dict[str, Worst]:
    """The worst case of everything that differs between cases, over whole bands and tolerance boxes.

    A grid with a closer look at its worst points; the value in the case found is exact, with multiple roots
    recognised, but a peak narrower than the grid can escape: `prove` excludes that.
    """
    found: dict[str, Worst] = {}
    for name, (sign, what) in worst_case_targets(problem, problem.cases).items():
        shared = {n: found[n].value for n in found if isinstance(what, Expression) and n in what.names}
        cases = [peak.case for peak in _peaks(problem, parameters, 1, sign, what, shared)[0]]
        each = [problem.values(case.applied(parameters)) for case in cases]
        measured = [Worst(c, float(_value(v, what, shared))) for c, v in zip(cases, each, strict=True)]
        found[name] = max(measured, key=lambda w: sign * w.value if np.isfinite(w.value) else np.inf)
    return found


def peaks(problem: Posed, designs: Mapping[str, float | Array], count: int) -> list[list[Case]]:
    """Of each of several designs, the cases in which something may be worst, by numeric roots.

    Args:
        designs: parameter → its value, or one for each of the `count` designs.
    """
    cases: list[list[Case]] = [[] for _ in range(count)]
    known: dict[str, Array] = {}
    for name, (sign, what) in worst_case_targets(problem, problem.cases).items():
        shared = {n: known[n] for n in known if isinstance(what, Expression) and n in what.names}
        found = _peaks(problem, designs, count, sign, what, shared)
        known[name] = np.array([sign * max(peak.value for peak in own) for own in found])
        for own, seen in zip(found, cases, strict=True):
            seen += [peak.case for peak in own]
    return cases


def _value(values: Values, what: Expression | str, shared: Mapping[str, float | Array]) -> Any:
    """A root quantity, or an expression with the given worst root quantities."""
    values = values.with_known(shared)
    return values[what] if isinstance(what, str) else what(values)


def _peaks(
    problem: Posed,
    designs: Mapping[str, float | Array],
    count: int,
    sign: float,
    what: Expression | str,
    shared: Mapping[str, float | Array],
) -> list[list[Worst]]:
    """Of each of several designs, the worst few cases of every choice of separate scenario values; worse is greater."""
    each = [space.peaks(problem, designs, count, sign, what, shared) for space in _spaces(problem)]
    return [[peak for found in each for peak in found[k]] for k in range(count)]


@dataclass(frozen=True)
class _Space:
    """Bands and tolerances as a unit cube, with separate scenario values fixed."""

    at: Table[float]
    bands: Mapping[str, Band]
    tolerances: Mapping[str, float]

    def case(self, u: Array) -> Case:
        """The case at a point of the cube."""
        at, offset = self._columns(u)
        values, moves = ({n: float(v) for n, v in table.items()} for table in (at, offset))
        return Case(Table({**self.at, **values}), Table(moves))

    def peaks(
        self,
        problem: Posed,
        designs: Mapping[str, float | Array],
        count: int,
        sign: float,
        what: Expression | str,
        shared: Mapping[str, float | Array],
    ) -> list[list[Worst]]:
        """Of each design, the worst few points of a grid, each moved to where it is locally worst."""
        size = len(self.bands) + len(self.tolerances)
        if size == 0:
            return [[Worst(Case(self.at), np.nan)]] * count

        def badness(u: Array, owner: NDArray[np.int64]) -> Array:
            def own(table: Mapping[str, float | Array]) -> dict[str, Any]:
                return {n: x[owner] if isinstance(x, np.ndarray) else x for n, x in table.items()}

            at, offset = self._columns(u)
            found = _evaluated(problem, {**own(designs), **self.at, **at}, offset, len(u), what, own(shared))
            return np.where(np.isfinite(found), sign * found, np.inf)

        every = np.arange(count)
        u = _grid(size)
        high = badness(np.tile(u, (count, 1)), np.repeat(every, len(u))).reshape(count, len(u))
        step = 1 / (_LINE - 1) if size == 1 else 0.5 * len(u) ** (-1 / size)
        chosen = [_apart(u, row, 4 * step) for row in high]
        moves = np.concatenate([_moves(len(rows), size) for rows in chosen])
        owner = np.repeat(every, [len(rows) for rows in chosen])
        rows = np.concatenate(chosen)
        best, value, peak = u[rows], high[owner, rows], np.arange(len(rows))
        for look in range(_LOOKS):  # all peaks at once: calls cost more than points
            reach = step * (_SHRINK if size == 1 else _SHRINK ** (1 / 2)) ** look
            around = np.clip(best[:, None] + reach * moves[:, look], 0, 1)
            trial = badness(around.reshape(-1, size), np.repeat(owner, _AROUND)).reshape(len(rows), _AROUND)
            top = np.argmax(trial, axis=1)
            higher = trial[peak, top] > value
            best = np.where(higher[:, None], around[peak, top], best)
            value = np.where(higher, trial[peak, top], value)
        found = [Worst(self.case(point), float(x)) for point, x in zip(best, value, strict=True)]
        return [[found[i] for i in np.flatnonzero(owner == k)] for k in range(count)]

    def _columns(self, u: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        columns = list(np.moveaxis(u, -1, 0))
        at = {n: b.min + (b.max - b.min) * c for (n, b), c in zip(self.bands.items(), columns, strict=False)}
        rest = columns[len(self.bands) :]
        return at, {n: t * (2 * c - 1) for (n, t), c in zip(self.tolerances.items(), rest, strict=True)}


def _spaces(problem: Posed) -> Iterator[_Space]:
    """One space for every choice of the separate scenario values."""
    bands = {n: s for n, s in problem.scenarios.items() if isinstance(s, Band)}
    separate = {n: s for n, s in problem.scenarios.items() if not isinstance(s, Band)}
    for values in product(*separate.values()):
        yield _Space(Table(dict(zip(separate, values, strict=True))), bands, problem.tolerances)


def _evaluated(
    problem: Posed,
    parameters: Mapping[str, Any],
    offset: Mapping[str, Array],
    count: int,
    what: Expression | str,
    shared: Mapping[str, float | Array],
) -> Array:
    varied = Case(offset=offset).applied(parameters)  # type: ignore[arg-type]
    [values] = evaluate(problem, [what], {**varied, **shared})
    return np.broadcast_to(values, count)


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


def cover(problem: Posed, parameters: Mapping[str, float], worst: float, boxes: int | None = None) -> Cover:
    """Prove that no case has a root right of `worst` plus SLACK: Liénard–Chipart signs of p(t + limit) in balls.

    Boxes whose signs are undecided are halved, widest first, until none is left.
    """
    if boxes is None:
        boxes = max(BOXES >> max(problem.model.degree - 4, 0), _FEWEST)
    limit = worst + SLACK * (1 + abs(worst))
    order = count()
    heap: list[tuple[float, int, _Box]] = [(-1.0, next(order), box) for box in _first(problem)]
    done = 0
    with flint.ctx.workdps(_DIGITS):
        gamma = flint.arb(limit)
        while heap and done < boxes:
            box = heapq.heappop(heap)[2]
            done += 1
            if not _left_of(problem, parameters, box, gamma):
                halves = box.halves()
                if not halves:
                    return Cover(limit, False, done)
                for half in halves:
                    heapq.heappush(heap, (-half.width, next(order), half))
    return Cover(limit, not heap, done)


@dataclass(frozen=True)
class _Box:
    """Intervals of scenario values and tolerances.

    Attributes:
        width: of the widest side, as a share of what the problem states.
    """

    at: Mapping[str, Interval]
    offset: Mapping[str, Interval]
    shares: Mapping[str, float]

    @property
    def width(self) -> float:
        return max(self.shares.values(), default=0.0)

    def varied(self, parameters: Mapping[str, float], middle: bool = False, moving: str = "") -> dict[str, Any]:
        """The designs of the box as balls, or the one in its middle; `moving` is the name of a series' variable."""
        balls = {n: flint.arb(v) for n, v in parameters.items()}
        balls |= {n: _within(ends, middle) for n, ends in self.at.items()}
        balls |= {n: balls[n] + _within(ends, middle) for n, ends in self.offset.items()}
        return {n: flint.arb_series([v, 1], prec=2) if n == moving else v for n, v in balls.items()}

    def halves(self) -> "tuple[_Box, ...]":
        """Both halves across the widest side; none where it cannot be divided."""
        if not self.shares:
            return ()
        key = max(self.shares, key=lambda k: self.shares[k])
        table, name = key.split(" ")
        lower, upper = getattr(self, table)[name]
        middle = (lower + upper) / 2
        if not lower < middle < upper:
            return ()
        shares = {**self.shares, key: self.shares[key] / 2}
        whole: dict[str, Any] = {"at": self.at, "offset": self.offset, "shares": shares}
        parts = ((lower, middle), (middle, upper))
        return tuple(_Box(**whole | {table: {**whole[table], name: part}}) for part in parts)


def _first(problem: Posed) -> Iterator[_Box]:
    """Bands and tolerances whole, one box for each choice of separate scenario values."""
    choices = [[(s.min, s.max)] if isinstance(s, Band) else [(v, v) for v in s] for s in problem.scenarios.values()]
    choices = [[outwards(*ends) for ends in each] for each in choices]
    offset = {n: outwards(-t, t) for n, t in problem.tolerances.items()}
    for values in product(*choices):
        at = dict(zip(problem.scenarios, values, strict=True))
        shares = {f"at {n}": 1.0 for n, (lo, hi) in at.items() if hi > lo} | {f"offset {n}": 1.0 for n in offset}
        yield _Box(at, offset, shares)


def _left_of(problem: Posed, parameters: Mapping[str, float], box: _Box, gamma: Any) -> bool:
    """Whether every design of a box certainly has all roots left of a vertical line."""
    sides = [(table, n) for table in ("at", "offset") for n, (lo, hi) in getattr(box, table).items() if hi > lo]
    over = _tests(problem, box.varied(parameters), gamma)
    if all(test > 0 for test in over):
        return True
    middle = _tests(problem, box.varied(parameters, middle=True), gamma)
    if not all(test > 0 for test in middle):
        return False
    # The mean value form, f(m) + Σ ∂f/∂x (x − m), is off by the square of the width, the plain one by the width.
    slopes = []
    for table, name in sides:
        series = _tests(problem, box.varied(parameters, moving=name), gamma)
        lower, upper = getattr(box, table)[name]
        slopes.append([_slope(test) * (_ball(lower, upper) - (lower + upper) / 2) for test in series])
    return all(test + sum(moves) > 0 for test, *moves in zip(middle, *slopes, strict=True))


def _tests(problem: Posed, parameters: Mapping[str, Any], gamma: Any) -> list[Any]:
    """Quantities that are all positive exactly when every root is left of the line; a0 first, by its sign."""
    given = problem.model.coefficients(parameters, problem.parameter_set)
    a = [flint.arb(c) if isinstance(c, int | float) else c for c in given]  # a model may have plain numbers too
    lead = a[0] if isinstance(a[0], flint.arb) else a[0][0]
    sign = -1 if lead < 0 else 1
    shifted = [sign * c for c in shift(a, gamma)]
    return [shifted[0], *lienard_chipart(shifted)]


def _slope(test: Any) -> Any:
    return flint.arb(0) if isinstance(test, flint.arb) else test[1]


def _within(ends: Interval, middle: bool) -> Any:
    return flint.arb((ends[0] + ends[1]) / 2) if middle else _ball(*ends)


def _ball(lower: float, upper: float) -> Any:
    if lower == upper:
        return flint.arb(lower)
    return flint.arb(lower).union(flint.arb(upper))
