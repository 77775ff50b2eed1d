"""A front is on the best branch also where two poorer ones cross: against a design that is judged by hand."""

from math import sin

import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_matrices

D = [["0.627 - 1.329*x2", "-1.172*x2"], ["-1.736*x1*x1", "-0.061"]]
K = [["-0.134", "0.26*sin(3*x2)"], ["-1.111*x2", "2.915 + 1.91*x0*x2"]]
FREE = {"x2": (-1.862, 1.681), "x1": (-1.44, 1.669), "x0": (-0.523, 1.434)}
X0, X1, X2 = 1.1854, 1.474, -0.8003
"""On the branch beyond x1 = 1.44, which is the better one where that of x1 < 0 has come to its bound."""

BELOW = -0.0405
"""Above the abscissa of that design."""

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def front():
    problem = tmsopt.Problem(from_matrices(np.eye(2), D, K), {}, FREE, pareto=["abscissa", "sin(4*x0)"])
    return tmsopt.pareto(problem, 9, workers=1)


def test_no_point_is_dominated_by_a_design_of_another_branch(front):
    """Its roots lie left of BELOW by Hurwitz' conditions on the polynomial shifted there."""
    first, last = np.poly1d([1, 0.627 - 1.329 * X2, -0.134]), np.poly1d([1, -0.061, 2.915 + 1.91 * X0 * X2])
    beside, below = np.poly1d([-1.172 * X2, 0.26 * sin(3 * X2)]), np.poly1d([-1.736 * X1 * X1, -1.111 * X2])
    _, a1, a2, a3, a4 = (first * last - beside * below)(np.poly1d([1, BELOW])).coeffs
    assert min(a1, a2, a3, a4, a1 * a2 * a3 - a3**2 - a1**2 * a4) > 1e-5
    assert all(p.objectives[0] < BELOW or p.objectives[1] < sin(4 * X0) for p in front.points)


def test_the_ends_have_their_labels_where_better_ones_were_found_on_the_way(front):
    """With sin 4 x0 = -1 the branch beyond x1 = 1.44 has the abscissa -0.038, the other -0.020."""
    assert [front.points[k].label for k in (0, -1)] == ["least abscissa", "least sin(4*x0)"]
    assert front.points[-1].objectives == pytest.approx((-0.0385, -1), abs=1e-4)
