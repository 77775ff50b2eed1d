"""Limits that are flat where they bind: met to 1e-9 they leave 1e-4 of a parameter, and are judged in that."""

import pytest
from helpers.skates import skate

import tmsopt
from tmsopt.evaluation import recheck

FREE = {"chi_B": (1.01, 5.0), "Fr": (0.01, 10.0), "lambda_s": (0.02, 1.4)}
DESIGN = {"chi_B": 1.5, "lambda_s": 0.4}


def bicycle(*limits, **asked):
    return skate(FREE, constraints={f"limit{k}": text for k, text in enumerate(limits)}, **asked)


def violated(limit, **parameters):
    problem = bicycle(limit, minimize="abscissa")
    return set(recheck(problem.posed, problem.posed.ordered({**DESIGN, **parameters})).violations)


@pytest.mark.parametrize(
    "limit",
    [
        "(Fr - 1.7)**4 <= 0",
        "0 >= 3 * (Fr - 1.7)**2",
        "(Fr - 1.7)**4 == 0",
        "(Fr - 1.7)**4 * chi_B <= 0",
        "Fr**2 - 3.4 * Fr + 2.89 <= 0",
    ],
)
def test_a_limit_that_one_speed_meets(limit):
    """The excess is 1e-16 or 1e-8 at 1e-4 from it, where nothing within 1e-9 of the box, which is 10 wide, meets it."""
    assert violated(limit, Fr=1.7) == set()
    assert violated(limit, Fr=1.7 + 4e-16) == set()
    assert violated(limit, Fr=1.6999) == {"limit0"}
    assert violated(limit, Fr=1.7001) == {"limit0"}


@pytest.mark.parametrize(
    ("limit", "speed"),
    [
        ("Fr <= 1.7", 1.7 + 5e-10),  # off by less than 1e-9 of the range
        ("1000 * Fr <= 1700", 1.7 + 1e-12),
        ("(Fr - 1.7)**3 <= 0", 1.7 + 5e-10),
        ("chi_H - 0.1 * 10 * Fr / Fr <= 0", 1.3),  # rounding alone, whatever the design
        ("abscissa <= abscissa + 0 * Fr", 1.3),
    ],
)
def test_what_rounding_leaves_is_no_violation(limit, speed):
    assert violated(limit, Fr=speed) == set()


@pytest.mark.parametrize("limit", ["abs(Fr - 1.7) <= 0", "(Fr - 1.7)**5 == 0", "(Fr - 1.7)**4 * (1 + chi_B**2) <= 0"])
def test_no_wrong_optimum_where_a_limit_leaves_one_speed(limit):
    """What is not within 1e-8 of 1.7 is not said to be optimal, nor that there is nothing."""
    design = tmsopt.solve(bicycle(limit, maximize="Fr"), throw=False, starts=12)
    assert design.status != "infeasible"
    assert design.status != "optimal" or design.value == pytest.approx(1.7, abs=2e-8)


def test_a_limit_that_is_flat_elsewhere_has_its_price():
    """Of x² ≤ 1e-4 the price is that of x over 2 x: 50."""
    design = tmsopt.solve(bicycle("(Fr - 1.7)**2 <= 1e-4", maximize="Fr"))
    assert (design.value, design.active["limit0"]) == (pytest.approx(1.71, abs=1e-9), pytest.approx(50))
