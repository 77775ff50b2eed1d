"""Polynomials against exact fractions and SymPy, numeric roots against exact and 60-digit arithmetic.

Roots are judged by the coefficients that they rebuild, in exact arithmetic on the very doubles returned.
"""

from fractions import Fraction

import numpy as np
import pytest
import sympy
from helpers.oracles import routh_exact
from hypothesis import given, settings, strategies as st

import tmsopt
from tmsopt.roots import (
    abscissa,
    backward_error,
    determinant,
    is_stable,
    lienard_chipart,
    product,
    quadratic_pencil,
    rebuilt,
    roots,
    shift,
)

JOINTLY_RIGHT = Fraction(1, 10**13)
"""The promised accuracy of rebuilt coefficients."""

s = sympy.Symbol("s")
repeatable = settings(max_examples=40, deadline=None, derandomize=True)
rational = st.fractions(min_value=-20, max_value=20, max_denominator=12)
polynomial = st.lists(rational, min_size=1, max_size=7)


def poly(coefficients):
    return sympy.Poly([sympy.Rational(c.numerator, c.denominator) for c in coefficients], s, domain="QQ")


def fractions(p, length):
    """Coefficients of a SymPy polynomial, padded with leading zeros."""
    found = [Fraction(int(c.p), int(c.q)) for c in p.all_coeffs()]
    return [Fraction(0)] * (length - len(found)) + found


# Polynomial arithmetic


@repeatable
@given(st.lists(polynomial, max_size=4))
def test_product_is_the_product(factors):
    expected = sympy.Poly(1, s, domain="QQ")
    for factor in factors:
        expected *= poly(factor)
    assert product(*factors) == fractions(expected, sum(len(f) - 1 for f in factors) + 1)


@repeatable
@given(polynomial, rational)
def test_shift_is_composition_with_t_plus_gamma(p, gamma):
    argument = sympy.Poly(s + sympy.Rational(gamma.numerator, gamma.denominator), s, domain="QQ")
    assert shift(p, gamma) == fractions(poly(p).compose(argument), len(p))


def _random_matrix(rng, n, length):
    return [[[Fraction(int(x), 7) for x in rng.integers(-9, 10, length)] for _ in range(n)] for _ in range(n)]


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_determinant_of_a_polynomial_matrix(n):
    entries = _random_matrix(np.random.default_rng(n), n, 3)
    expected = sympy.Matrix(n, n, lambda i, j: poly(entries[i][j]).as_expr()).det(method="berkowitz")
    assert determinant(entries) == fractions(sympy.Poly(expected, s, domain="QQ"), 2 * n + 1)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_quadratic_pencil_is_det_of_M_s2_D_s_K(n):
    rng = np.random.default_rng(10 + n)
    M, D, K = ([[e[0] for e in row] for row in _random_matrix(rng, n, 1)] for _ in range(3))
    pencil = sympy.Matrix(n, n, lambda i, j: poly([M[i][j], D[i][j], K[i][j]]).as_expr())
    expected = sympy.Poly(pencil.det(method="berkowitz"), s, domain="QQ")
    assert quadratic_pencil(M, D, K) == fractions(expected, 2 * n + 1)


# Numeric roots


def exact_elementary(values):
    """Coefficients of ∏ (s − value) as exact (real, imaginary) parts."""
    result = [(Fraction(1), Fraction(0))]
    for z in values:
        x, y = Fraction(z.real), Fraction(z.imag)
        grown = [*result, (Fraction(0), Fraction(0))]
        for k, (a, b) in enumerate(result):
            re, im = grown[k + 1]
            grown[k + 1] = (re - (x * a - y * b), im - (x * b + y * a))
        result = grown
    return result


def exact_monic(coefficients):
    return [Fraction(float(c)) / Fraction(float(coefficients[0])) for c in coefficients]


def errors(coefficients, found):
    """Joint error of roots by their exactly rebuilt coefficients, componentwise and normwise.

    Componentwise against the same symmetric function of |roots|, as `backward_error` has it; normwise in the
    largest coefficient, in the unit of time that makes the nonzero roots of size 1.
    """
    wanted, got = exact_monic(coefficients), exact_elementary(found)
    assert all(im == 0 for _, im in got), "conjugates are exact, so rebuilt coefficients are real"
    sizes = [re for re, _ in exact_elementary([-abs(z) for z in found])]
    off = [abs(re - w) for (re, _), w in zip(got, wanted, strict=True)]
    componentwise = max((o / z if z else Fraction(int(o > 0)) for o, z in zip(off, sizes, strict=True)))
    moduli = [abs(z) for z in found if z]
    unit = Fraction(float(np.exp(np.mean(np.log(moduli))))) if moduli else Fraction(1)
    largest = max(abs(w) / unit**k for k, w in enumerate(wanted))
    return componentwise, max(o / unit**k for k, o in enumerate(off)) / largest


def assert_jointly_right(coefficients):
    found = roots(coefficients)
    componentwise, normwise = errors(coefficients, found)
    assert componentwise <= JOINTLY_RIGHT, f"{float(componentwise)} of {list(coefficients)!r}"
    assert normwise <= JOINTLY_RIGHT, f"{float(normwise)} of {list(coefficients)!r}"
    # what the package says of itself is that error, up to the rounding of its own sums
    assert backward_error(coefficients, found) == pytest.approx(float(componentwise), abs=4e-15)


def coefficients_of(values, leading=1.0):
    """Exact coefficients of given roots, each rounded once."""
    return [float(re * Fraction(leading)) for re, _ in exact_elementary(values)]


def random_roots(rng, degree):
    """Real roots and pairs of either sign, sizes over two decades."""
    values = []
    while len(values) < degree:
        size, angle = 10 ** rng.uniform(-1, 1), rng.uniform(0, np.pi)
        if len(values) <= degree - 2 and rng.uniform() < 0.5:
            z = complex(size * np.cos(angle), size * np.sin(angle))
            values += [z, z.conjugate()]
        else:
            values.append(complex(size * rng.choice([-1, 1])))
    return values


@pytest.mark.parametrize("degree", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("scale", [1.0, 1e-8, 1e8])
def test_roots_of_random_polynomials_rebuild_the_coefficients(degree, scale):
    """In any unit of time."""
    rng = np.random.default_rng(degree)
    for _ in range(8):
        values = [scale * z for z in random_roots(rng, degree)]
        assert_jointly_right(coefficients_of(values, leading=rng.uniform(-5, 5)))
        assert_jointly_right(rng.normal(size=degree + 1) * scale ** np.arange(degree + 1))


@pytest.mark.parametrize("degree", [2, 3, 4, 5, 6])
def test_roots_sixteen_decades_apart(degree):
    rng = np.random.default_rng(degree)
    for _ in range(15):
        assert_jointly_right(coefficients_of([complex(-(10 ** rng.uniform(-8, 8))) for _ in range(degree)]))
        pair = 10 ** rng.uniform(-8, 8) * np.exp(1j * rng.uniform(0, np.pi))
        others = [complex(10 ** rng.uniform(-8, 8) * rng.choice([-1, 1])) for _ in range(degree - 2)]
        assert_jointly_right(coefficients_of([pair, pair.conjugate(), *others]))


@pytest.mark.parametrize("degree", [3, 4, 6, 8])
def test_newton_brings_roots_of_twelve_decades_to_a_few_roundings(degree):
    """Eigenvalues alone leave errors up to 1e-13 here, the limit above which roots are isolated exactly."""
    rng = np.random.default_rng(degree)
    c = np.array([np.poly(-(10 ** rng.uniform(-6, 6, degree))) for _ in range(300)])
    assert backward_error(c, roots(c)).max() < 1e-14


@st.composite
def near_ep4(draw):
    """Four roots within a relative 1e-16 … 1e-1 of a negative number, real or in pairs."""
    centre = -draw(st.floats(0.1, 10))
    spread = 10 ** draw(st.floats(-16, -1))
    offset = st.floats(-1, 1)
    values = []
    for is_pair in draw(st.sampled_from([(True, True), (True, False), (False, False)])):
        a, b = draw(offset), draw(offset)
        if is_pair:
            z = centre * (1 + spread * complex(a, b))
            values += [z, z.conjugate()]
        else:
            values += [complex(centre * (1 + spread * a)), complex(centre * (1 + spread * b))]
    return values


@settings(max_examples=120, deadline=None, derandomize=True)
@given(near_ep4(), st.sampled_from([1.0, -0.3, 1e-8, 1e8]), st.sampled_from([1.0, 1e-8, 1e8]))
def test_roots_next_to_a_four_fold_one_rebuild_the_coefficients(values, leading, scale):
    assert_jointly_right(coefficients_of([scale * z for z in values], leading))


@pytest.mark.parametrize("r", [-1.0, -1.8803015465431967, -1e8])
@pytest.mark.parametrize("degree", [2, 3, 4, 5, 6])
def test_multiple_roots_of_full_multiplicity(degree, r):
    assert_jointly_right(coefficients_of([complex(r)] * degree))


@pytest.mark.parametrize(
    "values", [[-1, -1, -2, -2], [1j, -1j, 1j, -1j], [-1, -1, -1, -1e-6], [-1, -1, -1, 1, 1, 1], [1, -1, 1j, -1j]]
)
def test_roots_of_special_patterns_rebuild_the_coefficients(values):
    assert_jointly_right(coefficients_of([complex(z) for z in values]))


@pytest.mark.parametrize("degree", [2, 3, 4, 5, 6])
def test_roots_at_zero_are_zero(degree):
    rng = np.random.default_rng(degree)
    for zeros in range(1, degree + 1):
        for _ in range(5):
            others = random_roots(rng, degree - zeros)
            c = [*coefficients_of(others, leading=-2.0), *[0.0] * zeros]
            assert_jointly_right(c)
            assert np.count_nonzero(roots(c) == 0) == zeros


@pytest.mark.parametrize(("c", "known"), [([1, 1e155, 1], [-1e155, -1e-155]), ([1, 1e308, 1e308], [-1e308, -1])])
def test_roots_hundreds_of_decades_apart(c, known):
    """Their product is the last coefficient and their sum the one before, to all digits."""
    np.testing.assert_allclose(roots(c), known, rtol=1e-15)


def test_conjugate_pairs_are_exact_and_adjacent():
    found = roots(np.random.default_rng(0).normal(size=(200, 7)))
    for row in found:
        k = 0
        while k < len(row):
            assert row[k].imag == 0 or row[k + 1] == row[k].conjugate()
            k += 1 + (row[k].imag != 0)
    assert np.any(found.imag != 0)


def test_abscissa_is_the_largest_real_part():
    """(s + 1)(s + 2)(s² + s + 1) and s (s + 3): −1/2 and 0."""
    assert abscissa(product([1, 1], [1, 2], [1, 1, 1])) == pytest.approx(-0.5, rel=1e-14)
    assert abscissa([1, 3, 0]) == 0
    assert abscissa(np.ones((2, 3, 4))).shape == (2, 3)


def test_rebuilt_coefficients_are_monic_and_real():
    assert rebuilt(np.array([1j, -1j, 2.0])).tolist() == [1, -2, 1, -2]


def test_backward_error_is_relative_to_the_terms_of_each_coefficient():
    """(s − 1)(s + 1) for s² + 0.002 s − 1: a1 is off by 0.002 and summed from terms of total size 2."""
    assert backward_error([1, 0.002, -1], np.array([1.0 + 0j, -1.0])) == pytest.approx(0.001, rel=1e-15)


@pytest.mark.parametrize("shape", [(), (1,), (2, 3), (2, 0)])
def test_roots_are_vectorised(shape):
    c = np.random.default_rng(3).normal(size=(*shape, 5))
    found = roots(c)
    assert found.shape == (*shape, 4)
    assert np.all(backward_error(c, found) <= 1e-13)


@pytest.mark.parametrize(
    "bad",
    [[0, 1, 2], [1, np.nan, 2], [1, np.inf], [-np.inf, 1], [1], [], 5.0, [[1, 2, 3], [0, 2, 3]], [[1, 2], [1, np.nan]]],
)
def test_roots_refuse_what_has_none(bad):
    with pytest.raises(ValueError, match="coefficients"):
        roots(bad)


# Stability and discriminant


def random_exact(degree):
    """Rational polynomials with a0 of both signs: products of factors with Re s near 0, some slightly changed."""
    rng = np.random.default_rng(degree)
    chosen = []
    for k in range(60):
        factors = [[Fraction(1), Fraction(int(rng.integers(-1, 20)), 7)] for _ in range(degree % 2)]
        for _ in range(degree // 2):
            factors.append([Fraction(1), Fraction(int(rng.integers(-1, 20)), 8), Fraction(int(rng.integers(1, 30)), 5)])
        p = product([Fraction(int(rng.integers(1, 6)) * (-1) ** k, 3)], *factors)
        if k % 3 == 0:
            p[-2] *= Fraction(int(rng.integers(1, 30)), 15)
        chosen.append(p)
    return chosen


@pytest.mark.parametrize("degree", [2, 3, 4, 5, 6])
def test_stability_agrees_with_the_exact_routh_table(degree):
    for p in random_exact(degree):
        stable = routh_exact(p)
        quantities = lienard_chipart([c * (1 if p[0] > 0 else -1) for c in p])
        assert len(quantities) == degree
        assert all(q > 0 for q in quantities) == stable
        # On the boundary itself, rounding of the doubles decides.
        if min(map(abs, lienard_chipart(p))) >= 1e-9 * sum(map(abs, p)):
            assert is_stable([float(c) for c in p]) == stable


@pytest.mark.parametrize(
    "unstable",
    [
        product([1, 0, 1], [1, 1, 1]),  # a pair on the imaginary axis
        product([1, 0], [1, 3, 3, 1]),  # a root at 0
        product([1, 0, 1], [1, 0, 1]),
        product([1, -1], [1, 1], [1, 1, 1]),
        [0, 1, 2, 1],  # a root at infinity
        [0, 0, 0],
        [1, np.nan, 1],
    ],
)
def test_the_boundary_is_not_stable(unstable):
    assert not is_stable(unstable)
    assert not is_stable([-c for c in unstable])


def test_is_stable_is_vectorised():
    c = np.array([[[1, 2, 3], [-1, -2, -3]], [[1, -2, 3], [1, 2, -3]]])
    assert is_stable(c).tolist() == [[True, True], [False, False]]


@pytest.mark.parametrize("distance", [1e-6, 1e-4])
def test_three_eigenvalues_at_equal_distances_are_no_triple_one(distance):
    """The squares of the distances from their mean add up to 0, the cubes do not."""
    around = 0.5 + distance * np.exp(2j * np.pi * np.arange(3) / 3)
    matrices = np.array([np.eye(4), -np.diag([*around, -1])])
    assert [root.multiplicity for root in tmsopt.roots.spectrum(matrices, 1e-12, is_complex=True).roots] == [1] * 4
