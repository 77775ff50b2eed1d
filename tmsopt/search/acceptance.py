"""Choose the best end of a search, polish it by Newton's method and recheck it.

An *end* is the point where the solver stopped after one start. A *trial* is a `CheckedEnd`: a polished, rechecked end.
"""

import math
from dataclasses import replace

from tmsopt.evaluation.recheck import recheck
from tmsopt.problem import Posed
from tmsopt.program.formulate import design_of
from tmsopt.program.ipopt import make_polisher
from tmsopt.search.state import CheckedEnd, LocalEnd, SearchState, clip_to_box, same_objective

_CONVERGED_STATUSES = ("Solve_Succeeded", "Solved_To_Acceptable_Level", "Feasible_Point_Found")


def accept_best(state: SearchState) -> SearchState:
    """Add the best end to the state: the first that passes the recheck after polishing, or else the least violating."""
    best, tried_objectives = state.best, list[float]()
    for end in sorted((e for e in state.ends[state.accepted :] if e.feasible), key=lambda end: end.objective):
        equal_count = sum(
            same_objective(end.objective, x, end.nlp.size, state.tuning.same_objective) for x in tried_objectives
        )
        if best and is_sound(state.problem, best) and not equal_count and best.end.objective <= end.objective:
            break
        if equal_count >= state.tuning.equal_ends:
            continue
        tried_objectives.append(end.objective)
        trial = check_end(state, end)
        if best is None or is_better(state.problem, trial, best):
            best = trial
        if not trial.checked.violations and is_stationary(trial) and has_matching_claim(state.problem, trial):
            break
    return replace(state, best=best, accepted=len(state.ends))


def check_end(state: SearchState, end: LocalEnd) -> CheckedEnd:
    """Polish an end under the limits that are active there, and recheck it in its cases."""
    point = make_polisher(end.nlp)(end.run, end.nlp)
    parameters = state.problem.ordered(design_of(state.problem, point.x.tolist()))
    return CheckedEnd(end, point, parameters, recheck(state.problem, parameters, end.nlp.cases), state.tuning)


def recheck_inside_box(state: SearchState, trial: CheckedEnd) -> CheckedEnd:
    """Clip a trial to the box and recheck it, so that no stage or rescue can make it look better than it is."""
    parameters = state.problem.ordered(clip_to_box(state.part, trial.parameters))
    return replace(trial, parameters=parameters, checked=recheck(state.problem, parameters, trial.end.nlp.cases))


def is_sound(problem: Posed, trial: CheckedEnd) -> bool:
    """Whether a trial violates no limit and has the objective that the solver claims."""
    return not trial.checked.violations and has_matching_claim(problem, trial) and not _has_unreached_root(trial)


def is_stationary(trial: CheckedEnd) -> bool:
    """Whether the gradient of the Lagrangian vanishes, even if IPOPT reports a failure."""
    return trial.point.stationarity <= trial.tuning.stationary_gradient


def has_converged(trial: CheckedEnd) -> bool:
    """Whether the solver's status or the gradient shows an optimum, and the rows of the program hold there."""
    tuning, is_optimal = trial.tuning, trial.end.run.status in _CONVERGED_STATUSES or is_stationary(trial)
    return is_optimal and (
        trial.point.violation <= tuning.polished_violation or trial.point.stationarity <= tuning.polished_gradient
    )


def has_matching_claim(problem: Posed, trial: CheckedEnd) -> bool:
    """Whether the objective that the solver claims equals that of the recheck."""
    if problem.objective is None:
        return True
    claim, objective, tolerance = (
        problem.sign * trial.point.objective,
        trial.checked.objective,
        trial.tuning.claim_tolerance,
    )
    return math.isclose(claim, objective, rel_tol=tolerance, abs_tol=tolerance)


def is_better(problem: Posed, candidate: CheckedEnd, other: CheckedEnd) -> bool:
    """Whether one trial is better than another: by the violation first, then by the objective of the recheck.

    If the solver claims another objective, the difference counts against the trial. Among equally good trials, a trial
    that has converged is better than one that has not.
    """

    def rank(trial: CheckedEnd) -> tuple[float, bool, float]:
        claim, value = trial.point.objective, problem.sign * trial.checked.objective
        penalty = 0.0 if has_matching_claim(problem, trial) else trial.tuning.claim_weight * abs(claim - value)
        objective = claim if math.isnan(value) else value + penalty
        return sum(trial.checked.violations.values()), _has_unreached_root(trial), objective

    (*keys, objective), (*other_keys, other_objective) = rank(candidate), rank(other)
    if keys == other_keys and same_objective(
        objective, other_objective, candidate.end.nlp.size, candidate.tuning.polished_difference
    ):
        return has_converged(candidate) and not has_converged(other)
    return (*keys, objective) < (*other_keys, other_objective)


def _has_unreached_root(trial: CheckedEnd) -> bool:
    """Whether a trial that has not converged has the objective of a multiple root that it only comes close to."""
    ideal, stored, tolerance = (
        trial.checked.structure.abscissa,
        trial.checked.abscissa_realised,
        trial.tuning.claim_tolerance,
    )
    return not has_converged(trial) and not math.isclose(ideal, stored, rel_tol=tolerance, abs_tol=tolerance)
