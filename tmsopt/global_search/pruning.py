"""Branch and prune by interval contractors of codac, in a process of its own.

From its import on, codac has doubles rounded upwards, all that a process computes: so it is imported in workers alone,
and whoever reads their answers must allow for nothing.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.formal import Formal, Symbol, by_symbol
from tmsopt.algebra.formula import NotAccepted
from tmsopt.algebra.intervals import interval

Tree = tuple[Any, ...]
"""``("x", number of a variable)``, ``("c", least, greatest)``, ``("+", tree, tree)``, ``("*", tree, tree)``,
``("^", tree, power)``, or ``(function, tree)``."""

Box = tuple[tuple[float, float], ...]
"""Least and greatest value of each variable."""

PARTIAL = ("inv", "sqrt", "asin", "acos")
"""Functions that do not exist, or have no slope, somewhere; not log, at which codac 2.1.2 ends its process."""

_FUNCTIONS = (*PARTIAL, "abs", "exp", "sin", "cos", "atan")

_GAIN = 0.9  # of a width: contracting goes on where one shrinks below
_ROUNDS = 8
_WIDER = 0.1  # of a width: the box in which a zero is looked for is so much wider at each end


@dataclass(frozen=True)
class Puzzle:
    """What is to hold in a box; plain data.

    Attributes:
        equations: trees that must be 0, as many as variables.
        limits: trees that must be ≥ 0.
        more: trees that must be 0 too.
        guarded: functions with their arguments that must exist for the equations to have slopes.
        widths: of the first box, 1 where it has no end.
    """

    equations: tuple[Tree, ...]
    limits: tuple[Tree, ...]
    guarded: tuple[tuple[str, Tree], ...]
    widths: tuple[float, ...]
    more: tuple[Tree, ...] = ()


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

        self.codac, self.widths, self.guarded = codac, puzzle.widths, [name for name, _ in puzzle.guarded]
        n = len(puzzle.equations)
        x = codac.VectorVar(n)
        self.system = codac.AnalyticFunction([x], [_expression(codac, e, x) for e in puzzle.equations])
        zero = codac.IntervalVector([[0.0, 0.0]] * n)
        self.rows = [codac.CtcInverse(self.system, zero, not puzzle.guarded)]
        allowed = [(codac.Interval(0.0, math.inf), puzzle.limits), (codac.Interval(0.0), puzzle.more)]
        for over, trees in allowed:
            self.rows += [codac.CtcInverse(_scalar(codac, x, found), over, False) for found in trees]
        self.arguments = [_scalar(codac, x, argument) for _, argument in puzzle.guarded]

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
            if name == "inv":
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


def _scalar(codac: Any, x: Any, found: Tree) -> Any:
    return codac.AnalyticFunction([x], _expression(codac, found, x))


def _expression(codac: Any, found: Tree, x: Any) -> Any:
    operation, *rest = found
    parts = [_expression(codac, part, x) for part in rest if isinstance(part, tuple)]
    return {
        "x": lambda: codac.ScalarExpr(x[rest[0]]),
        "c": lambda: codac.ScalarExpr(codac.Interval(*rest)),
        "+": lambda: parts[0] + parts[1],
        "*": lambda: parts[0] * parts[1],
        "^": lambda: codac.pow(parts[0], codac.ScalarExpr(codac.Interval(rest[1]))),
        "inv": lambda: codac.ScalarExpr(codac.Interval(1.0)) / parts[0],
    }.get(operation, lambda: getattr(codac, operation)(*parts))()


def _vector(codac: Any, box: Box) -> Any:
    return codac.IntervalVector([list(ends) for ends in box])


def _box(x: Any) -> Box:
    return tuple((x[k].lb(), x[k].ub()) for k in range(x.size()))


def tree(formula: Any, names: Sequence[str]) -> Tree:
    """A formula in variables of these names, each taken out of as many terms as hold it (Horner's rule).

    Raises:
        NotAccepted: for another function than these.
    """
    return _of_terms(formula.terms if isinstance(formula, Formal) else {(): formula}, names)


def _of_terms(terms: Any, names: Sequence[str]) -> Tree:
    if (parts := by_symbol(terms)) is None:
        return ("c", *ends(terms.get((), flint.fmpq(0))))
    symbol, power, inner, rest = parts
    taken = _of_symbol(symbol, names)
    if power > 1:
        taken = ("^", taken, power)
    factor = _of_terms(inner, names)
    if factor != ("c", 1.0, 1.0):
        taken = ("*", factor, taken)
    return ("+", taken, _of_terms(rest, names)) if rest else taken


def _of_symbol(symbol: Symbol, names: Sequence[str]) -> Tree:
    if symbol.argument is None:
        return ("x", names.index(symbol.name))
    if symbol.name not in _FUNCTIONS:
        raise NotAccepted(symbol.name)
    return (symbol.name, tree(symbol.argument, names))


def ends(number: Any) -> tuple[float, float]:
    """Doubles below and above a number, or twice the double that it is."""
    ball = flint.arb(number)
    if ball.is_finite() and ball.is_exact() and flint.arb(float(ball)) == ball:
        return float(ball), float(ball)
    return interval(ball)


def partial(found: Tree) -> set[tuple[str, Tree]]:
    """Functions in a tree that must be looked at before slopes are taken, with their arguments."""
    own = {(found[0], found[1])} if found[0] in PARTIAL else set()
    return own.union(*(partial(part) for part in found[1:] if isinstance(part, tuple)))
