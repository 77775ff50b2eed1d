"""Error bounds hold, by ball arithmetic at 300 bits, and are not much too wide."""

from importlib import import_module

import flint
import numpy as np
import pytest

from tmsopt.algebra import BALLS, Bounded, as_bounded

kinds = import_module("tmsopt.algebra.kinds")
ball_maximum, ball_minimum, quotient_or_nan = (
    getattr(kinds, name) for name in ["ball_maximum", "ball_minimum", "quotient_or_nan"]
)

FORMULAS = {
    "mixed": lambda a, b: (a * b + a) * (b / a) - 1 / b,
    "root": lambda a, b: abs(a * a + b).sqrt(),
    "cancels": lambda a, b: (a + b) * (a - b) - (a * a - b * b) + a,
    "power": lambda a, b: a**5 - b**-2,
    "sin": lambda a, b: a.sin(),
    "cos": lambda a, b: (30 * b).cos(),
    "tan": lambda a, b: (a / 2).tan(),
    "exp": lambda a, b: a.exp() * b.atan(),
    "log": lambda a, b: (a * a).log() - (3 + b),
    "asin": lambda a, b: (a / 4).asin(),
    "acos": lambda a, b: (b / 4).acos(),
    "fraction": lambda a, b: flint.fmpq(1, 3) * a - b * flint.fmpq(2, 7),
    "irrational": lambda a, b: BALLS.operations["pow"](abs(a), flint.fmpq(2, 3)),
    "greater": lambda a, b: ball_maximum(a * b, quotient_or_nan(a, b)),
    "lesser": ball_minimum,
}


@pytest.mark.parametrize("name", FORMULAS)
@pytest.mark.parametrize("share", [0.0, 1e-12])
def test_no_number_is_farther_off_than_it_says(name, share):
    rng = np.random.default_rng(0)
    a, b = rng.uniform(-3, 3, (2, 150))
    found = FORMULAS[name](Bounded(a, share * np.abs(a)), Bounded(b, share * np.abs(b)))
    with flint.ctx.workprec(300):
        for k in range(len(a)):
            ends = [
                flint.arb(float(x[k])) * (1 + share * flint.arb(move))
                for x, move in zip((a, b), rng.uniform(-1, 1, 2), strict=True)
            ]
            true = FORMULAS[name](*ends)
            assert abs(flint.arb(float(found.value[k])) - true) <= flint.arb(float(found.error[k]))
    typical = np.median(found.error / (1 + np.abs(found.value)))
    assert typical <= 100 * (share + 2.0**-50)


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 7])
def test_roots_of_a_degree(degree):
    x = np.random.default_rng(1).uniform(-3, 3, 200)
    found = Bounded(x, 1e-13 * np.abs(x)).root(degree)
    for moved in (x * (1 - 1e-13), x, x * (1 + 1e-13)):
        true = np.sign(moved) * np.abs(moved) ** (1 / degree) if degree % 2 else np.maximum(moved, 0) ** (1 / degree)
        assert np.all(np.abs(found.value - true) <= found.error + 4e-16)  # the roundings of what is true


def test_what_does_not_exist_is_never_known():
    zero, one = Bounded(np.zeros(1), np.zeros(1)), Bounded(np.ones(1), np.zeros(1))
    near = Bounded(np.ones(1), 2 * np.ones(1))
    with np.errstate(all="ignore"):
        lost = (
            one / zero,
            (zero - one).sqrt(),
            (one - one) / (one - one),
            Bounded(np.array([1e300]), np.zeros(1)) * 1e300,
            1.0 / near,
            near.log(),
            near.sqrt(),
            near.asin(),
            (1.5707963 * near).tan(),
        )
        for number in lost:
            assert not number.is_known_within(1.0).any()
            for choice in (
                ball_maximum(number, 1.0),
                ball_maximum(1.0, number),
                ball_minimum(number, 1.0),
                ball_minimum(1.0, number),
            ):
                assert not choice.is_known_within(1.0).any()


def test_exact_fractions_and_balls_keep_their_digits():
    for number, value in ((flint.fmpq(1, 3), 1 / 3), (flint.arb.pi(), np.pi), (flint.fmpq(2**70 + 1), 2.0**70)):
        found = as_bounded(number)
        assert found.value == value
        assert found.is_known_within(1e-15)
