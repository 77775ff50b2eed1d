"""Search one part of the box: from its initial state to a design with a status."""

from dataclasses import replace

from tmsopt.problem.quantities import RADIUS
from tmsopt.search.acceptance import accept_best
from tmsopt.search.local_search import solve_from
from tmsopt.search.outcome import Outcome, assess_best, assess_design, demote_if_beaten, demote_if_unbounded
from tmsopt.search.policy import Policy, search
from tmsopt.search.radius import RADIUS_POLICY
from tmsopt.search.rescues import RESCUES
from tmsopt.search.starts import propose_starts, sample_part
from tmsopt.search.state import SearchState
from tmsopt.search.stopping import count_starts, is_enough
from tmsopt.search.worst_cases import cover_cases

POLICY = Policy(sample_part, propose_starts, solve_from, accept_best, is_enough, RESCUES)
"""The default search."""


def search_part(state: SearchState, policy: Policy = POLICY) -> tuple[SearchState, Outcome | None]:
    """Run a search; return its final state and its best design, or None if nothing feasible was found."""
    goal = state.problem.objective.names if state.problem.objective else ()
    if RADIUS in goal and state.problem.pattern is None:
        state = search(state, replace(RADIUS_POLICY, tuning=policy.tuning))
    if state.best is None and not state.interrupted:
        state = search(state, policy)
    return state, assess_search(state, policy)


def assess_search(state: SearchState, policy: Policy) -> Outcome | None:
    """The best design of a finished search, with its status."""
    problem, best, fallback = state.problem, state.best, state.fallback
    starts = count_starts(state.ends, best.end.objective if best else float("nan"), state.tuning.same)
    if fallback:
        outcome = replace(
            assess_design(problem, fallback.design, fallback.words),
            status="not_converged",
            starts=starts,
            formulation=state.nlp.formulation,
            without_best=fallback.without_best,
        )
        return demote_if_unbounded(state, outcome)
    found = cover_cases(state, policy) if problem.cases else assess_best(state, starts)
    return demote_if_unbounded(state, demote_if_beaten(state, found)) if found else None


def search_nested(state: SearchState) -> Outcome | None:
    """The best design of a search inside another one.

    Raises:
        KeyboardInterrupt: if the user stops it, so that the outer search stops too.
    """
    state, outcome = search_part(state)
    if state.interrupted:
        raise KeyboardInterrupt
    return outcome
