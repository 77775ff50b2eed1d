"""Proof by interval arithmetic that a design keeps its abscissa over whole bands and tolerance boxes."""

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count, product
from typing import Any

import flint

from tmsopt.design.cases import Band
from tmsopt.design.problem import Problem
from tmsopt.design.solution import Cover
from tmsopt.roots import lienard_chipart, shift

SLACK = 1e-6
"""Above the worst abscissa found, relative to 1 + |abscissa|: a bound that is met with equality cannot be proved."""

BOXES = 4000
"""Boxes looked at before the proof is given up, a second or so; from degree 5 on ever fewer, for each takes longer."""

_FEWEST = 32

_DIGITS = 30
Interval = tuple[float, float]


def cover(problem: Problem, parameters: Mapping[str, float], worst: float, boxes: int | None = None) -> Cover:
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
        parts: list[_Box] = []
        for part in ((lower, middle), (middle, upper)):
            changed: dict[str, Any] = {"at": self.at, "offset": self.offset}
            changed[table] = {**changed[table], name: part}
            parts.append(_Box(**changed, shares=shares))
        return tuple(parts)


def _first(problem: Problem) -> Iterator[_Box]:
    """Bands and tolerances whole, one box for each choice of separate scenario values."""
    choices = [[(s.min, s.max)] if isinstance(s, Band) else [(v, v) for v in s] for s in problem.variations.values()]
    offset = {n: (-t, t) for n, t in problem.tolerances.items()}
    for values in product(*choices):
        at = dict(zip(problem.variations, values, strict=True))
        shares = {f"at {n}": 1.0 for n, (lo, hi) in at.items() if hi > lo} | {f"offset {n}": 1.0 for n in offset}
        yield _Box(at, offset, shares)


def _left_of(problem: Problem, parameters: Mapping[str, float], box: _Box, gamma: Any) -> bool:
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


def _tests(problem: Problem, parameters: Mapping[str, Any], gamma: Any) -> list[Any]:
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
