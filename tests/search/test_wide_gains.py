"""Boxes of gains so wide that the best ones are a speck of them beside zero."""

import numpy as np
import pytest

import tmsopt
from tmsopt.models import canonical, whipple

STATES = ("k_phi", "k_phidot", "k_delta", "k_deltadot")


def placed(parameters, root):
    """The gains with all four roots at one place: the determinant is linear in them."""
    M, C1, K0, K2 = (np.array(x, dtype=float) for x in canonical(parameters))
    v, g = parameters["v"], parameters["g"]

    def coefficients(gains):
        phi, phidot, delta, deltadot = gains
        D, K = v * C1, g * K0 + v * v * K2
        D[1] += phidot, deltadot
        K[1] += phi, delta
        rows = [[np.array([M[i, j], D[i, j], K[i, j]]) for j in (0, 1)] for i in (0, 1)]
        return np.convolve(rows[0][0], rows[1][1]) - np.convolve(rows[0][1], rows[1][0])

    still = coefficients(np.zeros(4))
    slopes = np.array([coefficients(unit) - still for unit in np.eye(4)]).T
    return np.asarray(np.linalg.solve(slopes[1:], (still[0] * np.poly([root] * 4) - still)[1:]))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("speed", "ends", "limits", "root"),
    [
        (5.44, ((-308, 0), (-31, 31), (-12, 12), (-40, 40)), {}, -4.0),
        (2.53, ((-409, 409), (-319, 0), (-328, 328), (0, 171)), {"torque": "torque_per_degree <= 0.3"}, -2.97),
    ],
)
@pytest.mark.slow
def test_gains_that_place_all_roots_are_not_overlooked(speed, ends, limits, root, seed):
    bicycle = {"g": 9.81, **tmsopt.read_bicycle("problems/bicycles/browser-rider.txt").parameters, "v": speed}
    known = placed(bicycle, root)
    assert all(low <= k <= high for (low, high), k in zip(ends, known, strict=True))
    assert not limits or abs(np.radians(known[0])) <= 0.3
    free = dict(zip(STATES, ends, strict=True))
    found = tmsopt.solve(
        tmsopt.Problem(whipple, fixed=bicycle, free=free, constraints=limits, minimize="abscissa"), seed=seed
    )
    assert found.abscissa <= root
