"""Nearest points of systems of higher degree, where roots of high multiplicity stand on the boundary."""

from fractions import Fraction

import flint
import numpy as np
import pytest
from helpers.curves import sturm

import tmsopt
from tmsopt.models import from_matrices


def _system(seed, degree, count):
    """A random stable matrix with some of its entries as parameters."""
    rng = np.random.default_rng(seed)
    numbers = rng.normal(size=(degree, degree)) * 0.5 - np.eye(degree) * 2.5
    matrix = [[repr(float(v)) for v in row] for row in numbers]
    places = [(i, j) for i in range(degree) for j in range(degree)]
    rng.shuffle(places)
    fixed = {}
    for i, j in places[:count]:
        fixed[f"p{i}_{j}"], matrix[i][j] = float(numbers[i, j]), f"p{i}_{j}"
    return tmsopt.Problem(from_matrices(A=matrix), fixed=fixed)


@pytest.mark.slow
def test_a_run_without_a_rival_goes_on_until_it_ends():
    """No ray meets heavy damping here, and no start comes to it within 200 iterations; later one does."""
    assert 0 < tmsopt.nearest(_system(107, 10, 8), "heavy damping").distance < np.inf


@pytest.mark.slow
def test_a_point_whose_distance_is_known_to_a_few_digits_is_not_refined():
    """A fivefold and a sixfold root: 1.469987821913869 by Newton's method with 50 digits on these multiplicities."""
    found = tmsopt.nearest(_system(3, 12, 24), "heavy damping")
    assert found.distance == pytest.approx(1.469987821913869, rel=1e-8)
    assert not found.refined


@pytest.mark.parametrize(
    ("system", "inside"),
    [  # thousandths of each parameter's size, in the order of `direction`: a point with real roots alone
        ((27, 6, 6), (-963, -355, 862, 858, -41, 705)),
        ((19, 8, 16), (-197, -103, 1351, -738, -99, 140, 1028, 121, 1376, 285, -332, -73, 93, -296, 123, 319)),
    ],
)
def test_no_point_of_heavy_damping_that_is_known_is_nearer(system, inside):
    """Different negative roots, as many as the degree, by Sturm's theorem on the matrix in fractions.

    The starts that are most damped led to 2.50 and 3.30, locally nearest points both.
    """
    problem = _system(*system)
    found = tmsopt.nearest(problem, "heavy damping")
    own = {n: Fraction(problem.fixed[n]) for n in found.direction}
    there = {n: x + abs(x) * Fraction(k, 1000) for (n, x), k in zip(own.items(), inside, strict=True)}
    assert sturm(_characteristic(*system, there)) == (system[1], 0, 0)
    assert found.refined
    assert found.distance < np.linalg.norm(inside) / 1000


def _characteristic(seed, degree, count, parameters):
    """det(s − A) of the system at other parameters, highest power first."""
    drawn = np.random.default_rng(seed).normal(size=(degree, degree)) * 0.5 - np.eye(degree) * 2.5
    assert len(parameters) == count
    matrix = [
        [parameters.get(f"p{i}_{j}", Fraction(x)) for j, x in enumerate(row)] for i, row in enumerate(drawn.tolist())
    ]
    polynomial = flint.fmpq_mat(degree, degree, [flint.fmpq(x.numerator, x.denominator) for row in matrix for x in row])
    return [Fraction(int(c.p), int(c.q)) for c in reversed(polynomial.charpoly().coeffs())]
