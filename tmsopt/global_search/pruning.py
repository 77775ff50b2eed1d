"""Branch and prune by interval arithmetic: many boxes at once, as arrays of doubles rounded outward.

An interval is an array whose first axis has the lower and the upper end. Ends that are no numbers, as of 0 times
infinity, become infinite: an interval may be too wide, never too narrow.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.formula import (
    CONSTANT,
    INPUT,
    Constant,
    Formula,
    Kind,
    Node,
    UnsupportedOperation,
    constant,
    fold,
    formula,
    make_node,
    symbol,
)
from tmsopt.algebra.intervals import ball, interval
from tmsopt.algebra.kinds import INTERVALS, NODES, as_exact
from tmsopt.algebra.rounding import UNIT
from tmsopt.records import Array, Truth

Box = tuple[tuple[float, float], ...]
"""Least and greatest value of each variable."""

_TINY = 1e-300  # more than what underflow loses
_GAIN = 0.5  # of a width: a box is contracted again, not split, where a side shrinks below
_FEW = 64  # boxes, which take hardly longer than one
_WIDER = 0.1  # of a width: the box in which a zero is looked for is so much wider at each end
_NARROW = 1e-12  # of the first box: and at least so much


@dataclass(frozen=True)
class Puzzle:
    """What is to hold in a box.

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


@dataclass(frozen=True)
class Pruned:
    """What became of boxes, arrays of shape (2, variables, boxes).

    Attributes:
        left: parts that may hold zeros.
        shown: pairs of a box that holds exactly one zero and the part of it in which that is, along a first axis.
        small: parts that may hold zeros and are too small to be split.
    """

    left: Array
    shown: Array
    small: Array


def prune(puzzle: Puzzle, x: Array, least: float) -> Pruned:
    """Contract boxes once, drop those without a zero, and split those that hardly shrink.

    Args:
        x: boxes, of shape (2, variables, boxes).
        least: share of the first box: what is smaller is not split.
    """
    with np.errstate(all="ignore"):
        before = x[1] - x[0]
        for asked, target in ((puzzle.equations, 0.0), (puzzle.more, 0.0), (puzzle.limits, np.inf)):
            x, kept = _narrowed(asked, x, target)
            x, before = x[..., kept], before[:, kept]
        wide, image, single, weights = _newton(puzzle, x)
        x = _meet(x, image)
        kept = (x[0] <= x[1]).all(axis=0)
        shown, keep = kept & single, kept & ~single
        again = keep & (x[1] - x[0] < _GAIN * before).any(axis=0)
        cut = keep & ~again
        parts, small = _split(x[..., cut], weights[:, cut], least * _column(puzzle.widths))
        return Pruned(np.concatenate([x[..., again], parts], axis=-1), np.stack([wide, image])[..., shown], small)


def _split(x: Array, weights: Array, least: Array) -> tuple[Array, Array]:
    """Boxes cut across the side of the greatest weight, few boxes more than once; and those that are small."""
    parts, small = x, x[..., :0]
    while True:
        width = parts[1] - parts[0]
        middle = parts[0] + width / 2
        across = (width > least) & (width < np.inf) & (parts[0] < middle) & (middle < parts[1])
        cut = across.any(axis=0)
        small = np.concatenate([small, parts[..., ~cut]], axis=-1)
        at = np.where(across, weights, -1.0).argmax(axis=0)[cut], np.arange(np.count_nonzero(cut))
        lower, weights = parts[..., cut], weights[:, cut]
        upper = lower.copy()
        lower[1][at] = upper[0][at] = middle[:, cut][at]
        weights[at] /= 2
        parts, weights = np.concatenate([lower, upper], axis=-1), np.concatenate([weights, weights], axis=-1)
        if not 0 < parts.shape[-1] < _FEW:
            return parts, small


def _newton(puzzle: Puzzle, x: Array) -> tuple[Array, Array, Truth, Array]:
    """Newton's operator, as it is and preconditioned.

    With the Jacobian J of a wider box around m, zeros have A (x − m) = −f(m) for a matrix A of J, and with Y near the
    inverse of its middle C (x − m) = −Y f(m) for a matrix C of Y J. Each row bounds each variable. Where the diagonal
    of C prevails there is one zero at most, and where its bounds are in the interior of the wider box there is one
    (Neumaier 1990, theorem 5.1.7).

    Returns:
        The wider boxes; where all their zeros are; whether there is exactly one; and for each variable how much its
        width adds to those of the equations, at most 1 each.
    """
    first = _column(puzzle.widths)
    room = _WIDER * (x[1] - x[0]) + _NARROW * first
    wide = np.stack([x[0] - room, x[1] + room])
    middle = (wide[0] + wide[1]) / 2
    reach = np.maximum(wide[1] - middle, middle - wide[0]) * (1 + UNIT) + _TINY
    found = _forward(puzzle.equations, np.stack([middle, middle]))
    outputs = [np.broadcast_to(found[o], wide[:, 0].shape) for o in puzzle.equations.outputs]
    values = np.stack(outputs, axis=1)[:, :, None]
    slopes = _slopes(puzzle.equations, wide)
    centre = np.moveaxis((slopes[0] + slopes[1]) / 2, -1, 0)
    size = np.linalg.det(centre)
    centre[~np.isfinite(size) | (size == 0)] = np.eye(len(first))  # any matrix will do
    inverse = np.moveaxis(np.linalg.inv(centre), 0, -1)
    preconditioned = _moves(_product(inverse, slopes), _product(inverse, values), reach)
    moves = np.concatenate([_moves(slopes, values, reach), preconditioned], axis=1)
    image = _outward(middle + np.stack([moves[0].max(axis=0), moves[1].min(axis=0)]))
    own = np.einsum("ekkm->ekm", preconditioned)
    around = _outward(middle + own)
    single = (np.abs(own).max(axis=0) < reach * (1 - 4 * UNIT)) & (around[0] > wide[0]) & (around[1] < wide[1])
    parts = np.abs(slopes).max(axis=0) * reach
    smear = (parts / np.maximum(parts.sum(axis=1, keepdims=True), _TINY)).sum(axis=0)
    share = np.minimum((x[1] - x[0]) / np.maximum(first, _TINY), 1.0)
    weights = np.where(np.isfinite(smear), smear + 1e-3 * share, share)
    return wide, image, single.all(axis=0), weights


def _moves(matrix: Array, values: Array, reach: Array) -> Array:
    """Where each equation, matrix · move + value = 0, leaves each variable that moves no farther than its reach."""
    parts = np.abs(matrix).max(axis=0) * reach
    growth = 1 + (len(reach) + 4) * UNIT
    rest = parts.sum(axis=1, keepdims=True) * growth - parts / growth + _TINY  # of all variables but one
    return _over(_outward(np.stack([-values[1] - rest, -values[0] + rest])), matrix)


def _product(exact: Array, x: Array) -> Array:
    """Products of matrices of doubles and of intervals, with a bound of the rounding of sums in any order."""
    middle, rounding = (x[0] + x[1]) / 2, (len(exact) + 4) * UNIT
    reach = (x[1] - x[0]) * (0.5 + UNIT) + rounding * np.abs(middle) + _TINY
    centre, error = (np.einsum("ijm,jkm->ikm", *own) for own in ((exact, middle), (np.abs(exact), reach)))
    error = error * (1 + rounding) + _TINY
    return _outward(np.stack([centre - error, centre + error]))


def _column(numbers: Sequence[float]) -> Array:
    return np.array(numbers)[:, None]


# Interval arithmetic.


def _outward(x: Array) -> Array:
    """The same array with its ends moved outward by more than one rounding."""
    room = np.abs(x) * UNIT + _TINY
    x[0] -= room[0]
    x[1] += room[1]
    unknown = np.isnan(x)
    if unknown.any():
        x[0][unknown[0]], x[1][unknown[1]] = -np.inf, np.inf
    return x


def _meet(a: Array, b: Array) -> Array:
    return np.stack([np.maximum(a[0], b[0]), np.minimum(a[1], b[1])])


def _plus(a: Array, b: Array) -> Array:
    return _outward(a + b)


def _minus(a: Array, b: Array) -> Array:
    return _outward(a - b[::-1])


def _negative(a: Array) -> Array:
    return -a[::-1]


def _times(a: Array, b: Array) -> Array:
    each = np.stack([a * b, a * b[::-1]])
    unknown = np.isnan(each)
    if unknown.any():
        each[unknown] = 0.0
    found = np.empty(each.shape[1:])
    each.min(axis=(0, 1), out=found[0])
    each.max(axis=(0, 1), out=found[1])
    return _outward(found)


def _inverse(a: Array) -> Array:
    """1/a of those of one sign or 0; without ends where both signs are met."""
    single = (a[0] >= 0) | (a[1] <= 0)
    low = np.where(single & (a[1] != 0), 1 / a[1], -np.inf)
    high = np.where(single & (a[0] != 0), 1 / a[0], np.inf)
    return _outward(np.stack([low, high]))


def _over(a: Array, b: Array) -> Array:
    return _times(a, _inverse(b))


def _holds_zero(a: Array) -> Truth:
    return np.asarray((a[0] <= 0) & (a[1] >= 0))


def _magnitude(a: Array) -> Array:
    ends = np.abs(a)
    return np.stack([np.where(_holds_zero(a), 0.0, ends.min(axis=0)), ends.max(axis=0)])


def _square(a: Array) -> Array:
    size = _magnitude(a)
    return np.maximum(_outward(size * size), 0.0)


def _square_root(a: Array) -> Array:
    return np.maximum(_outward(np.sqrt(np.maximum(a, 0.0))), 0.0)


def _by_balls(function: Callable[[Any], Any]) -> Callable[[Array], Array]:
    """A function of balls, one interval at a time."""

    def applied(a: Array) -> Array:
        ends = [interval(function(ball((low, high)))) for low, high in a.reshape(2, -1).T.tolist()]
        return np.array(ends).T.reshape(a.shape)

    return applied


# Operations.


@dataclass(frozen=True)
class _Operation:
    """An operation on intervals.

    Attributes:
        value: range of the result.
        slopes: from the operands and the result, slopes with respect to each operand; infinite where there are none.
        back: from the result and the operands, where each operand is.
    """

    value: Callable[..., Array]
    slopes: Callable[..., tuple[Array, ...]]
    back: Callable[..., tuple[Array, ...]]


_ONE, _SIGNS = np.ones((2, 1)), np.array([[-1.0], [1.0]])
_ANYTHING = _SIGNS * np.inf


def _factor(result: Array, other: Array) -> Array:
    """What times another is a result: anything where both may be 0."""
    return np.where(_holds_zero(result) & _holds_zero(other), _ANYTHING, _over(result, other))


def _of_magnitude(result: Array, a: Array) -> tuple[Array]:
    low, high = np.maximum(result, 0.0)
    return (np.stack([np.where(a[0] > -low, low, -high), np.where(a[1] < low, -low, high)]),)


def _function(
    name: str, value: Callable[..., Array] | None = None, back: Any = lambda _, a: (_ANYTHING,)
) -> _Operation:
    """A function of one operand, by balls and series of balls."""
    own = INTERVALS.operations[name]
    slope = _by_balls(lambda x: own(flint.arb_series([x, 1], prec=2))[1])
    return _Operation(value or _by_balls(own), lambda a, _: (slope(a),), back)


_QUOTIENT = _Operation(
    _over,
    lambda a, b, r: (_inverse(b), _negative(_over(r, b))),
    lambda r, a, b: (_times(r, b), _factor(a, r)),
)
_OPERATIONS = {
    "add": _Operation(_plus, lambda a, b, r: (_ONE, _ONE), lambda r, a, b: (_minus(r, b), _minus(r, a))),
    "sub": _Operation(_minus, lambda a, b, r: (_ONE, -_ONE), lambda r, a, b: (_plus(r, b), _minus(a, r))),
    "mul": _Operation(_times, lambda a, b, r: (b, a), lambda r, a, b: (_factor(r, b), _factor(r, a))),
    "neg": _Operation(_negative, lambda a, r: (-_ONE,), lambda r, a: (_negative(r),)),
    "square": _Operation(_square, lambda a, r: (_plus(a, a),), lambda r, a: _of_magnitude(_square_root(r), a)),
    "abs": _function("abs", _magnitude, _of_magnitude),
    "sqrt": _function("sqrt", _square_root, lambda r, _: (_square(np.maximum(r, 0.0)),)),
    **dict.fromkeys(("div", "quotient", "ratio"), _QUOTIENT),
    **{name: _function(name) for name in ("exp", "log", "sin", "cos", "tan", "atan")},
    **{name: _function(name, back=lambda _, a: (_SIGNS,)) for name in ("asin", "acos")},
}


def prepared(asked: Formula) -> Formula:
    """A formula in operations that branch and prune has.

    Raises:
        UnsupportedOperation: for another one, with its name.
    """
    known = {name: NODES.operations[name] for name in _OPERATIONS} | {"pow": _power}
    own = {name: symbol(name) for name in asked.names}
    return formula(fold(asked, own, Kind(known, NODES.constant)), asked.names)


def _power(a: Node, b: Node) -> Node:
    """A power by squares and products."""
    n = b.fraction
    if n is None or n.denominator > 1:
        raise UnsupportedOperation("pow")
    if n < 0:
        return 1 / _power(a, -b)
    if n == 0:
        return constant(1)
    half = make_node("square", _power(a, constant(n // 2))) if n > 1 else constant(1)
    return half * a if n % 2 else half


def _forward(asked: Formula, x: Array) -> list[Array]:
    """Ranges of all steps of a formula over boxes."""
    found: list[Array] = []
    for op, operands, value in asked.steps:
        if op == INPUT:
            found.append(x[:, asked.names.index(value)])
        elif op == CONSTANT:
            found.append(_enclosed(value))
        else:
            found.append(_OPERATIONS[op].value(*(found[o] for o in operands)))
    return found


@lru_cache(maxsize=4096)
def _enclosed(value: Constant) -> Array:
    return np.array(ends(as_exact(value)))[:, None]


def _slopes(asked: Formula, x: Array) -> Array:
    """Ranges of the slopes of the outputs over boxes: shape (2, outputs, variables, boxes)."""
    values, nothing = _forward(asked, x), np.zeros((2, *x.shape[1:]))
    found: list[Array | None] = []
    for k, (op, operands, value) in enumerate(asked.steps):
        own: Array | None = None
        if op == INPUT:
            own = nothing.copy()
            own[:, asked.names.index(value)] = 1.0
        elif any(found[o] is not None for o in operands):
            parts = _OPERATIONS[op].slopes(*(values[o] for o in operands), values[k])
            for o, part in zip(operands, parts, strict=True):
                if (inner := found[o]) is not None:
                    outer = inner if part is _ONE else _times(inner, part[:, None])
                    own = outer if own is None else _plus(own, outer)
        found.append(own)
    return np.stack([nothing if (own := found[o]) is None else own for o in asked.outputs], axis=1)


def _narrowed(asked: Formula, x: Array, most: float) -> tuple[Array, Truth]:
    """Boxes around the points at which all outputs are from 0 to `most`, and which of them may have any.

    Forward through the steps and backward, each operand from the result and the other one (Benhamou et al. 1999).
    """
    found, narrow = _forward(asked, x), x.copy()
    kept = np.ones(x.shape[-1], dtype=bool)

    def meet(k: int, own: Array) -> None:
        found[k] = _meet(found[k], own)
        np.logical_and(kept, found[k][0] <= found[k][1], out=kept)

    for o in asked.outputs:
        meet(o, np.array([[0.0], [most]]))
    for k, (op, operands, value) in reversed([*enumerate(asked.steps)]):
        if op == INPUT:
            narrow[:, asked.names.index(value)] = found[k]
        elif op != CONSTANT:
            each = _OPERATIONS[op].back(found[k], *(found[o] for o in operands))
            for o, part in zip(operands, each, strict=True):
                meet(o, part)
    return narrow, kept


def ends(number: Any) -> tuple[float, float]:
    """Doubles below and above a number, or twice the double that it is."""
    exact = flint.arb(number)
    if exact.is_finite() and exact.is_exact() and flint.arb(float(exact)) == exact:
        return float(exact), float(exact)
    return interval(exact)
