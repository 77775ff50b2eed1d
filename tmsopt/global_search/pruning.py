"""Branch and prune by interval arithmetic: many boxes at once, as arrays of doubles rounded outward.

An interval is an array whose first axis has the lower and the upper end. Ends that are no numbers, as of 0 times
infinity, become infinite: an interval may be too wide, never too narrow.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.formula import CONSTANT, INPUT, Constant, Formula, NotAccepted, Step
from tmsopt.algebra.intervals import ball, interval
from tmsopt.algebra.kinds import INTERVALS, as_exact
from tmsopt.algebra.rounding import UNIT
from tmsopt.records import Array, Truth

Box = tuple[tuple[float, float], ...]
"""Least and greatest value of each variable."""

_TINY = 1e-300  # more than what underflow loses
_GAIN = 0.5  # of a width: a box is contracted again, not split, where a side shrinks below
_FEW = 64  # boxes, which take hardly longer than one
_WIDER = 0.1  # of a width: the box in which a zero is looked for is so much wider at each end
_NARROW = 1e-12  # of the first box: and at least so much
_ROOT = 1e-9  # relative error of a root of NumPy, generously


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
        newton = _newton(puzzle, x)
        x = _meet(x, newton.image)
        keep = (x[0] <= x[1]).all(axis=0)
        shown = keep & newton.shown
        keep &= ~shown
        again = keep & (x[1] - x[0] < _GAIN * before).any(axis=0)
        cut = keep & ~again
        parts, small = _split(x[..., cut], newton.weights[:, cut], least * _column(puzzle.widths))
        left = np.concatenate([x[..., again], parts], axis=-1)
        return Pruned(left, np.stack([newton.wide, newton.image])[..., shown], small)


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


@dataclass(frozen=True)
class _Newton:
    """What Newton's operator makes of boxes.

    Attributes:
        wide: the boxes that it was applied to, somewhat wider.
        image: where all zeros of these are; without ends where it cannot be applied.
        shown: whether there is exactly one.
        weights: how much the width of each variable adds to those of the equations, at most 1 each.
    """

    wide: Array
    image: Array
    shown: Truth
    weights: Array


def _newton(puzzle: Puzzle, x: Array) -> _Newton:
    """Newton's operator, as it is and preconditioned.

    With the Jacobian J of a wider box around m, zeros have A (x − m) = −f(m) for a matrix A of J, and with Y near the
    inverse of its middle C (x − m) = −Y f(m) for a matrix C of Y J. Each row bounds each variable. Where the diagonal
    of C prevails there is one zero at most, and where its bounds are in the interior of the wider box there is one
    (Neumaier 1990, theorem 5.1.7).
    """
    first = _column(puzzle.widths)
    room = _WIDER * (x[1] - x[0]) + _NARROW * first
    wide = np.stack([x[0] - room, x[1] + room])
    middle = (wide[0] + wide[1]) / 2
    reach = np.maximum(wide[1] - middle, middle - wide[0]) * (1 + UNIT) + _TINY
    values = _results(puzzle.equations, np.stack([middle, middle]))
    _, slopes = _slopes(puzzle.equations, wide)
    usable = np.isfinite(values).all(axis=(0, 1)) & np.isfinite(slopes).all(axis=(0, 1, 2)) & np.isfinite(reach).all(0)
    share = np.where(first > 0, np.minimum((x[1] - x[0]) / np.where(first > 0, first, 1.0), 1.0), 0.0)
    parts = np.abs(slopes).max(axis=0) * reach
    total = parts.sum(axis=1, keepdims=True)
    weights = np.where(usable, (parts / np.maximum(total, _TINY)).sum(axis=0) + 1e-3 * share, share)
    growth = 1 + (x.shape[1] + 4) * UNIT
    rest = total * growth - parts / growth + _TINY  # of an equation, what all variables but one add to it at most
    left = -values[::-1][:, :, None]
    move = _over(_outward(np.stack([left[0] - rest, left[1] + rest])), slopes)
    image = _outward(middle + np.stack([move[0].max(axis=0), move[1].min(axis=0)]))
    shown = np.zeros(x.shape[-1], dtype=bool)
    centre = np.moveaxis((slopes[0] + slopes[1]) / 2, -1, 0)
    determinants = np.linalg.det(np.where(usable[:, None, None], centre, 0.0))
    usable &= np.isfinite(determinants) & (determinants != 0)
    inverse = np.linalg.inv(centre[usable])
    fine = np.isfinite(inverse).all(axis=(1, 2))
    (at,) = np.nonzero(usable)
    at, inverse = at[fine], inverse[fine]
    matrix, matrix_error = _product(inverse, np.moveaxis(slopes[..., at], -1, 1))
    step, step_error = _product(inverse, np.moveaxis(values[..., at], -1, 1)[..., None])
    reach, middle = reach[:, at].T, middle[:, at].T
    own = np.arange(x.shape[1])
    diagonal, diagonal_error = matrix[:, own, own], matrix_error[:, own, own]
    others = np.abs(matrix) + matrix_error
    others[:, own, own] = 0.0
    off = (step_error[..., 0] + (others @ reach[..., None])[..., 0]) * growth + _TINY
    least = (np.abs(diagonal) - diagonal_error) * (1 - UNIT)  # of the diagonal; what is not positive says nothing
    regular = least > 0
    move = _outward(np.stack([-step[..., 0] - off, -step[..., 0] + off]))
    move = _times(move, _inverse(_outward(np.stack([diagonal - diagonal_error, diagonal + diagonal_error]))))
    found = _outward(middle + move)
    image[..., at] = np.where(regular.T, _meet(np.moveaxis(found, 1, -1), image[..., at]), image[..., at])
    inside = (np.abs(move).max(axis=0) < reach * (1 - 4 * UNIT) - 4 * _TINY) & regular
    inside &= (found[0] > wide[0][:, at].T) & (found[1] < wide[1][:, at].T)
    shown[at] = inside.all(axis=1)
    return _Newton(wide, image, shown, weights)


def _product(exact: Array, intervals: Array) -> tuple[Array, Array]:
    """Products of matrices of doubles and of intervals, as middles and bounds of the error."""
    middle, radius = (intervals[0] + intervals[1]) / 2, (intervals[1] - intervals[0]) / 2
    size = np.abs(exact)
    rounded = (exact.shape[-1] + 4) * UNIT
    error = size @ (radius * (1 + 2 * UNIT) + rounded * np.abs(middle) + _TINY)
    return exact @ middle, error * (1 + rounded) + _TINY


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


def _power(a: Array, exponent: int) -> Array:
    if exponent < 0:
        return _inverse(_power(a, -exponent))
    if exponent == 0:
        return np.ones_like(a)
    if exponent % 2 == 0:
        return _square(_power(a, exponent // 2))
    low, high = (_times(end, _square(_power(end, exponent // 2))) for end in (a[[0, 0]], a[[1, 1]]))
    return np.stack([low[0], high[1]])


def _square_root(a: Array) -> Array:
    return np.maximum(_outward(np.sqrt(np.maximum(a, 0.0))), 0.0)


def _function(name: str) -> Callable[[Array], Array]:
    """A function by balls, one interval at a time."""
    operation = INTERVALS.operations[name]

    def applied(a: Array) -> Array:
        ends = [interval(operation(ball((low, high)))) for low, high in a.reshape(2, -1).T.tolist()]
        return np.array(ends).T.reshape(a.shape)

    return applied


_FUNCTIONS = {name: _function(name) for name in ("exp", "log", "sin", "cos", "tan", "asin", "acos", "atan")}
_QUOTIENTS = dict.fromkeys(("div", "quotient", "ratio"), _over)
_ONE = np.ones((2, 1))
_SIGNS = np.array([[-1.0], [1.0]])

_VALUES: Mapping[str, Callable[..., Array]] = {
    "add": _plus,
    "sub": _minus,
    "mul": _times,
    "neg": _negative,
    "square": _square,
    "sqrt": _square_root,
    "abs": _magnitude,
    **_QUOTIENTS,
    **_FUNCTIONS,
}

_SLOPES: Mapping[str, Callable[[Array, Array], Array]] = {
    "square": lambda a, _: _plus(a, a),
    "sqrt": lambda _, r: _inverse(_plus(r, r)),
    "abs": lambda a, _: np.where(_holds_zero(a), _SIGNS, np.sign(a)),
    "exp": lambda _, r: r,
    "log": lambda a, _: np.where(a[0] > 0, _inverse(a), _SIGNS * np.inf),
    "sin": lambda a, _: _FUNCTIONS["cos"](a),
    "cos": lambda a, _: _negative(_FUNCTIONS["sin"](a)),
    "tan": lambda _, r: _plus(_ONE, _square(r)),
    "atan": lambda a, _: _inverse(_plus(_ONE, _square(a))),
    "asin": lambda a, _: _inverse(_square_root(_minus(_ONE, _square(a)))),
    "acos": lambda a, _: _negative(_inverse(_square_root(_minus(_ONE, _square(a))))),
}
"""Of functions of one operand, from it and the result; infinite where there is none somewhere."""


def _results(asked: Formula, x: Array) -> Array:
    """Ranges of the outputs of a formula over boxes."""
    found = _forward(asked, x)
    return np.array([np.broadcast_to(found[o], x[:, 0].shape) for o in asked.outputs]).swapaxes(0, 1)


def _forward(asked: Formula, x: Array) -> list[Array]:
    """Ranges of all steps."""
    found: list[Array] = []
    for step in asked.steps:
        found.append(_value(asked, step, found, x))
    return found


def _value(asked: Formula, step: Step, found: Sequence[Array], x: Array) -> Array:
    if step.op == INPUT:
        return x[:, asked.names.index(step.value)]
    if step.op == CONSTANT:
        return _constant(step.value)
    if step.op == "pow":
        return _power(found[step.operands[0]], int(asked.steps[step.operands[1]].value))
    return _VALUES[step.op](*(found[o] for o in step.operands))


@lru_cache(maxsize=4096)
def _constant(value: Constant) -> Array:
    return np.array(ends(as_exact(value)))[:, None]


def _slopes(asked: Formula, x: Array) -> tuple[list[Array], Array]:
    """Ranges of all steps, and of the slopes of the outputs: shape (2, outputs, variables, boxes)."""
    found: list[Array] = []
    slopes: list[Array | None] = []
    for step in asked.steps:
        found.append(_value(asked, step, found, x))
        slopes.append(_slope(asked, step, found, slopes, x))
    nothing = np.zeros((2, *x.shape[1:]))
    each = [nothing if (own := slopes[o]) is None else np.broadcast_to(own, nothing.shape) for o in asked.outputs]
    return found, np.array(each).swapaxes(0, 1)


def _slope(  # noqa: PLR0911
    asked: Formula, step: Step, found: Sequence[Array], slopes: Sequence[Array | None], x: Array
) -> Array | None:
    """Slopes of one step with respect to all variables; None for a constant."""
    if step.op == INPUT:
        own = np.zeros((2, x.shape[1], 1))
        own[:, asked.names.index(step.value)] = 1.0
        return own
    known = [slopes[o] for o in step.operands]
    if all(own is None for own in known):
        return None
    a, b = known if len(known) == 2 else (known[0], None)
    values = [found[o][:, None] for o in step.operands]
    match step.op:
        case "add" | "sub":
            if a is None or b is None:
                return b if step.op == "add" and a is None else a if b is None else _negative(b)
            return _VALUES[step.op](a, b)
        case "neg":
            return None if a is None else _negative(a)
        case "mul":
            parts = [_times(own, v) for own, v in zip(known, reversed(values), strict=True) if own is not None]
            return parts[0] if len(parts) == 1 else _plus(*parts)
        case "div" | "quotient" | "ratio":
            less = None if b is None else _negative(_times(found[-1][:, None], b))
            parts = [own for own in (a, less) if own is not None]
            return _over(parts[0] if len(parts) == 1 else _plus(*parts), values[1])
        case "pow":
            n = int(asked.steps[step.operands[1]].value)
            return None if a is None else _times(a, _times(n * _ONE[:, None], _power(values[0], n - 1)))
    return None if a is None else _times(a, _SLOPES[step.op](found[step.operands[0]], found[-1])[:, None])


# Contraction.


def _narrowed(asked: Formula, x: Array, most: float) -> tuple[Array, Truth]:
    """Boxes around the points at which all outputs are from 0 to `most`, and which of them may have any.

    Forward through the steps and backward, each operand from the result and the other one (Benhamou et al. 1999).
    """
    found = _forward(asked, x)
    kept = np.ones(x.shape[-1], dtype=bool)

    def meet(k: int, own: Array) -> None:
        found[k] = _meet(found[k], own)
        np.logical_and(kept, found[k][0] <= found[k][1], out=kept)

    target = np.array([[0.0], [most]])
    for o in asked.outputs:
        meet(o, target)
    own = x.copy()
    for k in range(len(asked.steps) - 1, -1, -1):
        step = asked.steps[k]
        if step.op == INPUT:
            own[:, asked.names.index(step.value)] = found[k]
        elif step.op == "pow":
            meet(step.operands[0], _root(found[k], int(asked.steps[step.operands[1]].value)))
        elif step.op in _BACKWARD:
            operands = [found[o] for o in step.operands]
            for o, part in zip(step.operands, _BACKWARD[step.op](found[k], *operands), strict=True):
                meet(o, part)
    return own, kept


def _factor(result: Array, other: Array) -> Array:
    """What times another is a result: anything where both may be 0."""
    return np.where(_holds_zero(result) & _holds_zero(other), _SIGNS * np.inf, _over(result, other))


def _root(result: Array, exponent: int) -> Array:
    """What a power is of."""
    if exponent <= 0:
        return _SIGNS * np.inf
    size = np.abs(result) ** (1 / exponent)
    room = _ROOT * size + _TINY
    if exponent % 2 == 0:
        return np.asarray(_SIGNS * (size + room).max(axis=0))
    return np.asarray(np.sign(result) * size + _SIGNS * room)


def _of_square(result: Array, a: Array) -> tuple[Array]:
    """The operand of a square, or of a magnitude, by the root."""
    low, high = _square_root(result)
    return (_of_magnitude(np.stack([low, high]), a)[0],)


def _of_magnitude(result: Array, a: Array) -> tuple[Array]:
    low, high = np.maximum(result, 0.0)
    return (np.stack([np.where(a[0] > -low, low, -high), np.where(a[1] < low, -low, high)]),)


_BACKWARD: Mapping[str, Callable[..., tuple[Array, ...]]] = {
    "add": lambda r, a, b: (_minus(r, b), _minus(r, a)),
    "sub": lambda r, a, b: (_plus(r, b), _minus(a, r)),
    "mul": lambda r, a, b: (_factor(r, b), _factor(r, a)),
    "neg": lambda r, _: (_negative(r),),
    "square": _of_square,
    "abs": _of_magnitude,
    "sqrt": lambda r, _: (_square(np.maximum(r, 0.0)),),
    "asin": lambda _, a: (_SIGNS + 0 * a,),
    "acos": lambda _, a: (_SIGNS + 0 * a,),
    **dict.fromkeys(_QUOTIENTS, lambda r, a, b: (_times(r, b), _factor(a, r))),
}


def check(asked: Formula) -> None:
    """Refuse a formula that branch and prune cannot take.

    Raises:
        NotAccepted: with the name of an operation.
    """
    for step in asked.steps:
        exponent = asked.steps[step.operands[1]].value if step.op == "pow" else 1
        if (
            step.op not in {INPUT, CONSTANT, "pow", *_VALUES}
            or not isinstance(exponent, int | Fraction)
            or exponent % 1
        ):
            raise NotAccepted(step.op)


def ends(number: Any) -> tuple[float, float]:
    """Doubles below and above a number, or twice the double that it is."""
    exact = flint.arb(number)
    if exact.is_finite() and exact.is_exact() and flint.arb(float(exact)) == exact:
        return float(exact), float(exact)
    return interval(exact)
