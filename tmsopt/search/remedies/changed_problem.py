"""Solve a problem with changed limits again, within the time that advice may take."""

import time
from collections.abc import Mapping
from dataclasses import replace

from tmsopt.evaluation.bound import minimizes_abscissa
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem import Posed, Starts
from tmsopt.problem.dependence import stability_limit
from tmsopt.program import Options
from tmsopt.progress import Progress, Steps
from tmsopt.search.outcome import Outcome, assess_best, choose_outcome, has_runaway_root
from tmsopt.search.policy import run_nested
from tmsopt.search.search import POLICY, search_nested
from tmsopt.search.state import SearchState, begin_search
from tmsopt.search.stopping import count_starts

_FEW_STARTS = 6  # starts of the short search that comes first
_MIN_DECAY = 1e-6  # relative to the mean size of the roots: a design that decays this fast counts as stable
_MIN_SECONDS = 2.5  # least time limit, in process time: enough to solve a problem with seven free parameters again
_TIME_SHARE = 0.3  # time limit, relative to the time spent before


class OutOfTime(Exception):
    """Raised when the time limit is reached."""


def limit_time(options: Options, seconds_spent: float = 0.0) -> Options:
    """Return options with which a search raises `OutOfTime` when it reaches its time limit."""
    end_time = time.process_time() + max(_MIN_SECONDS, _TIME_SHARE * seconds_spent)

    def check_time(_: Progress) -> None:
        if time.process_time() > end_time:
            raise OutOfTime

    steps = Steps(check_time)
    steps.begin("solving again", "start")
    return replace(options, progress=steps, near=None)


def solve_again(
    problem: Posed, options: Options, original_problem: Posed, is_thorough: bool = False
) -> Mapping[str, float] | None:
    """Return the optimum of a changed problem; None if there is none, {} if it is unstable but must be stable.

    A short search decides if it ends at a stable design. Unless `is_thorough`, it also decides if all its starts end at
    the same least abscissa, stable or not. Otherwise the whole search runs.

    Args:
        original_problem: the problem before the change; it decides whether the optimum must be stable.
    """
    limits = {**problem.constraints, **stability_limit(original_problem, _MIN_DECAY)}
    stable_problem = problem.derive(constraints=limits, minimize=None, maximize=None)
    states = begin_search(problem, options)
    quick_outcomes = [
        None if problem.cases else _search_briefly(state, stable_problem, is_thorough) for state in states
    ]
    outcomes = [outcome or search_nested(state) for state, outcome in zip(states, quick_outcomes, strict=True)]
    best = choose_outcome(problem, outcomes, states[0].tuning)
    if best is None or best.status != "optimal":
        return None
    return best.parameters if _is_met(stable_problem, best) else {}


def _search_briefly(state: SearchState, stable_problem: Posed, is_thorough: bool) -> Outcome | None:
    """Return the outcome of a few starts if it decides: a stable design, or the same least abscissa from all starts."""
    state = replace(state, sample=POLICY.sample(state))
    state = run_nested(state, POLICY.starts(state), POLICY, _FEW_STARTS)
    outcome = assess_best(state, Starts())
    if (
        outcome is None
        or outcome.status != "optimal"
        or has_runaway_root(outcome.checked.structure.roots, state.tuning.infinite_root_size)
    ):
        return None
    has_one_optimum = all(end.feasible for end in state.ends) and count_starts(state.ends, 0.0).optima == 1
    is_settled = has_one_optimum and not is_thorough and minimizes_abscissa(state.part)
    return outcome if is_settled or _is_met(stable_problem, outcome) else None


def _is_met(problem: Posed, outcome: Outcome) -> bool:
    """Whether a design meets the limits of a problem."""
    return not recheck(problem, outcome.parameters, outcome.cases).violations
