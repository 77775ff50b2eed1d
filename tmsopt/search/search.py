"""Search one part of the box: from the initial state to a design with a status, also checked in its worst cases."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from tmsopt.evaluation import find_worst_cases
from tmsopt.evaluation.recheck import FEASIBILITY_TOLERANCE
from tmsopt.evaluation.worst_case import WorstCase
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
"""The default policy."""


def search_part(state: SearchState, policy: Policy = POLICY) -> tuple[SearchState, Outcome | None]:
    """Run a search. Return its final state and its best design, with None for the design if none is feasible."""
    goal = state.problem.objective.names if state.problem.objective else ()
    if RADIUS in goal and state.problem.pattern is None:
        state = search(state, replace(RADIUS_POLICY, tuning=policy.tuning))
    if state.best is None and not state.interrupted:
        state = search(state, policy)
    return state, _assess_search(state, policy)


def search_nested(state: SearchState) -> Outcome | None:
    """Return the best design of a search that runs inside another search; None if none is feasible.

    Raises:
        KeyboardInterrupt: if the user stops it, so that the outer search stops too.
    """
    state, outcome = search_part(state)
    if state.interrupted:
        raise KeyboardInterrupt
    return outcome


def _assess_search(state: SearchState, policy: Policy) -> Outcome | None:
    """Return the best design of a finished search, with its status."""
    problem, best, fallback = state.problem, state.best, state.fallback
    starts = count_starts(state.ends, best.end.objective if best else math.nan, state.tuning.same_objective)
    if fallback:
        outcome = replace(
            assess_design(problem, fallback.design, fallback.words),
            status="not_converged",
            starts=starts,
            formulation=state.nlp.formulation,
            has_no_best_design=fallback.without_best,
        )
        return demote_if_unbounded(state, outcome)
    result = add_worst_cases(state, policy, starts) if problem.cases else assess_best(state, starts)
    return demote_if_unbounded(state, demote_if_beaten(state, result)) if result else None


def add_worst_cases(state: SearchState, policy: Policy, starts: Starts) -> Outcome | None:
    """Add the worst cases between the listed ones and solve again, until none is worse; return the best design."""
    problem, tuning = state.problem, state.tuning
    exhaustive_policy = disable_stopping(policy)
    if state.best and problem.asks_radius and not any(case.edge for case in state.nlp.cases):
        designs = (state.best.parameters, *_list_leaders(state))
        climb_state = search(
            replace(state.with_program(state.nlp), extra=designs), replace(RADIUS_POLICY, tuning=tuning)
        )
        state = climb_state if climb_state.best else state
    best, worst_cases = state.best, dict[str, WorstCase]()
    for _ in range(tuning.radius_rounds if problem.asks_radius else tuning.case_rounds):
        trial = state.best
        if trial is None or best is None:
            return None
        if sum(trial.checked.violations.values()) > math.sqrt(FEASIBILITY_TOLERANCE) and not problem.asks_radius:
            break  # the design violates limits in the present cases
        worst_cases = find_worst_cases(problem, trial.parameters)
        new_cases = _find_worse_cases(problem, trial, worst_cases)
        if not new_cases:
            break
        best, worst_cases = trial if is_better(problem, trial, best) else best, {}
        best_designs = [best.parameters] if best is trial else [best.parameters, trial.parameters]
        leaders = _drop_duplicates(problem, [*best_designs, *_list_leaders(state)], tuning.equal_design_distance)
        state = state.with_program(formulate(state.part, (*trial.end.nlp.cases, *new_cases)))
        state = policy.accept(try_starts(state, (Start(d) for d in leaders), exhaustive_policy))
        if _is_worse_than_leaders(state, leaders):
            state = policy.accept(try_starts(state, (Start(d, near=False) for d in leaders), exhaustive_policy))
            if not problem.asks_radius and _is_worse_than_leaders(state, leaders):
                state = policy.accept(try_starts(state, policy.starts(state), policy))
        if state.interrupted:
            break
    if state.best is None:
        return None
    cases = state.best.end.nlp.cases
    listed_cases = merge_cases(problem, worst_cases or find_worst_cases(problem, state.best.parameters))
    return assess_best(state, starts, (*cases, *(c for c in listed_cases if c not in cases)))


def _is_worse_than_leaders(state: SearchState, leaders: Sequence[Mapping[str, float]]) -> bool:
    """Whether the best design is worse, in the cases of the program, than one of these starts."""
    if state.best is None:
        return True
    if state.problem.objective is None:
        return False
    sign, evaluations = state.problem.sign, [state.recheck(design) for design in leaders]
    best_known = min((sign * c.objective for c in evaluations if not c.violations), default=math.inf)
    value = sign * state.best.checked.objective
    return value > best_known and not same_objective(value, best_known, state.nlp.size, state.tuning.same_objective)


def _find_worse_cases(problem: Posed, trial: CheckedEnd, worst_cases: Mapping[str, WorstCase]) -> list[Case]:
    """Find cases in which a design is worse than in all cases of its program."""
    cases, checked = list[Case](), trial.checked
    values = {**checked.quantities, "abscissa": checked.structure.abscissa}
    for name, worst in worst_cases.items():
        if name in WORSE_DIRECTION:
            excess = WORSE_DIRECTION[name] * (worst.value - values[name])
        elif name == "objective":
            excess = abs(worst.value - checked.objective)
        else:
            amount = problem.conditions[name.removeprefix("constraint ")].excess(worst.value)
            excess = float(amount) if amount > 0 else 0.0  # nan counts as none
        if not excess <= FEASIBILITY_TOLERANCE * (1 + abs(worst.value)) and worst.case not in cases:
            cases.append(worst.case)
    return cases


def _drop_duplicates(problem: Posed, designs: Sequence[Mapping[str, float]], share: float) -> list[Mapping[str, float]]:
    """Return the designs, without those that nearly equal an earlier design."""
    selection: list[Mapping[str, float]] = []
    for design in designs:
        if not any(is_close(problem, design, other, share) for other in selection):
            selection.append(design)
    return selection


def _list_leaders(state: SearchState) -> list[dict[str, float]]:
    """Return the designs of the best few distinct optima."""
    return [state.design_at(end) for end in select_distinct_ends(state.ends)[: state.tuning.followed_optima]]
