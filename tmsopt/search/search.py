"""One part of the box, from a state at its beginning to a design with its status."""

from dataclasses import replace

from tmsopt.problem.quantities import RADIUS
from tmsopt.search.accept import accept_best
from tmsopt.search.enough import count_starts, is_enough
from tmsopt.search.local import run_from
from tmsopt.search.outcome import Outcome, as_it_is, demote, demote_if_beaten, found
from tmsopt.search.policy import Policy, search
from tmsopt.search.radius import RADIUS_POLICY
from tmsopt.search.rescues import RESCUES
from tmsopt.search.starts import propose_starts, sample_part
from tmsopt.search.state import SearchState
from tmsopt.search.worst import cover_cases

POLICY = Policy(sample_part, propose_starts, run_from, accept_best, is_enough, RESCUES)
"""The search as benchmarks shaped it."""


def search_part(state: SearchState, policy: Policy = POLICY) -> tuple[SearchState, Outcome | None]:
    """A search at its end, and its best design; None where nothing feasible was found."""
    goal = state.problem.objective.names if state.problem.objective else ()
    if RADIUS in goal and state.problem.pattern is None:
        state = search(state, replace(RADIUS_POLICY, tuning=policy.tuning))
    if state.best is None and not state.interrupted:
        state = search(state, policy)
    return state, outcome_of(state, policy)


def outcome_of(state: SearchState, policy: Policy) -> Outcome | None:
    """The best design of a search."""
    problem, best, fallback = state.problem, state.best, state.fallback
    starts = count_starts(state.ends, best.end.objective if best else float("nan"), state.tuning.same)
    if fallback:
        given = replace(as_it_is(problem, fallback.design, fallback.words), status="not_converged", starts=starts)
        return demote(state, replace(given, formulation=state.nlp.formulation, without_best=fallback.without_best))
    outcome = cover_cases(state, policy) if problem.cases else found(state, starts)
    return demote(state, demote_if_beaten(state, outcome)) if outcome else None


def search_whole(state: SearchState) -> Outcome | None:
    """The best design of a search that is part of another.

    Raises:
        KeyboardInterrupt: when the user ends it, which ends the other too.
    """
    state, outcome = search_part(state)
    if state.interrupted:
        raise KeyboardInterrupt
    return outcome
