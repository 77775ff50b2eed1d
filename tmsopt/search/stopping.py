"""Decide when a search ends: at a proven bound, after too many failures, or if few better optima are expected."""

import math
from collections.abc import Sequence
from itertools import pairwise

from tmsopt.evaluation.bound import instant_bound, is_gap_closed, minimizes_abscissa
from tmsopt.problem import Starts, degrees_of_freedom
from tmsopt.search.state import LocalEnd, SearchState, same_objective
from tmsopt.search.tuning import TUNING


def is_enough(state: SearchState) -> bool:
    """Whether more starts are unlikely to help.

    A search ends when few better optima are expected (see `Starts.suffice`), when a design reaches a proven bound, or
    when too many starts fail. Without an objective, it ends at the first solution, or if solutions form a continuum,
    when several starts agree.
    """
    tuning, feasible, sample = state.tuning, state.feasible, state.sample
    if not feasible:
        return is_hopeless(state)
    best, count = min(end.objective for end in feasible), len(state.ends)
    starts = count_starts(state.ends, best, tuning.same_objective)
    if state.problem.objective is None:
        freedom = degrees_of_freedom(state.part).count
        is_isolated = freedom == 0 or (freedom < 0 and best <= tuning.zero_squares)
        return starts.at_best >= (1 if is_isolated else tuning.agreeing_starts)
    if state.ends[-1].objective == best and is_proven(state, state.ends[-1]):
        return True
    if sample is None:
        return (
            count >= tuning.min_starts_without_sample and starts.at_best >= tuning.agreeing_starts and starts.suffice()
        )
    separate_count = sum(bool(sample.refined.violation[row] == 0) for row in state.left if row < len(sample.refined))
    can_end = count >= tuning.min_starts_if_narrow or not sample.box.is_narrow
    # A sampled design that leads straight to no end may lie in a basin of its own.
    return (can_end and starts.suffice(separate_count)) or count - len(feasible) >= 2 * tuning.hopeless_starts


def is_hopeless(state: SearchState) -> bool:
    """Whether so many starts failed that others are unlikely to succeed."""
    tuning, sample, failure_count = state.tuning, state.sample, len(state.ends) - len(state.feasible)
    if failure_count >= tuning.hopeless_far_starts and (sample.is_far_off if sample else state.out_of_reach):
        return True
    return failure_count >= (tuning.hopeless_starts if sample else 2 * tuning.hopeless_starts)


def is_proven(state: SearchState, end: LocalEnd) -> bool:
    """Whether an end reaches a proven bound; False unless all roots have nearly the same modulus."""
    problem = state.part
    if not (end.feasible and minimizes_abscissa(problem)):
        return False
    if problem.model.polynomial is None:
        return instant_bound(problem, end.objective).proven
    a = state.coefficients_at(end)[0]
    bound = -(abs(a[-1] / a[0]) ** (1 / problem.model.degree)) if a[0] else -math.inf
    is_near = is_gap_closed(end.objective - bound, bound, end.nlp.size)
    return is_near and instant_bound(problem, end.objective).proven


def count_starts(ends: Sequence[LocalEnd], best: float, tolerance: float = TUNING.same_objective) -> Starts:
    """Count starts by their ends; a sampled design that leads straight to an end counts as a start."""
    feasible = [end for end in ends if end.feasible]
    objectives = sorted(end.objective for end in feasible)
    size = ends[0].nlp.size if ends else 1.0
    return Starts(
        tried=sum(end.weight for end in ends),
        converged=sum(end.weight for end in feasible),
        at_best=sum(end.weight for end in feasible if same_objective(end.objective, best, end.nlp.size, tolerance)),
        optima=bool(objectives) + sum(not same_objective(a, b, size, tolerance) for a, b in pairwise(objectives)),
        runs=len(ends),
    )


def select_distinct_ends(ends: Sequence[LocalEnd], tolerance: float = TUNING.same_objective) -> list[LocalEnd]:
    """Return the best end of each optimum, the best first."""
    selection: list[LocalEnd] = []
    for end in sorted((e for e in ends if e.feasible), key=lambda e: e.objective):
        if not any(same_objective(end.objective, other.objective, end.nlp.size, tolerance) for other in selection):
            selection.append(end)
    return selection
