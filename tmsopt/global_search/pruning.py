"""Branch and prune by interval contractors of codac, in a process of its own.

From its import on, codac has doubles rounded upwards, all that a process computes: so it is imported in workers alone,
and whoever reads their answers must allow for nothing.
"""

import math
import operator
import time
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.formula import CONSTANT, INPUT, Formula, Kind, NotAccepted, fold
from tmsopt.algebra.intervals import interval
from tmsopt.algebra.kinds import as_exact

Box = tuple[tuple[float, float], ...]
"""Least and greatest value of each variable."""

PARTIAL = {"div": 1, "quotient": 1, "ratio": 1, "pow": 0, "sqrt": 0, "asin": 0, "acos": 0}
"""Operations that do not exist, or have no slope, somewhere, and which operand decides on that."""

_POLES = {"div", "quotient", "ratio", "pow"}  # where it is 0; of powers with a negative exponent

FUNCTIONS = ("sqrt", "abs", "exp", "sin", "cos", "asin", "acos", "atan")

_TINY = 1e-300
_GAIN = 0.9  # of a width: contracting goes on where one shrinks below
_ROUNDS = 8
_WIDER = 0.1  # of a width: the box in which a zero is looked for is so much wider at each end


@dataclass(frozen=True)
class Puzzle:
    """What is to hold in a box; plain data.

    Attributes:
        equations: what must be 0, as many as variables.
        limits: what must be ≥ 0.
        widths: of the first box, 1 where it has no end.
        more: what must be 0 too.
    """

    equations: Formula
    limits: Formula
    widths: tuple[float, ...]
    more: Formula

    @property
    def guarded(self) -> list[tuple[str, Formula]]:
        """Operations with their arguments that must exist for the equations to have slopes."""
        steps, names = self.equations.steps, self.equations.names
        smooth = {k for k, s in enumerate(steps) if s.op == "pow" and steps[s.operands[1]].value >= 0}
        taken = dict.fromkeys(
            (s.op, s.operands[PARTIAL[s.op]]) for k, s in enumerate(steps) if s.op in PARTIAL and k not in smooth
        )
        return [(op, Formula(names, steps, (k,))) for op, k in taken if steps[k].op != CONSTANT]


@dataclass(frozen=True)
class Pruned:
    """What became of boxes.

    Attributes:
        boxes: how many were looked at.
        left: those that were not.
        met: with a zero that Newton's operator shows, or seems to, beside it.
        small: those that could neither be emptied nor be split.
    """

    boxes: int
    left: tuple[Box, ...]
    met: tuple[Box, ...]
    small: tuple[Box, ...]


def prune(
    puzzle: Puzzle, boxes: Sequence[Box], proved: Sequence[Box], seconds: float, most: int, least: float
) -> Pruned:
    """Contract, drop and split boxes, the last one first, until time is over or a new zero was met.

    Args:
        proved: boxes with one zero each, which is known: nothing more is to be found in these.
        most: boxes at most that can neither be emptied nor be split.
        least: share of the first box: what is smaller is not split.
    """
    import codac

    if not _upwards(codac):
        raise RuntimeError("doubles are not rounded upwards, as codac needs it")
    contractors = _contractors(puzzle)
    known = [_vector(codac, box) for box in proved]
    left = list(boxes)
    met: list[Box] = []
    small: list[Box] = []
    end, count = time.perf_counter() + seconds, 0
    while left and not met and len(small) < most and (count == 0 or time.perf_counter() < end):
        x = _vector(codac, left.pop())
        count += 1
        zero = contractors.contract(x)
        if x.is_empty() or any(x.is_subset(k) for k in known):
            continue
        if zero:
            met.append(_box(x))
        elif parts := halves(_box(x), puzzle.widths, least, contractors.weights(x)):
            left += parts
        else:
            small.append(_box(x))
    if not _upwards(codac):
        raise RuntimeError("doubles were not rounded upwards all the time, as codac needs it")
    return Pruned(count, tuple(left), tuple(met), tuple(small))


def _upwards(codac: Any) -> bool:
    """Whether the rounding mode of this thread is what codac's intervals rely on."""
    third, sum = codac.Interval(1.0) / codac.Interval(3.0), codac.Interval(0.1) + codac.Interval(0.2)
    return bool(third.lb() < third.ub() and sum.lb() < sum.ub())


def halves(box: Box, widths: Sequence[float], least: float, weights: Sequence[float]) -> list[Box]:
    """A box cut across the side of the greatest weight; none for one that is small."""
    middles = [lo + (hi - lo) / 2 for lo, hi in box]
    each = enumerate(zip(box, middles, widths, strict=True))
    wide = [k for k, ((lo, hi), m, w) in each if least * w < hi - lo < math.inf and lo < m < hi]
    if not wide:
        return []
    k = max(wide, key=weights.__getitem__)
    return [(*box[:k], part, *box[k + 1 :]) for part in ((box[k][0], middles[k]), (middles[k], box[k][1]))]


class _Contractors:
    """The contractors of a puzzle."""

    def __init__(self, puzzle: Puzzle) -> None:
        import codac

        guarded = puzzle.guarded
        self.codac, self.widths, self.guarded = codac, puzzle.widths, [op for op, _ in guarded]
        n = len(puzzle.equations.outputs)
        x = codac.VectorVar(n)
        self.system = codac.AnalyticFunction([x], _expressions(codac, puzzle.equations, x))
        zero = codac.IntervalVector([[0.0, 0.0]] * n)
        self.rows = [codac.CtcInverse(self.system, zero, not guarded)]
        allowed = [(codac.Interval(0.0, math.inf), puzzle.limits), (codac.Interval(0.0), puzzle.more)]
        for over, asked in allowed:
            self.rows += [
                codac.CtcInverse(codac.AnalyticFunction([x], e), over, False) for e in _expressions(codac, asked, x)
            ]
        self.arguments = [codac.AnalyticFunction([x], *_expressions(codac, argument, x)) for _, argument in guarded]

    def contract(self, x: Any) -> bool:
        """Shrink a box around its zeros; whether Newton's operator shows one in it, or just beside."""
        zero, self.slopes = False, None
        for turn in range(_ROUNDS):
            before = x.diam()
            for row in self.rows:
                row.contract(x)
                if x.is_empty():
                    return False
            if _shrunk(x, before) and turn < _ROUNDS - 1:
                continue
            zero = self.newton(x) or zero
            if x.is_empty() or not _shrunk(x, before):
                break
        return zero

    def newton(self, x: Any) -> bool:
        """Newton's operator on a somewhat wider box: zeros of x are in what it leaves; whether it has one for sure."""
        codac, n = self.codac, x.size()
        if x.is_unbounded() or not self.regular(x):
            return False
        room = [_WIDER * x[k].diam() + 1e-12 * self.widths[k] for k in range(n)]
        wide = codac.IntervalVector([[x[k].lb() - room[k], x[k].ub() + room[k]] for k in range(n)])
        if not self.regular(wide):
            wide = x
        middle = codac.IntervalVector([[m, m] for m in (wide[k].mid() for k in range(n))])
        slopes, value = self.system.diff(wide), self.system.eval(codac.EvalMode.NATURAL, middle)
        if slopes.is_empty() or value.is_empty() or slopes.is_unbounded() or value.is_unbounded():
            return False
        self.slopes = slopes
        try:
            inverse = np.linalg.inv([[slopes[i, k].mid() for k in range(n)] for i in range(n)])
        except np.linalg.LinAlgError:
            return False
        if not np.all(np.isfinite(inverse)):
            return False
        matrix = codac.IntervalMatrix(codac.Matrix(inverse))
        slopes, value = matrix * slopes, matrix * -value
        around = [wide[k] - middle[k] for k in range(n)]
        shown = True
        for k in range(n):  # Gauss and Seidel; codac's own takes a coefficient that may be 0 for one that is not
            if slopes[k, k].contains(0.0):
                shown = False
                continue
            rest = sum((slopes[k, j] * around[j] for j in range(n) if j != k), codac.Interval(0.0))
            step = (value[k] - rest) / slopes[k, k]
            shown = shown and around[k].lb() < step.lb() and step.ub() < around[k].ub()
            around[k] &= step
            if around[k].is_empty():
                x.set_empty()
                return False
        for k in range(n):
            x[k] &= middle[k] + around[k]
        return shown

    def regular(self, x: Any) -> bool:
        """Whether every function that the equations use has a slope all over a box."""
        for name, argument in zip(self.guarded, self.arguments, strict=True):
            over = argument.eval(self.codac.EvalMode.NATURAL, x)
            if name in _POLES:
                if over.contains(0.0):
                    return False
            elif name in ("asin", "acos"):
                if not (over.lb() > -1.0 and over.ub() < 1.0):
                    return False
            elif not over.lb() > 0.0:
                return False
        return True

    def weights(self, x: Any) -> list[float]:
        """How much each variable's width adds to those of the equations, at most 1 each; or its share of the first."""
        n = x.size()
        own = [min(x[k].diam() / self.widths[k], 1.0) if self.widths[k] > 0 else 0.0 for k in range(n)]
        if (slopes := self.slopes) is None:
            return own
        total = [0.0] * n
        for i in range(n):
            parts = [slopes[i, k].mag() * x[k].diam() for k in range(n)]
            whole = sum(parts)
            if whole > 0:
                total = [t + p / whole for t, p in zip(total, parts, strict=True)]
        return [t + 1e-3 * s for t, s in zip(total, own, strict=True)]


def _shrunk(x: Any, before: Any) -> bool:
    """Whether a side of a box is now notably shorter."""
    return any(x[k].diam() < _GAIN * before[k] for k in range(x.size()))


@cache
def _contractors(puzzle: Puzzle) -> _Contractors:
    return _Contractors(puzzle)


def _expressions(codac: Any, asked: Formula, x: Any) -> list[Any]:
    """The outputs of a formula as expressions of codac.

    Raises:
        NotAccepted: for an operation that it lacks, or at which it ends its process, as log of codac 2.1.2.
    """
    inputs = {name: codac.ScalarExpr(x[k]) for k, name in enumerate(asked.names)}
    return [codac.ScalarExpr(x) if isinstance(x, codac.Interval) else x for x in fold(asked, inputs, _kind(codac))]


def _kind(codac: Any) -> Kind:
    return Kind(
        {
            **{name: getattr(operator, name) for name in ("add", "sub", "mul", "neg")},
            **dict.fromkeys(("div", "quotient"), operator.truediv),
            "ratio": lambda a, b: a * b / (codac.sqr(b) + codac.Interval(0.0, _TINY)),  # anything where b is 0
            "square": codac.sqr,
            "pow": lambda a, b: _power(codac, a, b) if b.lb() >= 0 else codac.Interval(1.0) / _power(codac, a, -b),
            **{name: getattr(codac, name) for name in FUNCTIONS},
        },
        lambda value: codac.Interval(*ends(as_exact(value))),  # an expression of its own wherever it is used
    )


def _power(codac: Any, base: Any, exponent: Any) -> Any:
    """Not for negative exponents: of these codac 2.1.2 loses zeros, as x⁻³ = −1."""
    return codac.pow(base, codac.ScalarExpr(exponent))


def _vector(codac: Any, box: Box) -> Any:
    return codac.IntervalVector([list(ends) for ends in box])


def _box(x: Any) -> Box:
    return tuple((x[k].lb(), x[k].ub()) for k in range(x.size()))


def check(asked: Formula) -> None:
    """Refuse a formula that codac cannot take.

    Raises:
        NotAccepted: with the name of an operation.
    """
    known = {INPUT, CONSTANT, "add", "sub", "mul", "neg", "div", "quotient", "ratio", "square", "pow", *FUNCTIONS}
    for step in asked.steps:
        exponent = asked.steps[step.operands[1]].value if step.op == "pow" else 1
        if step.op not in known or not isinstance(exponent, int | Fraction) or exponent % 1:
            raise NotAccepted(step.op)


def ends(number: Any) -> tuple[float, float]:
    """Doubles below and above a number, or twice the double that it is."""
    ball = flint.arb(number)
    if ball.is_finite() and ball.is_exact() and flint.arb(float(ball)) == ball:
        return float(ball), float(ball)
    return interval(ball)
