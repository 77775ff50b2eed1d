"""Rescues: extra stages for problems on which the loop finds a wrong design or none.

Each rescue starts from other designs or on another program, and uses the stages of the same policy.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from tmsopt.evaluation.digits import certified_numbers
from tmsopt.models.user_spectrum import full_patterns
from tmsopt.problem import degrees_of_freedom
from tmsopt.program import choose_starts, formulate_matching
from tmsopt.program.formulate import formulate
from tmsopt.search.acceptance import check_end, has_matching_claim, is_better, is_sound
from tmsopt.search.local_search import run_once
from tmsopt.search.outcome import BEST_SAMPLED, has_runaway_root, write_mass_advice
from tmsopt.search.policy import Policy, Rescue, disable_stopping, search_again, try_starts
from tmsopt.search.sample import DesignBatch, sample_box, stream
from tmsopt.search.starts import propose_sample_starts
from tmsopt.search.state import CheckedEnd, Fallback, SearchState, Start
from tmsopt.search.stopping import select_distinct_ends

# Roots that meet


def search_real_roots(state: SearchState, policy: Policy) -> SearchState:
    """Search with all roots real. Start from designs of least abscissa whose roots all coincide, if there are any."""
    nlp = formulate(state.part, state.problem.cases, damping_ratio=1.0)
    if starts := find_multiple_roots(state, policy):
        return search_again(
            search_again(state, disable_stopping(policy), starts), disable_stopping(policy), starts, nlp
        )
    return search_again(state, policy, nlp=nlp, max_starts=state.tuning.second_program_starts)


def find_multiple_roots(state: SearchState, policy: Policy) -> list[Start]:
    """Solve the equations of designs whose roots all coincide, in one root or one pair, for the least abscissa."""
    part, tuning, starts = state.part, state.tuning, list[Start]()
    limits = {name: text for name, text in part.constraints.items() if name not in part.asked_of_roots}
    changes = {"minimize": "abscissa", "maximize": None, "constraints": limits, "scenarios": {}, "tolerances": {}}
    short_policy = replace(
        policy,
        local=lambda pattern_state, start: run_once(pattern_state, start, "far"),
        enough=lambda pattern_state: (
            len(pattern_state.ends) >= tuning.starts_without_lead or bool(pattern_state.feasible)
        ),
    )
    for pattern in full_patterns(part.model) if state.sample and not state.options.near else ():
        pattern_problem = part.derive(locate=pattern, **changes)
        if degrees_of_freedom(pattern_problem).count >= 0 and state.sample:
            pattern_state = replace(
                state.with_program(formulate_matching(pattern_problem)), problem=pattern_problem, part=pattern_problem
            )
            pattern_state = try_starts(pattern_state, propose_sample_starts(state.sample), short_policy)
            starts += [
                Start(state.design_at(end)) for end in select_distinct_ends(pattern_state.ends)[: tuning.lead_starts]
            ]
    return starts


def can_have_positive_roots(state: SearchState) -> bool:
    """Whether the best design may have a positive real root, which has the damping ratio −1.

    If the damping ratio is a variable, the factors of the program keep all roots in a sector, which excludes this one.
    """
    if "damping_ratio" not in state.nlp.variables:
        return False
    if state.best is None or "damping_ratio" in state.nlp.contacts:  # a smaller damping ratio may be better
        return True
    goal = state.problem.objective
    return not (goal and "damping_ratio" in goal.names) and state.best.checked.structure.abscissa > 0


def search_positive_roots(state: SearchState, policy: Policy) -> SearchState:
    """Search with the damping ratio −1, which keeps the roots in no sector."""
    nlp = formulate(state.part, state.problem.cases, damping_ratio=-1.0)
    has_few_starts = (state.best and state.nlp.contacts) or (state.problem.sense, state.problem.goal) == (
        "maximize",
        "damping_ratio",
    )
    return search_again(state, policy, nlp=nlp, max_starts=state.tuning.second_program_starts if has_few_starts else 0)


def has_only_crossings(state: SearchState) -> bool:
    """Whether starts for a pattern with freedom ended only where roots meet without a Jordan chain."""
    has_crossing, best = any(end.crossing for end in state.ends), state.best
    return has_crossing and (not best or bool(best.checked.violations)) and degrees_of_freedom(state.problem).count > 0


def search_other_chains(state: SearchState, policy: Policy) -> SearchState:
    """Search for exceptional points from other starts, because the points found first are only crossings."""
    part = state.part
    for design in choose_starts(part, state.options.seed, state.tuning.chain_starts):
        nlp = formulate_matching(part.derive(minimize=None, maximize=None, start=design))
        state = search_again(state, policy, [Start(design)], nlp)
        if state.best and is_sound(state.problem, state.best):
            break
    return state


# Better designs in the sample


def find_rivals(state: SearchState) -> DesignBatch | None:
    """Find designs that are better than the best end, in the sample and near that end; the best comes first."""
    if state.sample is None:
        return None
    rivals = state.sample.refined
    if state.best:
        rivals = rivals.join(state.sample.box.explore(state.best.parameters))
    return rivals.select_better(compute_threshold(state))


def compute_threshold(state: SearchState, tolerance: float | None = None) -> float:
    """Return the objective below which a design is better than the best end; inf without a feasible best end."""
    best, tolerance = state.best, state.tuning.better_by if tolerance is None else tolerance
    if best is None or best.checked.violations:
        return math.inf
    objective = state.problem.sign * best.checked.objective
    return objective - tolerance * (best.end.nlp.size + abs(objective)) if math.isfinite(objective) else math.inf


def restart_from_rivals(state: SearchState, policy: Policy) -> SearchState:
    """Start from designs that are better than the best end, and repeat this while it helps."""
    for _ in range(state.tuning.appeals):
        rivals = find_rivals(state)
        if not rivals or not state.sample:
            break
        previous_best = state.best
        starts = (Start(design) for design in state.sample.box.designs(rivals.take_best(state.tuning.rival_starts)))
        state = search_again(state, disable_stopping(policy), starts)
        if state.best is previous_best:
            break
    return state


def has_doubtful_claim(state: SearchState) -> bool:
    """Whether an end claims a better objective than the best design, or a root near 0 makes the damping ratio jump."""
    goal, best, threshold = state.problem.objective, state.best, compute_threshold(state)
    if state.sample is None:
        return False
    if best is not None and goal is not None and "damping_ratio" in goal.names:
        sizes = sorted(root.size for root in best.checked.structure.roots)
        if sizes and sizes[0] < state.tuning.zero_root_size * sizes[-1]:
            return True
    return any(end.objective < threshold for end in state.feasible)


def move_aside(state: SearchState, policy: Policy) -> SearchState:
    """Replace the best end by a design close to an end, if that design has the objective claimed for this end."""
    problem, tolerance = state.problem, state.tuning.better_by
    for end in select_distinct_ends(state.ends)[: state.tuning.small_step_optima]:
        checked_end = check_end(state, end)
        for design in (checked_end.parameters, *_propose_near_designs(state, checked_end.parameters, end.objective)):
            checked = state.recheck(design)
            neighbour = replace(checked_end, parameters=problem.ordered(design), checked=checked)
            if checked.violations or not has_matching_claim(problem, neighbour):
                continue
            exact_value = certified_numbers(problem, neighbour.parameters, checked, state.nlp.cases).value
            is_confirmed = math.isclose(exact_value, problem.sign * end.objective, rel_tol=tolerance, abs_tol=tolerance)
            if is_confirmed and (state.best is None or not is_better(problem, state.best, neighbour)):
                return replace(state, best=neighbour)
    return state


def _propose_near_designs(
    state: SearchState, design: Mapping[str, float], objective: float
) -> Iterator[dict[str, float]]:
    """Move a design slightly towards others; yield designs that meet the limits and have nearly this objective."""
    assert state.sample is not None
    box, tuning = state.sample.box, state.tuning
    point = box.space.point(design)
    random = stream(box.seed, "aside").random((tuning.small_step_targets, len(point)))
    targets = np.concatenate([state.sample.refined.u[: tuning.rival_starts], random])
    points = point + np.array(tuning.small_steps)[:, None, None] * (targets - point)
    batch = box.judge_points(points.reshape(-1, len(point)))
    is_close = (batch.violation == 0) & (
        np.abs(batch.objective - objective) <= tuning.small_step_accuracy * (1 + abs(objective))
    )
    # The rows go from large moves to small ones: a large move may worsen the design, a tiny one is lost in rounding.
    rows = np.flatnonzero(is_close)
    return box.designs(batch.take(rows[:: max(len(rows) // tuning.rechecked_designs, 1)]))


def keep_rival(state: SearchState, policy: Policy) -> SearchState:
    """Keep a sampled design as a fallback if it is still better than all ends."""
    rivals = find_rivals(state)
    if not rivals or not state.sample:
        return state
    box = state.sample.box
    fine_batch = box.refine(rivals.take_first(1), state.tuning.polish_steps).join(rivals)
    for design in box.designs(fine_batch.take_first(state.tuning.rechecked_designs)):
        checked = state.recheck(design)
        if not checked.violations and state.problem.sign * checked.objective < compute_threshold(state):
            return replace(state, fallback=Fallback(design, BEST_SAMPLED))
    return state


# a0 = 0


def can_approach_infinity(state: SearchState) -> bool:
    """Whether designs may improve towards a0 = 0, where a root goes to infinity."""
    sample, best = state.sample, state.best
    if sample is None or not state.nlp.products:
        return False
    if find_rivals(state):
        return True
    if not sample.is_nearly_singular:
        return False
    has_failed_start = bool(np.any(sample.refined.violation == 0)) and not all(end.feasible for end in state.ends)
    return (
        has_failed_start
        or best is None
        or has_runaway_root(best.checked.structure.roots, state.tuning.far_root_size)
        or bool(find_singular_rivals(state))
    )


def find_singular_rivals(state: SearchState) -> DesignBatch:
    """Find designs with a singular mass matrix that, without their roots at infinity, are better than the best end."""
    assert state.sample is not None
    if not state.sample.is_nearly_singular:
        return state.sample.refined.take_first(0)
    a0 = state.part.model.coefficient_names()[0]
    limits = {**state.part.constraints, "a singular mass matrix": f"{a0} == 0"}
    sample = sample_box(state.part.derive(constraints=limits), state.options.seed, state.tuning)
    return sample.refined.select_better(compute_threshold(state))


def search_singular(state: SearchState, policy: Policy) -> SearchState:
    """Search on both sides of a0 = 0, which the program may reach here.

    The search finds an optimum that no end reached, or an infimum at a0 = 0. At an infimum no design is the best; the
    words of the fallback say so.
    """
    assert state.sample is not None
    tuning, box, best = state.tuning, state.sample.box, state.best
    rivals = (find_rivals(state) or state.sample.refined).join(find_singular_rivals(state))
    rows = np.arange(len(rivals))
    chosen_rows = np.union1d(rows[: tuning.singular_starts], rows[-tuning.singular_starts :])
    starts = [Start(design) for design in box.designs(rivals.take(chosen_rows))]
    starts += [Start(best.parameters)] if best else []
    starts += [
        Start(design, near=False) for design in box.designs(state.sample.boldest.take_first(tuning.singular_starts))
    ]
    is_at_zero = best is not None and abs(compute_relative_a0(state, best.parameters)) < tuning.zero_a0
    threshold = compute_threshold(state, -tuning.better_by if is_at_zero else tuning.polished_difference)
    for sign in (1, -1):
        side_starts = [s for s in starts if sign * compute_relative_a0(state, s.design) > -tuning.zero_a0]
        nlp = formulate(state.part, state.nlp.cases, a0_sign=sign)
        side_state = try_starts(state.with_program(nlp), side_starts, disable_stopping(policy))
        best_end = min(side_state.feasible, key=lambda end: end.objective, default=None)
        if best_end is None or not best_end.objective < threshold:
            continue
        is_a0_row = np.array(nlp.rows) == "a0"
        is_singular = bool(nlp.evaluate(best_end.run.x)[1][is_a0_row].min() < tuning.zero_a0)
        if is_singular:
            lower = np.where(is_a0_row, tuning.infimum_a0, nlp.row_lower)
            side_state = state.with_program(replace(nlp, row_lower=tuple(lower.tolist())))
            side_state = try_starts(side_state, [Start(state.design_at(best_end))], disable_stopping(policy))
        side_state = policy.accept(side_state)
        if side_state.best is None or side_state.best.checked.violations or has_merged_roots(side_state.best):
            is_near_infinity = (
                best and is_singular and has_runaway_root(best.checked.structure.roots, tuning.far_root_size)
            )
            if best and is_near_infinity and best_end.objective < compute_threshold(state):
                advice = write_mass_advice(state.problem)
                words = f"a better design may be close to a singular mass matrix (a0 = 0); {advice}"
                state = replace(state, fallback=Fallback(best.parameters, words))
            continue
        if not state.problem.sign * side_state.best.checked.objective < threshold:
            continue
        ends, threshold = (*state.ends, *side_state.ends), compute_threshold(side_state, tuning.polished_difference)
        state = replace(side_state, ends=ends, accepted=len(ends), fallback=None)
        if is_singular:
            goal = f"towards a singular mass matrix (a0 = 0), to {state.problem.sign * best_end.objective:.9g}"
            words = f"no best design: the objective improves {goal}; {write_mass_advice(state.problem)}"
            state = replace(state, fallback=Fallback(side_state.best.parameters, words, without_best=True))
    return state


def compute_relative_a0(state: SearchState, design: Mapping[str, float]) -> float:
    """Return a0 relative to the largest coefficient."""
    a = [float(c) for c in state.problem.values(state.problem.ordered(design)).coefficients]
    return a[0] / (max(map(abs, a)) or 1.0)


def has_merged_roots(trial: CheckedEnd) -> bool:
    """Whether distant roots count as one, because rounding errors near a0 = 0 dominate the coefficients."""
    ideal, stored = trial.checked.structure.abscissa, trial.checked.abscissa_realised
    return abs(ideal - stored) > trial.tuning.distinct_root_difference * abs(ideal)


RESCUES = (
    Rescue("other chains", "", has_only_crossings, search_other_chains),
    # If abscissa and damping ratio are both variables, their factors are singular where real roots meet.
    Rescue("real roots", "hard 3", lambda s: {"abscissa", "damping_ratio"} <= {*s.nlp.variables}, search_real_roots),
    Rescue("positive roots", "hard 7, systems 1, variety 4", can_have_positive_roots, search_positive_roots),
    Rescue("appeals", "sixfold 14", lambda s: bool(find_rivals(s)), restart_from_rivals),
    Rescue("small step", "narrow 14, hard 4, variety 1", has_doubtful_claim, move_aside),
    Rescue("infinity", "hard 9", can_approach_infinity, search_singular),
    Rescue("kept design", "", lambda s: bool(find_rivals(s)) and s.fallback is None, keep_rival),
)
"""All rescues, in the order in which they run."""
