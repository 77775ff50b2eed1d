"""Quotients and tangents with a pole in the box: optima in closed form beside poles."""

import math

import casadi as ca
import numpy as np
import pytest

import tmsopt
from tmsopt.models import from_coefficients
from tmsopt.search import solve

x, y = ca.SX.sym("x"), ca.SX.sym("y")
SQUARE = {"x": (0.0, 1.0), "y": (0.0, 1.0)}
MET = 1e-8  # what is asked of every value


def near(u, v):
    """s + 4 − (x − u)² − (y − v)²: the abscissa is least at (u, v), or as near to it as limits allow."""
    return from_coefficients([1, 4 - (x - u) ** 2 - (y - v) ** 2])


def problem(limits, at=(0.3, 0.7), free=None, **asked):
    constraints = {f"limit{k}": text for k, text in enumerate(limits)}
    asked = asked or {"minimize": "abscissa"}
    return tmsopt.Problem(near(*at), free=free or SQUARE, constraints=constraints, **asked)


# Limits, the point aimed at, and the nearest that they allow


def line(u, v, gap):
    """The nearest point with x − y = gap."""
    step = (gap - (u - v)) / 2
    return u + step, v - step


CASES = (
    (("1/(x - y) >= 30",), (0.7, 0.3), line(0.7, 0.3, 1 / 30)),
    (("1/(x - y) >= 1000",), (0.7, 0.3), line(0.7, 0.3, 1e-3)),
    (("1/(x - y) <= -30",), (0.3, 0.7), line(0.3, 0.7, -1 / 30)),
    (("1/(x - y) >= 30", "x >= 0.6"), (0.4, 0.35), (0.6, 0.6 - 1 / 30)),
    (("1/(x - y) == 30",), (0.2, 0.1), line(0.2, 0.1, 1 / 30)),
    (("abs(1/(x - y)) >= 30",), (0.3, 0.7), line(0.3, 0.7, -1 / 30)),
    (("abs(1/(x - y)) >= 30",), (0.7, 0.3), line(0.7, 0.3, 1 / 30)),
    (("x/(y - 0.5) <= -10",), (0.5, 0.0), (0.5 + 4.5 / 101, 45 / 101)),  # the foot on the line x + 10 y = 5
    (("x/(y - 0.5) >= 10",), (0.5, 1.0), (0.5 + 4.5 / 101, 1 - 45 / 101)),  # above the pole, on 10 y − x = 5
    (("tan(9*y) >= 2000",), (0.3, 0.7), (0.3, (math.atan(2000) + 2 * math.pi) / 9)),
    (("tan(9*y) >= 2000", "y <= 0.3"), (0.3, 0.1), (0.3, math.atan(2000) / 9)),
)


@pytest.mark.parametrize(("limits", "aim", "best"), CASES)
def test_optimum_beside_a_pole(limits, aim, best):
    design = tmsopt.solve(problem(limits, aim))
    assert design.status == "optimal"
    assert design.value == pytest.approx(-4 + math.dist(aim, best) ** 2, abs=MET)
    assert (design.parameters["x"], design.parameters["y"]) == pytest.approx(best, abs=1e-7)


@pytest.mark.parametrize(
    ("limits", "aim", "edge"),
    [
        (("(x + 1)/(x + y - 1)**2 >= 400",), (0.0, 0.0), lambda u: 1 - u - np.sqrt((u + 1) / 400)),
        (
            ("1/(x - 0.5) + 1/(y - 0.5) >= 50", "x >= 0.55", "y >= 0.5"),
            (0.9, 0.9),
            lambda u: np.where(u < 0.55, np.nan, 0.5 + 1 / (50 - 1 / (np.maximum(u, 0.55) - 0.5))),
        ),
    ],
)
def test_edges_that_are_curved(limits, aim, edge):
    """The nearest point by a scan of the edge, 1e-6 from the next: its distance is right to 1e-12."""
    across = np.linspace(0, 1, 1_000_001)
    squared = (across - aim[0]) ** 2 + (edge(across) - aim[1]) ** 2
    assert tmsopt.solve(problem(limits, aim)).value == pytest.approx(-4 + float(np.nanmin(squared)), abs=MET)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    ("limit", "aim", "gap"), [("1/(x - y) >= 1000", (0.9, 0.1), 1e-3), ("1/(y - x) >= 300", (0.2, 0.9), -1 / 300)]
)
def test_the_side_of_a_pole_does_not_depend_on_the_seed(limit, aim, gap, seed):
    design = tmsopt.solve(problem((limit,), aim), seed=seed)
    assert design.value == pytest.approx(-4 + math.dist(aim, line(*aim, gap)) ** 2, abs=MET)


@pytest.mark.parametrize(
    ("asked", "best"),
    [
        ({"minimize": "abs(1/(x - y) - 20) + 1e-3*x"}, 0.05e-3),  # x − y = 1/20 with the least x
        ({"maximize": "min(1/(x - 0.4), 7) - x"}, 7 - 0.4),  # not attained: 1/(x − 0.4) has no value at 0.4
        ({"minimize": "max(tan(3*x), -2) + y"}, -2.0),
    ],
)
def test_objectives_with_poles(asked, best):
    design = tmsopt.solve(problem((), **asked))
    assert design.value == pytest.approx(best, abs=MET)


def test_what_no_side_of_a_pole_allows():
    """x − y ≤ 1/30 and ≥ 1/20."""
    design = tmsopt.solve(problem(("1/(x - y) >= 30", "x - y >= 0.05")), throw=False)
    assert design.status == "infeasible"


def test_members_of_a_family_with_poles():
    for least in (30.0, 100.0, 1000.0):
        stated = problem((f"1/(x - y) >= {least}",), (0.7, 0.3))
        best = -4 + math.dist((0.7, 0.3), line(0.7, 0.3, 1 / least)) ** 2
        assert solve(stated).value == pytest.approx(best, abs=MET)
