"""Numbers of twice the digits: their bounds hold, by ball arithmetic at 300 bits."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import flint
import numpy as np
import pytest

from tmsopt.arithmetic import greater, lesser
from tmsopt.arithmetic.twofold import Twofold, twofold

FORMULAS: dict[str, Callable[[Any, Any], Any]] = {
    "mixed": lambda a, b: (a * b + a) * (b / a) - 1 / b, "root": lambda a, b: abs(a * a + b).sqrt(),
    "cancels": lambda a, b: (a + b) * (a - b) - (a * a - b * b) + a, "power": lambda a, b: a**5 - b**-2,
    "sin": lambda a, b: a.sin(), "cos": lambda a, b: (30 * b).cos(), "tan": lambda a, b: (a / 1000).tan(),
    "exp": lambda a, b: a.exp() * b.atan(),
}  # fmt: skip


@pytest.mark.parametrize("name", FORMULAS)
def test_no_number_is_farther_off_than_it_says(name: str) -> None:
    a, b = np.random.default_rng(0).uniform(-3, 3, (2, 400))
    found = FORMULAS[name](Twofold(a), Twofold(b))
    double, certain = found.nearest()
    with flint.ctx.workprec(300):
        for k in range(len(a)):
            true = FORMULAS[name](flint.arb(float(a[k])), flint.arb(float(b[k])))
            error = abs(flint.arb(float(found.high[k])) + flint.arb(float(found.low[k])) - true)
            assert error <= flint.arb(float(found.off[k]))
            assert not certain[k] or double[k] == float(true)
    assert certain.mean() > 0.99
    assert np.all(found.off <= 1e-22 * (1 + np.abs(found.high)))


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 7])
def test_roots_of_a_degree(degree: int) -> None:
    x = np.random.default_rng(1).uniform(-3, 3, 200)
    found = Twofold(x).root(degree)
    with flint.ctx.workprec(300):
        for k, value in enumerate(x.tolist()):
            size = flint.arb(abs(value)).root(degree)
            true = size if value > 0 else -size if degree % 2 else flint.arb(0)
            off = abs(flint.arb(float(found.high[k])) + flint.arb(float(found.low[k])) - true)
            assert off <= flint.arb(float(found.off[k]) + 1e-60)


def test_what_does_not_exist_is_never_certain() -> None:
    zero, one = Twofold(np.zeros(1)), Twofold(np.ones(1))
    with np.errstate(all="ignore"):
        for lost in (one / zero, (zero - one).sqrt(), (one - one) / (one - one), Twofold(np.array([1e300])) * 1e300):
            assert not lost.nearest()[1].any()
            for choice in (greater(lost, 1.0), greater(1.0, lost), lesser(lost, 1.0), lesser(1.0, lost)):
                assert not choice.nearest()[1].any()


def test_exact_fractions_keep_their_digits() -> None:
    third = twofold(flint.fmpq(1, 3))
    assert abs(Fraction(third.high) + Fraction(third.low) - Fraction(1, 3)) <= Fraction(third.off) < 1e-30
