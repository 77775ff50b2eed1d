"""Nearest points of systems of higher degree, where roots of high multiplicity stand on the boundary."""

import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_matrices


def _system(seed: int, degree: int, count: int) -> tmsopt.Problem:
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


def test_a_run_without_a_rival_goes_on_until_it_ends():
    """No ray meets heavy damping here, and no start comes to it within the first 200 iterations."""
    found = tmsopt.nearest(_system(107, 10, 8), "heavy damping")
    assert found.distance == pytest.approx(6.83834024, rel=1e-7)


@pytest.mark.slow
def test_a_point_whose_distance_is_known_to_a_few_digits_is_not_refined():
    """A fivefold and a sixfold root: 1.469987821913869 by Newton's method with 50 digits on these multiplicities."""
    found = tmsopt.nearest(_system(3, 12, 24), "heavy damping")
    assert found.distance == pytest.approx(1.469987821913869, rel=1e-8)
    assert not found.refined
