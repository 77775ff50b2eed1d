"""Multiplicity structures of any degree up to 12, against roots that the polynomial was made from.

Polynomials are products of rational factors in exact arithmetic, rounded once to doubles; nothing is judged by
recomputed roots. Perturbations are made at a known distance, to first order: across the tangent space of the set of
polynomials with the structure, spanned by exact derivatives, in units of the exact terms of each coefficient.
"""

from fractions import Fraction as F

import flint
import numpy as np
import pytest
import sympy

import tmsopt
from tmsopt.models import from_matrices
from tmsopt.roots import (
    backward_error,
    discriminant,
    pattern,
    pattern_distance,
    product,
    roots,
    structure,
)
from tmsopt.roots.patterns import nearest_double, nearest_roots

WORDS = ("", "pair", "two pairs", "three pairs", "four pairs", "five pairs", "six pairs")


def polynomial(items):
    factors = [f for re, im, m in items for f in [[F(1), -2 * re, re**2 + im**2] if im else [F(1), -re]] * m]
    return product([F(1)], *factors)


def doubles(coefficients, unit=1.0):
    return np.array([float(c) for c in coefficients]) * unit ** np.arange(len(coefficients))


def named(items):
    """Roots on the rightmost line: higher multiplicities first, then pairs, then a simple real root.

    A quartic with two real double roots is 2EP2 wherever they are, and one with a double pair is CEP2.
    """
    if sorted((m, im == 0) for _, im, m in items) == [(2, True)] * 2:
        return "2EP2"
    right = max(re for re, _, _ in items)
    line = [(m, im == 0) for re, im, m in items if re == right]
    parts = [("EP" if real else "CEP") + str(m) for m, real in sorted(line, reverse=True) if m > 1]
    parts += [WORDS[sum(m == 1 and not real for m, real in line)]]
    return "+".join(p for p in [*parts, "real" if (1, True) in line else ""] if p)


def every_root(items):
    return [(complex(re, w), m) for re, im, m in items for w in ({float(im), -float(im)})]


def assert_same(found, items, unit, within):
    left = every_root(items)
    assert len(found) == len(left)
    for root in found:
        z, m = min(left, key=lambda item: abs(item[0] - complex(root.re, root.im) / unit))
        assert m == root.multiplicity
        assert abs(z - complex(root.re, root.im) / unit) <= within
        left.remove((z, m))


def random_items(rng, degree):
    """Roots in tenths, 0.4 or more apart, of any multiplicities that make up the degree, ties likely."""
    items = []
    while left := degree - sum(m * (2 if im else 1) for _, im, m in items):
        im = F(int(rng.integers(4, 30)), 10) if rng.random() < 0.5 else F(0)
        re = items[0][0] if items and rng.random() < 0.3 else F(int(rng.integers(-40, 11)), 10)
        m = int(rng.integers(1, left + 1)) if rng.random() < 0.7 else 1
        apart = all(max(abs(re - a), abs(im - b)) >= F(4, 10) for a, b, _ in items)
        if apart and m * (2 if im else 1) <= left:
            items.append((re, im, m))
    return items


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5, 6, 8])
def test_every_structure_is_found_in_any_unit_of_time(degree):
    rng = np.random.default_rng(degree)
    for _ in range(80 if degree == 4 else 12):
        items = random_items(rng, degree)
        unit = 10.0 ** rng.integers(-6, 7)
        found = structure(-0.3 * doubles(polynomial(items), unit), 1e-11)
        assert found.name == named(items), items
        assert found.distance <= 1e-14
        # the factors of a structure 0.4 apart lose 6 digits at most: 1e-9 leaves some
        assert_same(found.roots, items, unit, 1e-9)


LARGE = [
    [(F(-13, 10), 0, 12)],
    [(F(-13, 10), F(7, 10), 6)],
    [(-1, 0, 6), (-1, 2, 3)],
    [(-1, 1, 2), (-1, 2, 2), (-1, 3, 1), (-1, 0, 2)],
    [(-1, k, 1) for k in range(1, 7)],
    [(-k, 0, 2) for k in (1, 2, 4, 8, 16, 32)],
    [(0, 0, 7), (-1, 0, 5)],
    [(F(-1, 100), 0, 3), (-1, 1, 2), (-100, 0, 4), (-1000, 0, 1)],
]


@pytest.mark.parametrize("items", LARGE)
def test_degree_12_and_roots_of_very_different_size(items):
    for unit in (1.0, 3.7e-5):
        found = structure(doubles(polynomial(items), unit), 1e-11)
        assert found.name == named(items)
        assert_same(found.roots, items, unit, 1e-7 * max(abs(z) for z, _ in every_root(items)))


def test_roots_that_are_multiple_left_of_the_line_are_counted_and_not_named():
    found = structure(doubles(polynomial([(-1, 0, 1), (-3, 1, 2), (-5, 0, 3)])), 1e-11)
    assert found.name == "real"
    assert sorted(r.multiplicity for r in found.roots) == [1, 2, 2, 3]


def test_exact_ones_come_before_those_that_pass_for_a_higher_multiplicity():
    """Two triple roots 0.01 apart are within 1e-6 of a 5-fold and a simple one, which has as many conditions."""
    items = [(-1, 0, 3), (F(-101, 100), 0, 3)]
    found = structure(doubles(polynomial(items)), 1e-6)
    assert (found.name, found.distance <= 1e-14) == ("EP3", True)
    assert [r.multiplicity for r in found.roots] == [3, 3]


# Tolerance


def across(items, rng):
    """The terms of each coefficient, and a relative change of length 1 across the set with the structure."""
    p = polynomial(items)
    size = np.poly([-abs(z) for z, m in every_root(items) for _ in range(m)])
    columns = []
    for k, (re, im, m) in enumerate(items):
        lower = [*items[:k], *([(re, im, m - 1)] if m > 1 else []), *items[k + 1 :]]
        for power in ([F(1), F(0)], [F(1)]) if im else ([F(1)],):
            column = product(polynomial(lower), power)
            columns.append([0.0] * (len(p) - len(column)) + [float(c) for c in column])
    tangent = np.array(columns).T / size[:, None]
    basis, _ = np.linalg.qr(tangent[1:])
    change = rng.choice([-1, 1], len(p) - 1) * rng.uniform(0.5, 1, len(p) - 1)
    change = change - basis @ (basis.T @ change)
    return size, np.concatenate([[0.0], change / np.linalg.norm(change)])


STRUCTURES = [
    [(-1, 0, 6)],
    [(-1, 0, 3), (-3, 0, 1), (-4, 2, 1)],
    [(-1, 0, 2), (-3, 0, 1), (-4, 2, 1), (-6, 0, 1)],
    [(-1, 1, 2), (-3, 0, 2)],
    [(-1, 1, 3), (-3, 0, 1)],
    [(-2, 0, 5), (-5, 0, 3)],
    [(-2, 0, 12)],
]


@pytest.mark.parametrize("tolerance", [1e-11, 1e-8])
@pytest.mark.parametrize("items", STRUCTURES)
def test_a_structure_is_named_within_the_tolerance_and_not_beyond(items, tolerance):
    """By a percent at 1e-8, where rounding is nothing and the second order less than that; at 1e-11 by a tenth.

    The terms are those of the polynomial's own roots: next to a 12-fold one these scatter by a fifth, and the sum over
    12 of them changes the terms by a tenth.
    """
    rng = np.random.default_rng(3)
    slack = 0.2 if items[0][2] == 12 else 0.01 if tolerance == 1e-8 else 0.1
    size, change = across(items, rng)
    within = structure(doubles(polynomial(items)) + (1 - slack) * tolerance * size * change, tolerance)
    assert within.name == named(items)
    assert sorted(r.multiplicity for r in within.roots) == sorted(m for _, m in every_root(items))
    assert within.distance == pytest.approx((1 - slack) * tolerance, rel=slack)
    if len([m for _, _, m in items if m > 1]) == 1:
        whole = pattern(named(items), len(size) - 1)
        moved = doubles(polynomial(items)) + tolerance * size * change
        assert pattern_distance(whole, moved) == pytest.approx(tolerance, rel=slack)
    beyond = structure(doubles(polynomial(items)) + (1 + slack) * tolerance * size * change, tolerance)
    assert sorted(r.multiplicity for r in beyond.roots) != sorted(m for _, m in every_root(items))


# The nearest polynomial in ball arithmetic


@pytest.mark.parametrize("items", [i for i in LARGE if named(i) != "real"])
def test_certified_roots_of_an_exact_structure_are_the_roots_it_was_made_from(items):
    """The nearest polynomial with the structure is the polynomial itself, whose coefficients are exact fractions."""
    p = polynomial(items)
    shown = structure(doubles(p), 1e-11)
    with flint.ctx.workprec(424):
        found = nearest_roots([flint.fmpq(c.numerator, c.denominator) for c in p], shown.roots)
        assert found is not None
        # a ball about 0 has no nearest double
        rounded = {(complex(nearest_double(z.re) or 0, nearest_double(z.im)), z.multiplicity) for z in found}
    assert rounded == set(every_root(items))


# Roots, stability and discriminant beyond degree 4


def test_roots_are_jointly_right_up_to_degree_12():
    """Each coefficient within 1e-13 of its terms, next to multiple roots and for sizes from 1e-3 to 1e3."""
    rng = np.random.default_rng(5)
    for degree in range(5, 13):
        for spread in (1, F(1, 1000), F(1000)):
            for _ in range(4):
                items = [
                    (re * spread if k % 2 else re, im, m) for k, (re, im, m) in enumerate(random_items(rng, degree))
                ]
                c = doubles(polynomial(items))
                assert backward_error(c, roots(c)) <= 1e-13, items


def test_discriminant_of_any_degree():
    """Against SymPy's resultant, exactly."""
    rng = np.random.default_rng(7)
    for degree in range(2, 10):
        c = [int(x) for x in rng.integers(1, 9, degree + 1)]
        expected = sympy.discriminant(sympy.Poly(c, sympy.Symbol("x")))
        assert discriminant([F(x) for x in c]) == F(int(expected))
    assert discriminant([F(x) for x in polynomial(LARGE[2])[:]]) == 0
    with pytest.raises(ValueError, match="degree"):
        discriminant([1, 2])


# Solved and proved


def test_three_pairs_on_one_line_are_proved():
    """Three masses in a chain, dampers on two, the last spring free: three pairs at −1/2 for c = (2, 1), k1 = 1.

    The trace of the damping matrix is twice the sum of the pairs' decay rates, so 3/2 is shared by three.
    """
    damping, springs = [["c1", 0, 0], [0, "c2", 0], [0, 0, 0]], [[2, -1, 0], [-1, 2, -1], [0, -1, "k1"]]
    model = from_matrices(np.eye(3), damping, springs)
    free = {"c1": (0.0, 10.0), "c2": (0.0, 10.0), "k1": (1.0, 4.0)}
    design = tmsopt.solve(tmsopt.Problem(model=model, free=free, minimize="abscissa"))
    assert design.structure == "three pairs"
    assert design.abscissa == pytest.approx(-sum(design.parameters[n] for n in ("c1", "c2")) / 6, rel=1e-14)
    proof = tmsopt.prove(design)
    assert (proof.proved, proof.pattern) == (True, "three pairs")
    assert float(proof.abscissa) == pytest.approx(-0.5, abs=1e-14)
