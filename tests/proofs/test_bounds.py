"""The parts of a proof by branch and bound: interlacing, ranges, arithmetic, what SCIP is told."""

import math
import re
from fractions import Fraction

import casadi as ca
import flint
import numpy as np
import pytest

from tmsopt.algebra import REAL_LINE, UnsupportedOperation, ball, bound_roots, from_casadi, interval, ranges
from tmsopt.global_search import (
    FOUND,
    INFEASIBLE,
    SCIP,
    frequency_count,
    interlacing_conditions,
    make_task,
    squared_frequencies,
)
from tmsopt.problem import parse_value
from tmsopt.program import NLP
from tmsopt.roots import product


def nlp_of(variables, function, *limits):
    """An NLP of a function of CasADi."""
    names = [f":{k}" for k in range(len(variables))]
    return NLP("test", variables, from_casadi(function, names), {}, *limits)


def value_of(text, **at):
    """The value of an expression."""
    return parse_value(text, tuple(at))(at)


def decide(nlp, seconds=5.0, **options):
    return SCIP.decide(make_task(nlp, seconds, **options))


scip = pytest.mark.skipif(not SCIP.is_available, reason="SCIP is not installed")

# Interlacing. The polynomials are products of rational factors, so where their roots are is known without computing
# any, on the axis too.


def drawn_factors(rng, degree, rightmost):
    """Factors with roots left of the axis and on it, some of them several times; one to the right of it if asked."""

    def size():
        return Fraction(int(rng.integers(1, 9)), int(rng.integers(1, 5)))

    factors = []
    if rightmost:
        real = [Fraction(1), -size()]
        pair = [Fraction(1), -size() / 4, size()]
        factors.append(real if degree < 2 or rng.random() < 0.5 else pair)
    while (left := degree + len(factors) - sum(map(len, factors))) > 0:
        kinds = [[Fraction(1), Fraction(0)], [Fraction(1), size()]]
        if left > 1:
            kinds += [[Fraction(1), Fraction(0), size()], [Fraction(1), size() / 4, size()]]
        again = [f for f in factors[1 if rightmost else 0 :] if len(f) <= left + 1]
        one = kinds[rng.integers(len(kinds))]
        factors.append(again[-1] if again and rng.random() < 0.3 else one)
    return factors


def squares_exactly(c):
    """The zeros of the second part as balls of 600 bits, largest first; None where one is not real."""
    second = [x if k % 2 == 0 else -x for k, x in enumerate(c[1::2])]
    scale = math.lcm(*(x.denominator for x in second))
    found = flint.fmpz_poly([int(x * scale) for x in reversed(second)]).complex_roots()
    zeros = [z for z, times in found for _ in range(times)]
    return sorted((z.real for z in zeros), key=lambda x: -float(x)) if all(z.imag == 0 for z in zeros) else None


def as_ball(x):
    return x if isinstance(x, flint.arb) else flint.arb(flint.fmpq(x.numerator, x.denominator))


def holds(c, squares):
    """Whether the conditions hold. A number of such small heights that is not 0 is far larger than a ball of 600 bits."""
    balls = [as_ball(x) for x in c]
    equations, nonnegative = interlacing_conditions(balls, [(x, 1) for x in map(as_ball, squares)])
    return all(flint.arb(e).contains(0) for e in equations) and not any(flint.arb(e) < 0 for e in nonnegative)


@pytest.mark.parametrize("degree", range(2, 8))
@pytest.mark.parametrize("rightmost", [0, 1])
def test_squares_interlace_exactly_if_no_root_is_to_the_right(degree, rightmost):
    rng = np.random.default_rng([degree, rightmost])
    seen = 0
    for _ in range(40):
        c = product(*drawn_factors(rng, degree, rightmost))
        if c[1] == 0:
            continue  # with a sum of roots of 0 and none to the right, all are on the axis: the next test
        with flint.ctx.workprec(600):
            squares = squares_exactly(c)
            assert (squares is not None and holds(c, squares)) == (rightmost == 0), c
        seen += 1
    assert seen > 15


@pytest.mark.parametrize("pairs", [(4,), (4, 1), (4, 4), (9, 4, 1), (9, 4, 4), (1, 1, 1)])
@pytest.mark.parametrize("zeros", [0, 1])
def test_all_roots_on_the_axis(pairs, zeros):
    """p(iω) has no second part then; the squares are any that its first part leaves room for: the pairs themselves."""
    c = product(*([Fraction(1), Fraction(0), Fraction(x)] for x in pairs), *[[Fraction(1), Fraction(0)]] * zeros)
    squares = pairs[: frequency_count(len(c) - 1)]
    assert holds(c, squares)
    found = squared_frequencies([float(x) for x in c])  # a triple root scatters by 6e-6, the cube root of a rounding
    assert holds(c, [Fraction(x).limit_denominator(1000) for x in found])


@pytest.mark.parametrize("c", [(1, 0, 1, 0, 1), (1, 0, -5, 0, 4), (1, 0, 3, 0, -4), (1, 0, 1, 0, 1, 0)])
def test_even_polynomials_with_roots_to_the_right(c):
    """Whatever the squares: s⁴ + s² + 1, (s² − 1)(s² − 4) and (s² + 4)(s² − 1) have a root to the right."""
    fractions = [Fraction(x) for x in c]
    count = frequency_count(len(c) - 1)
    grid = [Fraction(k, 7) for k in range(60)]
    tried = [(x, *([x / 3] * (count - 1))) for x in grid]
    assert not any(holds(fractions, squares) for squares in tried)


def test_a_double_square_admits_more_than_the_theorem():
    """From degree 5 the conditions leave a gap, on the safe side: nothing stable is ever excluded.

    (t² + 4)(t³ + t² + t + 4) has roots to the right, since 1·1 < 1·4, but its second part has the double zero 4, where
    the first part vanishes.
    """
    c = [Fraction(x) for x in product([1, 0, 4], [1, 1, 1, 4])]
    assert holds(c, [4, 4])


@pytest.mark.parametrize("degree", range(2, 8))
def test_squares_are_found_for_known_coefficients(degree):
    """Within half the digits of a double, which a double zero loses."""
    rng = np.random.default_rng(degree)
    for _ in range(30):
        c = [float(x) for x in product(*drawn_factors(rng, degree, 0))]
        squares = squared_frequencies(c)
        assert len(squares) == frequency_count(degree)
        equations, nonnegative = interlacing_conditions(c, [(x, 1.0) for x in squares])
        size = max(c) * (1 + max(squares, default=0.0)) ** (degree // 2)
        assert max([*map(abs, equations), *(-e for e in nonnegative)]) <= 1e-7 * size


# Ranges

EXPRESSIONS = (
    "x + y*z - 2*x/(3 + y)",
    "x**2 - y**3 + z**4",
    "x**-1 + y**-2",
    "(1 + x**2)**0.5 * (2 + x)**2.5",
    "sin(x)*cos(y) + tan(z/4)",
    "asin(x/3) + acos(y/3) - atan(z)",
    "sqrt(3 + x) + exp(y) - log(4 + z)",
    "abs(x) + min(x, y) - max(y, z)",
    "(x - y)*(x - y) - x*x",
    "2**x + 3*pi",
)


def function(text, names=("x", "y", "z")):
    """x → the value of an expression."""
    x = {name: ca.SX.sym(name) for name in names}
    return ca.Function("f", [ca.vertcat(*x.values())], [ca.SX(parse_value(text, names)(x))])


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_values_lie_in_ranges(text):
    """CasADi's own values at points of boxes, corners among them; its roundings are below 1e-13 of sizes below 1e3."""
    f, rng = function(text), np.random.default_rng(len(text))
    bounded = 0
    for _ in range(20):
        middle, half = rng.uniform(-1, 1, 3), rng.choice([0.0, 1e-9, 0.1, 1.0], 3)
        box = list(zip(middle - half, middle + half, strict=True))
        ((lower, upper),) = ranges(from_casadi(f), box)
        bounded += math.isfinite(lower)
        points = middle[:, None] + half[:, None] * np.hstack([rng.uniform(-1, 1, (3, 40)), [[1, -1]] * 3])
        values = np.array(f(points)).ravel()
        values = values[np.isfinite(values)]
        slack = 1e-13 * (1 + np.abs(values))
        assert np.all(values >= lower - slack)
        assert np.all(values <= upper + slack)
    assert bounded > 5


@pytest.mark.parametrize("text", ["1/x", "x**-1", "x**-2", "y/x", "log(x)", "sqrt(x)", "tan(2*x)", "asin(2*x)"])
def test_what_may_not_exist_has_no_bounds(text):
    assert ranges(from_casadi(function(text)), [(-1, 1), (1, 2), (0, 0)]) == [REAL_LINE]


@pytest.mark.parametrize(("text", "most"), [("x**2 + y**4", 85), ("(x - y)**2", 25), ("x**2", 4)])
def test_squares_are_not_negative(text, most):
    """0 is reached, and so is the other end; within the 30 bits of the radius of a ball."""
    assert ranges(from_casadi(function(text)), [(-1, 2), (-3, 1), (0, 0)])[0] == pytest.approx(
        (0, most), abs=1e-8 * most
    )


@pytest.mark.parametrize("ends", [(-math.inf, 1.0), (0.0, math.inf), REAL_LINE, (math.nan, 1.0)])
def test_an_infinite_end_leaves_no_bounds(ends):
    assert interval(ball(ends)) == REAL_LINE


@pytest.mark.parametrize("degree", range(1, 7))
def test_no_root_is_larger_than_the_bound(degree):
    """NumPy's roots, within 1e-3: an n-fold root loses all but an n-th of the digits."""
    rng = np.random.default_rng(degree)
    for _ in range(50):
        c = np.poly(rng.integers(-3, 4, degree)) * rng.choice([-3.0, 0.01, 1.0])
        half = np.abs(c) * rng.uniform(0, 0.5, degree + 1)
        most = bound_roots(list(zip(c - half, c + half, strict=True)))
        for _ in range(5):
            found = np.roots(c + half * rng.uniform(-1, 1, degree + 1))
            assert np.abs(found).max(initial=0) <= most * (1 + 1e-3)


def test_roots_have_no_bound_where_one_may_be_at_infinity():
    for leading in ((0.0, 1.0), (-1.0, 1.0), (-1.0, 0.0)):
        assert bound_roots([leading, (1.0, 1.0), (1.0, 1.0)]) == math.inf


# What SCIP is told

ONE_OF_EACH = {
    "x + 2": (0.3, (-1, 2)),
    "1 - x": (0.3, (-1, 2)),
    "x*(x - 1)*(x + 1)": (0.3, (-1, 2)),
    "3/(2 + x)": (0.3, (-1, 2)),
    "x/(x**2 + 1)": (-0.7, (-2, 2)),
    "x**2": (-0.7, (-1, 2)),
    "x**3": (-0.7, (-1, 2)),
    "x**4 - x": (-0.7, (-1, 2)),
    "x**-1": (-0.7, (0.5, 2)),
    "x**-2": (-0.7, (-2, -0.5)),
    "x**0.5": (0.7, (0.2, 2)),
    "x**2.5": (0.7, (0.2, 2)),
    "x**-1.5": (0.7, (0.2, 2)),
    "x**x": (0.7, (0.1, 2)),
    "2**x": (0.7, (-1, 2)),
    "sin(x)": (2.5, (-1, 5)),
    "cos(x)": (2.5, (-1, 5)),
    "tan(x)": (-1.1, (-1, 1.2)),
    "asin(x)": (-0.7, (-0.9, 1)),
    "acos(x)": (-0.7, (-1, 0.9)),
    "atan(x)": (-7.0, (-5, 2)),
    "sin(atan(x)) - cos(atan(x))*x**2": (-7.0, (-2, 2)),
    "tan(atan(x)) + atan(x)**2": (-0.7, (-2, 2)),
    "sqrt(x)": (0.7, (0, 2)),
    "exp(x)": (-0.7, (-1, 2)),
    "log(x)": (0.7, (0.2, 2)),
    "abs(x)": (-0.7, (-1, 2)),
    "min(x, 1 - x)": (-0.7, (-1, 2)),
    "max(x, 1 - x)": (-0.7, (-1, 2)),
    "max(x, 0)**1.5 - x": (-0.7, (-1, 2)),
    "1000*x - 2000": (0.3, (-1, 2)),
    "1e-3*sin(x)": (0.3, (-1, 2)),
}


def least(text, ends, sign=1.0):
    """minimise ± an expression of one x."""
    x = ca.SX.sym("x")
    f = ca.Function("f", [x], [sign * ca.SX(value_of(text, x=x)), ca.SX(0, 1)])
    return nlp_of(("x",), f, (float(ends[0]),), (float(ends[1]),), (), (), ())


@scip
@pytest.mark.parametrize("text", ONE_OF_EACH)
def test_every_operation_is_what_it_is(text):
    """With x known, no value is possible but that of NumPy; within the 1e-6 of the size that a bound is moved by."""
    at, _ = ONE_OF_EACH[text]
    value = float(value_of(text, x=at))
    for sign in (1.0, -1.0):
        decision = decide(least(text, (at, at), sign), minimise=True)
        assert decision.verdict == FOUND
        assert decision.bound == pytest.approx(sign * value, abs=3e-6 * (1 + abs(value)))
        assert decision.bound <= sign * value


@scip
@pytest.mark.parametrize("text", ONE_OF_EACH)
@pytest.mark.slow
def test_no_value_is_below_the_bound(text):
    """Values at 30 001 points, 0 and 1 among them, their least within 1e-6 of the true one; a bound is moved by as much."""
    _, ends = ONE_OF_EACH[text]
    values = value_of(text, x=np.linspace(*ends, 30001))
    for sign in (1.0, -1.0):
        lowest = float((sign * values).min())
        decision = decide(least(text, ends, sign), minimise=True)
        assert decision.verdict == FOUND
        assert lowest - 1e-5 * (1 + abs(lowest)) <= decision.bound <= lowest


def constrained(texts, ends, most=0.0):
    """Whether there are x, y with every expression ≤ most."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    rows = [ca.SX(value_of(text, x=x, y=y)) for text in texts]
    f = ca.Function("f", [ca.vertcat(x, y)], [ca.SX(0), ca.vertcat(*rows)])
    lower, upper = zip(*ends, strict=True)
    count = len(texts)
    return nlp_of(("x", "y"), f, lower, upper, tuple(texts), (-math.inf,) * count, (most,) * count)


@scip
@pytest.mark.parametrize(
    ("texts", "possible"),
    [
        (("x**2 + y**2 - 1", "1.42 - x - y"), False),  # the line is √2 from 0 at its nearest: 1.4142
        (("x**2 + y**2 - 1", "1.41 - x - y"), True),
        (("max(x - 1, 0)**1.5", "1 - x"), True),  # x = 1 exactly, where the base is 0
        (("max(x, 0)**1.5",), True),
        (("x**2*(x**2)**0.25",), True),  # x = 0
        (("sqrt(x) + 0.001",), False),
        (("1/x - 1e6", "x - 1e-7", "1e-9 - x"), False),
        (("(x - 1)**2 + 1 - 1/y", "y - 0.999"), True),
        (("(x - 1)**2 + 1 - 1/y", "1.001 - y"), False),
    ],
)
def test_possible_and_impossible(texts, possible):
    decision = decide(constrained(texts, [(-2, 2), (0.5, 2)]))
    assert decision.verdict == (FOUND if possible else INFEASIBLE)
    if possible:
        x, y = decision.point
        values = [float(value_of(t, x=x, y=y)) for t in texts]
        assert max(values) <= 1e-6
    else:
        assert decision.bound == math.inf


@scip
@pytest.mark.parametrize("text", ["x**2 - y", "x*y - y**3", "sin(x) - x", "log(x)**2 - y", "1/x - y", "sqrt(x) - y"])
@pytest.mark.parametrize("width", [0.0, 1e-15, 1e-12, 1e-9])
def test_hardly_any_room_is_room(text, width):
    """Summands cancel in a narrow box, and what is left of them is not known to more digits than they are."""
    centre = {"x": 1.7, "y": 0.9}
    value = float(value_of(text, **centre))
    ends = [(v - width, v + width) for v in centre.values()]
    rows = [f"{text} - ({value!r})", f"{value!r} - ({text})"]
    assert decide(constrained(rows, ends)).verdict == FOUND


def drawn_expression(rng, depth):
    """Any expression of x and y."""
    if depth == 0 or rng.random() < 0.15:
        return str(rng.choice(["x", "y", "x", "y", f"{rng.uniform(-2, 2):.3g}"]))
    a, b = drawn_expression(rng, depth - 1), drawn_expression(rng, depth - 1)
    a = a if re.search(r"\b[xy]\b", a) else "x"  # numbers alone may have no value, and are refused then
    one = [f"{f}({a})" for f in ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "abs")]
    powers = [f"({a})**{n}" for n in (2, 3, -1, -2, 0.5, 2.5)]
    two = [f"({a}) {op} ({b})" for op in "+-*/"] * 2 + [f"min({a}, {b})", f"max({a}, {b})"]
    return str(rng.choice([str(rng.choice(one)), str(rng.choice(powers)), str(rng.choice(two)), str(rng.choice(two))]))


@scip
@pytest.mark.parametrize("seed", range(30))
@pytest.mark.slow
def test_what_is_possible_is_never_called_impossible(seed):
    """Values that an expression has at points of the box, its corners and its middle among them, it can have."""
    rng = np.random.default_rng(seed)
    text = drawn_expression(rng, 4)
    box = np.array([[-1.0, 1.5], [0.25, 2.0]])
    points = np.vstack([box.T, box.mean(axis=1)[None], [[0.0, 1.0]], rng.uniform(*box.T, (30, 2))])
    values = np.broadcast_to(value_of(text, x=points[:, 0], y=points[:, 1]), len(points))
    known = values[np.isfinite(values) & (np.abs(values) < 1e3)]
    for value in (known.min(), known.max(), known[0]) if len(known) else ():
        slack = 1e-8 * (1 + abs(value))
        rows = [f"{text} - ({float(value + slack)!r})", f"({float(value - slack)!r}) - ({text})"]
        assert decide(constrained(rows, box.tolist()), 0.5).verdict != INFEASIBLE, (text, value)


@scip
def test_a_row_without_variables():
    for value, verdict in ((1.0, INFEASIBLE), (-1.0, FOUND)):
        x = ca.SX.sym("x", 2)
        f = ca.Function("f", [x], [ca.SX(0), ca.vertcat(ca.SX(value))])
        nlp = nlp_of(("x", "y"), f, (0.0, 0.0), (1.0, 1.0), ("row",), (-math.inf,), (0.0,))
        assert decide(nlp).verdict == verdict


@scip
def test_an_operation_that_scip_lacks_is_named():
    x = ca.SX.sym("x")
    f = ca.Function("f", [x], [ca.floor(x), ca.SX(0, 1)])
    with pytest.raises(UnsupportedOperation, match="floor"):
        decide(nlp_of(("x",), f, (0.0,), (1.0,), (), (), ()))
