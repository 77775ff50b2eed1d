"""Long work tells how far it is, and Ctrl-C leaves the best design so far: here of two wells (helpers/wells.py)."""

import os
import signal
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from helpers.wells import LEFT, depth, wells, x

import tmsopt
from tmsopt.global_search import SCIP
from tmsopt.models import from_coefficients
from tmsopt.studies import Sampling, prepare_study

solving = import_module("tmsopt.search.solve")
asking = import_module("tmsopt.global_search.stability")

MET = 1e-9  # feasibility to which a design is checked


def problem(limit="x <= 2", **asked):
    return wells(minimize="abscissa", constraints={"limit": limit}, **asked)


def stop(*_):
    raise KeyboardInterrupt


def third(done, most):
    return done == 3


def when(chosen, how=stop):
    """A progress callback by which the user stops a search."""
    return lambda told: how() if told.unit == "start" and chosen(told.done, told.most) else None


@pytest.fixture(autouse=True)
def _every_step_is_told(monkeypatch):
    monkeypatch.setattr("tmsopt.progress.PAUSE", 0.0)


def pressed():
    os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("how", [pressed, stop])
def test_the_best_so_far(how):
    asked = problem("x >= -1.5", start={"x": 0.2})
    found = tmsopt.solve(asked, throw=False, exhaustive=True, progress=when(third, how))
    assert (found.status, found.interrupted, dict(found.violations)) == ("not_converged", True, {})
    assert "the user stopped the search after 3 starts of the solver; this is the best design so far" in found.notes
    assert found.starts.tried == 3
    assert found.parameters["x"] >= -1.5 - MET
    assert found.value == pytest.approx(depth(found.parameters["x"]), abs=1e-12)  # doubles of size 1
    assert depth(LEFT) - 1e-12 <= found.value <= depth(0.2)  # of its start
    assert found.to_json()["interrupted"] is True
    assert "interrupted" not in tmsopt.solve(asked).to_json()


def test_it_is_raised_like_any_design_that_is_no_optimum():
    with pytest.raises(tmsopt.NotSolved, match="the user stopped the search") as raised:
        tmsopt.solve(problem(), exhaustive=True, progress=when(third))
    assert raised.value.solution.interrupted


def test_where_no_start_has_ended_the_best_that_was_looked_at_is_left():
    """Its sample was refined to 4e-4 of the box, where the well has the curvature 3 x² − 1 = 2.3."""
    found = tmsopt.solve(problem(), throw=False, policy=replace(tmsopt.POLICY, local=stop))
    assert (found.status, found.interrupted, found.starts.tried) == ("not_converged", True, 0)
    assert depth(LEFT) <= found.value <= depth(LEFT) + 2.3 / 2 * (4 * 4e-4) ** 2


def test_a_part_of_the_box_that_was_done_counts():
    """EP4 of the paper (Table 1) has normal rake; the search is stopped at the first start with reversed."""
    ep4 = tmsopt.load("problems/ep4.toml")
    free = {**ep4.free, "lambda_s": (-1.4, 1.4)}

    def again(told):
        if told.note.endswith("reversed rake"):
            raise KeyboardInterrupt

    found = tmsopt.solve(replace(ep4, free=free), throw=False, progress=again)
    assert found.interrupted
    assert found.parameters["chi_B"] == pytest.approx(np.sqrt(2), abs=1e-9)
    assert found.structure == "EP4"


@pytest.mark.parametrize("chosen", [third, lambda done, most: most < 64])
def test_of_an_infeasible_problem_the_least_violating_design_is_left(chosen):
    """While it is searched, or relaxed."""
    asked = problem("x >= 10")
    found = tmsopt.solve(asked, throw=False, progress=when(chosen))
    assert (found.status, found.interrupted, found.relaxation) == ("infeasible", True, None)
    assert found.parameters["x"] == pytest.approx(2.0, abs=4 * 4e-4)  # the end of the box, to the sample's last step
    assert "limit" in found.violations


@pytest.mark.skipif(not SCIP.is_available, reason="SCIP is not installed")
def test_the_question_for_a_stable_design_is_shown_and_can_be_stopped(monkeypatch):
    """s² + (x − 2) s + 1, stable where x > 2: at x = 1 the roots are 1/2 ± i √3/2."""
    monkeypatch.setattr(asking, "has_no_stable_design", lambda problem: False)
    asked = tmsopt.Problem(from_coefficients([1, x - 2, 1]), free={"x": (0, 1)}, minimize="abscissa")
    told = []
    done = tmsopt.solve(asked, progress=told.append)
    assert (done.any_stable, done.interrupted) == (False, False)
    passed = [t for t in told if t.what == "looking for a stable design"]
    assert [t.done for t in passed] == sorted(t.done for t in passed)
    assert {t.most for t in passed[1:]} == {5.0}

    def meanwhile(told):
        if told.unit == "s":
            stop()

    found = tmsopt.solve(asked, progress=meanwhile)
    assert (found.status, found.interrupted, found.any_stable) == ("optimal", True, None)
    assert found.value == pytest.approx(0.5, abs=1e-12)
    assert "the user stopped the search for a stable design" in found.notes
    with pytest.raises(KeyboardInterrupt):
        tmsopt.solve(asked, progress=meanwhile, interruptible=False)


def test_with_nothing_in_hand_there_is_nothing_to_leave():
    with pytest.raises(KeyboardInterrupt):
        tmsopt.solve(problem(), policy=replace(tmsopt.POLICY, sample=stop))


def test_a_second_one_ends_that_too(monkeypatch):
    monkeypatch.setattr(solving, "assess_design", stop)
    with pytest.raises(KeyboardInterrupt):
        tmsopt.solve(problem(), exhaustive=True, progress=when(third))


@pytest.mark.parametrize(
    "verb",
    [
        lambda asked: tmsopt.solve(asked, progress=stop, interruptible=False, throw=False),
        lambda asked: tmsopt.speeds(asked, progress=stop),
        lambda asked: tmsopt.compare(asked, progress=stop),
        lambda asked: prepare_study(Sampling(asked, 10, tolerances={"mu": 0.01}), progress=stop),
    ],
)
def test_verbs_that_solve_on_the_way_are_ended_whole(verb):
    with pytest.raises(KeyboardInterrupt):
        verb(tmsopt.load("problems/ep4.toml"))
