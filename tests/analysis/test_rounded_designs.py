"""Rounded designs beside the same by exact roots of decimals, worked out one by one."""

import math
from dataclasses import replace

import pytest

import tmsopt
from tmsopt import Problem, models
from tmsopt.analysis import list_rounded_designs, round_design
from tmsopt.evaluation import recheck

QUARTIC = models.from_coefficients(["1", "a", "b", "c", "d"], name="quartic")
BOX = {"a": (1.0, 9.0), "b": (1.0, 9.0), "c": (1.0, 9.0), "d": (0.5, 3.0)}


@pytest.mark.parametrize(
    "asked",
    [
        {"free": BOX, "constraints": {"place": "d == 1"}},
        {
            "fixed": {"c": 4.0, "d": 1.0},
            "free": {n: BOX[n] for n in "ab"},
            "constraints": {"fast": "abscissa <= -0.99", "calm": "angular_frequency <= 1e-6"},
        },
    ],
)
def test_whole_numbers_keep_their_ep4(asked):
    """(s + 1)⁴ exactly: numeric roots beside this one are 1e-4 off."""
    _, together = list_rounded_designs(tmsopt.solve(Problem(QUARTIC, locate="EP4", **asked)))
    assert [row.digits for row in together] == [2, 3, 4, 6]
    assert [(row.realised, row.damping_ratio) for row in together] == [(-1.0, 1.0)] * 4
    assert not any(row.violations for row in together)


def test_a_limit_is_violated_in_the_case_that_violates_it_most():
    fixed, free = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2}, {"Fr": (0.01, 10.0), "lambda_s": (0.02, 1.4)}
    layout, mu = {"layout": "chi_B + mu <= 1.5567"}, {"mu": [0.1, 0.2, 0.3]}
    asked = {"free": free | {"chi_B": (1.01, 5.0)}, "constraints": layout, "scenarios": mu, "minimize": "abscissa"}
    alone, together = list_rounded_designs(tmsopt.solve(Problem(models.tms, fixed=fixed, **asked)))
    off = {float(row.written["chi_B"]) + 0.3 - 1.5567: row for row in (alone["chi_B"], *together)}
    assert max(off) > 1e-4
    for excess, row in off.items():
        assert dict(row.violations) == ({"layout": pytest.approx(excess, rel=1e-9)} if excess > 0 else {})


def test_a_limit_is_violated_by_as_much_as_in_the_recheck():
    """(Fr - 2.2004)**4 <= 0 is met at one speed alone, which five digits have and two or three miss by 4e-4."""
    problem = replace(tmsopt.load("problems/ep4.toml"), constraints={"speed": "(Fr - 2.2004)**4 <= 0"})
    solution = replace(tmsopt.solve("problems/ep4.toml"), problem=problem)
    solution = replace(solution, parameters={**solution.parameters, "Fr": 2.2004})
    for row in round_design(solution, [(["Fr"], digits) for digits in (2, 3, 5)]):
        checked = recheck(problem.posed, {**solution.parameters, "Fr": float(row.written["Fr"])})
        assert dict(row.violations) == dict(checked.amounts)
        assert dict(row.violations) == ({"speed": pytest.approx(4e-4**4, rel=1e-9)} if row.digits < 4 else {})


def test_what_has_no_motion_is_judged_too():
    """At two digits the leading coefficient is 0: one root is at infinity, and the abscissa is that of the cubic."""
    quartic = models.from_coefficients(["m - 0.25", "4", "6 + 0*m", "4", "1"], name="lead")
    problem = Problem(quartic, free={"m": (0.2, 2.0)}, minimize="(m - 0.2500001)**2")
    solution = tmsopt.solve(problem, throw=False)
    _, together = list_rounded_designs(solution)
    row = together[0]
    assert dict(row.written) == {"m": "0.25"}
    assert row.realised == pytest.approx(-0.5, rel=1e-15)  # 4 s³ + 6 s² + 4 s + 1 = (2 s + 1)(2 s² + 2 s + 1)
    assert math.isnan(row.damping_ratio)
