"""What `speeds` and `simulate` look at: the design that `solve` finds for all scenarios, not one of the middle speed."""

import numpy as np
import pytest

import tmsopt
from tmsopt.models import canonical

SCHEDULE = "problems/gain_schedule.toml"


@pytest.fixture(scope="module")
def design():
    return tmsopt.solve(SCHEDULE)


def abscissa(p, v):
    """By LAPACK, of the published matrices with the gains of the schedule at a speed."""
    M, C1, K0, K2 = (np.array(B, dtype=float) for B in canonical(p))
    gains = (
        np.array([[0.0, 0.0], [p["k_phi"], 0.0]]),
        np.array([[0.0, 0.0], [p["k_phidot"] + p["k_phidot_v"] * v, 0.0]]),
    )
    K, D = p["g"] * K0 + v * v * K2 + gains[0], v * C1 + gains[1]
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    return np.linalg.eigvals(A).real.max()


def test_the_speeds_of_a_file_are_those_of_its_schedule(design):
    found = tmsopt.speeds(SCHEDULE)
    (band,) = found.stable
    assert band[0] < 1
    assert band[1] > 6
    for end in band:  # either side of an end, at a distance of 1e-4 of it
        assert abscissa(design.parameters, end * (1 - 1e-4)) * abscissa(design.parameters, end * (1 + 1e-4)) < 0


def test_the_motion_of_a_file_is_that_of_its_schedule(design):
    by_file, by_design = (tmsopt.simulate(of, push=0.3, seconds=2, at={"v": 1.5}) for of in (SCHEDULE, design))
    assert np.array(by_file["phi"]) == pytest.approx(np.array(by_design["phi"]), abs=1e-12)
    p = {**design.parameters, "v": 1.5}
    torque = (p["k_phidot"] + 1.5 * p["k_phidot_v"]) * np.array(by_file["phidot"]) + p["k_phi"] * np.array(
        by_file["phi"]
    )
    assert np.array(by_file["T_delta"]) == pytest.approx(-torque, abs=1e-10)


@pytest.mark.parametrize(
    ("at", "said"), [({"u": 1.0}, "unknown parameter 'u'"), ({"v": -1.0}, "forward speed is >= 0")]
)
def test_other_values_are_checked(design, at, said):
    with pytest.raises(tmsopt.InputError, match=said):
        tmsopt.simulate(design, at=at)
