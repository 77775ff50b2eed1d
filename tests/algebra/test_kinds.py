"""Operations of formulas in each kind of number, compared with Python's functions; every operation is tested."""

import math
from fractions import Fraction
from importlib import import_module

import casadi as ca
import flint
import numpy as np
import pytest

from tmsopt.algebra import (
    BALLS,
    CASADI,
    FLOATS,
    INTERVALS,
    NODES,
    UnsupportedOperation,
    fold,
    from_casadi,
    ranges,
    trace,
    values,
)
from tmsopt.problem import parse_value

as_double, gradients = (getattr(import_module("tmsopt.algebra.kinds"), n) for n in ("as_double", "gradients"))
formula, make_node, symbol = (
    getattr(import_module("tmsopt.algebra.formula"), n) for n in ("formula", "make_node", "symbol")
)

POINTS = [(0.7, 1.3), (2.6, 1.3), (1.3, 1.3), (3.1, 0.4), (0.25, -0.5)]

ALIKE = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": lambda a, b: a**b,
    "min": min,
    "max": max,
    "quotient_or_nan": lambda a, b: a / b,
    "quotient_or_zero": lambda a, b: a / b,
}
TRUTHS = {"less": lambda a, b: a < b, "at_most": lambda a, b: a <= b, "equal": lambda a, b: a == b}
ALONE = {
    "neg": lambda a: -a,
    "square": lambda a: a * a,
    "sqrt": math.sqrt,
    "abs": abs,
    "sign": lambda a: math.copysign(a != 0, a),
    **{name: getattr(math, name) for name in ("exp", "log", "sin", "cos", "tan", "atan")},
    "asin": lambda a: math.asin(a / 8),
    "acos": lambda a: math.acos(a / 8),
    "positive_part": lambda a: max(a, 0),
}
"""An operation on x, or on x/8, and on y."""

BOTH = {
    "and": lambda p, q: p and q,
    "or": lambda p, q: p or q,
}


def asked():
    """Every operation as a formula in x and y, with its expected value."""
    x, y = symbol("x"), symbol("y")
    found = {op: (make_node(op, x, y), f) for op, f in ALIKE.items()}
    chosen = {op: make_node("choose", make_node(op, x, y), x, 3) for op in TRUTHS}
    found |= {op: (chosen[op], lambda a, b, f=f: a if f(a, b) else 3) for op, f in TRUTHS.items()}
    found |= {
        op: (make_node(op, x / 8 if op in ("asin", "acos") else x), lambda a, b, f=f: f(a)) for op, f in ALONE.items()
    }
    for op, f in BOTH.items():
        condition = make_node(op, x < 2, y < 1)
        found[op] = make_node("choose", condition, x, y), lambda a, b, f=f: a if f(a < 2, b < 1) else b
    found["not"] = make_node("choose", ~(x < y), x, 3), lambda a, b: 3 if a < b else a
    found["choose"] = make_node("choose", x < y, x * x, y), lambda a, b: a * a if a < b else b
    found["negligible"] = make_node("choose", make_node("negligible", (x + 0.1) - 0.1 - x, x), y, 3), lambda a, b: b
    return found


@pytest.mark.parametrize("op", asked())
def test_operations_are_those_of_python(op):
    """Library functions are right to a few units in the last place, and balls contain the value."""
    node, truth = asked()[op]
    own = formula([node], ("x", "y"))
    points = [p for p in POINTS if op != "pow" or p[1] > -1]
    expected = [float(truth(*p)) for p in points]
    columns = dict(zip("xy", np.array(points).T, strict=True))
    assert values(own, columns)[0] == pytest.approx(expected, rel=1e-14, abs=1e-15)
    x = ca.SX.sym("x", 2)
    written = ca.Function("f", [x], [ca.SX(values(own, {"x": x[0], "y": x[1]})[0])])
    again = formula(values(own, {"x": symbol("x"), "y": symbol("y")}))  # nodes of nodes
    for point, value in zip(points, expected, strict=True):
        at = dict(zip("xy", point, strict=True))
        assert float(values(own, at)[0]) == float(values(again, at)[0]) == pytest.approx(value, rel=1e-14, abs=1e-15)
        assert float(written(point)) == pytest.approx(value, rel=1e-13, abs=1e-15)
        if op in BALLS.operations:
            exact = values(own, {n: flint.fmpq(*v.as_integer_ratio()) for n, v in at.items()})[0]
            ball = flint.arb(values(own, {n: flint.arb(v) for n, v in at.items()})[0])
            assert ball.overlaps(flint.arb(exact))
            assert op == "negligible" or float(ball.mid()) == pytest.approx(value, rel=1e-14, abs=1e-15)
        if op in INTERVALS.operations:
            over = fold(own, {n: flint.arb(v, 1e-3) for n, v in at.items()}, INTERVALS)[0]
            assert over.contains(flint.arb(value)) or not over.is_finite()


def test_no_operation_is_left_out():
    assert {*asked()} == {*FLOATS.operations} == {*CASADI.operations} == {*NODES.operations} - {"pi"}
    assert {*BALLS.operations} == {*FLOATS.operations} - {"sign"} | {"pi"}


def test_what_does_not_exist_is_nan_of_every_kind():
    x, y = symbol("x"), symbol("y")
    nodes = make_node("quotient_or_nan", x, y), make_node("quotient_or_zero", x, y), make_node("sqrt", -x)
    own, at, s = formula(nodes, ("x", "y")), {"x": 1.0, "y": 0.0}, ca.SX.sym("x", 2)
    written = ca.Function("f", [s], [ca.vertcat(*values(own, {"x": s[0], "y": s[1]}))])
    assert np.isnan(np.array(values(own, at), dtype=float)).all()
    assert np.isnan(np.array(written([1.0, 0.0])).ravel()[[0, 2]]).all()
    assert not any(flint.arb(x).is_finite() for x in values(own, {n: flint.arb(v) for n, v in at.items()}))
    nothing = formula([make_node("quotient_or_zero", x, y)], ("x", "y"))
    for zero in (0.0, np.zeros(3), flint.arb(0), flint.fmpq(0)):
        assert np.all(np.array([values(nothing, {"x": zero, "y": zero})[0] == 0]))


def test_where_a_ball_cannot_tell_both_choices_are_held():
    own = formula([make_node("choose", symbol("x") < 0, 1, 2)])
    found = values(own, {"x": flint.arb(0, 1)})[0]
    assert found.contains(1)
    assert found.contains(2)
    assert values(own, {"x": flint.arb(1)})[0] == 2
    assert not flint.arb(values(own, {"x": flint.arb_series([flint.arb(0, 1), 1], prec=2)})[0]).is_finite()


# Formulas


def test_constants_are_exact():
    """A constant has the value of its digits, and its double is the nearest one."""
    own = parse_value("0.1*x + 2*pi/3 - sqrt(1/3)", ["x"]).formula
    (found,) = fold(own, {"x": flint.fmpq(1)}, BALLS)
    with flint.ctx.workdps(60):
        assert (flint.arb(1) / 10 + 2 * flint.arb.pi() / 3 - (flint.arb(1) / 3).sqrt()).overlaps(found)
    assert parse_value("1/3 + 0.1", []).formula.constants == [Fraction(13, 30)]
    for text, value in {
        "1/3": 1 / 3,
        "1e-300/1e300": 0.0,
        "2*pi/3": 2 * math.pi / 3,
    }.items():
        assert as_double(parse_value(text, []).formula.constants[0]) == pytest.approx(value, rel=2e-16)


def test_what_is_certain_is_left_out():
    x, zero = symbol("x"), 0 * symbol("y")
    for same in (
        x + 0,
        0 + x,
        1 * x,
        x * 1,
        x / 1,
        x - 0,
        (-x).__neg__(),
        x**1,
        make_node("tan", make_node("atan", x)),
    ):
        assert same is x
    assert zero.fraction == (x - x).fraction == 0
    assert formula([x * 0.0]).inputs == ("x",)  # which makes of infinity what is no number
    assert [step.op for step in formula([x * x, x**2, x**0.5]).steps] == ["input", "square", "sqrt"]


def test_equal_parts_are_computed_once():
    own = trace(lambda v: [(v["x"] + v["y"]) ** 2, 3 / (v["x"] + v["y"])], ["x", "y"])
    assert [step.op for step in own.steps].count("add") == 1


def test_a_formula_does_not_ask_for_its_numbers():
    with pytest.raises(TypeError, match="choose"):
        bool(symbol("x") > 0)


def test_a_truth_among_numbers_is_1_or_0_of_every_kind():
    """Conditions count as 1 and 0, as in CasADi's derivative of max(x, y) at x = y; a number is true if it is not 0."""
    x, y = symbol("x"), symbol("y")
    kinks = gradients([make_node("max", x, y), make_node("min", x, y), abs(x - y)], [x, y])
    others = [
        2 * (x < y) + (x <= y),
        x < y,
        make_node("choose", x - y, 5, 7),
        make_node("choose", make_node("and", x < 2, y), 5, 7),
    ]
    slopes = formula([*(s for each in kinks for s in each), *others], "xy")
    for at, wanted in {
        (1.0, 1.0): (0.5, 0.5, 0.5, 0.5, 0, 0, 1, 0, 7, 5),
        (1.0, 2.0): (0, 1, 1, 0, -1, 1, 3, 1, 5, 5),
        (2.0, 1.0): (1, 0, 0, 1, 1, -1, 0, 0, 5, 7),
    }.items():
        assert fold(slopes, dict(zip("xy", at, strict=True)), FLOATS) == list(wanted)
        assert fold(slopes, dict(zip("xy", map(np.array, at), strict=True)), FLOATS) == list(wanted)
        assert [float(c) for c in fold(slopes, dict(zip("xy", map(ca.DM, at), strict=True)), CASADI)] == list(wanted)
        for (low, high), value in zip(ranges(slopes, [(a, a) for a in at]), wanted, strict=True):
            assert low <= value <= high <= low + 8 * math.ulp(max(1.0, value))


def test_functions_of_casadi_are_formulas():
    x, y = ca.SX.sym("x"), ca.SX.sym("y", 2)
    asked = [ca.sqrt(x) + y[0], ca.vertcat(x * x, 2 * y[1], 1 / x, ca.fabs(x - y[0]), ca.if_else(x < y[1], x, y[0]))]
    function = ca.Function("f", [x, y], [ca.densify(e) for e in asked])
    own = from_casadi(function)
    given = [0.7, 1.3, -0.4]
    expected = [float(v) for part in function(given[0], given[1:]) for v in part.full().ravel()]
    assert fold(own, dict(zip(own.names, given, strict=True)), FLOATS) == pytest.approx(expected, rel=1e-15)
    with pytest.raises(UnsupportedOperation, match="erf"):
        values(from_casadi(ca.Function("f", [x], [ca.erf(x)]), ["x"]), {"x": 1.0})


def test_an_exponent_stays_a_number_where_a_formula_is_split():
    """As a parameter of a solver it would have a derivative, with the logarithm of a negative base."""
    whole = trace(lambda v: [v["x"] ** 3 + 5 * v["c"]], ["x", "c"])
    names, early, late = whole.split(whole.dependent_steps(["x"]))
    assert fold(early, {"c": 2.0}, FLOATS) == [10.0]
    x, p = ca.SX.sym("x"), ca.SX.sym("p")
    slopes = ca.Function("f", [x, p], fold(late, {"x": x, **dict.fromkeys(names, p)}, CASADI)).jacobian()
    assert [float(d) for d in slopes(-2.0, 10.0, 0.0)] == [12.0, 1.0]
