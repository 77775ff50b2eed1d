"""Limits said to exclude each other do, and those said to be out of reach alone are: what thin needles hide as well."""

import math
from dataclasses import replace
from fractions import Fraction
from importlib import import_module
from math import comb

import numpy as np
import pytest
from helpers.oracles import routh_exact
from helpers.skates import skate

import tmsopt
from tmsopt.analysis import infeasible_sentences
from tmsopt.problem import Relaxation
from tmsopt.records import Table

FOLD = 8
"""(s + 1)⁸ is in the box, and little else that decays nearly as fast: moved by 4e-4 of the box, it is 0.38 off."""


def folded(fold):
    """(s + 1)ⁿ is at 0."""
    model = tmsopt.models.from_coefficients(["1", *(f"{comb(fold, k)} + x{k}" for k in range(1, fold + 1))])
    free = {f"x{k}": (-1.0, 1.3) for k in range(1, fold + 1)}
    return tmsopt.Problem(model, free=free, minimize="x3", constraints={"far": "abscissa <= -0.99", "x": "x1 >= 0.5"})


FAST = folded(FOLD)
DAMPED = tmsopt.Problem(
    tmsopt.models.tms,
    fixed={"Fr": 4.829142389714604, "mu": 1.4039653950756779, "chi_H": 1.5255656081856155, "lambda_s": -0.848691680576},
    free={"zeta_B": (-1.5, -0.2), "chi_B": (0.3, 3.0), "zeta_H": (-1.2, -0.1)},
    minimize="chi_B",
    constraints={"damped": "damping_ratio >= 0.97", "low": "zeta_H <= -1.0023476412008954"},
)
"""A heavily damped design is at chi_B = 1.33, zeta_B = -0.403, zeta_H = -0.463, and few are near it."""


def test_by_the_sum_of_the_roots_one_excludes_the_other():
    """Roots left of -0.99 with a sum of -8.5 or less: the sum of their products by two is least where all but one are
    there, and more than the box allows."""
    rest = 8.5 - (FOLD - 1) * 0.99
    least = comb(FOLD - 1, 2) * 0.99**2 + (FOLD - 1) * 0.99 * rest
    assert least > comb(FOLD, 2) + FAST.free["x2"][1]
    for left_out in FAST.constraints:
        kept = {n: text for n, text in FAST.constraints.items() if n != left_out}
        assert tmsopt.solve(replace(FAST, constraints=kept)).status == "optimal"


@pytest.mark.slow
def test_a_limit_that_a_needle_meets_is_not_out_of_reach():
    relaxation = tmsopt.solve(FAST, throw=False, alone=False, stability=0.0).relaxation
    limits = {n for n in relaxation.conflict if n in FAST.constraints}
    assert (limits, relaxation.irreducible) == (set(FAST.constraints), True)


def test_a_whole_search_finds_what_a_needle_hides_and_none_is_asked_where_a0_may_vanish():
    """All roots of the design found are left of -0.98, in exact numbers; DAMPED without its other limit is not asked."""
    reach, options = import_module("tmsopt.search.remedies.conflict").search_limits, tmsopt.Options()
    found, told = reach(FAST.posed, options, ["far"])
    assert told
    shifted = [Fraction(float(c)) for c in FAST.posed.values(found).coefficients]
    for end in range(len(shifted), 1, -1):
        for k in range(1, end):
            shifted[k] -= Fraction(98, 100) * shifted[k - 1]
    assert routh_exact(shifted)
    assert reach(DAMPED.posed, options, ["damped"]) == (None, False)


def test_where_a0_may_vanish_a_search_is_not_said_to_tell():
    design = tmsopt.solve(DAMPED, throw=False, alone=False, stability=0.0)
    first = " ".join(infeasible_sentences(design)[:1])
    assert set(design.relaxation.conflict) >= {*DAMPED.constraints} or not design.relaxation.irreducible
    assert "no design was found" in first
    assert "cannot" not in first


@pytest.mark.slow
def test_a_heavily_damped_design_meets_that_limit_alone():
    kept = {"damped": DAMPED.constraints["damped"]}
    design = tmsopt.solve(replace(DAMPED, constraints=kept), stability=0.0)
    p = DAMPED.posed.values(design.parameters)
    z = np.roots([float(a) for a in p.coefficients])
    assert np.min(-z.real / np.abs(z)) >= 0.97 - 1e-3  # as near as roots in doubles tell


BOUNDS = tmsopt.Problem(
    tmsopt.models.from_coefficients(["1", "3 + x", "3 + y", "1"]),
    free={"x": (0.0, 1.0), "y": (0.0, 1.0)},
    constraints={"a": "x >= 0.8", "b": "x <= 0.2", "c": "y >= 0.5"},
)


@pytest.fixture
def named(monkeypatch):
    """What `find_conflict` makes of BOUNDS; the nearest design moves b, and starts meet what designs at hand meet."""
    conflicts = import_module("tmsopt.search.remedies.conflict")
    monkeypatch.setattr(conflicts, "_can_be_met", lambda *_, **__: False)
    near = Relaxation(Table({"x": 0.8, "y": 0.5}), Table({"b": 0.6}))

    def find(reached):
        found = conflicts.find_conflict(BOUNDS.posed, near, ("b",), BOUNDS.posed, tmsopt.Options(), reached)
        return found.conflict, found.irreducible

    return find


def test_what_a_whole_search_meets_is_decided_anew(named):
    """Without a design of its own each set seems to be out of reach; the searches show what excludes what."""
    points = [{"x": x, "y": y} for x, y in ((0.1, 0.1), (0.1, 0.6), (0.9, 0.1))]
    asked = []

    def reached(names):
        asked.append(tuple(names))
        return next((p for p in points if meets(names, p)), None), True

    def meets(names, p):
        return all({"a": p["x"] >= 0.8, "b": p["x"] <= 0.2, "c": p["y"] >= 0.5}[n] for n in names)

    assert named(reached) == (("a", "b"), True)
    assert asked[-1] == ("a", "b")
    assert not any(meets("ab", p) for p in points)


def test_of_what_searches_go_on_to_meet_no_fewer_limits_are_claimed(named):
    endless = iter({"x": 0.5, "y": k / 1000} for k in range(1000))  # that meet none of the limits, whatever is said
    assert named(lambda names: (next(endless), True)) == (("a", "b", "c"), False)


def test_where_no_search_can_tell_that_is_said(named):
    _, irreducible = named(lambda names: (None, False))
    assert not irreducible


@pytest.mark.slow
@pytest.mark.parametrize("fold", [7, 10])
def test_a_root_of_any_multiplicity_is_within_reach_alone(fold):
    """x1 >= 0.5 excludes it, as at eight."""
    relaxation = tmsopt.solve(folded(fold), throw=False, alone=False, stability=0.0).relaxation
    assert {"far", "x"} <= set(relaxation.conflict)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["2EP2", "EP2+EP2"])
def test_the_least_speed_of_a_pattern_is_told_by_whichever_name(name):
    """By the law epset: its Froude number falls as the tilt grows to 0.405, so at 0.38 at most it is that at 0.38."""
    problem = skate({"lambda_s": (0.01, 0.38)}, {"chi_B": math.sqrt(2), "Fr": 1.0}, locate=name)
    need = tmsopt.solve(problem, throw=False).need
    assert need is not None
    assert need.parameter == "Fr"
    assert need.value == pytest.approx(float(tmsopt.laws.epset(zeta_B=-0.4, zeta_H=-0.2, lambda_s=0.38)), rel=1e-6)


def test_a_limit_that_is_moved_by_its_seventh_digit_is_shown_as_it_is():
    """s² + 2xs + 1 comes to −1 and no further."""
    oscillator = tmsopt.models.from_coefficients([1, "2*x", 1])
    asked = tmsopt.Problem(oscillator, free={"x": (0, 5)}, minimize="x", constraints={"c": "abscissa <= -1.000001"})
    lines = infeasible_sentences(tmsopt.solve(asked, throw=False))
    assert "smallest change found: abscissa <= -1 instead of -1.000001 (c)" in lines
