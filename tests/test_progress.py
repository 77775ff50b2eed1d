"""Progress of long work: the same record from every verb."""

import math
from dataclasses import replace
from functools import cache, partial
from types import SimpleNamespace

import pytest

import tmsopt
from tmsopt.progress import start_steps
from tmsopt.studies import prepare_study

PLANE = tmsopt.load("problems/chart.toml")
EP4 = tmsopt.load("problems/ep4.toml")
STUDY = tmsopt.over_grid(EP4, {"mu": [0.1, 0.2, 0.3]})
DRAWN = tmsopt.Sampling(EP4, 20, tolerances={"mu": 0.01})

SPACE = replace(EP4, free={"Fr": (2.0, 2.5), "chi_B": (1.3, 1.5), "lambda_s": (0.4, 0.6)}, minimize=None)

VERBS = [
    ("searching", partial(tmsopt.solve, EP4)),
    ("searching", partial(tmsopt.solve_all, "problems/ep4_matching.toml", seconds=0)),
    ("proving that no design is missed", partial(tmsopt.solve_all, "problems/ep4_matching.toml")),
    ("bounding the optimum", partial(tmsopt.certify, "problems/realistic.toml", seconds=1.0)),
    ("proving to 30 digits", partial(tmsopt.prove, EP4)),
    ("proving to 30 digits", lambda **told: tmsopt.prove(optimum(), **told)),
    ("comparing", partial(tmsopt.compare, EP4)),
    ("isolating speeds", lambda **told: tmsopt.speeds(optimum(), **told)),
    ("following the motion", lambda **told: tmsopt.simulate(optimum(), **told)),
    ("searching", partial(tmsopt.speeds, "problems/realistic.toml")),
    ("following the roots", partial(tmsopt.growth, EP4)),
    ("looking for the nearest boundaries", lambda **told: tmsopt.robustness(optimum(), **told)),
    ("looking for the nearest weave", lambda **told: tmsopt.nearest(optimum(), "weave", **told)),
    ("tracing EP2", partial(tmsopt.trace, PLANE, "EP2")),
    ("tracing weave", partial(tmsopt.domain, PLANE)),
    ("cutting the surface", partial(tmsopt.swallowtail, SPACE, rows=6, across=4, starts=4)),
    ("searching inside the loop", partial(tmsopt.encircle, "problems/loss_only_dimer.toml", starts=1)),
    ("computing eigenvalues", partial(tmsopt.sheets, "problems/loss_only_dimer.toml", grid=(9, 9))),
    ("charting", partial(tmsopt.chart, PLANE, points=(40, 30), tile=100)),
    ("tracing capsize", partial(tmsopt.chart, PLANE, points=(40, 30))),
    ("following the front", partial(tmsopt.pareto, "problems/pareto.toml", points=2)),
    ("solving rows", partial(tmsopt.run_study, STUDY)),
    ("solving rows", partial(tmsopt.run_study, DRAWN)),
    ("searching", partial(prepare_study, DRAWN)),
    ("drawing designs", lambda **told: tmsopt.monte_carlo(optimum(), 20, tolerances={"mu": 0.01}, **told)),
    ("moving limits", partial(tmsopt.explain, "problems/realistic.toml")),
    ("checking the optimum", lambda **told: tmsopt.optimality(optimum(), **told)),
    ("splitting roots", lambda **told: tmsopt.diagnose(optimum(), **told)),
    ("writing the page", partial(tmsopt.explore, EP4)),
    ("recomputing claims", partial(tmsopt.verify, only=["tab1-*"])),
]


@cache
def optimum():
    return tmsopt.solve(EP4)


@pytest.fixture
def told():
    return []


every_verb = pytest.mark.parametrize(("what", "verb"), VERBS, ids=[f"{k}-{what}" for k, (what, _) in enumerate(VERBS)])


@pytest.mark.slow
@every_verb
def test_every_verb_tells_the_same_content(what, verb, told, monkeypatch):
    monkeypatch.setattr("tmsopt.progress.PAUSE", 0.0)
    verb(progress=told.append)
    assert what in {t.what for t in told}
    assert all(t.what and t.seconds >= 0 for t in told)
    assert all(math.isnan(t.done) and math.isnan(t.most) for t in told if not t.unit)
    for piece in {t.what for t in told if t.unit}:
        of_it = [t for t in told if t.what == piece]
        assert len({t.unit for t in of_it}) == 1
        assert [t.done for t in of_it] == sorted(t.done for t in of_it)
        assert not of_it[-1].done > of_it[-1].most
        assert all(t.left >= 0 for t in of_it if not math.isnan(t.left))
        first = next((t for t in of_it if not math.isnan(t.most)), of_it[0])
        settled = [t for t in of_it if t.seconds > first.seconds + 3 and (t.unit == "s" or t.done >= first.done + 8)]
        assert not settled or any(math.isfinite(t.left) for t in settled)


@every_verb
def test_what_cannot_be_called_is_refused(what, verb):
    with pytest.raises(tmsopt.InputError, match="progress: found 3; accepted: a function"):
        verb(progress=3)


def test_a_page_is_told_of(told, tmp_path):
    tmsopt.save_report(optimum(), tmp_path / "design.html", progress=told.append)
    assert "writing the page" in {t.what for t in told}


def test_an_infeasible_problem_tells_of_its_limits(told):
    asked = replace(EP4, constraints={"no": "abscissa <= -100"}, minimize="Fr")
    assert tmsopt.solve(asked, throw=False, starts=4, progress=told.append).status == "infeasible"
    assert "searching for the smallest change of limits" in {t.what for t in told}


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand."""
    made = SimpleNamespace(now=100.0, perf_counter=lambda: made.now)
    monkeypatch.setattr("tmsopt.progress.time", made)
    return made


@pytest.fixture
def steps(told, clock):
    return start_steps(told.append, "solving rows", "row")


def test_time_left_is_that_of_the_rate_since_the_first_count(clock, told, steps):
    """40 rows of 100 were there; 20 more took 4 s, so the other 40 take 8."""
    steps(40, 100)
    clock.now += 4.0
    steps(60, 100, "all well")
    begun, first, last = told
    assert (begun.done, begun.seconds) == (0.0, 0.0)
    assert math.isnan(begun.most)
    assert (first.done, first.most) == (40, 100)
    assert math.isnan(first.left)
    assert last == tmsopt.Progress("solving rows", 60, 100, "row", 4.0, 8.0, "all well")


@pytest.mark.parametrize(
    ("done", "most", "seconds", "left"),
    [
        (7, 3000, 60.0, math.nan),  # too few
        (8, 3000, 1.9, math.nan),  # too soon
        (8, 3000, 2.0, 748.0),
        (4, 15, 8.0, 22.0),
        (1, 30, 30.0, math.nan),
        (2, 30, 30.0, 420.0),
        (0, 0, 5.0, math.nan),
    ],
)
def test_time_left_is_told_once_the_rate_is_one(clock, told, steps, done, most, seconds, left):
    steps(0, most)
    clock.now += seconds
    steps(done, most)
    assert told[-1].left == pytest.approx(left, nan_ok=True)


def test_of_work_that_ends_with_its_time_the_rest_of_it_is_left(told, steps):
    steps.begin("bounding the optimum", "s")
    steps(2.0, 60.0)
    assert told[-1].left == 58.0


def test_nobody_is_told_oftener_than_he_can_read(clock, told, steps):
    """A million rows in a second, and a callback every 50 ms; the first and the last are told whenever they are."""
    for done in range(1, 1001):
        clock.now += 1e-3
        steps(done, 1000)
    assert (told[1].done, told[-1].done) == (1, 1000)
    assert 15 <= len(told) <= 25


def test_beginnings_first_counts_and_ends_are_told_at_once(told, steps):
    """Three pieces of work in no time: nine records, whatever else is counted."""
    for what in ("tracing weave", "tracing capsize", "tracing EP2"):
        steps.begin(what, "start")
        for done in range(1, 49):
            steps(done, 48)
    assert [t.done for t in told[1:]] == [0, 1, 48] * 3


def test_a_slow_listener_costs_a_tenth_of_the_time_at_most(clock):
    """A hundred steps of 0.1 s, and a listener that takes as long: it is left alone for nine times that."""
    called = []

    def listen(now):
        called.append(now.done)
        clock.now += 0.1

    steps = start_steps(listen, "solving rows", "row")
    for done in range(1, 101):
        clock.now += 0.1
        steps(done, 100)
    assert 5 <= len(called) <= 14


def test_work_that_is_begun_anew_goes_on_counting(clock, told, steps):
    """12 of 64 starts on one side of the box, then 3 of 64 on the other; and after another piece of work, 5 of 8."""
    steps.begin("searching", "start")
    for done, most in ((1, 64), (12, 64), (1, 64), (3, 64)):
        clock.now += 1.0
        steps(done, most)
    assert (told[-1].done, told[-1].most) == (15, 76)
    steps.begin("looking at designs")
    assert math.isnan(told[-1].done)
    steps.begin("searching", "start")
    steps(5, 8)
    assert (told[-1].done, told[-1].most) == (20, 23)
