"""Sub-problems side by side: what comes of them does not depend on how many processes there are, or on their fate."""

import os
import threading
from dataclasses import replace
from importlib import import_module

import pytest
from helpers import shares

import tmsopt
from tmsopt import InputError
from tmsopt.executor import in_process
from tmsopt.models import tms

curve = import_module("tmsopt.fronts.curve")
options = import_module("tmsopt.program.options")
pareto = import_module("tmsopt.fronts.pareto")
subproblems = import_module("tmsopt.fronts.subproblems")

FIXED = {"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1}
FREE = {"Fr": (0.01, 10), "chi_B": (1.01, 5), "lambda_s": (0.035, 1.4)}
PROBLEM = tmsopt.Problem(tms, FIXED, FREE, pareto=["abscissa", "Fr"], constraints={"decay": "abscissa <= -0.3"})
ASK = subproblems.FrontSolver(PROBLEM, options.Options())


def map_items(function, items, workers):
    return dict(subproblems.map_items(workers, function, ASK, items))


def test_what_cannot_be_sent_is_solved_here():
    assert subproblems.can_pickle(ASK)
    assert not subproblems.can_pickle(replace(ASK, single_optima={0: threading.Lock()}))


def test_what_was_done_before_an_interrupt_is_kept_and_the_team_can_go_on():
    with in_process() as side_by_side:
        found = []
        with pytest.raises(KeyboardInterrupt):
            found.extend(subproblems.map_items(side_by_side, shares.interrupted_at_two, ASK, range(4)))
        assert found == [(0, 0), (1, 1)]
        assert map_items(shares.squared, [3], side_by_side) == {0: (9, os.getpid())}


@pytest.mark.slow
def test_the_front_is_the_same_for_any_number_of_processes():
    alone, beside = (tmsopt.pareto(PROBLEM, 5, workers=n) for n in (1, 3))
    assert [p.objectives for p in alone.points] == [p.objectives for p in beside.points]
    assert [dict(p.solution.parameters) for p in alone.points] == [dict(p.solution.parameters) for p in beside.points]
    assert (alone.kinks, alone.gaps, alone.solved) == (beside.kinks, beside.gaps, beside.solved)


def test_an_interrupt_leaves_the_ends_that_are_known(monkeypatch):
    first = pareto.solve_end
    monkeypatch.setattr(pareto, "solve_end", lambda ask, k: first(ask, k) if k == 0 else _stop())
    front = tmsopt.pareto(PROBLEM, 5, workers=1)
    assert front.interrupted
    assert [p.label for p in front.points] == ["least abscissa"]
    assert "stopped" in front.notes[0]


def test_an_interrupt_leaves_the_points_that_are_known(monkeypatch):
    probed, asked = curve._solve_request, []
    monkeypatch.setattr(
        curve, "_solve_request", lambda ask, of: probed(ask, of) if asked.append(of) or len(asked) < 3 else _stop()
    )
    front = tmsopt.pareto(PROBLEM, 9, workers=1)
    assert front.interrupted
    assert len(front.points) == 4
    for of in asked[:2]:  # each limit binds; the recheck forgives 1e-9
        assert min(abs(p.objectives[of.axis] - of.eps) for p in front.points) < 1e-9


def test_an_interrupt_before_any_end_is_known_is_raised(monkeypatch):
    monkeypatch.setattr(pareto, "minimise_without_limits", lambda ask, k: _stop())
    with pytest.raises(KeyboardInterrupt):
        tmsopt.pareto(PROBLEM, 5, workers=1)


@pytest.mark.parametrize("workers", [0, -1, 1.5, "2"])
def test_processes_that_cannot_be(workers):
    with pytest.raises(InputError, match=r"workers: found .*; accepted: a whole number, 1 or more"):
        tmsopt.pareto(PROBLEM, 5, workers=workers)


def _stop():
    raise KeyboardInterrupt
