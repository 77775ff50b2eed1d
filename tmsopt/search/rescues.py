"""Rescues: what a search does where its loop alone ends wrongly or with nothing, each earned on a benchmark.

Every one starts from other designs or on another program, and hands what it finds to the same loop.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from tmsopt.evaluation.digits import certified_numbers
from tmsopt.models.user_spectrum import full_patterns
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.program.formulate import formulate, formulate_matching
from tmsopt.program.starts import choose_starts
from tmsopt.search.accept import check_end, claim_matches, is_better, is_sound
from tmsopt.search.enough import distinct_ends
from tmsopt.search.local import run_once
from tmsopt.search.outcome import KEPT, mass_advice, runs_away
from tmsopt.search.policy import Policy, Rescue, search_again, try_all, try_starts
from tmsopt.search.sample import Looked, sample_box
from tmsopt.search.starts import sample_starts
from tmsopt.search.state import CheckedEnd, Fallback, SearchState, Start

# Roots that meet


def is_mixed(state: SearchState) -> bool:
    """Whether sectors and half-planes are asked for together, which are singular where real roots meet."""
    return {"abscissa", "damping_ratio"} <= set(state.nlp.variables)


def search_real_roots(state: SearchState, policy: Policy) -> SearchState:
    """The search where all roots are real; from designs of least abscissa with all roots in one, if there are any."""
    nlp = formulate(state.part, state.problem.cases, damping_ratio=1.0)
    if leads := find_multiple_roots(state, policy):
        return search_again(search_again(state, try_all(policy), leads), try_all(policy), leads, nlp)
    return search_again(state, policy, nlp=nlp, most=state.tuning.fewer)


def find_multiple_roots(state: SearchState, policy: Policy) -> list[Start]:
    """Designs of least abscissa with one root, or one pair, of full multiplicity: equations lead there."""
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
            own = try_starts(own, sample_starts(state.sample), few)
            leads += [Start(state.design_at(end)) for end in distinct_ends(own.ends)[: tuning.leads]]
    return leads


def may_have_positive_roots(state: SearchState) -> bool:
    """Whether the best design may have a positive real root, which has a damping ratio of −1 and no sector."""
    if "damping_ratio" not in state.nlp.variables:
        return False
    if state.best is None or "damping_ratio" in state.nlp.contacts:  # the less of it the better, somewhere
        return True
    goal = state.problem.objective
    return not (goal and "damping_ratio" in goal.names) and state.best.checked.structure.abscissa > 0


def search_positive_roots(state: SearchState, policy: Policy) -> SearchState:
    """The search without a sector, where the damping ratio is −1."""
    nlp = formulate(state.part, state.problem.cases, damping_ratio=-1.0)
    most = state.tuning.fewer if (state.best and state.nlp.contacts) or maximises_damping(state) else 0
    return search_again(state, policy, nlp=nlp, most=most)


def maximises_damping(state: SearchState) -> bool:
    """Whether the goal is the damping ratio alone."""
    return (state.problem.maximize or "").strip() == "damping_ratio"


def search_other_chains(state: SearchState, policy: Policy) -> SearchState:
    """Exceptional points nearest to other starts, where roots only cross nearest to the first."""
    part = state.part
    for design in choose_starts(part, state.options.seed, state.tuning.chains):
        nlp = formulate_matching(part.derive(minimize=None, maximize=None, start=design))
        state = search_again(state, policy, [Start(design)], nlp)
        if state.best and is_sound(state.problem, state.best):
            break
    return state


# The sample contradicts


def rivals_of(state: SearchState) -> Looked | None:
    """Designs of the sample, and about the best end, that are better than that, the best first."""
    if state.sample is None:
        return None
    rivals = state.sample.refined
    if state.best:
        rivals = rivals.joined(state.sample.box.around(state.best.parameters))
    return rivals.better(least_worth(state))


def least_worth(state: SearchState, lost: float | None = None) -> float:
    """What a design must be worth less than to be better than the best end."""
    best, lost = state.best, state.tuning.lost if lost is None else lost
    if best is None or best.checked.violations:
        return math.inf
    worth = state.problem.sign * best.checked.objective
    return worth - lost * (best.end.nlp.size + abs(worth)) if math.isfinite(worth) else math.inf


def appeal(state: SearchState, policy: Policy) -> SearchState:
    """Starts from designs that are better than the best end, as long as that helps."""
    for _ in range(state.tuning.appeals):
        rivals = rivals_of(state)
        if not rivals or not state.sample:
            break
        before = state.best
        starts = (Start(design) for design in state.sample.box.designs(rivals.best(state.tuning.rivals_seen)))
        state = search_again(state, try_all(policy), starts)
        if state.best is before:
            break
    return state


def claims_more(state: SearchState) -> bool:
    """Whether an end claims to be better than its design is, or a root of it is 0, whose damping ratio may jump."""
    goal, best, least = state.problem.objective, state.best, least_worth(state)
    if state.sample is None:
        return False
    if best is not None and goal is not None and "damping_ratio" in goal.names:
        sizes = sorted(root.size for root in best.checked.structure.roots)
        if sizes and sizes[0] < state.tuning.zero_root * sizes[-1]:
            return True
    return any(end.objective < least for end in state.feasible)


def move_aside(state: SearchState, policy: Policy) -> SearchState:
    """A design a hair's breadth from one of the best ends that is what that end claims."""
    problem, lost = state.problem, state.tuning.lost
    for end in distinct_ends(state.ends)[: state.tuning.asides]:
        whole = check_end(state, end)
        own = {n: whole.parameters[n] for n in problem.free}
        for design in (own, *_designs_beside(state, own, end.objective)):
            checked = state.recheck(design)
            moved = replace(whole, parameters=problem.ordered(design), checked=checked)
            if checked.violations or not claim_matches(problem, moved):
                continue
            exact = certified_numbers(problem, moved.parameters, checked, state.nlp.cases).value
            told = math.isclose(exact, problem.sign * end.objective, rel_tol=lost, abs_tol=lost)
            if told and (state.best is None or not is_better(problem, state.best, moved)):
                return replace(state, best=moved)
    return state


def _designs_beside(state: SearchState, design: Mapping[str, float], objective: float) -> Iterator[dict[str, float]]:
    """Designs next to one, towards others, that meet the limits and are worth about as much."""
    assert state.sample is not None
    box, tuning = state.sample.box, state.tuning
    own = box.space.points(design)
    random = box.stream("aside").random((tuning.towards, len(own)))
    towards = np.concatenate([state.sample.refined.u[: tuning.rivals_seen], random])
    seen = box.look((own + np.array(tuning.hairs)[:, None, None] * (towards - own)).reshape(-1, len(own)))
    close = (seen.violation == 0) & (np.abs(seen.worth - objective) <= tuning.edge * (1 + abs(objective)))
    rows = np.flatnonzero(close)  # from far to near: far ones may be worth less, of near ones rounding decides
    return box.designs(seen.take(rows[:: max(len(rows) // tuning.kept, 1)]))


def keep_rival(state: SearchState, policy: Policy) -> SearchState:
    """A design of the sample that is still better than all ends is given as it is."""
    rivals = rivals_of(state)
    if not rivals or not state.sample:
        return state
    box = state.sample.box
    finest = box.refine(rivals.first(1), state.tuning.finest).joined(rivals)
    for design in box.designs(finest.first(state.tuning.kept)):
        checked = state.recheck(design)
        if not checked.violations and state.problem.sign * checked.objective < least_worth(state):
            return replace(state, fallback=Fallback(design, KEPT))
    return state


# a0 = 0


def is_open(state: SearchState) -> bool:
    """Whether designs may improve towards a0 = 0, where a root leaves for infinity."""
    sample, best = state.sample, state.best
    if sample is None or not state.nlp.products:
        return False
    if rivals_of(state):
        return True
    if not sample.singular:
        return False
    failed = bool(np.any(sample.refined.violation == 0)) and not all(end.feasible for end in state.ends)
    return (
        failed
        or best is None
        or runs_away(best.checked.structure.roots, state.tuning.far_root)
        or bool(singular_rivals(state))
    )


def singular_rivals(state: SearchState) -> Looked:
    """Designs with a singular mass matrix that are better than the best end, their roots at infinity left aside."""
    assert state.sample is not None
    if not state.sample.singular:
        return state.sample.refined.first(0)
    a0 = state.part.model.coefficient_names()[0]
    limits = {**state.part.constraints, "a singular mass matrix": f"{a0} == 0"}
    sample = sample_box(state.part.derive(constraints=limits), state.options.seed, state.tuning)
    return sample.refined.better(least_worth(state))


def search_singular(state: SearchState, policy: Policy) -> SearchState:
    """The search where a0 may come to 0, from either side: an optimum that no end reached, or none but an infimum."""
    assert state.sample is not None
    tuning, box, best = state.tuning, state.sample.box, state.best
    rivals = (rivals_of(state) or state.sample.refined).joined(singular_rivals(state))
    few = np.unique([*range(len(rivals))][: tuning.open] + [*range(len(rivals))][-tuning.open :])
    starts = [Start(design) for design in box.designs(rivals.take(few))]
    starts += [Start({n: best.parameters[n] for n in state.problem.free})] if best else []
    starts += [Start(design, near=False) for design in box.designs(state.sample.boldest.first(tuning.open))]
    there = best is not None and abs(leading_of(state, best.parameters)) < tuning.singular  # all but there already
    least = least_worth(state, -tuning.lost if there else tuning.finer)
    for sign in (1, -1):
        ours = [s for s in starts if sign * leading_of(state, s.design) > -tuning.singular]
        nlp = formulate(state.part, state.nlp.cases, lead=sign)
        own = try_starts(state.with_program(nlp), ours, try_all(policy))
        reached = min(own.feasible, key=lambda end: end.objective, default=None)
        if reached is None or not reached.objective < least:
            continue
        rows = [k for k, name in enumerate(nlp.rows) if name == "a0"]
        singular = bool(nlp.evaluate(reached.run.x)[1][rows].min() < tuning.singular)
        if singular:
            lower = tuple(tuning.inside if k in rows else limit for k, limit in enumerate(nlp.row_lower))
            own = state.with_program(replace(nlp, row_lower=lower))
            own = try_starts(own, [Start(state.design_at(reached))], try_all(policy))
        own = policy.accept(own)
        if own.best is None or own.best.checked.violations or is_merged(own.best):
            near = best is not None and runs_away(best.checked.structure.roots, tuning.far_root)
            if best is not None and near and singular and reached.objective < least_worth(state):
                words = f"a better design may be next to a singular mass matrix (a0 = 0); {mass_advice(state.problem)}"
                state = replace(state, fallback=Fallback({n: best.parameters[n] for n in state.problem.free}, words))
            continue
        if not state.problem.sign * own.best.checked.objective < least:
            continue
        ends, least = (*state.ends, *own.ends), least_worth(own, tuning.finer)
        state = replace(own, ends=ends, accepted=len(ends), fallback=None)
        if singular:
            goal = f"towards a singular mass matrix (a0 = 0), to {state.problem.sign * reached.objective:.9g}"
            words = f"no best design: it improves {goal}; {mass_advice(state.problem)}"
            design = {n: own.best.parameters[n] for n in state.problem.free}
            state = replace(state, fallback=Fallback(design, words, without_best=True))
    return state


def leading_of(state: SearchState, design: Mapping[str, float]) -> float:
    """a0 relative to the other coefficients."""
    a = [float(c) for c in state.problem.values(state.problem.ordered(design)).coefficients]
    return a[0] / (max(map(abs, a)) or 1.0)


def is_merged(trial: CheckedEnd) -> bool:
    """Whether roots that are far apart count as one: next to a0 = 0 rounding leaves little of the coefficients."""
    ideal, stored = trial.checked.structure.abscissa, trial.checked.realised
    return abs(ideal - stored) > trial.tuning.merged * abs(ideal)


RESCUES = (
    Rescue(
        "other chains",
        "",
        lambda s: (
            any(end.crossing for end in s.ends)
            and (s.best is None or bool(s.best.checked.violations))
            and degrees_of_freedom(s.problem).count > 0
        ),
        search_other_chains,
    ),
    Rescue("real roots", "hard 3", is_mixed, search_real_roots),
    Rescue("positive roots", "hard 7, systems 1, variety 4", may_have_positive_roots, search_positive_roots),
    Rescue("appeals", "sixfold 14", lambda s: bool(rivals_of(s)), appeal),
    Rescue("aside", "narrow 14, hard 4, variety 1", claims_more, move_aside),
    Rescue("infinity", "hard 9", is_open, search_singular),
    Rescue("kept design", "", lambda s: bool(rivals_of(s)) and s.fallback is None, keep_rival),
)
"""In the order in which they are asked."""
