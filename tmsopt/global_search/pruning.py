"""Branch and prune by interval arithmetic on many boxes at once, in doubles rounded outward.

The first axis of an array holds the lower and the upper ends. NaN ends, such as those of 0 · ∞, become infinite: an
interval may be too wide, never too narrow.
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

_TINY = 1e-300  # exceeds any loss by underflow
_GAIN = 0.5  # of a width: a box with a side shrunk below this is contracted again, not split
_FEW = 64  # boxes; so many take hardly longer than one
_MARGIN = 0.1  # of a width: Newton's box extends so far beyond each end
_MIN_MARGIN = 1e-12  # of the first box: at least so far


@dataclass(frozen=True)
class BoxConditions:
    """The conditions to satisfy in a box.

    Attributes:
        equations: must be 0; as many as variables.
        limits: must be ≥ 0.
        widths: of the first box; 1 for an infinite one.
        extra: must be 0 too.
    """

    equations: Formula
    limits: Formula
    widths: tuple[float, ...]
    extra: Formula


@dataclass(frozen=True)
class PrunedBoxes:
    """Pruned boxes, arrays of shape (2, variables, boxes).

    Attributes:
        remaining: parts that may hold zeros.
        proved: a first axis holds boxes with exactly one zero, and their parts that hold it.
        small: parts that may hold zeros and are too small to split.
    """

    remaining_factors: Array
    proved: Array
    small: Array


def prune(conditions: BoxConditions, x: Array, least: float) -> PrunedBoxes:
    """Contract boxes once, drop those without a zero, and split those that hardly shrink.

    Args:
        x: boxes, of shape (2, variables, boxes).
        least: boxes narrower than this share of the first box are not split.
    """
    with np.errstate(all="ignore"):
        before = x[1] - x[0]
        for graph, target in ((conditions.equations, 0.0), (conditions.extra, 0.0), (conditions.limits, np.inf)):
            x, possible = _contract(graph, x, target)
            x, before = x[..., possible], before[:, possible]
        wide, image, single, weights = _apply_newton(conditions, x)
        x = _intersect(x, image)
        possible = (x[0] <= x[1]).all(axis=0)
        shown, keep = possible & single, possible & ~single
        contract_again = keep & (x[1] - x[0] < _GAIN * before).any(axis=0)
        cut = keep & ~contract_again
        parts, small = _split_boxes(x[..., cut], weights[:, cut], least * _as_column(conditions.widths))
        return PrunedBoxes(
            np.concatenate([x[..., contract_again], parts], axis=-1), np.stack([wide, image])[..., shown], small
        )


def _split_boxes(x: Array, weights: Array, least: Array) -> tuple[Array, Array]:
    """Halves of boxes along the side of greatest weight, a few boxes repeatedly; and the boxes too small to split."""
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


def _apply_newton(conditions: BoxConditions, x: Array) -> tuple[Array, Array, Truth, Array]:
    """Apply the interval Newton operator, plain and preconditioned.

    Let J be the Jacobian over a wider box around m. Zeros satisfy A (x − m) = −f(m) for a matrix A in J, and
    C (x − m) = −Y f(m) for a matrix C in Y J, where Y approximates the inverse of the middle of J. Each row bounds each
    variable. If the diagonal of C dominates, there is at most one zero; if its bounds lie inside the wider box, there
    is exactly one (Neumaier 1990, theorem 5.1.7).

    Returns:
        The wider boxes; parts that hold all their zeros; whether there is exactly one; and per variable the weight of
        its width in the equations, at most 1 each.
    """
    first = _as_column(conditions.widths)
    room = _MARGIN * (x[1] - x[0]) + _MIN_MARGIN * first
    wide = np.stack([x[0] - room, x[1] + room])
    middle = (wide[0] + wide[1]) / 2
    reach = np.maximum(wide[1] - middle, middle - wide[0]) * (1 + UNIT) + _TINY
    found = _evaluate_ranges(conditions.equations, np.stack([middle, middle]))
    outputs = [np.broadcast_to(found[o], wide[:, 0].shape) for o in conditions.equations.outputs]
    values = np.stack(outputs, axis=1)[:, :, None]
    slopes = _evaluate_slopes(conditions.equations, wide)
    centre = np.moveaxis((slopes[0] + slopes[1]) / 2, -1, 0)
    size = np.linalg.det(centre)
    centre[~np.isfinite(size) | (size == 0)] = np.eye(len(first))  # any matrix will do
    inverse = np.moveaxis(np.linalg.inv(centre), 0, -1)
    preconditioned = _bound_moves(_multiply_matrices(inverse, slopes), _multiply_matrices(inverse, values), reach)
    moves = np.concatenate([_bound_moves(slopes, values, reach), preconditioned], axis=1)
    image = _widen(middle + np.stack([moves[0].max(axis=0), moves[1].min(axis=0)]))
    own = np.einsum("ekkm->ekm", preconditioned)
    around = _widen(middle + own)
    single = (np.abs(own).max(axis=0) < reach * (1 - 4 * UNIT)) & (around[0] > wide[0]) & (around[1] < wide[1])
    parts = np.abs(slopes).max(axis=0) * reach
    smear = (parts / np.maximum(parts.sum(axis=1, keepdims=True), _TINY)).sum(axis=0)
    share = np.minimum((x[1] - x[0]) / np.maximum(first, _TINY), 1.0)
    weights = np.where(np.isfinite(smear), smear + 1e-3 * share, share)
    return wide, image, single.all(axis=0), weights


def _bound_moves(matrix: Array, values: Array, reach: Array) -> Array:
    """Moves of each variable, up to `reach`, that each equation matrix · move + value = 0 allows."""
    parts = np.abs(matrix).max(axis=0) * reach
    growth = 1 + (len(reach) + 4) * UNIT
    rest = parts.sum(axis=1, keepdims=True) * growth - parts / growth + _TINY  # of all variables but one
    return _divide(_widen(np.stack([-values[1] - rest, -values[0] + rest])), matrix)


def _multiply_matrices(exact: Array, x: Array) -> Array:
    """Products of matrices of doubles with matrices of intervals; rounding is bounded for any order of summation."""
    middle, rounding = (x[0] + x[1]) / 2, (len(exact) + 4) * UNIT
    reach = (x[1] - x[0]) * (0.5 + UNIT) + rounding * np.abs(middle) + _TINY
    centre, error = (np.einsum("ijm,jkm->ikm", *own) for own in ((exact, middle), (np.abs(exact), reach)))
    error = error * (1 + rounding) + _TINY
    return _widen(np.stack([centre - error, centre + error]))


def _as_column(numbers: Sequence[float]) -> Array:
    return np.array(numbers)[:, None]


# Interval arithmetic.


def _widen(x: Array) -> Array:
    """Move the ends outward by more than one rounding, in place; NaN becomes infinite."""
    room = np.abs(x) * UNIT + _TINY
    x[0] -= room[0]
    x[1] += room[1]
    unknown = np.isnan(x)
    if unknown.any():
        x[0][unknown[0]], x[1][unknown[1]] = -np.inf, np.inf
    return x


def _intersect(a: Array, b: Array) -> Array:
    return np.stack([np.maximum(a[0], b[0]), np.minimum(a[1], b[1])])


def _add(a: Array, b: Array) -> Array:
    return _widen(a + b)


def _subtract(a: Array, b: Array) -> Array:
    return _widen(a - b[::-1])


def _negate(a: Array) -> Array:
    return -a[::-1]


def _multiply(a: Array, b: Array) -> Array:
    each = np.stack([a * b, a * b[::-1]])
    unknown = np.isnan(each)
    if unknown.any():
        each[unknown] = 0.0
    found = np.empty(each.shape[1:])
    each.min(axis=(0, 1), out=found[0])
    each.max(axis=(0, 1), out=found[1])
    return _widen(found)


def _invert(a: Array) -> Array:
    """1/a; unbounded if a contains both signs."""
    single = (a[0] >= 0) | (a[1] <= 0)
    low = np.where(single & (a[1] != 0), 1 / a[1], -np.inf)
    high = np.where(single & (a[0] != 0), 1 / a[0], np.inf)
    return _widen(np.stack([low, high]))


def _divide(a: Array, b: Array) -> Array:
    return _multiply(a, _invert(b))


def _has_zero(a: Array) -> Truth:
    return np.asarray((a[0] <= 0) & (a[1] >= 0))


def _absolute(a: Array) -> Array:
    ends = np.abs(a)
    return np.stack([np.where(_has_zero(a), 0.0, ends.min(axis=0)), ends.max(axis=0)])


def _square(a: Array) -> Array:
    size = _absolute(a)
    return np.maximum(_widen(size * size), 0.0)


def _square_root(a: Array) -> Array:
    return np.maximum(_widen(np.sqrt(np.maximum(a, 0.0))), 0.0)


def _lift_to_arrays(function: Callable[[Any], Any]) -> Callable[[Array], Array]:
    """A function of arrays of intervals from a function of balls."""

    def apply(a: Array) -> Array:
        ends = [interval(function(ball((low, high)))) for low, high in a.reshape(2, -1).T.tolist()]
        return np.array(ends).T.reshape(a.shape)

    return apply


# Operations.


@dataclass(frozen=True)
class _Operation:
    """An operation on intervals.

    Attributes:
        value: operands → range of the result.
        slopes: operands and result → slope with respect to each operand; infinite if undefined.
        back: result and operands → range of each operand.
    """

    value: Callable[..., Array]
    slopes: Callable[..., tuple[Array, ...]]
    back: Callable[..., tuple[Array, ...]]


_ONE, _SIGNS = np.ones((2, 1)), np.array([[-1.0], [1.0]])
_ANYTHING = _SIGNS * np.inf


def _other_factor(result: Array, other: Array) -> Array:
    """The other factor of a product; anything if both may be 0."""
    return np.where(_has_zero(result) & _has_zero(other), _ANYTHING, _divide(result, other))


def _undo_absolute(result: Array, a: Array) -> tuple[Array]:
    low, high = np.maximum(result, 0.0)
    return (np.stack([np.where(a[0] > -low, low, -high), np.where(a[1] < low, -low, high)]),)


def _unary_operation(
    name: str, value: Callable[..., Array] | None = None, back: Any = lambda _, a: (_ANYTHING,)
) -> _Operation:
    """An operation with one operand; default value and slope come from balls and series of balls."""
    own = INTERVALS.operations[name]
    slope = _lift_to_arrays(lambda x: own(flint.arb_series([x, 1], prec=2))[1])
    return _Operation(value or _lift_to_arrays(own), lambda a, _: (slope(a),), back)


_QUOTIENT = _Operation(
    _divide,
    lambda a, b, r: (_invert(b), _negate(_divide(r, b))),
    lambda r, a, b: (_multiply(r, b), _other_factor(a, r)),
)
_OPERATIONS = {
    "add": _Operation(_add, lambda a, b, r: (_ONE, _ONE), lambda r, a, b: (_subtract(r, b), _subtract(r, a))),
    "sub": _Operation(_subtract, lambda a, b, r: (_ONE, -_ONE), lambda r, a, b: (_add(r, b), _subtract(a, r))),
    "mul": _Operation(_multiply, lambda a, b, r: (b, a), lambda r, a, b: (_other_factor(r, b), _other_factor(r, a))),
    "neg": _Operation(_negate, lambda a, r: (-_ONE,), lambda r, a: (_negate(r),)),
    "square": _Operation(_square, lambda a, r: (_add(a, a),), lambda r, a: _undo_absolute(_square_root(r), a)),
    "abs": _unary_operation("abs", _absolute, _undo_absolute),
    "sqrt": _unary_operation("sqrt", _square_root, lambda r, _: (_square(np.maximum(r, 0.0)),)),
    **dict.fromkeys(("div", "quotient", "ratio"), _QUOTIENT),
    **{name: _unary_operation(name) for name in ("exp", "log", "sin", "cos", "tan", "atan")},
    **{name: _unary_operation(name, back=lambda _, a: (_SIGNS,)) for name in ("asin", "acos")},
}


def prepare_formula(graph: Formula) -> Formula:
    """A formula rewritten in the operations of branch and prune.

    Raises:
        NotAccepted: for an unsupported operation, with its name.
    """
    known = {name: NODES.operations[name] for name in _OPERATIONS} | {"pow": _expand_power}
    own = {name: symbol(name) for name in graph.names}
    return formula(fold(graph, own, Kind(known, NODES.constant)), graph.names)


def _expand_power(a: Node, b: Node) -> Node:
    """A power by squares and products."""
    n = b.fraction
    if n is None or n.denominator > 1:
        raise UnsupportedOperation("pow")
    if n < 0:
        return 1 / _expand_power(a, -b)
    if n == 0:
        return constant(1)
    half = make_node("square", _expand_power(a, constant(n // 2))) if n > 1 else constant(1)
    return half * a if n % 2 else half


def _evaluate_ranges(graph: Formula, x: Array) -> list[Array]:
    """Ranges of all steps of a formula over boxes, of shape (2, boxes) each."""
    found: list[Array] = []
    for op, operands, value in graph.steps:
        if op == INPUT:
            found.append(x[:, graph.names.index(value)])
        elif op == CONSTANT:
            found.append(_enclose_constant(value))
        else:
            found.append(_OPERATIONS[op].value(*(found[o] for o in operands)))
    return found


@lru_cache(maxsize=4096)
def _enclose_constant(value: Constant) -> Array:
    return np.array(outer_doubles(as_exact(value)))[:, None]


def _evaluate_slopes(graph: Formula, x: Array) -> Array:
    """Ranges of the slopes of the outputs over boxes, of shape (2, outputs, variables, boxes)."""
    values, nothing = _evaluate_ranges(graph, x), np.zeros((2, *x.shape[1:]))
    found: list[Array | None] = []
    for k, (op, operands, value) in enumerate(graph.steps):
        own: Array | None = None
        if op == INPUT:
            own = nothing.copy()
            own[:, graph.names.index(value)] = 1.0
        elif any(found[o] is not None for o in operands):
            parts = _OPERATIONS[op].slopes(*(values[o] for o in operands), values[k])
            for o, part in zip(operands, parts, strict=True):
                if (inner := found[o]) is not None:
                    outer = inner if part is _ONE else _multiply(inner, part[:, None])
                    own = outer if own is None else _add(own, outer)
        found.append(own)
    return np.stack([nothing if (own := found[o]) is None else own for o in graph.outputs], axis=1)


def _contract(graph: Formula, x: Array, most: float) -> tuple[Array, Truth]:
    """Contract boxes to the points with all outputs between 0 and `most`; also returns which boxes may hold any.

    Evaluates the steps forward, then bounds each operand from the result and the other operand (Benhamou et al. 1999).
    """
    found, narrowed = _evaluate_ranges(graph, x), x.copy()
    possible = np.ones(x.shape[-1], dtype=bool)

    def narrow_step(k: int, own: Array) -> None:
        found[k] = _intersect(found[k], own)
        np.logical_and(possible, found[k][0] <= found[k][1], out=possible)

    for o in graph.outputs:
        narrow_step(o, np.array([[0.0], [most]]))
    for k, (op, operands, value) in reversed([*enumerate(graph.steps)]):
        if op == INPUT:
            narrowed[:, graph.names.index(value)] = found[k]
        elif op != CONSTANT:
            each = _OPERATIONS[op].back(found[k], *(found[o] for o in operands))
            for o, part in zip(operands, each, strict=True):
                narrow_step(o, part)
    return narrowed, possible


def outer_doubles(number: Any) -> tuple[float, float]:
    """Doubles below and above a number; the same double twice if the number is a double."""
    exact = flint.arb(number)
    if exact.is_finite() and exact.is_exact() and flint.arb(float(exact)) == exact:
        return float(exact), float(exact)
    return interval(exact)
