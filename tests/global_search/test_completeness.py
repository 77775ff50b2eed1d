"""Designs that are proved to be all: closed forms, counts by elimination, limits, and what cannot be decided."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
import sympy as sp
from helpers.places import PROBLEMS
from mpmath import acos, atan, cos, mpf, nstr, pi, sqrt, workdps

from tmsopt import Problem, load, solve_all
from tmsopt.global_search import prove_completeness
from tmsopt.models import from_coefficients
from tmsopt.roots import pattern as pattern_of_name

DIGITS = mpf(10) ** -22  # of 25 that are given

x, y, z = (ca.SX.sym(n) for n in "xyz")

pytestmark = pytest.mark.slow


def of_file(name, **changes):
    return prove_completeness(replace(load(PROBLEMS / f"{name}.toml"), **changes).posed)


def of_row(row, pattern, box=(-4.0, 4.0), constraints=None, **options):
    """The designs of a polynomial in x, y, z with a pattern."""
    model = from_coefficients(row)
    free = dict.fromkeys(sorted(model.sets[0].names), box)
    return prove_completeness(Problem(model, free=free, locate=pattern, constraints=constraints or {}).posed, **options)


def check_all(result, designs):
    """Check that these are proved to be all designs, to the last digits."""
    assert result.complete
    assert not any(result.limits)
    proved = [[mpf(n.value) for n in design.values()] for design in result.designs]
    order = [sorted(rows, key=lambda row: [*map(float, row)]) for rows in (proved, designs)]
    for row, expected in zip(*order, strict=True):
        assert all(abs(a - b) < DIGITS * (1 + abs(b)) for a, b in zip(row, expected, strict=True))


def places(result, name="x"):
    """A parameter of each design."""
    return [float(design[name]) for design in result.designs]


@pytest.fixture(autouse=True)
def digits():
    with workdps(40):
        yield


# Closed forms


def test_the_ep4_of_the_paper():
    """tan λ_s = 15/4 − 75 √2/32, χ_B = √2, Fr = 3 √(110 √2 − 120)/8 (Kirillov 2018)."""
    root = sqrt(2)
    tilt = atan(mpf(15) / 4 - 75 * root / 32)
    check_all(of_file("ep4_matching"), [[root, 3 * sqrt(110 * root - 120) / 8, tilt]])


def test_the_four_cep2_of_a_coupled_pair():
    """c2 = 11/10 with k = 1/8 ∓ √106/20, c2 = −11/10 with k = 9/50 ∓ 3 √435/100."""
    one, other = sqrt(106) / 20, 3 * sqrt(435) / 100
    tenths = mpf(11) / 10
    designs = [[tenths, mpf(1) / 8 + s * one] for s in (-1, 1)]
    designs += [[-tenths, mpf(9) / 50 + s * other] for s in (-1, 1)]
    check_all(of_file("coupled_pair"), designs)


def test_the_optimised_benchmark_is_the_only_bicycle():
    """χ_B = 119/100 exactly: a1 = 4 a0 and a3 = 4 a4 at s = −1, whatever the others are."""
    found = of_file("optimised_benchmark")
    assert found.complete
    (design,) = found.designs
    assert design["chi_B"].contains("1.19")
    assert [float(design[n]) for n in ("Fr", "mu", "lambda_s")] == pytest.approx(
        [2.337214017, 20.84626701, 0.8514403685]
    )


def test_the_three_controllers_with_one_root():
    """(s⁴ + 2 s²)(s² + x1 s + x0) + y2 s² + y1 s + y0 = (s − r)⁶: x1 = −6r, 15 r² = x0 + 2, 20 r³ = 12 r."""
    r = sqrt(mpf(3) / 5)
    designs = [[15 * s**2 - 2, -6 * s, s**6, -6 * s**5, 15 * s**4 - 2 * (15 * s**2 - 2)] for s in (-r, mpf(0), r)]
    check_all(of_file("two_mass_spring", minimize=None, locate="EP6"), designs)


def test_ten_meetings_of_one_pair():
    """s² + 3 T₅(x) s + 1 has a double root where T₅(x) = ±2/3."""
    chebyshev = 16 * x**5 - 20 * x**3 + 5 * x
    angles = [acos(s * mpf(2) / 3) for s in (-1, 1)]
    designs = {nstr(cos((s * a + 2 * pi * k) / 5), 30) for a in angles for s in (-1, 1) for k in range(5)}
    assert len(designs) == 10
    check_all(of_row([1, 3 * chebyshev, 1], "EP2", (-1.5, 1.5)), [[mpf(d)] for d in designs])


@pytest.mark.parametrize("size", [1e-3, 0.4, 50.0])
def test_roots_of_any_size(size):
    """(s − size)³ (s − 1), unfolded by x and y."""
    row = np.polymul(np.poly([size] * 3), [1.0, -1.0])
    a = [float(c) for c in row]
    found = of_row([a[0], a[1] * (1 + x), a[2] * (1 + y + x * x), a[3], a[4]], "EP3", (-0.04, 0.05))
    near = [d for d in found.designs if all(abs(float(v)) < 1e-9 for v in d.values())]
    assert found.complete
    assert len(near) == 1  # the coefficients are rounded


# Beside elimination


def _by_elimination(conditions, box):
    """Common zeros in a box of two polynomials in x and y with fractions: real roots of the resultant, each lifted."""
    u, v = sp.symbols("x y")
    count = 0
    for root in sp.Poly(sp.resultant(*conditions, v), u).nroots(n=40, maxsteps=500):
        if abs(sp.im(root)) > 1e-25 or not box[0] < sp.re(root) < box[1]:
            continue
        for w in sp.Poly(conditions[0].subs(u, sp.re(root)), v).nroots(n=30, maxsteps=500):
            real = abs(sp.im(w)) < 1e-12 and box[0] < sp.re(w) < box[1]
            count += bool(real and abs(conditions[1].subs({u: sp.re(root), v: sp.re(w)})) < 1e-10)
    return count


@pytest.mark.parametrize("seed", range(3))
def test_as_many_as_elimination_finds(seed):
    """s³ + a1 s² + a2 s + a3 is a cube where a1² = 3 a2 and a1 a2 = 9 a3; a_k of degree 2 in x and y."""
    rng = np.random.default_rng(seed)
    weights = rng.integers(-5, 6, (3, 6)).tolist()
    u, v = sp.symbols("x y")
    row = [
        [w[0] + w[1] * p + w[2] * q + w[3] * p * q + w[4] * p * p + w[5] * q * q for w in weights]
        for p, q in ((x, y), (u, v))
    ]
    a1, a2, a3 = row[1]
    expected = _by_elimination([sp.expand(a1**2 - 3 * a2), sp.expand(a1 * a2 - 9 * a3)], (-4, 4))
    found = of_row([1, *row[0]], "EP3")
    assert found.complete
    assert len(found.designs) == expected


@pytest.mark.parametrize(
    ("pattern", "factors"),
    [
        ("EP3", [[1, 1], [1, 1], [1, 1], [1, 0.5, 3]]),
        ("CEP2", [[1, 1, 2], [1, 1, 2], [1, 3]]),
        ("EP2+EP2", [[1, 1], [1, 1], [1, 2], [1, 2], [1, 0.25, 1]]),
        ("CEP2+EP2", [[1, 1, 2], [1, 1, 2], [1, 3], [1, 3]]),
        ("resonance", [[1, 0, 2], [1, 0, 2], [1, 3]]),
        ("weave+capsize", [[1, 0, 2], [1, 3], [1, 0], [1, 1]]),
    ],
)
def test_a_design_of_each_pattern_is_among_them(pattern, factors):
    """The product of the factors, unfolded by linear terms in as many parameters as there are conditions."""
    row = [1.0]
    for factor in factors:
        row = np.polymul(row, factor).tolist()
    count = pattern_of_name(pattern, len(row) - 1).codimension
    rng = np.random.default_rng(len(row))
    weights = rng.integers(-3, 4, (len(row), 3)).tolist()
    names = [x, y, z][:count]
    unfolded = [
        row[0],
        *(c + sum(w * n for w, n in zip(ws, names, strict=False)) for c, ws in zip(row[1:], weights, strict=False)),
    ]
    found = of_row(unfolded, pattern, (-0.05, 0.06) if count < 3 else (-0.02, 0.03))
    assert found.complete
    assert sum(all(v.contains(0) for v in d.values()) for d in found.designs) == 1


# Limits and constraints


def test_inequalities_take_part():
    """s² + x s + 1 has double roots at x = ±2."""
    for text, designs in (
        ("x >= 0", [[2]]),
        ("x**2 <= 3", []),
        ("sqrt(x + 3) >= 2", [[2]]),
        ("abs(x) >= 1", [[-2], [2]]),
    ):
        check_all(of_row([1, x, 1], "EP2", constraints={"limit": text}), designs)


@pytest.mark.parametrize(
    ("asked", "limit"), [({"box": (-2.0, 5.0)}, "the least x"), ({"constraints": {"c": "x >= -2"}}, "constraint c")]
)
def test_a_design_on_a_limit_is_said_to_be(asked, limit):
    found = of_row([1, x, 1], "EP2", **asked)
    assert found.complete
    assert places(found) == [-2.0, 2.0]
    assert found.limits == (limit, "")


def test_what_is_beyond_a_limit_by_a_hair_is_beyond():
    assert places(of_row([1, x, 1], "EP2", (-1.9999999999999, 5.0))) == [2.0]


def test_signs_tell_patterns_apart():
    """(s² + x s + 1)²: two real double roots for x² > 4, a complex pair for x² < 4."""
    row = [1, 2 * x, x * x + 2, 2 * x + (x * x - 9) * (x * x - 1) + y - 1, 1 + y * (y - 1)]
    for pattern, designs in (("2EP2", [[-3, 1], [3, 1]]), ("CEP2", [[-1, 1], [1, 1]])):
        check_all(of_row(row, pattern, constraints={"one": "y >= 1/2"}), designs)


# What is not decided


def test_where_two_designs_meet_stays_undecided():
    """(s + 1)² + x²(x − 1): a double root at x = 0, where two designs meet, and at x = 1."""
    found = of_row([1, 2, 1 + x * x * (x - 1)], "EP2")
    assert not found.complete
    assert places(found) == [1.0]
    assert "singular" in found.reason
    for place in found.undecided:
        assert max(map(abs, place.ranges["x"])) < 1e-3  # x² of boxes 1e-7 as wide as the first
    assert any(lo <= 0 <= hi for lo, hi in (p.ranges["x"] for p in found.undecided))


def test_a_curve_of_designs_stays_undecided_and_no_more():
    """s⁴ + (Om² − 1 − k) s² + k: both pairs meet wherever Om = 1 + √k, from 1.71 to 2.73 in this box."""
    Om, k = ca.SX.sym("Om"), ca.SX.sym("k")
    model = from_coefficients([1, 0, Om**2 - 1 - k, 0, k])
    found = prove_completeness(Problem(model=model, free={"Om": (0.5, 6.0), "k": (0.5, 3.0)}, locate="CEP2").posed)
    assert not found.complete
    assert "singular" in found.reason
    lower, upper = (f(place.ranges["Om"][j] for place in found.undecided) for j, f in ((0, min), (1, max)))
    assert 1.6 < lower <= 1 + math.sqrt(0.5)
    assert 1 + math.sqrt(3) <= upper < 2.84


def test_time_that_is_over():
    found = of_row([1, x, 1], "EP2", seconds=1e-6)
    assert not found.complete
    assert found.designs == ()
    assert found.reason == "time limit reached"
    assert all(place.ranges["x"] == (-4.0, 4.0) for place in found.undecided)


def test_what_cannot_be_written_is_said():
    """A power that varies."""
    found = of_row([1, x, ca.power(2.0, x)], "EP2")
    assert not found.complete
    assert "pow" in found.reason


@pytest.mark.parametrize(("most", "ends"), [(2, [-2.0, 2.0]), (1.5, [-2.0])])
@pytest.mark.parametrize("text", ["log(x + 5) <= {}", "min(log(x + 5), 3) <= {}"])
def test_a_limit_is_asked_of_every_design(text, most, ends):
    """Also where branch and prune cannot take it, as the lesser of two: log 7 = 1.946."""
    found = of_row([1, x, 1 + 0 * x], "EP2", constraints={"most": text.format(most)})
    assert found.complete
    assert places(found) == pytest.approx(ends, abs=1e-12)


# What is told


def test_progress_is_told_in_seconds():
    told = []
    prove_completeness(load(PROBLEMS / "coupled_pair.toml").posed, 30, lambda *counts: told.append(counts))
    assert told
    assert all(0 <= done <= most == 30 for done, most, _ in told)


def test_limits_on_derived_quantities_take_part():
    """The optimised benchmark has ω0 = −1, Fr above its weave boundary, and needs 0.61 of ballast at the rear wheel."""
    for text, count in (("omega0 <= -1/2", 1), ("Fr >= Fr_c", 1), ("ballast_rear <= 0.1", 0), ("abscissa <= -1/2", 1)):
        found = of_file("optimised_benchmark", constraints={"decay": "omega0 == -1", "limit": text})
        assert found.complete, text
        assert len(found.designs) == count, text
        assert not any(found.limits), text
    on = of_file("optimised_benchmark", constraints={"decay": "abscissa == -1", "limit": "omega0 <= -1"})
    assert on.limits == ("constraint limit",)


def test_ctrl_c_is_no_end():
    """Whatever was in hand is undecided."""

    def stop(*_):
        raise KeyboardInterrupt

    found = prove_completeness(load(PROBLEMS / "coupled_pair.toml").posed, progress=stop)
    assert not found.complete
    assert found.stopped
    assert found.reason == "interrupted"
    assert found.undecided[0].ranges["c2"] == (-3.0, 3.0)

    def later(told):
        if told.unit == "s" and told.most > 0:
            stop()

    every = solve_all(PROBLEMS / "coupled_pair.toml", progress=later)
    assert every.coverage is None


@pytest.mark.parametrize(("limit", "kept"), [("x**1.5 <= 5", 2.0), ("1/(x - 2) <= 5", -2.0)])
def test_a_design_at_which_a_limit_has_no_value_is_none(limit, kept):
    """s² + x s + 1 has its double roots at x = 2 and x = -2."""
    found = of_row([1, x, 1], "EP2", (-3.0, 3.0), constraints={"a": limit})
    assert found.complete
    assert places(found) == pytest.approx([kept], abs=1e-9)
