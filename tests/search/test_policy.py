"""The search as a policy: each stage alone, the loop with stages of one's own, rescues, and the numbers of it all.

What is minimised is f − 1, the root of s + 1 − f, with f = x⁴/4 − x²/2 + x/10: wells near −1.05 and 0.95, the left one deeper.
"""

from dataclasses import FrozenInstanceError, fields, replace
from importlib import import_module

import casadi as ca
import numpy as np
import pytest

import tmsopt
from benchmarks.suites import hard_problem
from tmsopt.errors import InputError
from tmsopt.models import from_coefficients
from tmsopt.search import begin_search

accepting, driver, states = (import_module(f"tmsopt.search.{name}") for name in ("acceptance", "policy", "state"))

x = ca.SX.sym("x")
LEFT, RIDGE, RIGHT = sorted(np.roots([1, 0, -1, 0.1]).real.tolist())
BOX = {"x": (-2.0, 2.0)}
POLICY = tmsopt.POLICY


def depth(at):
    return at**4 / 4 - at**2 / 2 + at / 10 - 1


def problem(**asked):
    stated = {"model": from_coefficients([1, -depth(x)]), "free": BOX, "minimize": "x**4/4 - x**2/2 + x/10 - 1"}
    return tmsopt.Problem(**(stated | asked))


def begun(**asked):
    """The state at the beginning of a search."""
    (state,) = begin_search(problem(**asked).posed)
    return state


# Each stage alone


def test_the_sample_knows_both_wells():
    sample = POLICY.sample(begun())
    places = [sample.box.design(sample.refined, row)["x"] for row in range(len(sample.refined))]
    for well in (LEFT, RIGHT):
        assert min(abs(place - well) for place in places) < 1e-2
    worth = sample.refined.objective
    assert worth[0] == worth.min()
    assert worth[0] == pytest.approx(depth(LEFT), abs=1e-5)


def test_there_is_no_sample_for_a_pattern():
    assert POLICY.sample(begun(model=from_coefficients([1, x, 1]), minimize=None, locate="EP2")) is None


def test_starts_begin_with_those_at_hand_then_take_turns():
    state = replace(begun(start={"x": 0.5}), extra=({"x": -1.5}, {"x": 3.0}))
    state = replace(state, sample=POLICY.sample(state))
    starts = [start for start, _ in zip(POLICY.starts(state), range(6), strict=False)]
    assert [start.design["x"] for start in starts[:2]] == [0.5, -1.5]  # 3 is outside
    assert [start.near for start in starts[2:]] == [True, False, True, False]
    rows = [start.row for start in starts[2:]]
    assert rows[0] == 0
    assert rows[1] == len(state.sample.refined)


@pytest.mark.parametrize(("at", "well"), [(-1.3, LEFT), (0.7, RIGHT), (1.9, RIGHT)])
def test_a_start_ends_in_its_well(at, well):
    end = POLICY.local(begun(), tmsopt.Start({"x": at}))
    assert end.feasible
    assert begun().design_at(end)["x"] == pytest.approx(well, abs=1e-6)
    assert end.objective == pytest.approx(depth(well), abs=1e-10)


def test_the_best_end_is_accepted_whatever_their_order():
    state = begun()
    ends = tuple(POLICY.local(state, tmsopt.Start({"x": at})) for at in (0.7, -1.3, 0.9))
    accepted = POLICY.accept(replace(state, ends=ends))
    assert accepted.best.parameters["x"] == pytest.approx(LEFT, abs=1e-9)
    assert accepted.accepted == 3
    more = (*ends, POLICY.local(state, tmsopt.Start({"x": 0.8})))
    assert POLICY.accept(replace(accepted, ends=more)).best == accepted.best


def test_of_two_ends_as_good_the_converged_one_is_better():
    state = begun()
    whole = accepting.check_end(state, POLICY.local(state, tmsopt.Start({"x": -1.3})))
    lower = replace(whole.checked, objective=whole.checked.objective - 1e-14)
    run = replace(whole.end.run, status="Maximum_Iterations_Exceeded")
    stopped = replace(
        whole, end=replace(whole.end, run=run), point=replace(whole.point, stationarity=1.0), checked=lower
    )
    assert accepting.is_better(state.problem, whole, stopped)
    assert not accepting.is_better(state.problem, stopped, whole)
    better = replace(stopped, checked=replace(lower, objective=whole.checked.objective - 1e-9))
    assert accepting.is_better(state.problem, better, whole)


def test_one_end_is_not_enough():
    state = begun()
    state = replace(state, sample=POLICY.sample(state))
    end = POLICY.local(state, tmsopt.Start({"x": -1.3}))
    assert not POLICY.enough(replace(state, ends=(end,)))
    many = replace(state, ends=(replace(end, led=frozenset(range(len(state.sample.leaders)))),) * 8)
    assert POLICY.enough(many)


def test_an_exhaustive_search_asks_no_rule():
    hasty = replace(POLICY, enough=lambda state: True)
    runs = [tmsopt.solve(problem(), policy=hasty, starts=5, exhaustive=e).starts.runs for e in (False, True)]
    assert runs == [1, 5]


# The loop


def test_a_stage_of_ones_own_is_called_with_the_state():
    counts = []

    def enough(state):
        counts.append((len(state.ends), state.best))
        return len(state.ends) == 2

    design = tmsopt.solve(problem(), policy=replace(POLICY, enough=enough), throw=False)
    assert counts == [(1, None), (2, None)]  # accepted after the loop
    assert design.value == pytest.approx(depth(LEFT), abs=1e-8)  # the first start is the best of the sample


def test_a_policy_cannot_make_a_design_look_better_than_it_is():
    """Stages that lie are found out by the recheck."""

    def flattered(state, start):
        return replace(POLICY.local(state, start), objective=-1e3)

    design = tmsopt.solve(problem(), policy=replace(POLICY, local=flattered), throw=False)
    assert design.value >= depth(LEFT) - 1e-12
    assert design.value == pytest.approx(depth(design.parameters["x"]), abs=1e-12)


def test_what_another_stage_accepts_is_rechecked_inside_the_box():
    """A stage that praises a design outside the box, or one that violates a constraint."""
    for praised in (5.0, 1.5):

        def accept(state, praised=praised):
            best = POLICY.accept(state).best
            flattered = replace(best, parameters={"x": praised}, checked=replace(best.checked, objective=-1e3))
            return replace(state, best=flattered, accepted=len(state.ends))

        asked = problem(constraints={"left": "x <= 0"})
        rescue = tmsopt.Rescue("praise", "", lambda state: True, lambda state, policy, accept=accept: accept(state))
        for lying in (replace(POLICY, accept=accept, rescues=()), replace(POLICY, rescues=(rescue,))):
            design = tmsopt.solve(asked, policy=lying, throw=False)
            assert design.status != "optimal" or design.value == pytest.approx(depth(LEFT), abs=1e-9)
            assert design.parameters["x"] <= 2.0
            assert design.value == pytest.approx(depth(design.parameters["x"]), abs=1e-12)
            assert design.violations if design.parameters["x"] > 0 else not design.violations


def test_a_search_that_ends_early_is_not_sure():
    hasty = tmsopt.solve(problem(), policy=replace(POLICY, enough=lambda state: True))
    assert hasty.starts.runs == 1
    assert hasty.starts.sureness[-1] == "a better one is possible"
    whole = tmsopt.solve(problem())
    assert whole.starts.runs >= whole.starts.optima + 2
    assert len(whole.starts.sureness) == 1


@pytest.mark.parametrize(
    ("policy", "words"),
    [
        ("hasty", "found 'hasty'; accepted: a tmsopt.Policy"),
        (replace(POLICY, enough=3, local=None), "policy.local: found None.*\n.*policy.enough: found 3"),
    ],
)
def test_what_is_no_policy_is_refused(policy, words):
    with pytest.raises(InputError, match=words):
        tmsopt.solve(problem(), policy=policy)


def test_starts_that_lead_to_the_same_end_are_not_run():
    tried = []

    def local(state, start):
        tried.append(start.row)
        return POLICY.local(state, start)

    design = tmsopt.solve(problem(), policy=replace(POLICY, local=local))
    rows = [row for row in tried if row >= 0]
    assert len(rows) == len(set(rows))
    assert design.starts.tried > len(tried)  # led ones count


@pytest.mark.parametrize(("at", "side"), [(0.7, 1), (-1.3, -1)])
def test_a_start_beyond_the_ridge_does_not_lead_to_an_end(at, side):
    state = begun()
    state = replace(state, sample=POLICY.sample(state))
    end = POLICY.local(state, tmsopt.Start({"x": at}))
    designs = [state.sample.box.design(state.sample.leaders, row)["x"] for row in end.led]
    assert len(designs) > 2
    assert all(side * (x - RIDGE) > 0 for x in designs)


# Rescues


def test_rescues_are_left_out_by_name():
    names = [rescue.name for rescue in POLICY.rescues]
    assert len(names) == len(set(names))
    for name in names:
        assert [rescue.name for rescue in POLICY.without(name).rescues] == [n for n in names if n != name]
        assert POLICY.without(name).tuning == POLICY.tuning
    with pytest.raises(InputError, match="no rescue is called 'asid'; did you mean 'aside'"):
        POLICY.without("asid")


def test_a_start_may_leave_out_parameters():
    """They are where the problem starts, or in the middle."""
    local, seen = POLICY.local, []

    def noted(state, start):
        seen.append(dict(start.design))
        return local(state, start)

    policy = replace(POLICY, starts=lambda state: iter([tmsopt.Start({"m": 3.0})]), local=noted)
    asked = tmsopt.Problem(
        from_coefficients(["m", "c", 1]), free={"m": (1, 4), "c": (0, 4)}, start={"c": 3.5}, minimize="abscissa"
    )
    tmsopt.solve(asked, policy=policy, throw=False)
    assert seen[0] == {"m": 3.0, "c": 3.5}


def test_a_rescue_of_ones_own_steps_in_after_the_loop():
    """The starts know the right well alone; the rescue starts on the left."""

    def run(state, policy):
        end = policy.local(state, tmsopt.Start({"x": -1.3}))
        return policy.accept(replace(state, ends=(*state.ends, end)))

    right = replace(POLICY, starts=lambda state: iter([tmsopt.Start({"x": 0.9})] * 9), sample=lambda state: None)
    blind = replace(right, rescues=())
    assert tmsopt.solve(problem(), policy=blind).value == pytest.approx(depth(RIGHT), abs=1e-9)
    left = tmsopt.Rescue("left", "", lambda state: state.best.parameters["x"] > 0, run)
    found = tmsopt.solve(problem(), policy=replace(right, rescues=(left,)))
    assert found.value == pytest.approx(depth(LEFT), abs=1e-9)


def test_a_better_end_takes_the_place_of_a_fallback_and_a_worse_one_does_not():
    state = begun()
    right = POLICY.accept(replace(state, ends=(POLICY.local(state, tmsopt.Start({"x": 0.9})),)))
    told = replace(right, fallback=states.Fallback({"x": 0.0}, "no optimum"))
    same = driver.search_again(told, POLICY, [tmsopt.Start({"x": 0.8})])
    assert same.fallback == told.fallback
    assert same.best == right.best
    left = driver.search_again(told, POLICY, [tmsopt.Start({"x": -1.3})])
    assert left.fallback is None
    assert left.best.parameters["x"] == pytest.approx(LEFT, abs=1e-9)
    assert len(left.ends) == left.accepted == 2


def test_what_one_stage_draws_changes_no_other():
    """Random numbers of a stage are those of its name and the seed alone."""
    state = begun()
    box = POLICY.sample(state).box
    first = sampling.stream(box.seed, "refine").random(4)
    sampling.stream(box.seed, "around").random(100)
    assert np.array_equal(sampling.stream(box.seed, "refine").random(4), first)
    assert not np.array_equal(sampling.stream(box.seed, "around").random(4), first)
    before, after = POLICY.sample(state), POLICY.sample(state)
    assert np.array_equal(before.refined.u, after.refined.u)


@pytest.mark.slow
def test_one_bold_design_is_enough_to_approach_a_singular_mass_matrix():
    """All designs of its sample that are bold lie in one corner."""
    found = tmsopt.solve(hard_problem(266, 2), throw=False)
    assert found.status == "not_converged"
    assert not found.violations


# Records and numbers


def test_nothing_of_a_search_can_be_changed():
    for record in (POLICY, tmsopt.TUNING, begun(), tmsopt.Start({})):
        with pytest.raises(FrozenInstanceError):
            setattr(record, fields(record)[0].name, None)


def test_every_number_has_a_unit_a_reason_and_a_benchmark():
    from benchmarks.command import SECTIONS

    known = {section.name for section in SECTIONS} | {"sixfold"}
    for field in fields(tmsopt.TUNING):
        assert field.metadata["unit"]
        assert field.metadata["reason"]
        assert field.metadata["benchmark"] in known, field.name


def test_a_tuning_of_ones_own_is_used():
    fewer = replace(POLICY, tuning=replace(tmsopt.TUNING, most=600, least=600, first=600))
    assert 600 <= tmsopt.solve(problem(), policy=fewer).starts.looked < 610
    assert tmsopt.solve(problem()).starts.looked > 1500


def test_tolerances_of_ones_own_are_obeyed():
    """Nothing converges where the gradient and what rows are off by are to be negative."""
    policy = replace(POLICY, tuning=replace(tmsopt.TUNING, exact=-1.0, polished=-1.0, stationary=-1.0))
    assert tmsopt.solve(problem(), policy=policy, throw=False).status == "not_converged"


def test_climbs_for_the_radius_are_tuned_too():
    fewer = replace(POLICY, tuning=replace(tmsopt.TUNING, climbs=1, fewest_climbs=1))
    asked = problem(model=from_coefficients([1, 1, x]), minimize=None, maximize="radius", free={"x": (0.5, 2.0)})
    assert tmsopt.solve(asked, policy=fewer, throw=False).starts.runs == 1


def test_an_odd_number_of_designs_may_be_looked_at_about_each():
    odd = replace(POLICY, tuning=replace(tmsopt.TUNING, local=41, basin_local=25))
    assert tmsopt.solve(problem(), policy=odd).value == pytest.approx(depth(LEFT), abs=1e-8)
