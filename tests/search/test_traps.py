"""Traps of the search, each once fallen into: basins that few starts see, needles, points of bands."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from helpers.skates import FIXED, skate
from helpers.texts import write

import tmsopt
from benchmarks.suites import hard_problem
from benchmarks.suites.narrow_optima import hidden
from tmsopt.evaluation import find_worst_cases
from tmsopt.models import whipple

# Bands and tolerances

WIDE = {"chi_B": (1.01, 3.0), "lambda_s": (0.05, 1.2)}
BAND_OPTIMUM = -0.3778543571
"""Of the band Fr = 1.2 … 2.4, by differential evolution over 2 401 speeds (tests/search/test_problems.py, speed_band)."""


def banded(points, **asked):
    return skate(WIDE, scenarios={"Fr": {"min": 1.2, "max": 2.4, "points": points}}, **asked)


@pytest.mark.parametrize("points", [2, 6])  # 7 in tests/search/test_problems.py
def test_points_of_a_band_do_not_matter(points):
    """With 6 points a search once ended where two factors share a double root, which then cannot become a pair."""
    assert tmsopt.solve(banded(points, minimize="abscissa")).value == pytest.approx(BAND_OPTIMUM, abs=1e-9)


@pytest.mark.slow
def test_a_relaxation_over_a_band_holds_over_the_whole_band():
    asked = banded(3, minimize="chi_B", constraints={"decay": "abscissa <= -1"})
    relaxation = tmsopt.solve(asked, throw=False).relaxation
    assert relaxation.amounts["decay"] == pytest.approx(1 + BAND_OPTIMUM, abs=1e-7)


@pytest.mark.parametrize("n", [4, 7])
@pytest.mark.parametrize("width", [0.1, 0.5])
def test_a_worst_case_along_an_edge_of_many_tolerances(n, width):
    """A smooth peak along one edge of the box, 1 high, on n − 1 sides of height 1: the worst value is n."""
    at = {**FIXED, "chi_B": 1.3, "lambda_s": 0.15, "Fr": 1.8}
    units = [f"(({name} - ({value}))/0.01)" for name, value in list(at.items())[:n]]
    peak = f"exp(-(({units[0]} - 0.43)/{width})**2) + {' + '.join(units[1:])} <= 0"
    tolerances = dict.fromkeys(list(at)[:n], 0.01)
    posed = skate({}, at, tolerances=tolerances, constraints={"peak": peak}).posed
    assert find_worst_cases(posed, posed.ordered({}))["constraint peak"].value == pytest.approx(n, abs=1e-8)


@pytest.mark.slow
def test_no_warning_where_a_start_runs_into_a_singular_mass_matrix():
    free = {"Fr": (0.5, 3.0), "chi_B": (0.5, 2.0), "lambda_s": (-0.7, 0.7)}
    limits = {"fast": "Fr/sqrt(chi_B) <= 1.5", "tilt": "abs(tan(lambda_s))/chi_B <= 0.3"}
    problem = skate(free, {"zeta_B": -0.3, "zeta_H": -0.3}, minimize="abscissa", constraints=limits)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = tmsopt.solve(problem, throw=False, starts=16)
    assert found.status == "optimal" or not any("is better" in note for note in found.notes)


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
    T, zeta_H = np.tan(0.939), (-1.15 + 0.0952) / 2
    needed = (0.924 - 1 - zeta_H * T) / np.sqrt(1 + T * T) + 0.107
    for asked in ("abscissa", "Fr"):
        problem = skate(free, {"chi_B": 1.8, "lambda_s": 0.939}, constraints=limits, minimize=asked)
        relaxation = tmsopt.solve(problem, throw=False).relaxation
        assert dict(relaxation.amounts) == {"high": pytest.approx(needed, abs=1e-9)}


def test_the_bound_over_scenarios_is_that_of_one_of_them():
    """omega0 = −(zeta_B zeta_H)^(−1/4): heights −0.4 and −0.8 are asked for, and nothing of the mean, −0.6."""
    free = {**WIDE, "Fr": (0.1, 5.0)}
    found = tmsopt.solve(skate(free, scenarios={"zeta_B": [-0.4, -0.8]}, minimize="abscissa"))
    assert found.bound.value == pytest.approx(-((0.4 * 0.2) ** -0.25), rel=1e-12)
    assert found.value > -((0.8 * 0.2) ** -0.25)


# Basins that few starts see: a triple root beside zero in a wide box, and a well a thousandth of it wide

TRIPLE = """[model]
M = [[1, 0], [0, 1]]
D = [[0.687, 0.667], [1.2108, "0.507 + k_deltadot"]]
K = [[1.088, -0.058], ["0.895 + k_phi", -0.03792]]
[parameters]
k_phi = { min = -33.5, max = 40.8 }
k_deltadot = { min = -22.5, max = 49.7 }
[objective]
minimize = "abscissa"
"""
WELL = """[model]
coefficients = [1, "2 + x*x/4000 + 3*exp(-x*x*10000)", 9]
[parameters]
x = { min = -60, max = 40 }
[objective]
minimize = "abscissa"
"""


def triple_abscissa(k_phi, k_deltadot):
    """By NumPy's eigenvalues, which scatter beside a triple root and are no better than it is."""
    D = np.array([[0.687, 0.667], [1.2108, 0.507 + k_deltadot]])
    K = np.array([[1.088, -0.058], [0.895 + k_phi, -0.03792]])
    return float(np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -D]])).real.max())


@pytest.mark.parametrize("seed", range(2))
def test_a_triple_root_beside_zero_is_not_overlooked(seed, tmp_path):
    """Three starts agree at −0.2279, far from it."""
    known = triple_abscissa(0.06957112229, 0.19888527776)  # by differential evolution
    assert known < -0.34
    found = tmsopt.solve(write(tmp_path, TRIPLE), seed=seed)
    assert found.value <= known + 1e-6
    assert triple_abscissa(found.parameters["k_phi"], found.parameters["k_deltadot"]) == pytest.approx(
        found.value, abs=1e-3
    )


@pytest.mark.parametrize("seed", range(2))
def test_a_well_of_exponentials_beside_zero_is_found(seed, tmp_path):
    """s² + b s + 9 has the abscissa −b/2 for b < 6: −5/2 at x = 0, where b is 5; elsewhere b is 2.9 at most."""
    assert tmsopt.solve(write(tmp_path, WELL), seed=seed).value == pytest.approx(-2.5, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("number", [78, 179])  # a root at 0 beside a double pair; a start that its run leaves
def test_an_optimum_is_not_lost_after_it_was_met(number, tmp_path):
    """The best of 60,000 designs, polished by SciPy on the eigenvalues, is no better."""
    problem = hidden()[number]
    found = tmsopt.solve(write(tmp_path, problem.text), stability=0.0)
    assert problem.sign * found.value <= problem.sign * problem.value + 1e-7


@pytest.mark.slow
def test_ends_that_claim_more_do_not_hide_the_one_that_is_what_it_claims():
    """A damping ratio is to be 0.0557, which two of three optima only claim; a root of the third is 0."""
    found = tmsopt.solve(hard_problem(175, 3))
    roots = np.roots([float(a) for a in found.problem.posed.values(found.parameters).coefficients])
    swinging = roots[np.abs(roots.imag) > 1e-3]
    assert -swinging.real / np.abs(swinging) == pytest.approx(0.0557, abs=1e-8)
    assert np.all(roots.real <= 1e-9)


# Gains in boxes so wide that the best ones are a speck of them beside zero


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    ("speed", "ends", "limits", "root"),
    [
        (5.44, ((-308, 0), (-31, 31), (-12, 12), (-40, 40)), {}, -4.0),
        (2.53, ((-409, 409), (-319, 0), (-328, 328), (0, 171)), {"torque": "torque_per_degree <= 0.3"}, -2.97),
    ],
)
@pytest.mark.slow
def test_gains_that_place_all_roots_are_not_overlooked(speed, ends, limits, root, seed):
    """The determinant is linear in the gains, and those that place all four roots at `root` are in the box and the limit."""
    bicycle = {"g": 9.81, **tmsopt.read_bicycle("problems/bicycles/browser-rider.txt").parameters, "v": speed}
    free = dict(zip(("k_phi", "k_phidot", "k_delta", "k_deltadot"), ends, strict=True))
    found = tmsopt.solve(
        tmsopt.Problem(whipple, fixed=bicycle, free=free, constraints=limits, minimize="abscissa"), seed=seed
    )
    assert found.abscissa <= root


# Needles where a0 may vanish: roots, or pairs, of full multiplicity lead there

BOX = {"chi_B": (0.4, 2.5), "chi_H": (0.771, 1.0), "zeta_H": (-1.0, -0.1), "lambda_s": (0.159, 0.474)}
LIMITS = {
    "c1": "((chi_H - 0.89)/0.11)*cos(5*((zeta_H + 0.55)/0.45)) >= -0.642",
    "c2": "sin(3*((chi_B - 1.4)/1.1))*sin(4*((zeta_H + 0.55)/0.45)) + ((chi_H - 0.89)/0.11)/2 >= -0.143",
}
NEEDLE = tmsopt.Problem(
    tmsopt.models.tms,
    fixed={"Fr": 1.95, "mu": 4.69, "zeta_B": -1.19},
    free=BOX,
    constraints=LIMITS,
    minimize="abscissa",
)
DEEPEST = -1.8989459
"""By SciPy's SLSQP on eigenvalues, from designs of an evolution; fewer than one in a million random designs is at −1."""

ROBOT = tmsopt.Problem(
    tmsopt.models.tms,
    fixed={"w": 0.25, "m_B": 9.7},
    free={
        "v": (1.7, 3.0),
        "m_H": (0.488, 2.56),
        "x_B": (0.246, 0.363),
        "x_H": (0.193, 0.246),
        "z_B": (-0.293, -0.155),
        "z_H": (-0.3, -0.03),
        "lambda_s": (0.03, 0.7),
    },
    minimize="abscissa",
)


@pytest.mark.parametrize("seed", [0, pytest.param(3, marks=pytest.mark.slow)])
def test_a_double_pair_in_a_needle_is_found(seed):
    assert tmsopt.solve(NEEDLE, seed=seed, stability=0.0).value <= DEEPEST


@pytest.mark.slow
def test_both_root_quantities_at_their_best_at_one_design():
    """No damping ratio is above 1 and no abscissa below the least, so a design with both is the best of any sum."""
    least = tmsopt.solve(ROBOT)
    assert least.structure == "EP4"
    both = tmsopt.solve(replace(ROBOT, minimize=None, maximize="damping_ratio - 0.14*abscissa"), throw=False)
    # Beside a0 = 0 doubles hold such a root to 1e-4 of its size, and it may be said that they do not.
    assert both.value == pytest.approx(1 - 0.14 * least.value, abs=1e-4)
    assert both.violations == {}


@pytest.mark.slow
@pytest.mark.parametrize("goal", ["v", "-lambda_s"])
def test_a_needle_about_the_least_abscissa_is_not_called_empty(goal):
    """The least abscissa is -3.1251038, proved, so -3.125 leaves a needle, at whose end every goal is nearly what it is.

    No design that was looked at is in it.
    """
    robot = tmsopt.load("problems/point_mass_robot.toml")
    least = tmsopt.solve(robot)
    limits = {**robot.constraints, "fast": "abscissa <= -3.125"}
    found = tmsopt.solve(replace(robot, minimize=goal, constraints=limits), throw=False)
    assert found.status == "optimal"
    assert found.abscissa == pytest.approx(-3.125, abs=1e-8)
    assert found.value <= robot.posed.values(least.parameters)[goal.strip("-")] * (-1 if goal.startswith("-") else 1)
