"""Boxes with both signs of the tilt: both are searched, and each is the answer to the problem on its own side."""

import json
from dataclasses import replace
from math import isnan

import numpy as np
import pytest
from helpers.skates import FIXED, skate

import tmsopt
from tmsopt import laws
from tmsopt.search import begin_search

SWAPPED = {**FIXED, "zeta_B": -0.2, "zeta_H": -0.4}
BOX = {"Fr": (0.1, 5.0), "chi_B": (0.3, 3.0), "lambda_s": (-1.2, 1.2)}
FORWARD, BACKWARD = "normal rake", "reversed rake"


def problem(fixed=FIXED, free=BOX, **asked):
    return skate(free, fixed, **asked)


def on(side, stated):
    """The problem with one sign of the tilt alone."""
    lower, upper = stated.free["lambda_s"]
    ends = (0.0, upper) if side == FORWARD else (lower, 0.0)
    return replace(stated, free={**stated.free, "lambda_s": ends}, start={})


@pytest.mark.slow
@pytest.mark.parametrize(("fixed", "winner"), [(FIXED, FORWARD), (SWAPPED, BACKWARD)])
def test_the_winner_is_named_and_each_side_is_its_own_problem(fixed, winner):
    """Heights exchanged, the EP4 tilts the other way, by the law; its mirror is as stable."""
    stated = problem(fixed, minimize="abscissa")
    design = tmsopt.solve(stated, starts=16)
    law = laws.ep4_chi_H_1(fixed["zeta_B"], fixed["zeta_H"])
    assert design.value == pytest.approx(-(12.5**0.25), abs=1e-11)
    assert np.tan(design.parameters["lambda_s"]) == pytest.approx(float(law.tan_lambda_s), abs=1e-10)
    assert np.sign(design.parameters["lambda_s"]) == (1 if winner == FORWARD else -1)
    assert list(design.sides) == [FORWARD, BACKWARD]
    for side, value in design.sides.items():
        assert value == pytest.approx(tmsopt.solve(on(side, stated), starts=16).value, abs=1e-6 * (1 + abs(value)))
    assert [f"{winner} is better" in n for n in design.notes if "rake is better" in n] == [True]
    shown = {side: float(f"{value:.9g}") for side, value in design.sides.items()}  # of designs that are not shown
    assert json.loads(json.dumps(design.to_json()))["sides"] == shown


@pytest.mark.slow
def test_a_side_without_a_design_is_said_to_have_none():
    """With these heights no reversed rake is stable at chi_H = 1, by the law of the EP4: its dual has T > 0."""
    design = tmsopt.solve(problem(minimize="Fr", constraints={"decay": "abscissa <= -0.5"}))
    alone = tmsopt.solve(on(FORWARD, design.problem))
    assert design.value == pytest.approx(alone.value, abs=1e-9)
    assert design.sides[FORWARD] == design.value
    assert isnan(design.sides[BACKWARD])
    assert any("no feasible design with reversed rake" in n for n in design.notes)
    assert json.loads(json.dumps(design.to_json()))["sides"][BACKWARD] is None


@pytest.mark.parametrize(("sign", "winner"), [("+", FORWARD), ("-", BACKWARD)])
def test_maximising_takes_the_greater_side(sign, winner):
    """t² ± t is greatest at the ends of the box, 2.64 at one and 0.24 at the other."""
    steep = tmsopt.solve(problem(maximize=f"lambda_s**2 {sign} lambda_s"))
    assert steep.value == pytest.approx(2.64, abs=1e-7)
    assert steep.sides == pytest.approx({FORWARD: 0.24, BACKWARD: 0.24} | {winner: 2.64}, abs=1e-7)
    assert abs(steep.parameters["lambda_s"]) == pytest.approx(1.2, abs=1e-8)
    assert any(f"{winner} is better" in n for n in steep.notes)


def test_a_start_on_the_losing_side_does_not_decide():
    design = tmsopt.solve(problem(minimize="abscissa", start={"lambda_s": -0.3, "Fr": 2.0, "chi_B": 2.0}))
    assert design.value == pytest.approx(-(12.5**0.25), abs=1e-11)
    assert design.parameters["lambda_s"] > 0


@pytest.mark.parametrize("tilt", [(0.05, 1.2), (-1.2, 0.0)])
def test_one_sign_has_no_sides(tilt):
    stated = problem(free={**BOX, "lambda_s": tilt}, minimize="Fr - lambda_s**2")
    assert [state.side for state in begin_search(stated.posed)] == [""]
    design = tmsopt.solve(stated)
    assert design.sides == {}
    assert "sides" not in design.to_json()
    assert not any("signs" in n for n in design.notes)
    assert design.value == pytest.approx(0.1 - 1.44, abs=1e-7)


def test_matching_on_both_sides():
    """One EP4 for each order of heights: located on its side, and none on the other."""
    design = tmsopt.solve(problem(SWAPPED, locate="EP4"))
    law = laws.ep4_chi_H_1(-0.2, -0.4)
    assert np.tan(design.parameters["lambda_s"]) == pytest.approx(float(law.tan_lambda_s), abs=1e-10)
    assert any("reversed rake is better" in n for n in design.notes)


def test_sides_that_are_equally_good_are_said_to_be():
    """No design with Fr >= 0.6 is better than 0.6, whatever its tilt."""
    design = tmsopt.solve(skate({"Fr": (0.6, 1.0), "lambda_s": (-0.5, 0.5)}, {"chi_B": 1.0}, minimize="Fr"))
    assert design.value == pytest.approx(0.6, abs=1e-12)
    assert design.sides[FORWARD] == pytest.approx(design.sides[BACKWARD], abs=1e-12)
    (note,) = (n for n in design.notes if "both signs" in n)
    assert "is as good as" in note
    assert "is better" not in note


def test_the_side_with_the_best_design_of_a_sample_is_searched_first():
    """Sides are told in their order all the same."""
    searched = []

    def told(state):
        if not searched or searched[-1] != state.side:
            searched.append(state.side)
        return tmsopt.POLICY.starts(state)

    design = tmsopt.solve(problem(SWAPPED, minimize="abscissa"), policy=replace(tmsopt.POLICY, starts=told))
    assert searched == [BACKWARD, FORWARD]
    assert list(design.sides) == [FORWARD, BACKWARD]
    assert design.value == pytest.approx(-(12.5**0.25), abs=1e-11)
