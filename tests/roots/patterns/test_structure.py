"""The multiplicity structure against exact multiplicities, and distances against linear least squares.

Nothing is judged by recomputed roots: multiplicities come from FLINT's certified isolation of the exact
coefficients, distances from least squares in the exact derivatives of the pattern.
"""

import numpy as np
import pytest
from helpers.oracles import abscissa_60, exact_multiplicities, roots_60
from hypothesis import given, settings, strategies as st
from mpmath import mp

from tmsopt.roots import PATTERNS, exact_abscissa, exact_roots, pattern, pattern_distance, product, structure

I2 = [1, 2, 2]  # −1 ± i
EXAMPLES = {
    "EP4": [[[1, 1]] * 4, [[1, 0]] * 4],
    "EP3": [[[1, 1]] * 3 + [[1, 2]], [[1, -1]] * 3 + [[1, 5]]],
    "2EP2": [[[1, 1]] * 2 + [[1, 2]] * 2, [[1, 0]] * 2 + [[1, 3]] * 2],
    "CEP2": [[I2, I2], [[1, 0, 1]] * 2],
    "EP2": [[[1, 1]] * 2 + [[1, 2], [1, 3]], [[1, -3]] * 2 + [[1, 0, 1]]],
    "EP2+pair": [[[1, 0]] * 2 + [[1, 0, 4]]],
    "pair+real": [[[1, 0, 1], [1, 0], [1, 3]]],
    "two pairs": [[[1, 0, 1], [1, 0, 4]]],
    "pair": [[[1, 0, 4], [1, 3], [1, 3]]],  # a double root left of the rightmost line is not named
    "real": [[[1, 0], [1, 1], [1, 2], [1, 3]], [[1, 1], [1, 2], [1, 2], [1, 2]]],  # nor is an EP3
}
EVERY = [(name, factors) for name, examples in EXAMPLES.items() for factors in examples]


def scaled(coefficients, scale, leading):
    """In another unit of time, s → s/scale, with another leading coefficient."""
    return [leading * c * scale**k for k, c in enumerate(coefficients)]


@pytest.mark.parametrize(("name", "factors"), EVERY)
def test_every_kind_is_named_in_any_unit_of_time(name, factors):
    """Scaling rounds each coefficient by about 1e-16, far below the tolerance of 1e-12."""
    for scale, leading in ((1.0, -0.017), (1e-6, 1.0), (1e8, 1.0)):
        found = structure(scaled(product(*factors), scale, leading))
        assert found.name == name, scale
        assert found.distance <= 1e-14


@pytest.mark.parametrize("power", [-78, -66, -58, -52, 90])
def test_an_ep2_of_degree_8_is_one_in_units_whose_powers_leave_doubles(power):
    """A power of 2 does not round; the product of the roots is 16,800 times its eighth power, down to 1e-184."""
    c = product([1, 1], [1, 1], [1, 6, 20], [1, 3], [1, 4], [1, 5], [1, 7])
    found = structure(scaled(c, 2.0**power, 1.0))
    assert found.name == "EP2"
    assert found.abscissa == pytest.approx(-(2.0**power), rel=1e-12)


def test_the_greatest_root_that_is_a_double():
    assert structure([1, 1.7e308]).abscissa == -1.7e308


# Tolerance


@pytest.mark.parametrize(("name", "factors"), [e for e in EVERY if e[0] not in ("real", "pair")])
def test_zero_tolerance_cannot_be_decided_at_an_exceptional_point(name, factors):
    assert structure(product(*factors), 0.0).name == "undecided"


def test_zero_tolerance_is_decided_away_from_every_pattern():
    for factors, name in (([I2, [1, 2], [1, 3]], "pair"), ([[1, 1], [1, 2], [1, 4, 5]], "real")):
        assert structure(product(*factors), 0.0).name == name


def test_undecided_only_where_rounding_decides():
    """A tolerance equal to the distance is undecided; one percent more or less decides."""
    c = product([1, 1], [1, 1], [1, 3], [1, 4])
    c[-1] += 1e-9
    distance = pattern_distance(PATTERNS["EP2"], c)
    assert 1e-13 < distance <= 1e-9 / 12  # a change of a4 alone takes it there, and smaller ones of all four do
    assert structure(c, distance).name == "undecided"
    assert structure(c, 1.01 * distance).name == "EP2"
    assert structure(c, 0.99 * distance).name == "pair"


def test_a_structure_near_the_origin_of_its_own_scale():
    """A root of size 1e-7 is not part of an EP3 at −1, and is rightmost."""
    assert structure(product([1, 1], [1, 1], [1, 1], [1, 1e-7])).name == "real"
    assert structure(product([1, 1], [1, 1], [1, 1], [1, 1e7])).name == "EP3"


@pytest.mark.parametrize(
    "bad", [[1], [1] * 14, [0, 1, 2, 3, 4], [1, 2, 3, 4, np.nan], [1, 2, np.inf, 4, 5], 5.0, [[1, 4, 6, 4, 1]]]
)
def test_structure_refuses_what_is_no_polynomial_of_degree_1_to_12(bad):
    with pytest.raises(ValueError, match="coefficient"):
        structure(bad)
    assert pattern_distance(PATTERNS["EP4"], bad) == np.inf


# Patterns that can be located, and the distance to them


def test_codimensions():
    known = {"EP4": 3, "EP3": 2, "2EP2": 2, "CEP2": 2, "EP2": 1, "weave": 1, "capsize": 1, "resonance": 3}
    assert {name: pattern.codimension for name, pattern in PATTERNS.items()} == known


MEMBERS = {
    **{name: EXAMPLES[name] for name in ("EP4", "EP3", "2EP2", "CEP2", "EP2")},
    "weave": [[[1, 0, 2], [1, 3, 1]], [[1, 0, 2], [1, 1], [1, -3]]],
    "capsize": [[[1, 0], [1, 3, 3, 1]], [[1, 0], [1, -2], [1, 1], [1, 7]]],
    "resonance": [[[1, 0, 1]] * 2, [[1, 0, 9]] * 2],
}


@pytest.mark.parametrize("name", MEMBERS)
def test_members_of_a_pattern_are_at_distance_0(name):
    for factors in MEMBERS[name]:
        assert pattern_distance(PATTERNS[name], [-7 * c for c in product(*factors)]) <= 1e-14, factors


def test_distance_to_capsize_is_the_whole_last_coefficient():
    """A root at 0 takes a4 = 0, a relative change of 1."""
    assert pattern_distance(PATTERNS["capsize"], product([1, 1], [1, 2], [1, 3], [1, 4])) == pytest.approx(1, rel=1e-12)


def test_a_pattern_without_unknowns_has_a_distance():
    assert pattern_distance(pattern("capsize", 1), [2.0, 1.0]) == 1.0


def test_patterns_of_opposite_sign_are_told_apart():
    """Two real double roots and a double pair are one factored form with b² − 4c of either sign."""
    for name, other in (("2EP2", "CEP2"), ("CEP2", "2EP2")):
        for factors in EXAMPLES[name]:
            assert pattern_distance(PATTERNS[other], product(*factors)) > 1e-3


# The exact route


rationals = st.fractions(min_value=-9, max_value=9, max_denominator=10)
factor = st.lists(rationals, min_size=2, max_size=3).filter(lambda f: f[0] != 0)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.lists(factor, min_size=1, max_size=2), st.sampled_from([1, 2, 3]))
def test_exact_roots_agree_with_60_digits(factors, power):
    """The roots of the factors by mpmath, without square-free parts; 1e-15 is one rounding error."""
    p = product(*factors, *[factors[0]] * (power - 1))
    found = exact_roots(p)
    assert [root.re for root in found] == sorted((root.re for root in found), reverse=True)
    assert sorted(r.multiplicity for r in found) == sorted(m for m, d in exact_multiplicities(p) for _ in range(d))
    with mp.workdps(60):
        left = [complex(z) for k, f in enumerate(factors) for z in roots_60(f) * (power if k == 0 else 1)]
    for root in found:
        for _ in range(root.multiplicity):
            nearest = min(left, key=lambda z: abs(z - complex(root.re, root.im)))
            assert abs(nearest - complex(root.re, root.im)) <= 1e-15 * max(abs(nearest), 1)
            left.remove(nearest)
    assert not left


def test_exact_abscissa_beside_an_exceptional_point():
    """Doubles nearest to (s + r)⁴ have roots that scatter by ε^(1/4), and exact arithmetic finds these."""
    for r in (0.3, 1.8803015465431967, 7.1):
        c = [1.0, 4 * r, 6 * r**2, 4 * r**3, r**4]
        assert exact_abscissa(c) == pytest.approx(float(abscissa_60(c)), rel=1e-15)
        assert 1e-6 < exact_abscissa(c) + r < 1e-2


def test_exact_roots_of_exactly_multiple_roots():
    """(3s + 1)³ (s² + 2): a triple root at −1/3 and ±i√2."""
    found = exact_roots(product(*[[3, 1]] * 3, [1, 0, 2]))
    assert [(r.multiplicity, r.im) for r in found[:2]] == [(1, 2**0.5), (1, -(2**0.5))]
    assert (found[2].re, found[2].im, found[2].multiplicity) == (-1 / 3, 0.0, 3)


@pytest.mark.parametrize("c", [[1, 0, 1.99, 0, 0.44784509906620285], [1, 0, 3, 0, 2.25], [1, 0, 14, 0, 49, 0, 36]])
def test_pairs_of_an_even_polynomial_are_on_the_axis_exactly(c):
    """All roots of p(s) = q(s²) are imaginary where those of q are negative, here (−1.0 ± 0.74) and −1, −4, −9."""
    found = structure(c)
    assert found.abscissa == 0
    assert all(root.re == 0 for root in found.roots)
