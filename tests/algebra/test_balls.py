"""Formulas over balls: the same value as at 60 digits, certain enclosures, and nan where nothing exists."""

import math
import re
from importlib import import_module

import flint
import numpy as np
import pytest
from helpers.designs import designs
from mpmath import mp

from tmsopt.algebra import BALLS, exact
from tmsopt.models import FUNCTIONS, Values, tms, to_si
from tmsopt.problem import parse_comparison, parse_value

kinds = import_module("tmsopt.algebra.kinds")
HALF = flint.fmpq(1, 2)


def series(x):
    return flint.arb_series([flint.arb(x), 1], prec=2)


@pytest.mark.parametrize("of", tms.sets, ids=lambda s: s.name)
def test_every_quantity_of_balls_encloses_what_doubles_give(of):
    """Balls and exact fractions agree with doubles to the conditioning of doubles, and are nan where doubles are nan."""
    seen = 0
    for native in designs(30):
        p = to_si(native, w=1.7, m_B=11.0) if of.name == "SI" else native
        names = [q.name for q in (*tms.quantities, *of.quantities)]
        plain = Values(tms, of, p)
        with flint.ctx.workdps(60):
            for convert in (exact, flint.arb):
                balls = Values(tms, of, {n: convert(v) for n, v in p.items()})
                for name in names:
                    ball = flint.arb(balls[name])
                    if math.isnan(plain[name]):
                        assert not ball.is_finite()
                    else:
                        assert float(ball) == pytest.approx(float(plain[name]), rel=1e-9, abs=1e-13)
                        assert ball.rad() <= abs(ball) * 1e-45 + 1e-45
                        seen += 1
    assert seen > 250


def test_a_weave_speed_of_0_is_exactly_0():
    """ζ_B = ζ_H and χ_H = 1 in SI: x_H/w − 1 and z_B/w − z_H/w are exactly 0 in fractions, perhaps not in doubles."""
    given = dict(zip(tms.sets[1].names, (0.7, 3.0, 9.81, 0.2, 9.0, 0.9, -0.3, 1.0, 0.7, -0.3), strict=True))
    assert Values(tms, tms.sets[1], {n: exact(v) for n, v in given.items()})["Fr_c"] == 0


ORACLE = {
    **{name: getattr(mp, name) for name in FUNCTIONS[:9]},
    "abs": abs,
    "min": min,
    "max": max,
    "pi": mp.pi,
}


@pytest.mark.parametrize(
    "text",
    [
        *(f"{name}(x)" for name in FUNCTIONS[:10]),
        "max(x, y, 0.3)",
        "min(y, x, 2)",
        "(-x)**3 - x**-3",
        "x**0.5*y**x",
        "x/3 - pi*abs(x - y) + one/7",
    ],
)
def test_expressions_over_balls_enclose_the_60_digit_value(text):
    x, y = 0.7, 1.9
    tree = parse_value(text.replace("one", "1"), ["x", "y"])
    with mp.workdps(60), flint.ctx.workdps(50):
        names = {**ORACLE, "x": mp.mpf(x), "y": mp.mpf(y), "one": mp.mpf(1), "mpf": mp.mpf, "__builtins__": {}}
        exactly = re.sub(r"\d+\.\d+", lambda number: f"(mpf({number[0]!r}))", text)  # as written, not as doubles
        wanted = mp.mpf(eval(exactly, names))
        for convert in (exact, flint.arb):
            got = tree.of({"x": convert(x), "y": convert(y)}, BALLS)
            assert abs(flint.arb(got) - flint.arb(mp.nstr(wanted, 60))) < flint.arb(10) ** -45
        got = tree.of({"x": series(x), "y": flint.arb(y)}, BALLS)
        slope = got[1] if isinstance(got, flint.arb_series) else flint.arb(0)
        step = mp.mpf(10) ** -15
        up, down = (mp.mpf(eval(exactly, {**names, "x": mp.mpf(x) + s})) for s in (step, -step))
        assert float(slope) == pytest.approx(float((up - down) / (2 * step)), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("text", ["log(-x)", "asin(2*x)", "x/(y - y)", "(-x)**0.5"])
def test_expressions_without_a_value_are_nan(text):
    got = parse_value(text, ["x", "y"]).of({"x": exact(0.7), "y": exact(1.9)}, BALLS)
    assert not flint.arb(got).is_finite()


def test_a_comparison_over_balls_is_left_minus_right():
    """A number has the value of all its digits, and a quotient of numbers is a fraction."""
    for text in ("0.1", "1/10", "0.1000", "1e-1", "0.30000000000000004444 - 0.20000000000000004444"):
        got = parse_comparison(f"x >= {text}", ["x"]).of({"x": exact(0.5)}, BALLS)
        assert got == flint.fmpq(1, 2) - flint.fmpq(1, 10)


def test_choices_and_magnitudes_of_balls():
    """Decided choices are exact, undecided ones enclose both cases, and floats and arrays keep their type."""
    wide, slope = flint.arb(0, 0.5), flint.arb_series([flint.arb(0, 0.5), 3], prec=2)
    assert kinds.ball_maximum(exact(2), exact(1)) == kinds.ball_minimum(exact(2), flint.arb(3)) == 2
    assert kinds.ball_maximum(wide, flint.arb(0)).contains(flint.arb(0.5))
    assert all(kinds.magnitude(slope)[1].contains(flint.arb(x)) for x in (-3, 3))
    assert kinds.ball_minimum(slope, flint.arb(0))[1].contains(flint.arb(3))
    assert (kinds.magnitude(series(-2.0))[1], kinds.positive_part(series(2.0))[1]) == (-1, 1)
    assert kinds.ball_maximum(series(-2.0), flint.arb(1)) == 1
    assert (kinds.sqrt(exact(0.25)), kinds.tan(exact(0)), BALLS.operations["pow"](exact(4), HALF)) == (HALF, 0, 2)
    np.testing.assert_array_equal(kinds.quotient_or_nan(np.array([1.0, 1.0]), np.array([2.0, 0.0])), [0.5, np.nan])
