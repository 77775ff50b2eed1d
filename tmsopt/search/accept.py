"""From where starts ended to one design: the best end, polished by Newton's method and rechecked."""

import math
from dataclasses import replace

from tmsopt.evaluation.recheck import recheck
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import design_of
from tmsopt.program.ipopt import make_polisher
from tmsopt.search.state import CheckedEnd, LocalEnd, SearchState, same_objective

_CONVERGED = ("Solve_Succeeded", "Solved_To_Acceptable_Level", "Feasible_Point_Found")


def accept_best(state: SearchState) -> SearchState:
    """The state with the best of its ends: the first to pass the recheck once polished, or that fails it least."""
    best, tried = state.best, list[float]()
    for end in sorted((e for e in state.ends[state.accepted :] if e.feasible), key=lambda end: end.objective):
        alike = sum(same_objective(end.objective, value, end.nlp.size, state.tuning.same) for value in tried)
        if best and is_sound(state.problem, best) and not alike and best.end.objective <= end.objective:
            break
        if alike >= state.tuning.alike:
            continue
        tried.append(end.objective)
        trial = check_end(state, end)
        if best is None or is_better(state.problem, trial, best):
            best = trial
        if not trial.checked.violations and is_stationary(trial) and claim_matches(state.problem, trial):
            break
    return replace(state, best=best, accepted=len(state.ends))


def check_end(state: SearchState, end: LocalEnd) -> CheckedEnd:
    """An end polished under the limits that held there, and rechecked in its cases."""
    point = make_polisher(end.nlp)(end.run, end.nlp)
    parameters = state.problem.ordered(design_of(state.problem, point.x.tolist()))
    return CheckedEnd(end, point, parameters, recheck(state.problem, parameters, end.nlp.cases), state.tuning)


def check_again(state: SearchState, trial: CheckedEnd) -> CheckedEnd:
    """An end inside the box and rechecked, whatever a stage or a rescue says of it."""
    inside = {n: min(max(trial.parameters[n], low), high) for n, (low, high) in state.part.free.items()}
    parameters = state.problem.ordered(inside)
    return replace(trial, parameters=parameters, checked=recheck(state.problem, parameters, trial.end.nlp.cases))


def is_sound(problem: Posed, trial: CheckedEnd) -> bool:
    """Whether a trial violates nothing and is what the solver claims."""
    return not trial.checked.violations and claim_matches(problem, trial) and not _is_flattered(trial)


def is_stationary(trial: CheckedEnd) -> bool:
    """Whether the gradient of the Lagrangian vanishes, whatever IPOPT says."""
    return trial.point.stationarity <= trial.tuning.stationary


def has_converged(trial: CheckedEnd) -> bool:
    """Whether the solver stopped at an optimum of its own, by its word or by the gradient, and on the rows."""
    tuning, ended = trial.tuning, trial.end.run.status in _CONVERGED or is_stationary(trial)
    return ended and (trial.point.violation <= tuning.exact or trial.point.stationarity <= tuning.polished)


def claim_matches(problem: Posed, trial: CheckedEnd) -> bool:
    """Whether the objective that the solver claims is the design's own."""
    if problem.objective is None:
        return True
    claimed, own, most = problem.sign * trial.point.objective, trial.checked.objective, trial.tuning.claimed
    return math.isclose(claimed, own, rel_tol=most, abs_tol=most)


def is_better(problem: Posed, one: CheckedEnd, other: CheckedEnd) -> bool:
    """Whether one trial beats another: by violation first, then by the objective that the recheck found.

    Where that is not the solver's, what lies between them is weighed against it. Of two that are as good, one that has
    converged beats one that has not.
    """

    def rank(trial: CheckedEnd) -> tuple[float, bool, float]:
        claimed, own = trial.point.objective, problem.sign * trial.checked.objective
        doubt = 0.0 if claim_matches(problem, trial) else trial.tuning.doubt * abs(claimed - own)
        worth = claimed if math.isnan(own) else own + doubt
        return sum(trial.checked.violations.values()), _is_flattered(trial), worth

    (*first, worth), (*second, known), most = rank(one), rank(other), one.tuning.finer
    if first == second and same_objective(worth, known, one.end.nlp.size, most):
        return has_converged(one) and not has_converged(other)
    return (*first, worth) < (*second, known)


def _is_flattered(trial: CheckedEnd) -> bool:
    """Whether an end that is no optimum owes its standing to a multiple root that it only comes close to."""
    ideal, stored, most = trial.checked.structure.abscissa, trial.checked.realised, trial.tuning.claimed
    return not has_converged(trial) and not math.isclose(ideal, stored, rel_tol=most, abs_tol=most)
