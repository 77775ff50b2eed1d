"""The judge of the design benchmarks, its proof over bands, and the conflicts: against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.judges import Judge, abscissa_below, highest_abscissa, verdict, worst_roots
from benchmarks.suites import conflict, conflicts, moved, varied_problem
from tmsopt import Problem, models

HEIGHTS = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}


def test_worst_roots_of_known_factors():
    """(s + 1)(s + 2)(s² + 2 s + 5): abscissa −1, damping ratio 1/√5; (s − 1)(s + 2)(s + 3)(s + 4): 1 and −1."""
    first = np.polymul(np.polymul([1, 1], [1, 2]), [1, 2, 5])
    second = np.poly([1, -2, -3, -4])
    abscissa, damping = worst_roots(np.array([[first], [second]], dtype=float))
    assert abscissa == pytest.approx([-1, 1], abs=1e-12)
    assert damping == pytest.approx([1 / math.sqrt(5), -1], abs=1e-12)


def test_scatter_of_a_fourfold_root_is_granted():
    """The EP4 of the paper: abscissa −(zeta_B zeta_H)^(−1/4), which eigenvalues of the rounded design miss by 1e-4."""
    design = {
        "chi_B": math.sqrt(2),
        "lambda_s": math.atan(15 / 4 - 75 * math.sqrt(2) / 32),
        "Fr": 3 * math.sqrt(110 * math.sqrt(2) - 120) / 8,
    }
    box = {name: (0.9 * value, 1.1 * value) for name, value in design.items()}
    claimed = -((0.4 * 0.2) ** -0.25)
    problem = Problem(
        model=models.tms, fixed=HEIGHTS, free=box, constraints={"c": f"abscissa <= {claimed!r}"}, minimize="abscissa"
    )
    judged = verdict(problem, {**HEIGHTS, **design})
    assert 1e-6 < judged.value - claimed < 1e-3
    assert abs(judged.value - claimed) <= judged.granted
    assert judged.violation == 0
    too_low = replace(problem, constraints={"c": f"abscissa <= {claimed - 0.01!r}"})
    assert verdict(too_low, {**HEIGHTS, **design}).violation > 1e-3


def test_worst_case_is_that_of_the_band_and_the_tolerance():
    """load_front = (chi_B + mu chi_H)/(1 + mu) is largest at the upper ends of chi_B and, for chi_H < chi_B, lower of mu."""
    problem = Problem(
        model=models.tms,
        fixed={"Fr": 2.0, "chi_H": 0.9, "zeta_B": -0.5, "zeta_H": -0.3, "lambda_s": 0.5},
        free={"chi_B": (1.0, 2.0)},
        scenarios={"mu": {"min": 0.1, "max": 0.5}},
        tolerances={"chi_B": 0.1},
        minimize="load_front",
    )
    assert Judge(problem).of({"chi_B": 1.5}).value[0] == pytest.approx((1.6 + 0.1 * 0.9) / 1.1, rel=1e-14)


def test_proof_ends_at_the_weave_boundary():
    """At chi_H = 1 stable exactly above Fr_c, Fr_c² = chi_B T (zeta_B − zeta_H)/((chi_B − 1)(zeta_B − zeta_H chi_B))."""
    design = {**HEIGHTS, "chi_B": 1.3, "lambda_s": 0.2}
    critical = math.sqrt(1.3 * math.tan(0.2) * -0.2 / (0.3 * (-0.4 + 0.2 * 1.3)))
    assert abscissa_below(design, critical * (1 + 1e-9), 3.0, 0.0)[0]
    assert not abscissa_below(design, critical * (1 - 1e-9), 3.0, 0.0)[0]
    highest = highest_abscissa(design, 1.2, 2.4, 2001)
    proved, pieces = abscissa_below(design, 1.2, 2.4, highest + 1e-4)
    assert proved
    assert pieces >= 6  # one for each polynomial
    assert not abscissa_below(design, 1.2, 2.4, highest - 1e-4)[0]


def test_backward_tilt_has_a_negative_leading_coefficient():
    """Never stable at chi_H = 1 with chi_B > 1; far to the right of its roots the proof succeeds all the same."""
    design = {**HEIGHTS, "chi_B": 1.3, "lambda_s": -0.2}
    assert not abscissa_below(design, 1.2, 2.4, 0.0)[0]
    assert abscissa_below(design, 1.2, 2.4, 100.0)[0]


def test_every_conflict_lacks_something():
    found = conflicts(50)
    assert all(c.short > 0 for c in found)
    assert len({c.kind for c in found}) == 10
    assert conflict(7).problem == found[7].problem


def test_limits_are_moved_outwards():
    problem = Problem(
        model=models.tms,
        fixed=HEIGHTS,
        free={"Fr": (1, 2), "chi_B": (1, 2), "lambda_s": (0.1, 1)},
        constraints={"a": "Fr*chi_B >= 5", "b": "Fr <= 1.5", "c": "chi_B == 3"},
        minimize="Fr",
    )
    wider = moved(problem, {"a": 1.0, "b": 0.5, "c": -1.0, "Fr.max": 0.25, "chi_B.min": 0.5})
    values = wider.posed.values(wider.posed.ordered({"Fr": 2.0, "chi_B": 2.0, "lambda_s": 0.5}))
    assert [c.violation(values) for c in wider.posed.conditions.values()] == [0, 0, 0]
    assert wider.free["Fr"] == (1, 2.25)
    assert wider.free["chi_B"] == (0.5, 2)


@pytest.mark.parametrize("index", [0, 13, 104])
def test_a_varied_problem_is_the_same_every_time(index):
    assert varied_problem(index) == varied_problem(index)
