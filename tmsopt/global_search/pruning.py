"""Prunes many boxes at once by interval arithmetic, in doubles rounded outward.

A box is a range for each variable. Pruning contracts it, splits it, or proves that it holds no zero or exactly one.

The first axis of an array holds the lower and the upper ends. NaN ends, such as those of 0 · ∞, become infinite, since
an interval may be too wide but never too narrow.
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

_TINY = 1e-300  # larger than any loss by underflow
_MAX_SHRUNK_PART = 0.5  # if a side shrinks below this part of its width, the box is contracted again, not split
_MIN_BOXES = 64  # fewer boxes are split repeatedly, because so many boxes take hardly longer than one
_MARGIN = 0.1  # relative to a width: how far Newton's box extends beyond each end
_MIN_MARGIN = 1e-12  # relative to the first box: least value of that margin


@dataclass(frozen=True)
class BoxConditions:
    """The conditions to satisfy in a box.

    Attributes:
        equations: expressions that must be 0, as many as variables.
        limits: expressions that must be ≥ 0.
        widths: width of the first box in each variable; 1 where it is infinite.
        extra: further expressions that must be 0.
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
        proved: boxes with exactly one zero, and the parts of these that hold the zero, stacked along a first axis.
        small: parts that may hold zeros and are too small to split.
    """

    remaining: Array
    proved: Array
    small: Array


def prune(conditions: BoxConditions, x: Array, min_width: float) -> PrunedBoxes:
    """Contract boxes once, drop those without a zero, and split those that hardly shrink.

    Args:
        x: boxes, of shape (2, variables, boxes).
        min_width: least width to split, relative to the first box.
    """
    with np.errstate(all="ignore"):
        widths = x[1] - x[0]
        for graph, target in ((conditions.equations, 0.0), (conditions.extra, 0.0), (conditions.limits, np.inf)):
            x, can_hold_zero = _contract(graph, x, target)
            x, widths = x[..., can_hold_zero], widths[:, can_hold_zero]
        wide_boxes, image_boxes, has_one_zero, weights = _apply_newton(conditions, x)
        x = _intersect(x, image_boxes)
        can_hold_zero = (x[0] <= x[1]).all(axis=0)
        is_proved, is_open = can_hold_zero & has_one_zero, can_hold_zero & ~has_one_zero
        is_contracted_again = is_open & (x[1] - x[0] < _MAX_SHRUNK_PART * widths).any(axis=0)
        is_split = is_open & ~is_contracted_again
        parts, small = _split_boxes(x[..., is_split], weights[:, is_split], min_width * _as_column(conditions.widths))
        return PrunedBoxes(
            np.concatenate([x[..., is_contracted_again], parts], axis=-1),
            np.stack([wide_boxes, image_boxes])[..., is_proved],
            small,
        )


def _split_boxes(x: Array, weights: Array, min_width: Array) -> tuple[Array, Array]:
    """Halve boxes along the side of greatest weight, repeatedly if they are few; return parts and small boxes."""
    parts, small = x, x[..., :0]
    while True:
        width = parts[1] - parts[0]
        middle = parts[0] + width / 2
        can_split = (width > min_width) & (width < np.inf) & (parts[0] < middle) & (middle < parts[1])
        is_splittable = can_split.any(axis=0)
        small = np.concatenate([small, parts[..., ~is_splittable]], axis=-1)
        cut_sides = (
            np.where(can_split, weights, -1.0).argmax(axis=0)[is_splittable],
            np.arange(np.count_nonzero(is_splittable)),
        )
        lower, weights = parts[..., is_splittable], weights[:, is_splittable]
        upper = lower.copy()
        lower[1][cut_sides] = upper[0][cut_sides] = middle[:, is_splittable][cut_sides]
        weights[cut_sides] /= 2
        parts, weights = np.concatenate([lower, upper], axis=-1), np.concatenate([weights, weights], axis=-1)
        if not 0 < parts.shape[-1] < _MIN_BOXES:
            return parts, small


def _apply_newton(conditions: BoxConditions, x: Array) -> tuple[Array, Array, Truth, Array]:
    """Apply the interval Newton operator, plain and preconditioned.

    Let J be the Jacobian over a wider box around m. Zeros satisfy A (x − m) = −f(m) for a matrix A in J, and
    C (x − m) = −Y f(m) for a matrix C in Y J, where Y approximates the inverse of the middle of J. Each row bounds each
    variable. If the diagonal of C dominates, there is at most one zero; if its bounds lie inside the wider box, there
    is exactly one (Neumaier 1990, theorem 5.1.7).

    Returns:
        The wider boxes; their parts that hold all zeros; whether there is exactly one zero; and for each variable the
        weight of its width in the equations, at most 1 for each equation.
    """
    first_widths = _as_column(conditions.widths)
    margin = _MARGIN * (x[1] - x[0]) + _MIN_MARGIN * first_widths
    wide_boxes = np.stack([x[0] - margin, x[1] + margin])
    middle = (wide_boxes[0] + wide_boxes[1]) / 2
    half_widths = np.maximum(wide_boxes[1] - middle, middle - wide_boxes[0]) * (1 + UNIT) + _TINY
    step_ranges = _evaluate_ranges(conditions.equations, np.stack([middle, middle]))
    outputs = [np.broadcast_to(step_ranges[o], wide_boxes[:, 0].shape) for o in conditions.equations.outputs]
    values = np.stack(outputs, axis=1)[:, :, None]
    slopes = _evaluate_slopes(conditions.equations, wide_boxes)
    centre = np.moveaxis((slopes[0] + slopes[1]) / 2, -1, 0)
    determinants = np.linalg.det(centre)
    is_singular = ~np.isfinite(determinants) | (determinants == 0)
    centre[is_singular] = np.eye(len(first_widths))  # the bounds hold for any matrix
    inverse = np.moveaxis(np.linalg.inv(centre), 0, -1)
    preconditioned = _bound_moves(_multiply_matrices(inverse, slopes), _multiply_matrices(inverse, values), half_widths)
    moves = np.concatenate([_bound_moves(slopes, values, half_widths), preconditioned], axis=1)
    image = _widen(middle + np.stack([moves[0].max(axis=0), moves[1].min(axis=0)]))
    diagonal = np.einsum("ekkm->ekm", preconditioned)
    zero_ranges = _widen(middle + diagonal)
    has_one_zero = (
        (np.abs(diagonal).max(axis=0) < half_widths * (1 - 4 * UNIT))
        & (zero_ranges[0] > wide_boxes[0])
        & (zero_ranges[1] < wide_boxes[1])
    )
    terms = np.abs(slopes).max(axis=0) * half_widths
    sensitivity = (terms / np.maximum(terms.sum(axis=1, keepdims=True), _TINY)).sum(axis=0)
    share = np.minimum((x[1] - x[0]) / np.maximum(first_widths, _TINY), 1.0)
    weights = np.where(np.isfinite(sensitivity), sensitivity + 1e-3 * share, share)
    return wide_boxes, image, has_one_zero.all(axis=0), weights


def _bound_moves(matrix: Array, values: Array, half_widths: Array) -> Array:
    """Bound the move of each variable, at most a half width, by each equation (matrix · move + value = 0)."""
    terms = np.abs(matrix).max(axis=0) * half_widths
    growth = 1 + (len(half_widths) + 4) * UNIT
    other_terms = terms.sum(axis=1, keepdims=True) * growth - terms / growth + _TINY  # sum without the variable itself
    return _divide(_widen(np.stack([-values[1] - other_terms, -values[0] + other_terms])), matrix)


def _multiply_matrices(exact: Array, x: Array) -> Array:
    """Multiply matrices of doubles by matrices of intervals; the rounding bound holds for any order of summation."""
    middle, rounding = (x[0] + x[1]) / 2, (len(exact) + 4) * UNIT
    radius = (x[1] - x[0]) * (0.5 + UNIT) + rounding * np.abs(middle) + _TINY
    centre, error = (np.einsum("ijm,jkm->ikm", *matrices) for matrices in ((exact, middle), (np.abs(exact), radius)))
    error = error * (1 + rounding) + _TINY
    return _widen(np.stack([centre - error, centre + error]))


def _as_column(numbers: Sequence[float]) -> Array:
    return np.array(numbers)[:, None]


# Interval arithmetic.


def _widen(x: Array) -> Array:
    """Move the ends outward by more than one rounding, in place; NaN becomes infinite."""
    margin = np.abs(x) * UNIT + _TINY
    x[0] -= margin[0]
    x[1] += margin[1]
    is_nan = np.isnan(x)
    if is_nan.any():
        x[0][is_nan[0]], x[1][is_nan[1]] = -np.inf, np.inf
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
    products = np.stack([a * b, a * b[::-1]])
    is_nan = np.isnan(products)
    if is_nan.any():
        products[is_nan] = 0.0
    product = np.empty(products.shape[1:])
    products.min(axis=(0, 1), out=product[0])
    products.max(axis=(0, 1), out=product[1])
    return _widen(product)


def _invert(a: Array) -> Array:
    """1/a; unbounded if a contains numbers of both signs."""
    has_one_sign = (a[0] >= 0) | (a[1] <= 0)
    low = np.where(has_one_sign & (a[1] != 0), 1 / a[1], -np.inf)
    high = np.where(has_one_sign & (a[0] != 0), 1 / a[0], np.inf)
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
    """Make a function of arrays of intervals from a function of balls (midpoint and radius)."""

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
        operand_ranges: result and operands → range of each operand.
    """

    value: Callable[..., Array]
    slopes: Callable[..., tuple[Array, ...]]
    operand_ranges: Callable[..., tuple[Array, ...]]


_ONE, _SIGNS = np.ones((2, 1)), np.array([[-1.0], [1.0]])
_UNBOUNDED = _SIGNS * np.inf


def _other_factor(result: Array, factor: Array) -> Array:
    """Divide a product by a factor; the result is unbounded if both may be 0."""
    return np.where(_has_zero(result) & _has_zero(factor), _UNBOUNDED, _divide(result, factor))


def _undo_absolute(result: Array, a: Array) -> tuple[Array]:
    low, high = np.maximum(result, 0.0)
    return (np.stack([np.where(a[0] > -low, low, -high), np.where(a[1] < low, -low, high)]),)


def _unary_operation(
    name: str, value: Callable[..., Array] | None = None, operand_ranges: Any = lambda _, a: (_UNBOUNDED,)
) -> _Operation:
    """An operation with one operand; its slope, and by default its value, come from ball arithmetic."""
    function = INTERVALS.operations[name]
    slope = _lift_to_arrays(lambda x: function(flint.arb_series([x, 1], prec=2))[1])
    return _Operation(value or _lift_to_arrays(function), lambda a, _: (slope(a),), operand_ranges)


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
    **dict.fromkeys(("div", "quotient_or_nan", "quotient_or_zero"), _QUOTIENT),
    **{name: _unary_operation(name) for name in ("exp", "log", "sin", "cos", "tan", "atan")},
    **{name: _unary_operation(name, operand_ranges=lambda _, a: (_SIGNS,)) for name in ("asin", "acos")},
}


def prepare_formula(graph: Formula) -> Formula:
    """Rewrite a formula in the operations of branch and prune.

    Raises:
        UnsupportedOperation: for an unsupported operation, with its name.
    """
    operations = {name: NODES.operations[name] for name in _OPERATIONS} | {"pow": _expand_power}
    symbols = {name: symbol(name) for name in graph.names}
    return formula(fold(graph, symbols, Kind(operations, NODES.constant)), graph.names)


def _expand_power(a: Node, b: Node) -> Node:
    """Write an integer power as squares and products."""
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
    step_ranges: list[Array] = []
    for op, operands, value in graph.steps:
        if op == INPUT:
            step_ranges.append(x[:, graph.names.index(value)])
        elif op == CONSTANT:
            step_ranges.append(_enclose_constant(value))
        else:
            step_ranges.append(_OPERATIONS[op].value(*(step_ranges[o] for o in operands)))
    return step_ranges


@lru_cache(maxsize=4096)
def _enclose_constant(value: Constant) -> Array:
    return np.array(outer_doubles(as_exact(value)))[:, None]


def _evaluate_slopes(graph: Formula, x: Array) -> Array:
    """Ranges of the slopes of the outputs over boxes, of shape (2, outputs, variables, boxes)."""
    values, zero_slopes = _evaluate_ranges(graph, x), np.zeros((2, *x.shape[1:]))
    step_slopes: list[Array | None] = []
    for k, (op, operands, value) in enumerate(graph.steps):
        slope: Array | None = None
        if op == INPUT:
            slope = zero_slopes.copy()
            slope[:, graph.names.index(value)] = 1.0
        elif any(step_slopes[o] is not None for o in operands):
            parts = _OPERATIONS[op].slopes(*(values[o] for o in operands), values[k])
            for o, part in zip(operands, parts, strict=True):
                if (inner := step_slopes[o]) is not None:
                    outer = inner if part is _ONE else _multiply(inner, part[:, None])
                    slope = outer if slope is None else _add(slope, outer)
        step_slopes.append(slope)
    return np.stack([zero_slopes if (slope := step_slopes[o]) is None else slope for o in graph.outputs], axis=1)


def _contract(graph: Formula, x: Array, upper_end: float) -> tuple[Array, Truth]:
    """Contract boxes to the points with all outputs between 0 and `upper_end`; also return which boxes may hold any.

    Evaluate the steps forward, then bound each operand from the result and the other operand (Benhamou et al. 1999).
    """
    step_ranges, narrowed_boxes = _evaluate_ranges(graph, x), x.copy()
    is_possible = np.ones(x.shape[-1], dtype=bool)

    def narrow_step(k: int, allowed_range: Array) -> None:
        step_ranges[k] = _intersect(step_ranges[k], allowed_range)
        np.logical_and(is_possible, step_ranges[k][0] <= step_ranges[k][1], out=is_possible)

    for o in graph.outputs:
        narrow_step(o, np.array([[0.0], [upper_end]]))
    for k, (op, operands, value) in reversed([*enumerate(graph.steps)]):
        if op == INPUT:
            narrowed_boxes[:, graph.names.index(value)] = step_ranges[k]
        elif op != CONSTANT:
            operand_ranges = _OPERATIONS[op].operand_ranges(step_ranges[k], *(step_ranges[o] for o in operands))
            for o, operand_range in zip(operands, operand_ranges, strict=True):
                narrow_step(o, operand_range)
    return narrowed_boxes, is_possible


def outer_doubles(number: Any) -> tuple[float, float]:
    """A double at or below a number and one at or above it; the same double twice if the number is a double."""
    exact = flint.arb(number)
    if exact.is_finite() and exact.is_exact() and flint.arb(float(exact)) == exact:
        return float(exact), float(exact)
    return interval(exact)
