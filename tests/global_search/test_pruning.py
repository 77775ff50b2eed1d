"""What branch and prune is made of: boxes that never lose a zero, and identities of angles."""

from fractions import Fraction
from importlib import import_module

import numpy as np
import pytest

from tmsopt.global_search import Puzzle, available, prune
from tmsopt.killable import Killable

formula, made, symbol = (getattr(import_module("tmsopt.algebra.formula"), n) for n in ("formula", "made", "symbol"))
multiplied_out = import_module("tmsopt.algebra.identity").multiplied_out

NAMES = ("x", "y", "z")
nothing = formula([], NAMES)
ROUNDS = 60


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


@pytest.mark.skipif(not available(), reason="codac is not installed")
def test_no_box_loses_a_zero():
    """Systems with a zero planted at a fraction, mid in the box or on an end of it, singular ones among them."""
    worker = Killable()
    rng = np.random.default_rng(0)
    try:
        for _ in range(ROUNDS):
            at = [Fraction(int(rng.integers(-4, 5)), 2) for _ in NAMES]
            equations = []
            for left, function in (drawn(rng, 3) for _ in NAMES):
                equations.append(left - function(at))
            reach = [(float(rng.choice([0, 1, 2.5])), float(rng.choice([0, 0.5, 3]))) for _ in NAMES]
            box = tuple((float(c) - lo, float(c) + hi) for c, (lo, hi) in zip(at, reach, strict=True))
            asked = multiplied_out(formula(equations, NAMES))
            puzzle = Puzzle(asked, nothing, tuple(hi - lo for lo, hi in box), nothing)
            pruned = worker.call(prune, puzzle, [box], [], 0.2, 50, 1e-7).result(timeout=60)
            left = [*pruned.left, *pruned.met, *pruned.small]
            assert any(all(lo <= c <= hi for c, (lo, hi) in zip(at, b, strict=True)) for b in left)
    finally:
        worker.end()


@pytest.mark.skipif(not available(), reason="codac is not installed")
@pytest.mark.parametrize("power", [-1, -3])
def test_a_pole_has_no_slope(power):
    """x⁻¹ + 1 falls on both sides of 0, but not from one to the other: by slopes alone the zero at −1 would be lost."""
    worker = Killable()
    asked, box = formula([symbol("x") ** power + 1], ("x",)), ((-2.0, 2.1),)
    none = formula([], ("x",))
    try:
        pruned = worker.call(prune, Puzzle(asked, none, (4.1,), none), [box], [], 1.0, 50, 1e-7).result(timeout=60)
    finally:
        worker.end()
    assert any(lo <= -1 <= hi for ((lo, hi),) in (*pruned.left, *pruned.met, *pruned.small))


def test_identities_of_angles():
    t = symbol("x")
    angle = made("atan", t)
    assert made("tan", angle) is t
    sine, cosine = made("sin", angle), made("cos", angle)
    assert multiplied_out(formula([sine - t * cosine])).constants == [0]
    assert multiplied_out(formula([Fraction(1, 2) + t - t])).constants == [Fraction(1, 2)]
    assert multiplied_out(formula([(t / 4) ** 3 * 64 - t * t * t])).constants == [0]
