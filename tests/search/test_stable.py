"""Whether a design is stable, and whether any is, as solutions and reports say it: s² + (x − 2) s + 1 is where x > 2."""

import re
import time
from dataclasses import replace
from importlib import import_module

import pytest

import tmsopt
from tmsopt.global_search import SCIP
from tmsopt.models import from_coefficients

solving = import_module("tmsopt.search.solve")

scip = pytest.mark.skipif(not SCIP.is_available, reason="SCIP is not installed")

NONE = "no design within the ranges is stable (proved)"
BOUND = "no design within the ranges that satisfies the constraints is stable (proved)"
UNKNOWN = "no stable design was found, but not proved that none exists"


def found(most, coefficients=(1, "x - 2", 1), stability=10.0, **asked):
    model, asked = from_coefficients(list(coefficients)), {"minimize": "abscissa", **asked}
    return tmsopt.solve(tmsopt.Problem(model, free={"x": (0, most)}, **asked), throw=False, stability=stability)


def headline(design):
    """How it ended, and what is said of stability."""
    first = re.match(r"((?:[^\n]|\n  (?! ))*)", design.report())  # wrapped lines go on two columns in
    assert first
    return " ".join(first[1].split()).partition("; ")[2]


@pytest.mark.parametrize("x", [1.0, 2.0, 3.0])
def test_a_given_design(x):
    design = tmsopt.solve(tmsopt.Problem(from_coefficients([1, "x - 2", 1]), fixed={"x": x}))
    assert design.stable is (x > 2)
    assert design.to_json()["stable"] is (x > 2)


@scip
def test_that_none_is_stable_is_proved():
    design = found(1.0)
    assert (design.stable, design.any_stable) == (False, False)
    assert headline(design) == f"not stable: {NONE}"
    assert design.to_json()["any_stable"] is False


@pytest.mark.slow
@scip
def test_limits_that_a_proof_rests_on_are_named():
    """Without the limit x = 3 would do; one on the roots themselves is none that it rests on."""
    assert headline(found(3.0, constraints={"most": "x**2 <= 3"})) == f"not stable: {BOUND}"
    design = found(1.5, constraints={"decay": "abscissa <= -0.1"}, minimize="x")
    assert design.status == "infeasible"
    assert headline(design).startswith(NONE)


@scip
def test_at_the_edge_nothing_is_proved():
    design = found(2.0)
    assert design.abscissa == pytest.approx(0, abs=1e-9)
    assert (design.stable, design.any_stable) == (False, None)
    assert headline(design) == f"marginally stable; {UNKNOWN}"


@pytest.mark.parametrize(
    ("most", "asked", "stable", "any_stable", "words"),
    [
        (1.0, {"stability": 0.0}, False, None, f"not stable: {UNKNOWN}"),  # what is not asked is not known
        # The product of the roots is 0, so one of them is: the instant bound says so.
        (3.0, {"coefficients": (1, "x", 1, 0), "stability": 0.0}, False, False, f"marginally stable; {NONE}"),
        (3.0, {}, True, True, "stable"),
        (3.0, {"minimize": "x"}, False, None, "not stable"),  # who does not ask for stability is told of none
    ],
)
def test_what_is_known_without_a_search(most, asked, stable, any_stable, words):
    design = found(most, **asked)
    assert (design.stable, design.any_stable, headline(design)) == (stable, any_stable, words)


@scip
def test_a_stable_design_that_the_search_missed_is_found():
    """The best design of the box 0 ≤ x ≤ 1, sold as that of 0 ≤ x ≤ 3, where −1/2 is least, at x = 3."""
    part = found(1.0, stability=0.0)
    missed = replace(part, problem=replace(part.problem, free={"x": (0.0, 3.0)}))
    design = solving._search_stable_design(missed, tmsopt.Options(stability=10.0), time.perf_counter(), tmsopt.POLICY)
    assert (design.status, design.stable, design.any_stable) == ("optimal", True, True)
    assert design.value == pytest.approx(-0.5, abs=1e-12)
    assert any("stable design that branch and bound found" in note for note in design.notes)


@scip
def test_a_limit_that_cannot_be_met_though_designs_are_stable():
    """The least abscissa is −1/2, at x = 3."""
    design = found(3.0, constraints={"decay": "abscissa <= -0.6"}, minimize="x")
    assert design.status == "infeasible"
    assert design.stable


@pytest.mark.parametrize("stability", [-1.0, float("nan"), "soon"])
def test_seconds_must_be_a_number(stability):
    with pytest.raises(tmsopt.InputError, match=r"stability: found .*; accepted: seconds, 0 or more"):
        found(1.0, stability=stability)
