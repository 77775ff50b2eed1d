"""The search as a policy: each stage alone, the loop with stages of one's own, rescues, and the numbers of it all.

What is minimised are two wells, the left one deeper (helpers/wells.py).
"""

from dataclasses import fields, replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.wells import LEFT, RIDGE, RIGHT, begun, depth, wells, x

import tmsopt
from benchmarks.suites import hard_problem
from tmsopt.errors import InputError
from tmsopt.models import from_coefficients
from tmsopt.problem import expected_unseen
from tmsopt.search import SearchState, make_failed_end

accepting, driver, sampling, states = (
    import_module(f"tmsopt.search.{name}") for name in ("acceptance", "policy", "sample", "state")
)
POLICY, Start, solve = tmsopt.POLICY, tmsopt.Start, tmsopt.solve


def end_at(*places, state=None):
    """The ends of starts at these places."""
    return tuple(POLICY.local(state or begun(), Start({"x": at})) for at in places)


# Each stage alone


def test_the_sample_knows_both_wells():
    sample = POLICY.sample(begun())
    places = [design["x"] for design in sample.box.designs(sample.refined)]
    for well in (LEFT, RIGHT):
        assert min(abs(place - well) for place in places) < 1e-2
    worth = sample.refined.objective
    assert worth[0] == worth.min()
    assert worth[0] == pytest.approx(depth(LEFT), abs=1e-5)


def test_there_is_no_sample_for_a_pattern():
    assert POLICY.sample(begun(model=from_coefficients([1, x, 1]), minimize=None, locate="EP2")) is None


def test_starts_begin_with_those_at_hand_then_take_turns():
    state = replace(begun(sampled=True, start={"x": 0.5}), extra=({"x": -1.5}, {"x": 3.0}))
    starts = [start for start, _ in zip(POLICY.starts(state), range(6), strict=False)]
    assert [start.design["x"] for start in starts[:2]] == [0.5, -1.5]  # 3 is outside
    assert [start.near for start in starts[2:]] == [True, False, True, False]
    assert [start.row for start in starts[2:4]] == [0, len(state.sample.refined)]


def test_the_best_end_is_accepted_whatever_their_order():
    ends = end_at(0.7, -1.3, 0.9)
    accepted = POLICY.accept(replace(begun(), ends=ends))
    assert accepted.best.parameters["x"] == pytest.approx(LEFT, abs=1e-9)
    assert accepted.accepted == 3
    assert POLICY.accept(replace(accepted, ends=(*ends, *end_at(0.8)))).best == accepted.best


def test_of_two_ends_as_good_the_converged_one_is_better():
    state = begun()
    whole = accepting.check_end(state, *end_at(-1.3))
    lower = replace(whole.checked, objective=whole.checked.objective - 1e-14)
    end = replace(whole.end, run=replace(whole.end.run, status="Maximum_Iterations_Exceeded"))
    stopped = replace(whole, end=end, point=replace(whole.point, stationarity=1.0), checked=lower)
    assert accepting.is_better(state.problem, whole, stopped)
    assert not accepting.is_better(state.problem, stopped, whole)
    better = replace(stopped, checked=replace(lower, objective=whole.checked.objective - 1e-9))
    assert accepting.is_better(state.problem, better, whole)


@pytest.mark.parametrize(
    ("violation", "slope", "ended"), [(1e-12, 1e-5, True), (1e-7, 1e-12, True), (1e-7, 1e-7, False)]
)
def test_an_end_off_the_rows_is_no_optimum(violation, slope, ended):
    """IPOPT says that it succeeded of rows as it scales them; beside a pole they are large, and polished all the same."""
    end = SimpleNamespace(run=SimpleNamespace(status="Solve_Succeeded"))
    point = SimpleNamespace(violation=violation, stationarity=slope)
    assert accepting.has_converged(SimpleNamespace(end=end, point=point, tuning=tmsopt.TUNING)) is ended


# When a search ends: by the optima that are expected still, from how many starts ended in how many different ones


PLAIN = tmsopt.Problem(from_coefficients([1, 2 + x]), free={"x": (0.0, 1.0)}, minimize="x").posed


def settled(ends, share=0.5, far_off=False, left=0):
    """Of starts that ended at these objectives, None where at nothing feasible; so many refined designs are left."""
    nlp = SimpleNamespace(size=1.0, variables=())
    failed = make_failed_end(Start({}), nlp)
    ended = tuple(failed if e is None else replace(failed, objective=e, feasible=True) for e in ends)
    refined = sampling.DesignBatch(np.zeros((left, 1)), np.zeros(left), np.zeros(left))
    box = SimpleNamespace(is_narrow=share < tmsopt.TUNING.narrow_share)
    sample = SimpleNamespace(box=box, is_far_off=far_off, refined=refined, leaders=refined)
    return bool(POLICY.enough(SearchState(PLAIN, PLAIN, nlp, sample=sample, ends=ended)))


@pytest.mark.parametrize(
    ("ends", "enough", "asked"),
    [
        ([1.0], 8, {}),  # w/(n − w − 2) is 1/5 where eight starts ended in one optimum
        ([1.0, 2.0], 14, {}),
        ([1.0, 2.0, 3.0], 20, {}),
        ([1.0], 8, {"share": 0.01}),
        ([None], 8, {}),  # nothing feasible
        ([None], 3, {"share": 0.0, "far_off": True}),  # no design of the sample comes near the limits
        ([1.0, 2.0, *[None] * 20], 18, {}),  # sixteen failed, beside two others
    ],
)
def test_a_search_ends_with_so_many_starts_and_not_before(ends, enough, asked):
    tried = (ends * enough)[:enough]
    assert settled(tried, **asked)
    assert not settled(tried[:-1], **asked)


def test_designs_left_count_as_optima_of_their_own():
    """Ten starts in one optimum and three designs left: w = 4, n = 13, and 4/7 are expected."""
    assert settled([1.0] * 10)
    assert not settled([1.0] * 10, left=3)
    assert settled([1.0] * 23, left=3)


def test_the_estimate_is_that_of_boender_and_rinnooy_kan():
    """Optima in equal basins: the mean number not met is what is estimated from those that were, within its noise.

    The estimate is w (w + 1)/(n − w − 2), the posterior mean for a uniform prior over numbers and shares of basins.
    """
    rng = np.random.default_rng(1)
    truth, estimate = [], []
    for _ in range(4000):
        count = int(rng.integers(1, 30))
        seen = len(np.unique(rng.choice(count, 60, p=rng.dirichlet(np.ones(count)))))
        truth.append(count - seen)
        estimate.append(expected_unseen(60, seen))
    small = np.array(estimate) < 8  # the prior of the estimate has no end, this one ends at 29
    assert np.mean(np.array(truth)[small]) == pytest.approx(np.mean(np.array(estimate)[small]), rel=0.25)


@pytest.mark.parametrize(
    ("tried", "at_best", "counts", "words"),
    [
        (64, 1, {"optima": 30, "runs": 64}, ("found from 1 of 64 starts", "a better design is likely")),
        (64, 40, {"optima": 3, "runs": 64}, ("found from 40 of 64 starts",)),
        (3, 3, {"optima": 1, "runs": 3}, ("found from 3 of 3 starts", "a better design is possible")),
        (0, 0, {}, ()),
        # All but one were only seen to lead there.
        (39, 39, {"optima": 1, "runs": 1}, ("found from 39 of 39 starts", "a better design is possible")),
    ],
)
def test_the_words_follow_from_the_numbers(tried, at_best, counts, words):
    assert tmsopt.Starts(tried, tried, at_best, **counts).sureness == words


# The loop


def test_an_exhaustive_search_asks_no_rule():
    hasty = replace(POLICY, enough=lambda state: True)
    assert [solve(wells(), policy=hasty, starts=5, exhaustive=e).starts.runs for e in (False, True)] == [1, 5]


def test_a_stage_of_ones_own_is_called_with_the_state():
    counts = []

    def enough(state):
        counts.append((len(state.ends), state.best))
        return len(state.ends) == 2

    design = solve(wells(), policy=replace(POLICY, enough=enough), throw=False)
    assert counts == [(1, None), (2, None)]  # accepted after the loop
    assert design.value == pytest.approx(depth(LEFT), abs=1e-8)  # the first start is the best of the sample


@pytest.mark.parametrize("rescued", [False, True])
@pytest.mark.parametrize("praised", [5.0, 1.5])
def test_what_another_stage_accepts_is_rechecked_inside_the_box(praised, rescued):
    """A stage that praises a design outside the box, or one that violates a constraint."""

    def accept(state, policy=None):
        best = POLICY.accept(state).best
        flattered = replace(best, parameters={"x": praised}, checked=replace(best.checked, objective=-1e3))
        return replace(state, best=flattered, accepted=len(state.ends))

    rescue = tmsopt.Rescue("praise", "", lambda state: True, accept)
    lying = replace(POLICY, rescues=(rescue,)) if rescued else replace(POLICY, accept=accept, rescues=())
    design = solve(wells(constraints={"left": "x <= 0"}), policy=lying, throw=False)
    assert design.status != "optimal" or design.value == pytest.approx(depth(LEFT), abs=1e-9)
    assert design.parameters["x"] <= 2.0
    assert design.value == pytest.approx(depth(design.parameters["x"]), abs=1e-12)
    assert bool(design.violations) == (design.parameters["x"] > 0)


@pytest.mark.parametrize(
    ("policy", "words"),
    [
        ("hasty", "found 'hasty'; accepted: a tmsopt.Policy"),
        (replace(POLICY, enough=3, local=None), "policy.local: found None.*\n.*policy.enough: found 3"),
    ],
)
def test_what_is_no_policy_is_refused(policy, words):
    with pytest.raises(InputError, match=words):
        solve(wells(), policy=policy)


def test_starts_that_lead_to_the_same_end_are_not_run():
    tried = []

    def local(state, start):
        tried.append(start.row)
        return POLICY.local(state, start)

    design = solve(wells(), policy=replace(POLICY, local=local))
    rows = [row for row in tried if row >= 0]
    assert len(rows) == len(set(rows))
    assert design.starts.tried > len(tried)  # led ones count


@pytest.mark.parametrize(("at", "side"), [(0.7, 1), (-1.3, -1)])
def test_a_start_beyond_the_ridge_does_not_lead_to_an_end(at, side):
    state = begun(sampled=True)
    (end,) = end_at(at, state=state)
    designs = [state.sample.box.design(state.sample.leaders, row)["x"] for row in end.led]
    assert len(designs) > 2
    assert all(side * (x - RIDGE) > 0 for x in designs)


def test_a_start_may_leave_out_parameters():
    """They are where the problem starts, or in the middle."""
    seen = []

    def noted(state, start):
        seen.append(dict(start.design))
        return POLICY.local(state, start)

    policy = replace(POLICY, starts=lambda state: iter([Start({"m": 3.0})]), local=noted)
    free = {"m": (1, 4), "c": (0, 4)}
    asked = tmsopt.Problem(from_coefficients(["m", "c", 1]), free=free, start={"c": 3.5}, minimize="abscissa")
    solve(asked, policy=policy, throw=False)
    assert seen[0] == {"m": 3.0, "c": 3.5}


# Rescues


def test_rescues_are_left_out_by_name():
    names = [rescue.name for rescue in POLICY.rescues]
    assert len(names) == len(set(names))
    for name in names:
        assert [rescue.name for rescue in POLICY.without(name).rescues] == [n for n in names if n != name]
        assert POLICY.without(name).tuning == POLICY.tuning
    with pytest.raises(InputError, match="no rescue is called 'small ste'; did you mean 'small step'"):
        POLICY.without("small ste")


def test_a_rescue_of_ones_own_steps_in_after_the_loop():
    """The starts know the right well alone; the rescue starts on the left."""

    def run(state, policy):
        return policy.accept(replace(state, ends=(*state.ends, policy.local(state, Start({"x": -1.3})))))

    left = tmsopt.Rescue("left", "", lambda state: state.best.parameters["x"] > 0, run)
    right = replace(POLICY, starts=lambda state: iter([Start({"x": 0.9})] * 9), sample=lambda state: None)
    for rescues, well in (((), RIGHT), ((left,), LEFT)):
        assert solve(wells(), policy=replace(right, rescues=rescues)).value == pytest.approx(depth(well), abs=1e-9)


def test_a_better_end_takes_the_place_of_a_fallback_and_a_worse_one_does_not():
    right = POLICY.accept(replace(begun(), ends=end_at(0.9)))
    told = replace(right, fallback=states.Fallback({"x": 0.0}, "no optimum"))
    same, left = (driver.search_again(told, POLICY, [Start({"x": at})]) for at in (0.8, -1.3))
    assert (same.fallback, same.best) == (told.fallback, right.best)
    assert left.fallback is None
    assert left.best.parameters["x"] == pytest.approx(LEFT, abs=1e-9)
    assert len(left.ends) == left.accepted == 2


def test_what_one_stage_draws_changes_no_other():
    """Random numbers of a stage are those of its name and the seed alone."""
    refine, again, around = (sampling.stream(0, stage).random(4) for stage in ("refine", "refine", "around"))
    assert np.array_equal(refine, again)
    assert not np.array_equal(refine, around)
    first, again, other = (sampling.sample_box(wells().posed, seed) for seed in (5, 5, 6))
    assert np.array_equal(first.refined.u, again.refined.u)
    assert not np.array_equal(first.refined.u, other.refined.u)


@pytest.mark.slow
def test_one_bold_design_is_enough_to_approach_a_singular_mass_matrix():
    """All designs of its sample that are bold lie in one corner."""
    found = solve(hard_problem(266, 2), throw=False)
    assert found.status == "not_converged"
    assert not found.violations


# Records and numbers


def test_every_number_has_a_unit_a_reason_and_a_benchmark():
    from benchmarks.command import SECTIONS

    known = {section.name for section in SECTIONS} | {"sixfold"}
    for field in fields(tmsopt.TUNING):
        assert field.metadata["unit"]
        assert field.metadata["reason"]
        assert field.metadata["benchmark"] in known, field.name


def tuned(asked=None, **numbers):
    policy = replace(POLICY, tuning=replace(tmsopt.TUNING, **numbers))
    return solve(asked or wells(), policy=policy, throw=False)


def test_a_tuning_of_ones_own_is_used():
    assert 600 <= tuned(max_sample=600, min_sample=600, base_sample=600).starts.looked < 610
    assert tuned().starts.looked > 1500


def test_tolerances_of_ones_own_are_obeyed():
    """Nothing converges where the gradient and what rows are off by are to be negative."""
    assert tuned(polished_violation=-1.0, polished_gradient=-1.0, stationary_gradient=-1.0).status == "not_converged"


def test_climbs_for_the_radius_are_tuned_too():
    asked = wells(model=from_coefficients([1, 1, x]), minimize=None, maximize="radius", free={"x": (0.5, 2.0)})
    assert tuned(asked, max_climbs=1, min_climbs=1).starts.runs == 1


def test_an_odd_number_of_designs_may_be_looked_at_about_each():
    assert tuned(neighbour_count=41, basin_neighbour_count=25).value == pytest.approx(depth(LEFT), abs=1e-8)
