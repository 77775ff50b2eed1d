"""Search one part of the box: from its initial state to a design with a status, in the worst cases too."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from tmsopt.evaluation import find_worst_cases
from tmsopt.evaluation.recheck import FEASIBLE
from tmsopt.evaluation.worst_case import Worst
from tmsopt.problem import Case, Posed, Starts
from tmsopt.problem.dependence import WORSE_DIRECTION
from tmsopt.problem.quantities import RADIUS
from tmsopt.program.formulate import formulate
from tmsopt.search.acceptance import accept_best, is_better
from tmsopt.search.local_search import solve_from
from tmsopt.search.outcome import (
    Outcome,
    assess_best,
    assess_design,
    demote_if_beaten,
    demote_if_unbounded,
    merge_cases,
)
from tmsopt.search.policy import Policy, disable_stopping, search, try_starts
from tmsopt.search.radius import RADIUS_POLICY
from tmsopt.search.rescues import RESCUES
from tmsopt.search.starts import propose_starts, sample_part
from tmsopt.search.state import CheckedEnd, SearchState, Start, is_close, same_objective
from tmsopt.search.stopping import count_starts, is_enough, select_distinct_ends

POLICY = Policy(sample_part, propose_starts, solve_from, accept_best, is_enough, RESCUES)
"""The default search."""


def search_part(state: SearchState, policy: Policy = POLICY) -> tuple[SearchState, Outcome | None]:
    """Run a search; return its final state and its best design, or None if nothing feasible was found."""
    goal = state.problem.objective.names if state.problem.objective else ()
    if RADIUS in goal and state.problem.pattern is None:
        state = search(state, replace(RADIUS_POLICY, tuning=policy.tuning))
    if state.best is None and not state.interrupted:
        state = search(state, policy)
    return state, _assess_search(state, policy)


def search_nested(state: SearchState) -> Outcome | None:
    """The best design of a search inside another one.

    Raises:
        KeyboardInterrupt: if the user stops it, so that the outer search stops too.
    """
    state, outcome = search_part(state)
    if state.interrupted:
        raise KeyboardInterrupt
    return outcome


def _assess_search(state: SearchState, policy: Policy) -> Outcome | None:
    """The best design of a finished search, with its status."""
    problem, best, fallback = state.problem, state.best, state.fallback
    starts = count_starts(state.ends, best.end.objective if best else math.nan, state.tuning.same)
    if fallback:
        outcome = replace(
            assess_design(problem, fallback.design, fallback.words),
            status="not_converged",
            starts=starts,
            formulation=state.nlp.formulation,
            without_best=fallback.without_best,
        )
        return demote_if_unbounded(state, outcome)
    found = cover_cases(state, policy, starts) if problem.cases else assess_best(state, starts)
    return demote_if_unbounded(state, demote_if_beaten(state, found)) if found else None


def cover_cases(state: SearchState, policy: Policy, starts: Starts) -> Outcome | None:
    """The best design once cases have been added until none between them is worse."""
    problem, tuning = state.problem, state.tuning
    exhaustive = disable_stopping(policy)
    if state.best and problem.asks_radius and not any(case.edge for case in state.nlp.cases):
        designs = (state.best.parameters, *_list_leaders(state))
        climbed = search(replace(state.with_program(state.nlp), extra=designs), replace(RADIUS_POLICY, tuning=tuning))
        state = climbed if climbed.best else state
    best, worst = state.best, dict[str, Worst]()
    for _ in range(tuning.far_rounds if problem.asks_radius else tuning.rounds):
        trial = state.best
        if trial is None or best is None:
            return None
        if sum(trial.checked.violations.values()) > math.sqrt(FEASIBLE) and not problem.asks_radius:
            break  # the current cases are not met
        worst = find_worst_cases(problem, trial.parameters)
        more = _find_uncovered_cases(problem, trial, worst)
        if not more:
            break
        best, worst = trial if is_better(problem, trial, best) else best, {}
        current = [best.parameters] if best is trial else [best.parameters, trial.parameters]
        leaders = _select_apart(problem, [*current, *_list_leaders(state)], tuning.alike_designs)
        state = state.with_program(formulate(state.part, (*trial.end.nlp.cases, *more)))
        state = policy.accept(try_starts(state, (Start(d) for d in leaders), exhaustive))
        if _is_worse_than_leaders(state, leaders):
            state = policy.accept(try_starts(state, (Start(d, near=False) for d in leaders), exhaustive))
            if not problem.asks_radius and _is_worse_than_leaders(state, leaders):
                state = policy.accept(try_starts(state, policy.starts(state), policy))
        if state.interrupted:
            break
    if state.best is None:
        return None
    cases = state.best.end.nlp.cases
    listed = merge_cases(problem, worst or find_worst_cases(problem, state.best.parameters))
    return assess_best(state, starts, (*cases, *(c for c in listed if c not in cases)))


def _is_worse_than_leaders(state: SearchState, leaders: Sequence[Mapping[str, float]]) -> bool:
    """Whether the best design is worse, in the cases of its program, than a design that it started from."""
    if state.best is None:
        return True
    if state.problem.objective is None:
        return False
    sign, own = state.problem.sign, [state.recheck(design) for design in leaders]
    known = min((sign * c.objective for c in own if not c.violations), default=math.inf)
    reached = sign * state.best.checked.objective
    return reached > known and not same_objective(reached, known, state.nlp.size, state.tuning.same)


def _find_uncovered_cases(problem: Posed, trial: CheckedEnd, found: Mapping[str, Worst]) -> list[Case]:
    """Cases in which the design is worse than in all cases that it was made for."""
    more, known = list[Case](), trial.checked
    own = {**known.quantities, "abscissa": known.structure.abscissa}
    for name, worst in found.items():
        if name in WORSE_DIRECTION:
            excess = WORSE_DIRECTION[name] * (worst.value - own[name])
        elif name == "objective":
            excess = abs(worst.value - known.objective)
        else:
            beyond = problem.conditions[name.removeprefix("constraint ")].excess(worst.value)
            excess = float(beyond) if beyond > 0 else 0.0  # nan counts as none
        if not excess <= FEASIBLE * (1 + abs(worst.value)) and worst.case not in more:
            more.append(worst.case)
    return more


def _select_apart(problem: Posed, designs: Sequence[Mapping[str, float]], share: float) -> list[Mapping[str, float]]:
    """The designs without those that nearly equal an earlier one."""
    kept: list[Mapping[str, float]] = []
    for design in designs:
        if not any(is_close(problem, design, other, share) for other in kept):
            kept.append(design)
    return kept


def _list_leaders(state: SearchState) -> list[dict[str, float]]:
    """The designs of the best few distinct optima."""
    return [state.design_at(end) for end in select_distinct_ends(state.ends)[: state.tuning.followed]]
