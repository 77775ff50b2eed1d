"""Elementary functions of whatever number a formula is given: floats, arrays, CasADi expressions, balls.

A ball is an exact fraction (`flint.fmpq`), an interval with a middle and a radius (`flint.arb`), a power series of
these (`flint.arb_series`), or an array of numbers with bounds of their errors (`rounding.Bounded`). A value that does
not exist, or that the balls are too wide to tell, is a ball nan.
"""

import math
from fractions import Fraction
from typing import Any

import casadi as ca
import flint
import numpy as np

from tmsopt.algebra import rounding
from tmsopt.algebra.formal import Formal

DIGITS = 60


def tan(x: Any) -> Any:
    """Tangent of x (radians); of a symbolic arctangent, its argument, so that formulas in tan stay polynomial."""
    if hasattr(x, "is_op") and x.is_op(ca.OP_ATAN):
        return x.dep(0)
    if isinstance(x, flint.fmpq):
        return as_ball(x).tan()
    return x.tan() if hasattr(x, "tan") else np.tan(np.asarray(x, dtype=float))[()]


def sqrt(x: Any) -> Any:
    """Square root of x; nan, without a warning, for a negative float."""
    if isinstance(x, flint.fmpq):
        is_square = x >= 0 and x.p.is_square() and x.q.is_square()
        return flint.fmpq(x.p.isqrt(), x.q.isqrt()) if is_square else flint.arb(x).sqrt()
    if hasattr(x, "sqrt"):
        return x.sqrt()
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.asarray(x, dtype=float))[()]


def positive_part(x: Any) -> Any:
    """x where it is positive, else 0; exact, for (x + |x|)/2 only doubles and halves."""
    return (x + magnitude(x)) / 2


def magnitude(x: Any) -> Any:
    """|x|; where the sign of a series is not certain, its slopes may have either."""
    if not isinstance(x, flint.arb_series):
        return abs(x)
    constant = x[0]
    if constant > 0:
        return x
    if constant < 0:
        return -x
    either = x * flint.arb(0, 1)
    return flint.arb_series([abs(constant), *(either[k] for k in range(1, x.prec))], prec=x.prec)


def greater(a: Any, b: Any) -> Any:
    """The greater of two balls."""
    return _chosen(a, b, 1)


def lesser(a: Any, b: Any) -> Any:
    """The lesser of two balls."""
    return _chosen(a, b, -1)


def quotient(a: Any, b: Any) -> Any:
    """a / b, nan where b is 0: a quantity that does not exist, not an infinite one."""
    if is_ball(a) or is_ball(b):
        try:
            return a / b
        except (ZeroDivisionError, ValueError):  # of fractions, of series
            return flint.arb("nan")
    if is_symbolic(a) or is_symbolic(b):
        return ca.if_else(b == 0, np.nan, a / b)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return chosen(np.equal(b, 0), np.nan, np.divide(a, b))


def power(a: Any, b: Any) -> Any:
    """a to the power b for balls; nan for a negative a and a b that is not whole. A fraction of many bits is a ball."""
    whole = isinstance(b, flint.fmpq) and b.q == 1 and abs(b.p) <= _WHOLE
    if whole and not (isinstance(a, flint.fmpq) and a.height_bits() * abs(int(b.p)) > _BITS):
        try:
            return a ** int(b.p)
        except (ZeroDivisionError, ValueError):
            return flint.arb("nan")
    return as_ball(a) ** as_ball(b)


def chosen(condition: Any, a: Any, b: Any) -> Any:
    """a where the condition holds, else b: arrays or CasADi expressions."""
    if is_symbolic(condition):
        return ca.if_else(condition, a, b)
    return np.where(condition, a, b)[()]


def is_symbolic(x: Any) -> bool:
    """Whether x is a CasADi expression."""
    return isinstance(x, ca.SX | ca.MX)


def is_ball(x: Any) -> bool:
    """Whether x is a number of ball arithmetic, exact fractions and formulas of these among them."""
    return isinstance(x, flint.fmpq | flint.arb | flint.arb_series | Formal | rounding.Bounded)


def exact(x: Any) -> Any:
    """A number as an exact fraction, a double as the binary number that it is; balls unchanged."""
    if is_ball(x):
        return x
    return flint.fmpq(*x.as_integer_ratio())


def printed(x: float) -> Any:
    """A double as the shortest decimal that prints it, 0.1 as 1/10; a ball that is nan where it is no number."""
    if not math.isfinite(x):
        return flint.arb("nan")
    return flint.fmpq(*Fraction(repr(float(x))).as_integer_ratio())


def as_ball(x: Any) -> Any:
    """An exact fraction as a ball of the working precision; balls and series unchanged."""
    return flint.arb(x) if isinstance(x, flint.fmpq) else x


_WHOLE = 1023  # exponent up to which a power is a product
_BITS = 2**22  # of a fraction that is a power
_FARTHEST = 2**20  # exponent of two of a fraction made of a ball


def _chosen(a: Any, b: Any, sign: int) -> Any:
    """(a + b + sign |a − b|)/2, and exactly one of the two where it is certain which."""
    if isinstance(a, rounding.Bounded) or isinstance(b, rounding.Bounded):
        return sign * rounding.greater(sign * a, sign * b)
    difference = a - b
    constant = difference[0] if isinstance(difference, flint.arb_series) else difference
    if sign * constant >= 0:
        return a
    if sign * constant <= 0:
        return b
    if isinstance(difference, flint.arb):
        return as_ball(a).max(as_ball(b)) if sign > 0 else as_ball(a).min(as_ball(b))
    return (a + b + sign * magnitude(difference)) / 2


def rational(x: Any, digits: int = DIGITS) -> flint.fmpq:
    """A number as an exact fraction: floats and fractions unchanged, balls by their middle at `digits`.

    A middle that would have millions of bits, as exp(1e300) and its inverse, is a power of two far beyond doubles.
    """
    if isinstance(x, flint.fmpq):
        return x
    if isinstance(x, flint.arb):
        figures, exponent = (int(part) for part in x.mid().man_exp())
        if abs(exponent) <= _FARTHEST:
            return x.mid().fmpq()
        far = flint.fmpq(2) ** (_FARTHEST if exponent > 0 else -_FARTHEST)
        return far if figures > 0 else -far
    ratio = Fraction(x)
    return flint.fmpq(ratio.numerator, ratio.denominator)
