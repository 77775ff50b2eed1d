"""What branch and prune is made of: boxes that never lose a zero, and identities of angles."""

import math
from contextlib import suppress
from fractions import Fraction
from importlib import import_module
from itertools import combinations_with_replacement, product

import numpy as np
import pytest

from tmsopt.algebra import NODES, fold
from tmsopt.global_search import BoxConditions, prune

pruning = import_module("tmsopt.global_search.pruning")
formula, make_node, symbol = (
    getattr(import_module("tmsopt.algebra.formula"), n) for n in ("formula", "make_node", "symbol")
)
multiply_out = import_module("tmsopt.algebra.identity").multiply_out

NAMES = ("x", "y", "z")
nothing = ()
ROUNDS = 30


def drawn(rng, depth):
    """A formula in x, y, z, and the same as a function of fractions."""
    if depth == 0:
        k = int(rng.integers(5))
        constant = Fraction(int(rng.integers(-8, 9)), 4)
        if k > 2:
            return constant, lambda at: constant
        return symbol(NAMES[k]), lambda at: at[k]
    (one, f), (other, g) = drawn(rng, depth - 1), drawn(rng, depth - 1)
    match int(rng.integers(3)):
        case 0:
            return one + other, lambda at: f(at) + g(at)
        case 1:
            return one - other, lambda at: f(at) - g(at)
    return one * other, lambda at: f(at) * g(at)


def pruned(equations, box, least=1e-7, turns=60, limits=nothing):
    """Arrays that hold what is left of a box."""
    names = equations.names
    equations = pruning.prepare_formula(equations)
    conditions = BoxConditions(
        equations,
        pruning.prepare_formula(formula(limits or [], names)),
        tuple(hi - lo for lo, hi in box),
        formula([], names),
    )
    waiting, kept = np.array(box).T[..., None], []
    for _ in range(turns):
        found = prune(conditions, waiting[..., -512:], least)
        kept += [found.proved[1], found.small]
        waiting = np.concatenate([waiting[..., :-512], found.remaining], axis=-1)
    return np.concatenate([*kept, waiting], axis=-1)


def holds(boxes, at):
    """Whether some box has a point of fractions."""
    return any(all(lo <= c <= hi for lo, hi, c in zip(*box, at, strict=True)) for box in np.moveaxis(boxes, -1, 0))


def test_no_box_loses_a_zero():
    """Systems with a zero planted at a fraction, mid in the box or on an end of it, singular ones among them."""
    rng = np.random.default_rng(0)
    for _ in range(ROUNDS):
        at = [Fraction(int(rng.integers(-4, 5)), 2) for _ in NAMES]
        equations = []
        for left, function in (drawn(rng, 3) for _ in NAMES):
            equations.append(left - function(at))
        reach = [(float(rng.choice([0, 1, 2.5])), float(rng.choice([0, 0.5, 3]))) for _ in NAMES]
        box = tuple((float(c) - lo, float(c) + hi) for c, (lo, hi) in zip(at, reach, strict=True))
        assert holds(pruned(multiply_out(formula(equations, NAMES)), box, turns=12), at)


X, Y = symbol("x"), symbol("y")
NAMED = {name: getattr(math, name) for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan")}
NAMED |= {"abs": abs, "neg": lambda a: -a, "square": lambda a: a * a}
OPERATIONS = {
    **{name: (make_node(name, X), lambda a, _, f=f: f(a)) for name, f in NAMED.items()},
    **{f"power {n}": (X**n, lambda a, _, n=n: a**n) for n in (-3, -2, -1, 2, 3, 4, 5)},
    "div": (make_node("div", X, Y), float.__truediv__),
    "sub": (make_node("sub", X, Y), float.__sub__),
}
PAIRS = [*combinations_with_replacement((-2.0, -0.7, 0.0, 0.3, 0.9, 2.5), 2)]


@pytest.mark.parametrize("name", OPERATIONS)
def test_no_operation_loses_a_point_or_a_slope(name):
    """Ranges, slopes and contraction hold what a point of the box has, for boxes with and without their ends in order."""
    node, function = OPERATIONS[name]
    asked = pruning.prepare_formula(formula([node], ("x", "y")))
    others = PAIRS if name in ("div", "sub") else PAIRS[8:9]
    ends = np.array([*product(PAIRS, others)]).T  # of every box, its ends by x and y
    with np.errstate(all="ignore"):
        low, high = pruning._evaluate_ranges(asked, ends)[asked.outputs[0]]
        slopes = pruning._evaluate_slopes(asked, ends)[:, 0]
    step = 1e-6
    for share in (0.0, 0.25, 1.0):
        points = np.minimum(ends[0] + share * (ends[1] - ends[0]), ends[1])
        for k, (a, b) in enumerate(points.T.tolist()):
            with suppress(ValueError, ZeroDivisionError):  # where the function ends
                value = function(a, b)
                assert low[k] <= value <= high[k]
                level = formula([fold_minus(asked, value), Y - Fraction(b)], ("x", "y"))
                with np.errstate(all="ignore"):
                    own, kept = pruning._contract(pruning.prepare_formula(level), ends[..., k : k + 1], 0.0)
                assert kept[0], (ends[:, :, k], a, b)
                assert np.all((own[0, :, 0] <= [a + 1e-9, b + 1e-9]) & (own[1, :, 0] >= [a - 1e-9, b - 1e-9]))
                slope = (function(a + step, b) - function(a - step, b)) / (2 * step)
                if np.isfinite(slopes[:, :, k]).all() and ends[0, 0, k] + step <= a <= ends[1, 0, k] - step:
                    assert slopes[0, 0, k] - 1e-4 <= slope <= slopes[1, 0, k] + 1e-4


def fold_minus(asked, value):
    """A formula less a number, as a node."""
    return fold(asked, {n: symbol(n) for n in asked.names}, NODES)[0] - Fraction(value)


def test_zeros_without_limits_and_where_functions_end():
    """A variable without ends, x = y² and y = 3; sqrt(x − 1) = 1; |x| = 2 within what a limit leaves."""
    x, y = symbol("x"), symbol("y")
    left = pruned(formula([x - y * y, y - 3], ("x", "y")), ((-np.inf, np.inf), (-10.0, 10.0)))
    assert np.allclose(left[..., 0].T, [[9, 9], [3, 3]], atol=1e-6)
    (ends,) = pruned(formula([make_node("sqrt", x - 1) - 1], ("x",)), ((-5.0, 5.0),)).T[0]
    assert ends == pytest.approx([2, 2], abs=1e-6)
    boxes = pruned(formula([make_node("abs", x) - 2], ("x",)), ((-5.0, 5.0),), limits=[-x])
    assert holds(boxes, [-2])
    assert not holds(boxes, [2])


@pytest.mark.parametrize("power", [-1, -3])
def test_a_pole_has_no_slope(power):
    """x⁻¹ + 1 falls on both sides of 0, but not from one to the other: by slopes alone the zero at −1 would be lost."""
    assert holds(pruned(formula([symbol("x") ** power + 1], ("x",)), ((-2.0, 2.1),)), [-1])


def test_identities_of_angles():
    t = symbol("x")
    angle = make_node("atan", t)
    assert make_node("tan", angle) is t
    sine, cosine = make_node("sin", angle), make_node("cos", angle)
    assert multiply_out(formula([sine - t * cosine])).constants == [0]
    assert multiply_out(formula([Fraction(1, 2) + t - t])).constants == [Fraction(1, 2)]
    assert multiply_out(formula([(t / 4) ** 3 * 64 - t * t * t])).constants == [0]
