"""Numbers of real roots against polynomials with known roots and exact Sturm chains."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest
from helpers import curves
from hypothesis import given, settings, strategies as st

from tmsopt.roots import product, real_roots

repeatable = settings(max_examples=80, deadline=None, derandomize=True)


def counted(coefficients):
    negative, positive = real_roots(np.array(coefficients, dtype=float))
    return int(negative), int(positive)


def exact(coefficients):
    """By Sturm's chain in fractions, for the coefficients as stored."""
    negative, _, positive = curves.sturm([Fraction(float(c)) for c in coefficients])
    return negative, positive


integer = st.integers(-6, 6)


@repeatable
@given(
    st.lists(integer, max_size=8),
    st.lists(st.tuples(integer, st.integers(1, 9)), max_size=3),
    st.sampled_from([1, -1, 3]),
)
def test_known_roots_of_degrees_2_to_8(real, pairs, lead):
    """Real roots r, repeated as drawn, and pairs a ± i√b, as integer polynomials: counted by hand."""
    factors = [[1, -r] for r in real] + [[1, -2 * a, a * a + b] for a, b in pairs]
    c = [lead * k for k in product(*factors)]
    if not 2 <= len(c) - 1 <= 8:
        return
    assert max(map(abs, c)) < 2**53
    assert counted(c) == (sum(r < 0 for r in set(real)), sum(r > 0 for r in set(real)))


@pytest.mark.parametrize("degree", [2, 3, 4, 5, 8])
def test_random_coefficients_of_every_degree(degree):
    rng = np.random.default_rng(degree)
    c = rng.normal(size=(60, degree + 1)) * 10.0 ** rng.uniform(-3, 3, (60, degree + 1))
    assert np.transpose(real_roots(c)).tolist() == [[*exact(row)] for row in c]


@pytest.mark.parametrize("order", [2, 4, 6])
@pytest.mark.parametrize("size", [0.0, 1e-16, 1e-13, 1e-10, 1e-4])
def test_beside_an_exceptional_point(order, size):
    """(s + 1)^n with coefficients changed by `size`; the count is exact for the coefficients as stored."""
    rng = np.random.default_rng(order)
    c = np.array([comb(order, k) for k in range(order + 1)], dtype=float) * np.ones((25, 1))
    c[:, 1:] *= 1 + size * rng.choice([-1.0, 0.0, 1.0, 0.37], c[:, 1:].shape)
    assert np.transpose(real_roots(c)).tolist() == [[*exact(row)] for row in c]


@pytest.mark.parametrize(
    "factors",
    [
        [[1, 0, 0, 0, -1]],  # s⁴ − 1: the chain drops three degrees at once
        [[1, 0, 0, 0, 1]],
        [[1, 0, 0, 0, 0, 0, 0, 0, -1]],
        [[1, 0, 0, 0, 0, 1]],
        [[1, 0, -1], [1, 0, -4]],  # even
        [[1, 0]],
        [[2, 3]],
    ],
)
def test_special_sequences(factors):
    c = product(*factors)
    for same in (c, [-k for k in c], [k * (-1) ** i for i, k in enumerate(c)]):
        assert counted(same) == exact(same)


@pytest.mark.parametrize("scale", [1e-60, 1e-8, 1e8, 1e60])
def test_scales_of_root_and_leading_coefficient_do_not_matter(scale):
    """(s + 1)(s + 2)(s − 3)(s² + 1) in s/scale, times any factor, far from overflow."""
    c = np.array(product([1, 1], [1, 2], [1, -3], [1, 0, 1]), dtype=float)
    assert counted(c * scale) == (2, 1)
    assert counted(c * scale ** np.arange(6)) == (2, 1)
    assert counted(c * 2.0 ** -np.arange(6.0) * -scale) == (2, 1)


@pytest.mark.parametrize(
    "c",
    [
        [1.0, -63.45483490561214, 1017.232023002181, -336.35398658904313, 26.465713768042725],  # four positive
        [1.0, 3850.58034704624, 0.2660469595135265, 4.678182901274241e-06, 2.8442763160104014e-12],  # four negative
        [1.0, 3313.543621875525, 0.1040664897257225, -4.871750239188283e-06, -1.5592497370933543e-10],  # a pair
    ],
)
def test_a_double_root_among_roots_of_other_size(c):
    """A double root, 30 to 1e8 times as large or small as another root, moved by the rounding of the coefficients."""
    assert counted(c) == exact(c)


def test_shape_follows_the_leading_axes():
    assert np.shape(real_roots(np.broadcast_to([1.0, 3.0, 2.0], (4, 5, 3)))) == (2, 4, 5)
    assert real_roots(np.empty((0, 5)))[0].shape == (0,)


@pytest.mark.parametrize("c", [[0.0, 1.0, 2.0], [1.0, np.nan, 2.0], [1.0, np.inf], [1.0], 3.0])
def test_what_is_no_polynomial_is_refused(c):
    with pytest.raises(ValueError, match="leading one must not be 0"):
        real_roots(c)
