"""What CasADi's operations are in other arithmetics: those of NumPy's arrays, and of balls."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.algebra import elementary
from tmsopt.algebra.walk import Arithmetic


def _truth(relation: Callable[..., Any]) -> Callable[..., Any]:
    return lambda *operands: np.where(relation(*operands), 1.0, 0.0)[()]


ARRAYS: Arithmetic = {
    ca.OP_CONST: np.float64,
    ca.OP_ASSIGN: lambda x: x,
    ca.OP_ADD: np.add,
    ca.OP_SUB: np.subtract,
    ca.OP_MUL: np.multiply,
    ca.OP_DIV: np.divide,
    ca.OP_NEG: np.negative,
    ca.OP_SQRT: np.sqrt,
    ca.OP_FABS: np.abs,
    ca.OP_SIGN: np.sign,
    ca.OP_FMIN: np.minimum,  # nan where either is: CasADi's own would take the other
    ca.OP_FMAX: np.maximum,
    ca.OP_LT: _truth(np.less),
    ca.OP_LE: _truth(np.less_equal),
    ca.OP_EQ: _truth(np.equal),
    ca.OP_NOT: _truth(np.logical_not),
    ca.OP_AND: _truth(np.logical_and),
    ca.OP_OR: _truth(np.logical_or),
    ca.OP_IF_ELSE_ZERO: lambda c, x: np.where(np.not_equal(c, 0), x, 0.0)[()],
    ca.OP_FLOOR: np.floor,
    ca.OP_CEIL: np.ceil,
    ca.OP_POW: np.power,
    ca.OP_EXP: np.exp,
    ca.OP_LOG: np.log,
    ca.OP_LOG1P: np.log1p,
    ca.OP_EXPM1: np.expm1,
    ca.OP_SIN: np.sin,
    ca.OP_COS: np.cos,
    ca.OP_TAN: np.tan,
    ca.OP_ASIN: np.arcsin,
    ca.OP_ACOS: np.arccos,
    ca.OP_ATAN: np.arctan,
    ca.OP_ATAN2: np.arctan2,
    ca.OP_SINH: np.sinh,
    ca.OP_COSH: np.cosh,
    ca.OP_TANH: np.tanh,
    ca.OP_ASINH: np.arcsinh,
    ca.OP_ACOSH: np.arccosh,
    ca.OP_ATANH: np.arctanh,
    ca.OP_FMOD: np.fmod,
    ca.OP_HYPOT: np.hypot,
    ca.OP_COPYSIGN: np.copysign,
    ca.OP_SQ: lambda x: x * x,
    ca.OP_TWICE: lambda x: x + x,
    ca.OP_INV: lambda x: np.divide(1.0, x),
    ca.OP_CONSTPOW: np.power,
    ca.OP_NE: _truth(np.not_equal),
}
"""Every operation on floats and arrays."""


def _function(name: str) -> Callable[[Any], Any]:
    return lambda x: getattr(elementary.as_ball(x), name)()


BALLS: Arithmetic = {
    ca.OP_CONST: elementary.printed,
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: elementary.quotient,
    ca.OP_NEG: lambda a: -a,
    ca.OP_SQ: lambda a: a * a,
    ca.OP_TWICE: lambda a: 2 * a,
    ca.OP_INV: lambda a: elementary.quotient(elementary.exact(1), a),
    ca.OP_POW: elementary.power,
    ca.OP_CONSTPOW: elementary.power,
    ca.OP_SQRT: elementary.sqrt,
    ca.OP_FABS: elementary.magnitude,
    ca.OP_FMIN: elementary.lesser,
    ca.OP_FMAX: elementary.greater,
    ca.OP_EXP: _function("exp"),
    ca.OP_LOG: _function("log"),
    ca.OP_SIN: _function("sin"),
    ca.OP_COS: _function("cos"),
    ca.OP_TAN: _function("tan"),
    ca.OP_ASIN: _function("asin"),
    ca.OP_ACOS: _function("acos"),
    ca.OP_ATAN: _function("atan"),
}
"""Operations on balls, exact fractions and series of them among these: a number is the decimal that prints it."""
