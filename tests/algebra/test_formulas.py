"""What users' formulas are in other arithmetics, against Python's own functions; every operation is met."""

import math

import casadi as ca
import flint
import numpy as np
import pytest

from tmsopt.algebra import ARRAYS, BALLS, Formulas, operation_name, steps

x, y = ca.SX.sym("x"), ca.SX.sym("y")

OPERATIONS = {
    ca.OP_ADD: (x + y, lambda a, b: a + b),
    ca.OP_SUB: (x - y, lambda a, b: a - b),
    ca.OP_MUL: (x * y, lambda a, b: a * b),
    ca.OP_DIV: (x / y, lambda a, b: a / b),
    ca.OP_NEG: (-x, lambda a, b: -a),
    ca.OP_SQ: (x * x, lambda a, b: a * a),
    ca.OP_TWICE: (2 * x, lambda a, b: 2 * a),
    ca.OP_INV: (1 / x, lambda a, b: 1 / a),
    ca.OP_CONST: (x + 0.3, lambda a, b: a + 0.3),
    ca.OP_POW: (x**y, lambda a, b: a**b),
    ca.OP_CONSTPOW: (x**1.7, lambda a, b: a**1.7),
    ca.OP_SQRT: (ca.sqrt(x), lambda a, b: math.sqrt(a)),
    ca.OP_FABS: (ca.fabs(x - y), lambda a, b: abs(a - b)),
    ca.OP_SIGN: (ca.sign(x - y), lambda a, b: math.copysign(a != b, a - b)),
    ca.OP_FMIN: (ca.fmin(x, y), min),
    ca.OP_FMAX: (ca.fmax(x, y), max),
    ca.OP_LT: (x < y, lambda a, b: a < b),
    ca.OP_LE: (x <= y, lambda a, b: a <= b),
    ca.OP_EQ: (x == y, lambda a, b: a == b),
    ca.OP_NE: (x != y, lambda a, b: a != b),
    ca.OP_NOT: (ca.logic_not(x - y), lambda a, b: a == b),
    ca.OP_AND: (ca.logic_and(x - y, y), lambda a, b: a != b),
    ca.OP_OR: (ca.logic_or(x - y, y - x), lambda a, b: a != b),
    ca.OP_IF_ELSE_ZERO: (ca.if_else(x - y, x, 0), lambda a, b: a if a != b else 0),
    ca.OP_FLOOR: (ca.floor(x), lambda a, b: math.floor(a)),
    ca.OP_CEIL: (ca.ceil(x), lambda a, b: math.ceil(a)),
    ca.OP_EXP: (ca.exp(x), lambda a, b: math.exp(a)),
    ca.OP_LOG: (ca.log(x), lambda a, b: math.log(a)),
    ca.OP_LOG1P: (ca.log1p(x), lambda a, b: math.log1p(a)),
    ca.OP_EXPM1: (ca.expm1(x), lambda a, b: math.expm1(a)),
    ca.OP_SIN: (ca.sin(x), lambda a, b: math.sin(a)),
    ca.OP_COS: (ca.cos(x), lambda a, b: math.cos(a)),
    ca.OP_TAN: (ca.tan(x), lambda a, b: math.tan(a)),
    ca.OP_ASIN: (ca.asin(x / 8), lambda a, b: math.asin(a / 8)),
    ca.OP_ACOS: (ca.acos(x / 8), lambda a, b: math.acos(a / 8)),
    ca.OP_ATAN: (ca.atan(x), lambda a, b: math.atan(a)),
    ca.OP_ATAN2: (ca.atan2(x, y), math.atan2),
    ca.OP_SINH: (ca.sinh(x), lambda a, b: math.sinh(a)),
    ca.OP_COSH: (ca.cosh(x), lambda a, b: math.cosh(a)),
    ca.OP_TANH: (ca.tanh(x), lambda a, b: math.tanh(a)),
    ca.OP_ASINH: (ca.asinh(x), lambda a, b: math.asinh(a)),
    ca.OP_ACOSH: (ca.acosh(x + 1), lambda a, b: math.acosh(a + 1)),
    ca.OP_ATANH: (ca.atanh(x / 8), lambda a, b: math.atanh(a / 8)),
    ca.OP_FMOD: (ca.fmod(x, y), math.fmod),
    ca.OP_HYPOT: (ca.hypot(x, y), math.hypot),
    ca.OP_COPYSIGN: (ca.copysign(x, -y), lambda a, b: math.copysign(a, -b)),
}
"""An expression with each operation, and what it is."""

POINTS = [(0.7, 1.3), (2.6, 1.3), (1.3, 1.3), (3.1, 0.4)]


def test_no_operation_is_left_out():
    """But handing a value on, which no expression can be made of."""
    assert {*OPERATIONS, ca.OP_ASSIGN} == {*ARRAYS} > {*BALLS}


@pytest.mark.parametrize("operation", OPERATIONS, ids=operation_name)
def test_operations_are_those_of_python(operation):
    """Each function of the two libraries is right to a few units of its last digit; balls have 53 bits."""
    expression, truth = OPERATIONS[operation]
    formula = Formulas(("x", "y"), ca.Function("formula", [ca.vertcat(x, y)], [expression]))
    assert operation in {step.operation for step in steps(formula.function)}
    expected = [float(truth(*point)) for point in POINTS]
    columns = np.array(POINTS).T
    assert formula({"x": columns[0], "y": columns[1]})[0] == pytest.approx(expected, rel=1e-14, abs=1e-15)
    for point, value in zip(POINTS, expected, strict=True):
        assert float(formula(dict(zip("xy", point, strict=True)))[0]) == pytest.approx(value, rel=1e-14, abs=1e-15)
        if operation in BALLS:
            ball = formula(dict(zip("xy", map(flint.arb, point), strict=True)))[0]
            assert float(flint.arb(ball).mid()) == pytest.approx(value, rel=1e-14, abs=1e-15)
