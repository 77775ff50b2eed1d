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

_FEW_STARTS = 6  # tried first for a problem with changed limits
_LEAST_DECAY = 1e-6  # of the roots' mean size: a design that decays this fast counts as stable
_SECONDS = 2.5  # least allowance, of process time: enough to solve a problem with seven free parameters again
_SHARE = 0.3  # allowance as a share of the time spent before


class OutOfTime(Exception):
    """Raised when the allowance is used up."""


def limit_time(options: Options, spent: float = 0.0) -> Options:
    """A copy of the options with which work raises `OutOfTime` once its allowance is used up."""
    end = time.process_time() + max(_SECONDS, _SHARE * spent)

    def check_time(_: Progress) -> None:
        if time.process_time() > end:
            raise OutOfTime

    steps = Steps(check_time)
    steps.begin("solving again", "start")
    return replace(options, progress=steps, near=None)


def solve_again(
    problem: Posed, options: Options, original: Posed, thorough: bool = False
) -> Mapping[str, float] | None:
    """Return the optimum of a changed problem; {} if it is unstable but `original` needs stability; None without one.

    A few starts suffice if they end at a stable design. They also suffice if all end at one least abscissa that is not
    stable, unless `thorough`. Otherwise the whole search runs.
    """
    limits = {**problem.constraints, **stability_limit(original, _LEAST_DECAY)}
    stable = problem.derive(constraints=limits, minimize=None, maximize=None)
    states = begin_search(problem, options)
    quick_outcomes = [None if problem.cases else _search_few_starts(state, stable, thorough) for state in states]
    outcomes = [outcome or search_nested(state) for state, outcome in zip(states, quick_outcomes, strict=True)]
    best = choose_outcome(problem, outcomes, states[0].tuning)
    if best is None or best.status != "optimal":
        return None
    return best.parameters if _is_met(stable, best) else {}


def _search_few_starts(state: SearchState, stable: Posed, thorough: bool) -> Outcome | None:
    """Return the outcome of a few starts if it decides: a stable design, or the same least abscissa from all starts."""
    state = replace(state, sample=POLICY.sample(state))
    state = run_nested(state, POLICY.starts(state), POLICY, _FEW_STARTS)
    outcome = assess_best(state, Starts())
    if (
        outcome is None
        or outcome.status != "optimal"
        or has_runaway_root(outcome.checked.structure.roots, state.tuning.runaway)
    ):
        return None
    is_agreed = all(end.feasible for end in state.ends) and count_starts(state.ends, 0.0).optima == 1
    is_settled = is_agreed and not thorough and minimizes_abscissa(state.part)
    return outcome if is_settled or _is_met(stable, outcome) else None


def _is_met(problem: Posed, outcome: Outcome) -> bool:
    return not recheck(problem, outcome.parameters, outcome.cases).violations
