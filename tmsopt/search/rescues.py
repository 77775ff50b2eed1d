"""Rescues: extra stages for problems on which the loop alone ends at a wrong design or at none.

Each one starts from other designs or on another program, and returns to the same loop.
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
from tmsopt.search.acceptance import check_end, claim_matches, is_better, is_sound
from tmsopt.search.local_search import run_once
from tmsopt.search.outcome import KEPT, has_runaway_root, write_mass_advice
from tmsopt.search.policy import Policy, Rescue, disable_stopping, search_again, try_starts
from tmsopt.search.sample import DesignBatch, sample_box, stream
from tmsopt.search.starts import propose_sample_starts
from tmsopt.search.state import CheckedEnd, Fallback, SearchState, Start
from tmsopt.search.stopping import select_distinct_ends

# Roots that meet


def search_real_roots(state: SearchState, policy: Policy) -> SearchState:
    """Search with all roots real; start from designs of least abscissa with one multiple root, if there are any."""
    nlp = formulate(state.part, state.problem.cases, damping_ratio=1.0)
    if leads := find_multiple_roots(state, policy):
        return search_again(search_again(state, disable_stopping(policy), leads), disable_stopping(policy), leads, nlp)
    return search_again(state, policy, nlp=nlp, most=state.tuning.fewer)


def find_multiple_roots(state: SearchState, policy: Policy) -> list[Start]:
    """Designs of least abscissa with one root, or one pair, of full multiplicity, found from their equations."""
    part, tuning, leads = state.part, state.tuning, list[Start]()
    limits = {name: text for name, text in part.constraints.items() if name not in part.asked_of_roots}
    free = {"minimize": "abscissa", "maximize": None, "constraints": limits, "scenarios": {}, "tolerances": {}}
    few = replace(
        policy,
        local=lambda own, start: run_once(own, start, "far"),
        enough=lambda own: len(own.ends) >= tuning.leadless or bool(own.feasible),
    )
    for pattern in full_patterns(part.model) if state.sample and not state.options.near else ():
        asked = part.derive(locate=pattern, **free)
        if degrees_of_freedom(asked).count >= 0 and state.sample:
            own = replace(state.with_program(formulate_matching(asked)), problem=asked, part=asked)
            own = try_starts(own, propose_sample_starts(state.sample), few)
            leads += [Start(state.design_at(end)) for end in select_distinct_ends(own.ends)[: tuning.leads]]
    return leads


def can_have_positive_roots(state: SearchState) -> bool:
    """Whether the best design may have a positive real root, whose damping ratio −1 belongs to no sector."""
    if "damping_ratio" not in state.nlp.variables:
        return False
    if state.best is None or "damping_ratio" in state.nlp.contacts:  # the less of it the better, somewhere
        return True
    goal = state.problem.objective
    return not (goal and "damping_ratio" in goal.names) and state.best.checked.structure.abscissa > 0


def search_positive_roots(state: SearchState, policy: Policy) -> SearchState:
    """Search with a damping ratio of −1, without a sector."""
    nlp = formulate(state.part, state.problem.cases, damping_ratio=-1.0)
    few = (state.best and state.nlp.contacts) or (state.problem.sense, state.problem.goal) == (
        "maximize",
        "damping_ratio",
    )
    return search_again(state, policy, nlp=nlp, most=state.tuning.fewer if few else 0)


def has_only_crossings(state: SearchState) -> bool:
    """Whether starts for a pattern with freedom ended only where roots meet without a Jordan chain."""
    crossing, best = any(end.crossing for end in state.ends), state.best
    return crossing and (not best or bool(best.checked.violations)) and degrees_of_freedom(state.problem).count > 0


def search_other_chains(state: SearchState, policy: Policy) -> SearchState:
    """Search for exceptional points from other starts, if the point nearest to the first start is only a crossing."""
    part = state.part
    for design in choose_starts(part, state.options.seed, state.tuning.chains):
        nlp = formulate_matching(part.derive(minimize=None, maximize=None, start=design))
        state = search_again(state, policy, [Start(design)], nlp)
        if state.best and is_sound(state.problem, state.best):
            break
    return state


# Better designs in the sample


def find_rivals(state: SearchState) -> DesignBatch | None:
    """Designs of the sample and near the best end that are better than the best end, the best first."""
    if state.sample is None:
        return None
    rivals = state.sample.refined
    if state.best:
        rivals = rivals.join(state.sample.box.explore(state.best.parameters))
    return rivals.select_better(compute_threshold(state))


def compute_threshold(state: SearchState, lost: float | None = None) -> float:
    """The objective below which a design is better than the best end."""
    best, lost = state.best, state.tuning.lost if lost is None else lost
    if best is None or best.checked.violations:
        return math.inf
    objective = state.problem.sign * best.checked.objective
    return objective - lost * (best.end.nlp.size + abs(objective)) if math.isfinite(objective) else math.inf


def restart_from_rivals(state: SearchState, policy: Policy) -> SearchState:
    """Start from designs that are better than the best end, as long as that helps."""
    for _ in range(state.tuning.appeals):
        rivals = find_rivals(state)
        if not rivals or not state.sample:
            break
        before = state.best
        starts = (Start(design) for design in state.sample.box.designs(rivals.take_best(state.tuning.rivals_seen)))
        state = search_again(state, disable_stopping(policy), starts)
        if state.best is before:
            break
    return state


def has_doubtful_claim(state: SearchState) -> bool:
    """Whether an end claims more than the best design has, or a root near 0 makes its damping ratio jump."""
    goal, best, least = state.problem.objective, state.best, compute_threshold(state)
    if state.sample is None:
        return False
    if best is not None and goal is not None and "damping_ratio" in goal.names:
        sizes = sorted(root.size for root in best.checked.structure.roots)
        if sizes and sizes[0] < state.tuning.zero_root * sizes[-1]:
            return True
    return any(end.objective < least for end in state.feasible)


def move_aside(state: SearchState, policy: Policy) -> SearchState:
    """Replace the best end by a design a tiny step away that has the objective which one of the best ends claims."""
    problem, lost = state.problem, state.tuning.lost
    for end in select_distinct_ends(state.ends)[: state.tuning.asides]:
        whole = check_end(state, end)
        for design in (whole.parameters, *_propose_near_designs(state, whole.parameters, end.objective)):
            checked = state.recheck(design)
            moved = replace(whole, parameters=problem.ordered(design), checked=checked)
            if checked.violations or not claim_matches(problem, moved):
                continue
            exact = certified_numbers(problem, moved.parameters, checked, state.nlp.cases).value
            confirmed = math.isclose(exact, problem.sign * end.objective, rel_tol=lost, abs_tol=lost)
            if confirmed and (state.best is None or not is_better(problem, state.best, moved)):
                return replace(state, best=moved)
    return state


def _propose_near_designs(
    state: SearchState, design: Mapping[str, float], objective: float
) -> Iterator[dict[str, float]]:
    """Designs close to one, towards others, that meet the limits and have nearly the given objective."""
    assert state.sample is not None
    box, tuning = state.sample.box, state.tuning
    own = box.space.points(design)
    random = stream(box.seed, "aside").random((tuning.towards, len(own)))
    towards = np.concatenate([state.sample.refined.u[: tuning.rivals_seen], random])
    seen = box.judge_points((own + np.array(tuning.hairs)[:, None, None] * (towards - own)).reshape(-1, len(own)))
    close = (seen.violation == 0) & (np.abs(seen.objective - objective) <= tuning.edge * (1 + abs(objective)))
    rows = np.flatnonzero(close)  # from far to near: far ones may be worse, and rounding decides between near ones
    return box.designs(seen.take(rows[:: max(len(rows) // tuning.kept, 1)]))


def keep_rival(state: SearchState, policy: Policy) -> SearchState:
    """Keep a sampled design that is still better than all ends, as a fallback."""
    rivals = find_rivals(state)
    if not rivals or not state.sample:
        return state
    box = state.sample.box
    finest = box.refine(rivals.take_first(1), state.tuning.finest).join(rivals)
    for design in box.designs(finest.take_first(state.tuning.kept)):
        checked = state.recheck(design)
        if not checked.violations and state.problem.sign * checked.objective < compute_threshold(state):
            return replace(state, fallback=Fallback(design, KEPT))
    return state


# a0 = 0


def can_approach_infinity(state: SearchState) -> bool:
    """Whether designs may improve towards a0 = 0, where a root goes to infinity."""
    sample, best = state.sample, state.best
    if sample is None or not state.nlp.products:
        return False
    if find_rivals(state):
        return True
    if not sample.singular:
        return False
    failed = bool(np.any(sample.refined.violation == 0)) and not all(end.feasible for end in state.ends)
    return (
        failed
        or best is None
        or has_runaway_root(best.checked.structure.roots, state.tuning.far_root)
        or bool(find_singular_rivals(state))
    )


def find_singular_rivals(state: SearchState) -> DesignBatch:
    """Designs with a singular mass matrix that beat the best end, roots at infinity ignored."""
    assert state.sample is not None
    if not state.sample.singular:
        return state.sample.refined.take_first(0)
    a0 = state.part.model.coefficient_names()[0]
    limits = {**state.part.constraints, "a singular mass matrix": f"{a0} == 0"}
    sample = sample_box(state.part.derive(constraints=limits), state.options.seed, state.tuning)
    return sample.refined.select_better(compute_threshold(state))


def search_singular(state: SearchState, policy: Policy) -> SearchState:
    """Search where a0 may reach 0, from either side: for an optimum that no end reached, or an infimum at a0 = 0."""
    assert state.sample is not None
    tuning, box, best = state.tuning, state.sample.box, state.best
    rivals = (find_rivals(state) or state.sample.refined).join(find_singular_rivals(state))
    rows = np.arange(len(rivals))
    few = np.union1d(rows[: tuning.open], rows[-tuning.open :])
    starts = [Start(design) for design in box.designs(rivals.take(few))]
    starts += [Start(best.parameters)] if best else []
    starts += [Start(design, near=False) for design in box.designs(state.sample.boldest.take_first(tuning.open))]
    at_zero = best is not None and abs(compute_relative_a0(state, best.parameters)) < tuning.singular
    least = compute_threshold(state, -tuning.lost if at_zero else tuning.finer)
    for sign in (1, -1):
        own_starts = [s for s in starts if sign * compute_relative_a0(state, s.design) > -tuning.singular]
        nlp = formulate(state.part, state.nlp.cases, lead=sign)
        own = try_starts(state.with_program(nlp), own_starts, disable_stopping(policy))
        reached = min(own.feasible, key=lambda end: end.objective, default=None)
        if reached is None or not reached.objective < least:
            continue
        leads = np.array(nlp.rows) == "a0"
        singular = bool(nlp.evaluate(reached.run.x)[1][leads].min() < tuning.singular)
        if singular:
            lower = np.where(leads, tuning.inside, nlp.row_lower)
            own = state.with_program(replace(nlp, row_lower=tuple(lower.tolist())))
            own = try_starts(own, [Start(state.design_at(reached))], disable_stopping(policy))
        own = policy.accept(own)
        if own.best is None or own.best.checked.violations or has_merged_roots(own.best):
            near = best and singular and has_runaway_root(best.checked.structure.roots, tuning.far_root)
            if best and near and reached.objective < compute_threshold(state):
                advice = write_mass_advice(state.problem)
                words = f"a better design may be close to a singular mass matrix (a0 = 0); {advice}"
                state = replace(state, fallback=Fallback(best.parameters, words))
            continue
        if not state.problem.sign * own.best.checked.objective < least:
            continue
        ends, least = (*state.ends, *own.ends), compute_threshold(own, tuning.finer)
        state = replace(own, ends=ends, accepted=len(ends), fallback=None)
        if singular:
            goal = f"towards a singular mass matrix (a0 = 0), to {state.problem.sign * reached.objective:.9g}"
            words = f"no best design: it improves {goal}; {write_mass_advice(state.problem)}"
            state = replace(state, fallback=Fallback(own.best.parameters, words, without_best=True))
    return state


def compute_relative_a0(state: SearchState, design: Mapping[str, float]) -> float:
    """a0 relative to the largest coefficient."""
    a = [float(c) for c in state.problem.values(state.problem.ordered(design)).coefficients]
    return a[0] / (max(map(abs, a)) or 1.0)


def has_merged_roots(trial: CheckedEnd) -> bool:
    """Whether distant roots count as one, because rounding near a0 = 0 dominates the coefficients."""
    ideal, stored = trial.checked.structure.abscissa, trial.checked.realised
    return abs(ideal - stored) > trial.tuning.merged * abs(ideal)


RESCUES = (
    Rescue("other chains", "", has_only_crossings, search_other_chains),
    # If both are variables, their factors are singular where real roots meet.
    Rescue("real roots", "hard 3", lambda s: {"abscissa", "damping_ratio"} <= {*s.nlp.variables}, search_real_roots),
    Rescue("positive roots", "hard 7, systems 1, variety 4", can_have_positive_roots, search_positive_roots),
    Rescue("appeals", "sixfold 14", lambda s: bool(find_rivals(s)), restart_from_rivals),
    Rescue("aside", "narrow 14, hard 4, variety 1", has_doubtful_claim, move_aside),
    Rescue("infinity", "hard 9", can_approach_infinity, search_singular),
    Rescue("kept design", "", lambda s: bool(find_rivals(s)) and s.fallback is None, keep_rival),
)
"""In the order in which they run."""
