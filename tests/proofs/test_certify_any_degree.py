"""Bounds, certificates and proofs for systems of any degree, beside closed forms and independent computations."""

import math
from fractions import Fraction
from importlib import import_module

import casadi as ca
import numpy as np
import pytest
from flint import fmpq
from mpmath import mp, mpf, workdps

from tmsopt import Problem, prove, solve
from tmsopt.evaluation import omega0_bound, relation_bound
from tmsopt.global_search import FOUND, INFEASIBLE, SCIP, Question, make_task
from tmsopt.models import from_coefficients
from tmsopt.proofs import prove_design
from tmsopt.roots import Root, product, roots
from tmsopt.roots.patterns import find_patterns, has_pattern

factored = import_module("tmsopt.proofs.factorisation")

scip = pytest.mark.skipif(not SCIP.is_available, reason="SCIP is not installed")

R6 = math.sqrt(15) / 5


def symbols(names):
    return [ca.SX.sym(n) for n in names.split()]


def free_polynomial(degree, **given):
    """s^n + a1 s^(n−1) + …, every coefficient a parameter but those given as functions of the others."""
    a = [ca.SX(1), *(ca.SX.sym(f"a{k}_") for k in range(1, degree + 1))]
    return from_coefficients([given[f"a{k}"](a) if f"a{k}" in given else c for k, c in enumerate(a)])


def boxed(model, lower=-20.0, upper=20.0, **asked):
    """A problem with one range for all parameters; the abscissa is minimised if nothing else is asked."""
    free = dict.fromkeys(model.sets[0].names, (lower, upper))
    return Problem(model, free=free, **(asked or {"minimize": "abscissa"}))


def omega0(problem):
    return omega0_bound(problem.posed, math.inf).value


def holds(found, truth):
    return bool(abs(mpf(found.value) - truth) <= mpf(found.radius) + mpf(10) ** (5 - mp.dps))


def rebuilt(proof):
    """Monic coefficients from the proved roots."""
    c = [mpf(1)]
    for root in proof.roots:
        z = mp.mpc(root.re.value, root.im.value)
        for _ in range(root.multiplicity):
            c = [a - z * b for a, b in zip([*c, mpf(0)], [mpf(0), *c], strict=True)]
    return c


# Relations of the coefficients


def test_the_two_mass_spring_controller_is_optimal_and_its_6_fold_root_exists():
    """The published optimum −√15/5; (s + √15/5)⁶ gives x1 = 6r, x0 = 15r² − 2, y2 = 15r⁴ − 2x0, y1 = 6r⁵, y0 = r⁶."""
    design = solve("problems/two_mass_spring.toml")
    assert (design.structure, design.bound.method, design.bound.proven) == ("EP6", "relation", True)
    assert design.bound.value <= -R6 <= design.bound.value + 4e-16
    proof = prove(design)
    assert (proof.proved, proof.pattern, proof.method) == (True, "EP6", "Krawczyk")
    assert (proof.stable.holds, proof.heavily_damped.holds, proof.inside.holds) == (True, True, True)
    assert [z.multiplicity for z in proof.roots] == [6]
    with workdps(45):
        r = mp.sqrt(15) / 5
        truth = {"x1": 6 * r, "x0": mpf(7), "y2": -mpf(43) / 5, "y1": 6 * r**5, "y0": r**6, "r": -r}
        assert all(holds(({**proof.parameters, **proof.unknowns})[n], x) for n, x in truth.items())


@pytest.mark.parametrize("degree", range(2, 13))
def test_constant_product_and_constant_mean(degree):
    """With aₙ = c the bound is ω0 = −c^(1/n), with a1 = c the mean of the roots, −c/n."""
    last = boxed(free_polynomial(degree, **{f"a{degree}": lambda a: 3 + 0 * a[1]}))
    mean = boxed(free_polynomial(degree, a1=lambda a: 3 + 0 * a[2]))
    assert relation_bound(last.posed) == pytest.approx(-(3 ** (1 / degree)), rel=1e-15)
    assert omega0(last) == pytest.approx(-(3 ** (1 / degree)), rel=1e-14)
    assert relation_bound(mean.posed) == pytest.approx(-3 / degree, rel=1e-15)


def test_of_two_relations_the_one_without_the_leading_coefficient_counts_too():
    """a₃ = 100 and a₄ = 1: 100 = −Σ Re 1/sₖ ≤ 4/d where all Re sₖ ≤ −d < 0; either relation alone says far less."""
    a, b = symbols("a b")
    both = boxed(from_coefficients([1, a, b, 100, 1]), 0.0, 200.0)
    assert relation_bound(both.posed) == pytest.approx(-0.04, rel=1e-15)


@pytest.mark.parametrize("degree", [2, 3, 4, 6, 9])
def test_no_polynomial_of_a_family_with_one_relation_is_below_its_bound(degree):
    """Drawn from the family at random, and near (s + z)ⁿ with z a zero of h, where that is the optimum."""
    rng = np.random.default_rng(degree)
    reached = 0
    for _ in range(4):
        b = rng.integers(-6, 7, degree + 1).astype(float)
        b[1] = 2.0 + abs(b[1])

        def first(a, b=b):
            return -(b[0] + sum(b[k] * a[k] for k in range(2, degree + 1))) / b[1]

        bound = relation_bound(boxed(free_polynomial(degree, a1=first)).posed)
        drawn = rng.normal(size=(200, degree + 1)) * 3.0 ** rng.integers(-2, 3, (200, 1))
        binomial = np.array([math.comb(degree, k) * (-bound) ** k for k in range(degree + 1)])
        drawn[:100] = binomial * (1 + 0.1 * drawn[:100])
        drawn[:, 0] = 1.0
        drawn[:, 1] = [first(row) for row in drawn]
        assert roots(drawn).real.max(axis=1).min() >= bound - 1e-9
        at = abs(first(binomial) - binomial[1])  # 0 where (s + z)ⁿ is of the family
        reached += bool(at <= 1e-9 * np.abs(b * binomial).max())
    assert reached


def test_what_is_no_relation():
    """Without one, with one that holds for one sign only, and with numbers that are no fractions: no bound."""
    a, b = symbols("a b")
    piecewise = [1, ca.fabs(a - 1.999), b, 1.999 - a]  # a1 = a3 nearly everywhere in the box
    for coefficients in ([1, a, b], [1, ca.fabs(a), b, a * b], [1, ca.sin(b) * 0 + ca.sqrt(2 + b), a], piecewise):
        assert relation_bound(boxed(from_coefficients(coefficients), 0.5, 2.0).posed) == -math.inf


# The product of the roots of models that users state


@pytest.mark.parametrize(
    "last",
    [
        lambda x, y: x**6 - 3 * x**4 + 2.5 * x**2 + y / 10,  # of a degree that nothing is fitted for
        lambda x, y: 2 + ca.sin(3 * x) + y,
        lambda x, y: ca.fabs(x - 0.7) + y,
        lambda x, y: x * x * y * y - x * y + 1,
        lambda x, y: (1 + x) / (2 + y),
    ],
)
def test_the_bound_by_the_product_of_the_roots_holds_for_any_formula(last):
    x, y = symbols("x y")
    model = from_coefficients([1, x, y, last(x, y)])
    problem = boxed(model, 0.0, 1.5)
    grid = np.meshgrid(np.linspace(0, 1.5, 301), np.linspace(0, 1.5, 301))
    largest = np.abs(model.coefficients(dict(zip("xy", grid, strict=True)))[-1]).max()
    bound = omega0(problem)
    assert -math.inf < bound <= -(largest ** (1 / 3)) * (1 - 1e-15)


def test_the_product_of_the_roots_may_be_greatest_inside():
    """x/(1 + x²) is at most 1/2, at x = 1."""
    x, y = symbols("x y")
    problem = boxed(from_coefficients([1 + x * x, x, y, x]), 0.5, 3.0)
    least = -(0.5 ** (1 / 3))
    assert least * (1 + 1e-12) <= omega0(problem) <= least


def test_more_parameters_than_have_corners():
    """Twelve of thirteen coefficients free: the product is the last one, at most 1."""
    problem = boxed(free_polynomial(12, a1=lambda a: a[2] * a[3]), 0.0, 1.0)
    more = {f"b{k}": (0.0, 1.0) for k in range(3)}
    extra = sum(ca.SX.sym(n) for n in more)
    wide = boxed(free_polynomial(12, a1=lambda a: a[2] * extra), 0.0, 1.0)
    assert omega0(problem) == pytest.approx(-1.0, rel=1e-14)
    assert -1 - 1e-8 <= omega0(wide) <= -1  # balls have radii of 30 bits


# Branch and bound


def verdict(problem, limit, **options):
    question = Question(problem.posed, limit=limit, **options)
    return {SCIP.decide(make_task(question.program(sign), 20.0)).verdict for sign in question.possible_signs()}


@scip
@pytest.mark.parametrize(
    ("names", "coefficients", "optimum"),
    [
        ("c", lambda c: [1, c, 4], -2.0),  # critical damping
        ("a b", lambda a, b: [1, a, b, a], -math.sqrt(3)),  # (s + r)³ with r³ = 3r
        ("a b c d", lambda a, b, c, d: [1, a, b, c, d, 32], -2.0),  # (s + 2)⁵, ω0
        ("x1 x0 y2 y1 y0", lambda x1, x0, y2, y1, y0: [1, x1, x0 + 2, 2 * x1, 2 * x0 + y2, y1, y0], -R6),
    ],
)
def test_branch_and_bound_draws_the_line_at_the_optimum(names, coefficients, optimum):
    """Degrees 2, 3, 5 and 6: nothing is 1 % beyond the closed form, something is 1 % short of it."""
    model = from_coefficients(coefficients(*symbols(names)))
    problem = boxed(model, -10.0 if names.startswith("x") else 0.0, 90.0)
    assert verdict(problem, 1.01 * optimum) == {INFEASIBLE}
    if model.degree < 6:  # a point is harder to find than to exclude
        assert FOUND in verdict(problem, 0.9 * optimum)


@scip
@pytest.mark.parametrize(
    ("sign", "asked", "limit", "told"),
    [
        (1, {"maximize": "damping_ratio"}, 0.51, INFEASIBLE),  # ζ = z/2 ≤ 1/2 of s² + z s + 1
        (1, {"maximize": "damping_ratio"}, 0.49, FOUND),
        (-1, {"constraints": {"it": "damping_ratio <= -0.9"}, "minimize": "d + z"}, None, FOUND),  # −1 of a root d > 0
        (-1, {"constraints": {"it": "damping_ratio >= -0.9"}, "minimize": "d + z"}, None, INFEASIBLE),
    ],
)
def test_damping_ratios_of_an_odd_degree(sign, asked, limit, told):
    """(s ± d)(s² + z s + 1)."""
    d, z = symbols("d z")
    model = from_coefficients(product([1, sign * d], [1, z, 1]))
    assert told in verdict(Problem(model, free={"d": (0.3, 2.0), "z": (0.1, 1.0)}, **asked), limit)


def test_the_greatest_damping_ratio_of_an_odd_degree():
    """(s + r)(s² + p s + 1): ζ = p/2 is greatest at x = 1/5 among r = (x − 2/5)(x − 4/5) ≥ 0; beyond, p is larger."""
    (x,) = symbols("x")
    p = 0.6 - 10 * (x - 0.2) ** 2 + 40 * (x - 0.2) ** 3
    model = from_coefficients(product([1, (x - 0.4) * (x - 0.8)], [1, p, 1]))
    design = solve(boxed(model, 0.0, 0.7, maximize="damping_ratio"))
    assert design.parameters["x"] == pytest.approx(0.2, abs=1e-7)  # a maximum is flat
    assert design.value == pytest.approx(0.3, abs=1e-12)


@scip
@pytest.mark.parametrize(("most", "told"), [(4.9, INFEASIBLE), (5.1, FOUND)])
def test_patterns_are_excluded_or_found_in_any_unit(most, told):
    """(s + 100)⁵ = s⁵ + 500 s⁴ + … + 10¹⁰ is in the box only if 500 is in the range of the first coefficient."""
    a, b, c, d = symbols("a b c d")
    model = from_coefficients([1, 1e2 * a, 1e4 * b, 1e6 * c, 1e8 * d, 1e10])
    free = {**dict.fromkeys("bcd", (0.0, 20.0)), "a": (1.0, most)}
    assert verdict(Problem(model, free=free, locate="EP5"), None, unit=128.0) == {told}


# Proofs


def test_the_whole_structure_of_an_optimum_is_proved():
    """Degree 5 with a₅ = 2a₁ − 1: a double pair and a real root on one line; the roots rebuild the coefficients."""
    a, b, d, e = symbols("a b d e")
    design = solve(boxed(from_coefficients([1, a, b, d, e, 2 * a - 1]), 0.0, 20.0))
    proof = prove(design, 25)
    assert (proof.proved, proof.pattern) == (True, "CEP2+real")
    assert "a 2-fold complex pair and a real root on one vertical line" in proof.claim
    assert sorted(z.multiplicity for z in proof.roots) == [1, 2, 2]
    with workdps(30):
        p = {n: mpf(x.value) for n, x in proof.parameters.items()}
        given = [mpf(1), p["a"], p["b"], p["d"], p["e"], 2 * p["a"] - 1]
        assert all(abs(x - y) < mpf(10) ** -22 for x, y in zip(rebuilt(proof), given, strict=True))
        assert len({z.re.value for z in proof.roots}) == 1


@pytest.mark.parametrize("names", ["a1 a2 a3 a4 a5 a6", "r b c W d1 c1"])
def test_parameters_may_have_the_names_of_unknowns(names):
    """(s + 1/3)² (s² + s/7 + 1/3)² beside, in doubles: whatever the parameters are called."""
    exact = product(*[[Fraction(1), Fraction(1, 3)]] * 2, *[[Fraction(1), Fraction(1, 7), Fraction(1, 3)]] * 2)
    model = from_coefficients([1, *symbols(names)])
    stored = {n: float(c) for n, c in zip(names.split(), exact[1:], strict=True)}
    problem = boxed(model, -5.0, 5.0, locate="EP2+CEP2")
    proof = prove_design(problem.posed, stored, "pair", 20)
    assert (proof.proved, proof.pattern, len(proof.moved)) == (True, "EP2+CEP2", 3)
    found = {u.rpartition(".")[2]: x for u, x in proof.unknowns.items()}
    with workdps(20):  # three coefficients are moved; the others are held at their decimals, 1e-16 off
        near = {"r": -mpf(1) / 3, "b": mpf(1) / 7, "c": mpf(1) / 3}
        assert all(abs(mpf(found[n].value) - x) < 1e-12 for n, x in near.items())


def test_twelve_equal_roots():
    """s¹² + 4s¹¹ + …: (s + 1/3)¹² by its eleven other coefficients, of which doubles are as far off as they round."""
    model = free_polynomial(12, a1=lambda a: 4 + 0 * a[2])
    stored = {f"a{k}_": math.comb(12, k) / 3.0**k for k in range(2, 13)}
    problem = Problem(model, free={n: (x / 2, 2 * x) for n, x in stored.items()}, locate="EP12")
    proof = prove_design(problem.posed, stored, "EP12", 30)
    assert (proof.proved, proof.pattern, len(proof.moved)) == (True, "EP12", 11)
    with workdps(40):
        assert holds(proof.unknowns["r"], -mpf(1) / 3)
        assert holds(proof.parameters["a12_"], mpf(3) ** -12)


@pytest.mark.parametrize(
    ("factors", "name", "patterns"),
    [
        ([[1, 2]] * 6, "EP6", {"EP6"}),
        ([[1, 2]] * 3 + [[1, 2, 5]] * 2, "EP3+CEP2", {"EP3+CEP2", "EP3", "CEP2"}),
        ([[1, 0, 3]] * 2 + [[1, 1]], "CEP2", {"CEP2", "weave", "resonance"}),
        ([[1, 0, 3], [1, 0, 2], [1, 0], [1, 1]], "", {"weave", "capsize", "weave+capsize"}),
        ([[1, 2]] * 2 + [[1, 0, 3], [1, 1, 1]], "EP2", {"EP2", "weave", "EP2+weave"}),
        ([[1, -2, -1]] * 2, "2EP2", {"2EP2"}),  # 1 ± √2, twice each
        ([[1, 0, -3], [1, 1, 1]], "", set()),  # a symmetric pair that is real
        ([[1, 0, 3]] * 2 + [[1, 1, 1]], "CEP2", {"CEP2", "weave", "resonance"}),  # its pair does not count twice
    ],
)
def test_patterns_of_fractions_of_any_degree(factors, name, patterns):
    a = [fmpq(-3, 7) * c for c in product(*factors)]
    asked = {"EP6", "EP3+CEP2", "EP3", "CEP2", "EP2", "2EP2", "3EP2", "weave", "resonance", "capsize"}
    asked |= {"weave+capsize", "EP2+weave", "CEP2+weave"}
    assert {n for n in asked if factored.has_pattern(n, a)} == patterns
    assert factored.multiple_roots(a) == name
    moved = [a[0], a[1] + fmpq(1, 10**40), *a[2:]]
    assert factored.multiple_roots(moved) == ""


def test_exact_fractions_are_decided_without_rounding():
    """(s + 1/2)³ (s² + s + 1)²: nothing is free, and nothing needs to be."""
    c = product(*[[Fraction(1), Fraction(1, 2)]] * 3, *[[Fraction(1)] * 3] * 2)
    names = [f"a{k}_" for k in range(1, 8)]
    problem = Problem(free_polynomial(7), fixed=dict(zip(names, map(float, c[1:]), strict=True)))
    proof = prove(solve(problem))
    assert (proof.proved, proof.pattern, proof.method) == (True, "EP3+CEP2", "exact factorisation")
    assert sorted(z.multiplicity for z in proof.roots) == [2, 2, 3]


def roots_of(*places):
    return [Root(w.real, w.imag, m) for z, m in places for w in ((z, z.conjugate()) if z.imag else (z,))]


@pytest.mark.parametrize(
    ("places", "names"),
    [
        ([(-1 + 0j, 6)], ["EP6"]),
        ([(-1 + 0j, 3), (-1 + 2j, 1), (-3 + 0j, 2)], ["EP3+pair beside EP2", "EP3+pair", "EP3+EP2", "EP3"]),
        ([(-1 + 1j, 2), (-2 + 0j, 1)], ["CEP2"]),
        ([(-1 + 1j, 1), (-1 + 2j, 1), (-1 + 0j, 1)], ["two pairs+real"]),
        ([(-1 + 1j, 1), (-2 + 0j, 1)], []),
        ([(-1 + 1j, 1), (-2 + 0j, 2)], ["EP2"]),
    ],
)
def test_patterns_that_roots_show(places, names):
    """Each starts from unknowns that rebuild the polynomial."""
    found = find_patterns(roots_of(*places))
    assert [p.name for p in found] == names
    z = np.array([complex(r.re, r.im) for r in roots_of(*places) for _ in range(r.multiplicity)])
    for p in found:
        (u,) = p.guesses(z)
        assert p.degree == len(z)
        assert np.allclose(p.monic(u), np.poly(z).real, rtol=1e-12)


@pytest.mark.parametrize(
    ("places", "name", "told"),
    [
        ([(-1 + 0j, 6)], "2EP3", True),
        ([(-1 + 0j, 6)], "EP3+CEP2", False),  # seven roots
        ([(-1 + 0j, 4)], "CEP2", True),
        ([(-1 + 1j, 3)], "CEP2", True),
        ([(-1 + 1j, 2)], "EP2", False),
        ([(-1 + 0j, 3), (-2 + 0j, 2)], "2EP2", True),
        ([(-1 + 0j, 2)], "EP3", False),
        ([(1j, 1)], "weave", False),  # nothing is said of where the line is
    ],
)
def test_patterns_that_others_imply(places, name, told):
    assert has_pattern(roots_of(*places), name) is told
