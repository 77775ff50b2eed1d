"""Traps of the search, each once fallen into: what is known of the answer does not depend on how it is looked for."""

import warnings

import numpy as np
import pytest

import tmsopt
from tmsopt.evaluation import find_worst_cases

TMS = tmsopt.models.tms
HEIGHTS = {"chi_H": 1.0, "mu": 0.1, "zeta_B": -0.4, "zeta_H": -0.2}
WIDE = {"chi_B": (1.01, 3.0), "lambda_s": (0.05, 1.2)}
BAND_OPTIMUM = -0.3778543571
"""Of the band Fr = 1.2 … 2.4, by differential evolution over 2 401 speeds (tests/search/test_problems.py, speed_band)."""


@pytest.mark.parametrize("points", [2, 6])  # 7 in tests/search/test_problems.py
def test_points_of_a_band_do_not_matter(points):
    """With 6 points a search once ended where two factors share a double root, which then cannot become a pair."""
    band = {"Fr": {"min": 1.2, "max": 2.4, "points": points}}
    found = tmsopt.solve(tmsopt.Problem(TMS, fixed=HEIGHTS, free=WIDE, scenarios=band, minimize="abscissa"))
    assert found.value == pytest.approx(BAND_OPTIMUM, abs=1e-9)


@pytest.mark.slow
def test_a_relaxation_over_a_band_holds_over_the_whole_band():
    problem = tmsopt.Problem(
        TMS,
        fixed=HEIGHTS,
        free=WIDE,
        scenarios={"Fr": {"min": 1.2, "max": 2.4, "points": 3}},
        minimize="chi_B",
        constraints={"decay": "abscissa <= -1"},
    )
    relaxation = tmsopt.solve(problem, throw=False).relaxation
    assert relaxation.amounts["decay"] == pytest.approx(1 + BAND_OPTIMUM, abs=1e-7)


@pytest.mark.parametrize("n", [4, 7])
@pytest.mark.parametrize("width", [0.1, 0.5])
def test_a_worst_case_along_an_edge_of_many_tolerances(n, width):
    """A smooth peak along one edge of the box, 1 high, on n − 1 sides of height 1: the worst value is n."""
    at = {**HEIGHTS, "chi_B": 1.3, "lambda_s": 0.15, "Fr": 1.8}
    units = [f"(({name} - ({value}))/0.01)" for name, value in list(at.items())[:n]]
    peak = f"exp(-(({units[0]} - 0.43)/{width})**2) + {' + '.join(units[1:])} <= 0"
    tolerances = dict.fromkeys(list(at)[:n], 0.01)
    problem = tmsopt.Problem(TMS, fixed=at, tolerances=tolerances, constraints={"peak": peak})
    assert find_worst_cases(problem.posed, problem.posed.ordered({}))["constraint peak"].value == pytest.approx(
        n, abs=1e-8
    )


@pytest.mark.slow
def test_no_warning_where_a_start_runs_into_a_singular_mass_matrix():
    problem = tmsopt.Problem(
        TMS,
        fixed={"chi_H": 1.0, "mu": 0.1, "zeta_B": -0.3, "zeta_H": -0.3},
        free={"Fr": (0.5, 3.0), "chi_B": (0.5, 2.0), "lambda_s": (-0.7, 0.7)},
        minimize="abscissa",
        constraints={"fast": "Fr/sqrt(chi_B) <= 1.5", "tilt": "abs(tan(lambda_s))/chi_B <= 0.3"},
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = tmsopt.solve(problem, throw=False, starts=16)
    assert found.status == "optimal" or not any("wins" in note for note in found.notes)


@pytest.mark.slow
def test_a_relaxation_does_not_depend_on_the_objective():
    """Limits on nu_H that contradict, and an equality: the least move is 0.4877 of one of them, whatever is minimised.

    nu_H falls with zeta_H, which the equality fixes, and with chi_H, which is least at its bound.
    """
    limits = {"low": "nu_H >= 0.0536", "heights": "zeta_B - 2*zeta_H == -0.0952", "high": "nu_H <= -0.107"}
    free = {
        "Fr": (0.6, 3.9),
        "mu": (2.2, 15.0),
        "chi_H": (0.924, 1.0),
        "zeta_B": (-1.34, -1.15),
        "zeta_H": (-1.0, -0.05),
    }
    for asked in ("abscissa", "Fr"):
        problem = tmsopt.Problem(
            TMS, fixed={"chi_B": 1.8, "lambda_s": 0.939}, free=free, constraints=limits, minimize=asked
        )
        relaxation = tmsopt.solve(problem, throw=False).relaxation
        T, zeta_H = np.tan(0.939), (-1.15 + 0.0952) / 2
        needed = (0.924 - 1 - zeta_H * T) / np.sqrt(1 + T * T) + 0.107
        assert dict(relaxation.amounts) == {"high": pytest.approx(needed, abs=1e-9)}


def test_the_bound_over_scenarios_is_that_of_one_of_them():
    """omega0 = −(zeta_B zeta_H)^(−1/4): heights −0.4 and −0.8 are asked for, and nothing of the mean, −0.6."""
    problem = tmsopt.Problem(
        TMS,
        fixed={"chi_H": 1.0, "mu": 0.1, "zeta_H": -0.2},
        free={**WIDE, "Fr": (0.1, 5.0)},
        scenarios={"zeta_B": [-0.4, -0.8]},
        minimize="abscissa",
    )
    found = tmsopt.solve(problem)
    assert found.bound.value == pytest.approx(-((0.4 * 0.2) ** -0.25), rel=1e-12)
    assert found.value > -((0.8 * 0.2) ** -0.25)
