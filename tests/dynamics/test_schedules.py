"""What `speeds` and `simulate` look at: the design that `solve` finds for all scenarios, not one of the middle speed."""

import numpy as np
import pytest
from helpers import bicycles

import tmsopt

SCHEDULE = "problems/gain_schedule.toml"


@pytest.fixture(scope="module")
def design():
    return tmsopt.solve(SCHEDULE)


def abscissa(p, v):
    """By LAPACK, of the published matrices with the gains of the schedule at a speed."""
    return bicycles.abscissa(p, v, (p["k_phi"], p["k_phidot"] + p["k_phidot_v"] * v, 0.0, 0.0))


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
