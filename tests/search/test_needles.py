"""Optima that stand in needles where a0 may vanish: roots, or pairs, of full multiplicity lead there."""

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import pytest

import tmsopt

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


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 3))])
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
@pytest.mark.parametrize("goal", ["v", "m_H", "x_B", "-lambda_s"])
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


@pytest.mark.parametrize(
    ("violation", "slope", "ended"), [(1e-12, 1e-5, True), (1e-7, 1e-12, True), (1e-7, 1e-7, False)]
)
def test_an_end_off_the_rows_is_no_optimum(violation, slope, ended):
    """IPOPT says that it succeeded of rows as it scales them; beside a pole they are large, and polished all the same."""
    run = SimpleNamespace(status="Solve_Succeeded")
    point = SimpleNamespace(violation=violation, stationarity=slope)
    trial = SimpleNamespace(end=SimpleNamespace(run=run), point=point, tuning=tmsopt.TUNING)
    assert import_module("tmsopt.search.acceptance").has_converged(trial) is ended
