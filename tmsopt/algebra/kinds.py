"""Kinds of number: the operations of a formula for floats and arrays, CasADi, balls, intervals and nodes.

A ball is a midpoint with a radius; `balls` lists its types. A node is a part of a new formula. To fold a formula is to
evaluate it in one kind of number. A condition on balls is True, False or None (undecided); on power series of balls,
undecided is nan. These operations are not the usual ones:

    quotient_or_nan   a / b; nan where b is 0, because the quantity does not exist there and is not infinite
    quotient_or_zero  a / b; 0 where a is 0, for every b; nan where only b is 0
    choose            b where the condition a holds, else c
    positive_part     a where it is positive, else 0
    negligible        whether a is 0, or as small as the rounding error of a sum of terms of size b
"""

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache, partial
from typing import Any

import casadi as ca
import flint
import numpy as np

from tmsopt.algebra import rounding
from tmsopt.algebra.balls import DIGITS, as_ball, exact, is_ball
from tmsopt.algebra.formula import (
    PI,
    Constant,
    Formula,
    Kind,
    Node,
    constant,
    fold,
    formula,
    make_node,
    nodes_from_casadi,
)
from tmsopt.algebra.rounding import Bounded

_MAX_EXPONENT = 1023  # a power of balls with a larger exponent is computed by logarithms
_MAX_BITS = 2**22  # a power of a fraction with more bits becomes a ball
_TINY = 1e-300  # avoids 0/0 in a solver and changes no other value
ROUNDING = 4 * float(np.finfo(float).eps)
"""Rounding error of a sum of a few terms, relative to their size."""

Operations = Mapping[str, Callable[..., Any]]

ARITHMETIC: Operations = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "neg": operator.neg,
    "square": lambda x: x * x,
}


def _python_operations(absolute: Callable[[Any], Any]) -> Operations:
    """Operations that are the same in NumPy and CasADi, except for `absolute`, which has other names there."""
    return {
        **ARITHMETIC,
        "abs": absolute,
        "less": operator.lt,
        "at_most": operator.le,
        "equal": operator.eq,
        "positive_part": lambda x: (x + absolute(x)) / 2,
        "negligible": lambda x, size: absolute(x) <= ROUNDING * size,
    }


# Floats and arrays.


def as_double(value: Constant) -> Any:
    """The NumPy double nearest to a constant. Its operations give nan and inf where Python's raise."""
    return np.float64(value) if isinstance(value, float) else _double(value)


@lru_cache(maxsize=4096)
def _double(value: Fraction | Formula) -> Any:
    if isinstance(value, Fraction):
        try:
            return np.float64(float(value))
        except OverflowError:
            return np.float64(math.copysign(math.inf, value))
    with flint.ctx.workdps(DIGITS):
        ball = flint.arb(as_exact(value))
    if not ball.is_finite():
        with np.errstate(all="ignore"):
            return fold(value, {}, FLOATS)[0]  # nan or inf
    return np.float64(0.0 if ball.contains(0) else float(ball))


def _power(base: Any, exponent: Any) -> Any:
    """A power; common exponents are computed as products and roots, which are more accurate."""
    special_case = _POWERS.get(float(exponent)) if np.ndim(exponent) == 0 else None
    return np.power(base, exponent) if special_case is None else special_case(base)


_POWERS: Mapping[float, Callable[[Any], Any]] = {
    -1.0: lambda x: np.divide(1.0, x),
    0.5: np.sqrt,
    1.0: lambda x: x,
    2.0: lambda x: x * x,
    3.0: lambda x: x * x * x,
    4.0: lambda x: (square := x * x) * square,
}


def _choose(condition: Any, a: Any, b: Any) -> Any:
    return np.where(condition, a, b)[()]


def _quotient_or_nan(a: Any, b: Any) -> Any:
    return _choose(b == 0, np.nan, a / b)


FLOATS = Kind(
    {
        **_python_operations(abs),
        "pow": _power,
        **{name: getattr(np, name) for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "sign")},
        **{name: getattr(np, f"arc{name[1:]}") for name in ("asin", "acos", "atan")},
        "min": np.minimum,  # nan if one of the two is nan
        "max": np.maximum,
        "and": np.logical_and,
        "or": np.logical_or,
        "not": np.logical_not,
        "choose": _choose,
        "quotient_or_nan": _quotient_or_nan,
        "quotient_or_zero": lambda a, b: _choose(a == 0, 0.0, _quotient_or_nan(a, b)),
    },
    as_double,
    np.float64,
)
"""Scalars and arrays that broadcast; switch off NumPy's warnings before you fold a formula with this kind."""


# Expressions of CasADi.


def _tangent(x: Any) -> Any:
    """The tangent; tan(atan(x)) is x, so that formulas in tan stay polynomial."""
    return x.dep(0) if not isinstance(x, ca.DM) and x.is_op(ca.OP_ATAN) else ca.tan(x)


def _symbolic_quotient_or_zero(a: Any, b: Any) -> Any:
    """a / b, smooth where b may be 0."""
    if isinstance(b, ca.DM):
        return a / b if b != 0 else 0 * a
    return a * b / (b * b + _TINY)


CASADI = Kind(
    {
        **_python_operations(ca.fabs),
        "pow": operator.pow,
        **{name: getattr(ca, name) for name in ("sqrt", "exp", "log", "sin", "cos", "asin", "acos", "atan", "sign")},
        "tan": _tangent,
        "min": ca.fmin,
        "max": ca.fmax,
        "and": ca.logic_and,
        "or": ca.logic_or,
        "not": ca.logic_not,
        "choose": ca.if_else,
        "quotient_or_nan": lambda a, b: ca.if_else(b == 0, np.nan, a / b),
        "quotient_or_zero": _symbolic_quotient_or_zero,
    },
    lambda value: float(as_double(value)),
    lambda x: x if isinstance(x, ca.SX | ca.MX) else ca.DM(float(x)),
)


# Balls.


def as_exact(value: Constant) -> Any:
    """A constant as a fraction, or else as a ball of the working precision."""
    if isinstance(value, Fraction):
        return exact(value)
    return flint.arb(value) if isinstance(value, float) else fold(value, {}, BALLS)[0]


def _ball_number(x: Any) -> Any:
    if x is None or isinstance(x, bool | np.bool_ | np.ndarray):  # x is a condition
        return x
    return flint.arb(x) if isinstance(x, float) and not math.isfinite(x) else exact(x)


def _ball_sqrt(x: Any) -> Any:
    if isinstance(x, flint.fmpq):
        is_square = x >= 0 and x.p.is_square() and x.q.is_square()
        return flint.fmpq(x.p.isqrt(), x.q.isqrt()) if is_square else flint.arb(x).sqrt()
    return x.sqrt()


def _ball_quotient_or_nan(a: Any, b: Any) -> Any:
    try:
        return a * (1 / b) if isinstance(a, flint.arb_poly) else a / b
    except (ZeroDivisionError, ValueError):  # fractions raise the first error, and series the second
        return flint.arb("nan")


def _ball_power(a: Any, b: Any) -> Any:
    """a to the power b, nan for a negative a and a fractional b. A fraction of too many bits becomes a ball."""
    is_product = isinstance(b, flint.fmpq) and b.q == 1 and abs(b.p) <= _MAX_EXPONENT
    if is_product and not (isinstance(a, flint.fmpq) and a.height_bits() * abs(int(b.p)) > _MAX_BITS):
        try:
            return a ** int(b.p)
        except (ZeroDivisionError, ValueError):
            return flint.arb("nan")
    return as_ball(a) ** as_ball(b)


def magnitude(x: Any) -> Any:
    """|x| of a ball; if the sign of a power series is undecided, the balls of its derivatives contain both signs."""
    if not isinstance(x, flint.arb_series):
        return abs(x)
    if x[0] > 0:
        return x
    if x[0] < 0:
        return -x
    with_both_signs = x * flint.arb(0, 1)
    return flint.arb_series([abs(x[0]), *(with_both_signs[k] for k in range(1, x.prec))], prec=x.prec)


def ball_maximum(a: Any, b: Any) -> Any:
    """The greater of two balls: one of the two if their order is decided, else (a + b + |a − b|)/2."""
    if isinstance(a, Bounded) or isinstance(b, Bounded):
        return rounding.maximum(a, b)
    difference = a - b
    value = difference[0] if isinstance(difference, flint.arb_series) else difference
    if value >= 0:
        return a
    if value <= 0:
        return b
    if isinstance(difference, flint.arb):
        return as_ball(a).max(as_ball(b))
    return (a + b + magnitude(difference)) / 2


def ball_minimum(a: Any, b: Any) -> Any:
    """The lesser of two balls."""
    return -ball_maximum(-a, -b)


def _compare(compare: Callable[..., Any], opposite: Callable[..., Any], a: Any, b: Any) -> Any:
    """Compare two balls. For arrays the answer is 1.0, 0.0 or nan (undecided).

    Args:
        compare, opposite: a comparison such as ``<``, and the comparison that holds if the first one fails.
    """
    difference = a - b
    if isinstance(difference, Bounded):
        low, high = difference.value - difference.error, difference.value + difference.error
        is_false = opposite(high, 0) & opposite(low, 0)
        return np.where(compare(high, 0) & compare(low, 0), 1.0, np.where(is_false, 0.0, np.nan))
    is_series = isinstance(difference, flint.arb_series)
    value = difference[0] if is_series else difference
    return True if compare(value, 0) else False if opposite(value, 0) else math.nan if is_series else None


def _ball_choice(condition: Any, a: Any, b: Any) -> Any:
    """a if the condition holds, else b; a ball that contains both if the condition is undecided."""
    if isinstance(condition, float | flint.arb):  # it is nan for series: a jump has no derivative
        return flint.arb("nan")
    if isinstance(condition, np.ndarray):
        first, second = rounding.as_bounded(a), rounding.as_bounded(b)
        return first.where(condition == 1, second).where(~np.isnan(condition), Bounded(np.nan, np.inf))
    if condition is None:
        first, second = as_ball(a), as_ball(b)
        are_finite = all(isinstance(x, flint.arb) and x.is_finite() for x in (first, second))
        return first.union(second) if are_finite else flint.arb("nan")
    return a if condition else b


def _ball_quotient_or_zero(a: Any, b: Any) -> Any:
    if isinstance(a, Bounded):
        is_zero = (a.value == 0) & (a.error == 0)
        return Bounded(np.zeros_like(a.value)).where(is_zero, a / rounding.as_bounded(b))
    is_zero = all(a[k] == 0 for k in range(a.prec)) if hasattr(a, "prec") else bool(a == 0)
    return 0 * b if is_zero else _ball_quotient_or_nan(a, b)


def _ball_and(a: Any, b: Any) -> Any:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.minimum(a, b)
    return False if a is False or b is False else b if a is True else a


def _ball_not(a: Any) -> Any:
    return 1.0 - a if isinstance(a, np.ndarray | float) else None if a is None else not a


_ball_equals = partial(_compare, operator.eq, operator.ne)


def _ball_function(name: str) -> Callable[[Any], Any]:
    return lambda x: getattr(as_ball(x), name)()


BALLS = Kind(
    {
        **ARITHMETIC,
        "div": _ball_quotient_or_nan,
        "quotient_or_nan": _ball_quotient_or_nan,
        "quotient_or_zero": _ball_quotient_or_zero,
        "pow": _ball_power,
        "pi": flint.arb.pi,
        "sqrt": _ball_sqrt,
        "abs": magnitude,
        "min": ball_minimum,
        "max": ball_maximum,
        **{name: _ball_function(name) for name in ("exp", "log", "sin", "cos", "tan", "asin", "acos", "atan")},
        "less": partial(_compare, operator.lt, operator.ge),
        "at_most": partial(_compare, operator.le, operator.gt),
        "equal": _ball_equals,
        "and": _ball_and,
        "or": lambda a, b: _ball_not(_ball_and(_ball_not(a), _ball_not(b))),
        "not": _ball_not,
        "choose": _ball_choice,
        "positive_part": lambda x: (x + magnitude(x)) / 2,
        "negligible": lambda x, size: _ball_equals(x, 0),
    },
    as_exact,
    _ball_number,
)
"""Constants are exact, and fractions stay fractions where possible."""


def interval_square(x: Any) -> Any:
    """x² of an interval, never negative. The ball abs(x) is not used, because around 0 it contains negative numbers."""
    return (x.abs_lower() ** 2).union(x.abs_upper() ** 2) if x.is_finite() else flint.arb(0, math.inf)


def _interval_power(x: Any, y: Any) -> Any:
    """x to the power y; for an integer y, x may be negative."""
    if not y.is_integer():
        return x**y
    exponent = int(abs(float(y)))
    power = x**exponent if exponent % 2 else interval_square(x ** (exponent // 2))
    return power if y >= 0 else 1 / power


INTERVALS = Kind(
    {**BALLS.operations, "square": interval_square, "pow": _interval_power},
    lambda value: flint.arb(as_exact(value)),
)
"""Balls for whole ranges of the inputs; an even power is never below 0."""


# Nodes: an operation builds a part of a new formula.


def _as_node(value: Constant) -> Node:
    node: Node = fold(value, {}, NODES)[0] if isinstance(value, Formula) else constant(value)
    return node


NODES = Kind({name: partial(make_node, name) for name in (*FLOATS.operations, "pi")}, _as_node, constant)


def kind_of(*numbers: Any) -> Kind:
    """The kind that all these numbers can be converted to. Floats can be converted to every kind."""
    kind = FLOATS
    for x in numbers:
        if isinstance(x, float):  # by far the most frequent case
            continue
        if isinstance(x, Node):
            return NODES
        if isinstance(x, ca.SX | ca.MX):
            kind = CASADI
        elif kind is FLOATS and is_ball(x):
            kind = BALLS
    return kind


def values(formula: Formula, inputs: Mapping[str, Any]) -> list[Any]:
    """Outputs of a formula for numbers of any kind; nan and inf of floats give no warning."""
    with np.errstate(all="ignore"):
        return fold(formula, inputs, kind_of(*[inputs[name] for name in formula.names if name in inputs]))


# Operations of formulas, on numbers of any kind.


def _make_function(op: str) -> Callable[..., Any]:
    def evaluate(*operands: Any) -> Any:
        kind = kind_of(*operands)
        with np.errstate(all="ignore"):
            return kind.operations[op](*map(kind.number, operands))

    return evaluate


sqrt, tan, atan, absolute, minimum, less = map(_make_function, ["sqrt", "tan", "atan", "abs", "min", "less"])
choose, logical_and, positive_part, negligible = map(_make_function, ["choose", "and", "positive_part", "negligible"])
quotient_or_nan, quotient_or_zero = map(_make_function, ["quotient_or_nan", "quotient_or_zero"])


def pi(number: Any) -> Any:
    """π, in the kind of a number."""
    return kind_of(number).constant(_PI)


_PI = formula([PI])


def gradients(outputs: Sequence[Any], inputs: Sequence[Node]) -> list[list[Node]]:
    """Derivatives of each output with respect to each input, as nodes, by CasADi."""
    traced_formula = formula(outputs)
    symbols = {name: ca.SX.sym(name) for name in dict.fromkeys((*traced_formula.inputs, *(x.value for x in inputs)))}
    variables = ca.vertcat(*(symbols[x.value] for x in inputs))
    jacobian = ca.jacobian(ca.vertcat(*fold(traced_formula, symbols, CASADI)), variables)
    function = ca.Function("gradients", [ca.vertcat(*symbols.values())], [ca.densify(jacobian.T)])
    nodes = iter(nodes_from_casadi(function, list(symbols)))
    return [[next(nodes) for _ in inputs] for _ in outputs]
