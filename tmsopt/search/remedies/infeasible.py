"""Problems without a feasible end: the least-violating design, why none is feasible, and which limits must change."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from tmsopt.evaluation.bound import bounded
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem.dependence import stability_wanted
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import RADIUS
from tmsopt.problem.searches import Starts
from tmsopt.problem.verdict.meetings import nearest_crossing
from tmsopt.program.formulate import formulate, middle
from tmsopt.program.options import Options
from tmsopt.progress import begin
from tmsopt.search.acceptance import accept_best
from tmsopt.search.outcome import (
    Outcome,
    assess_best,
    assess_design,
    has_runaway_root,
    is_better_outcome,
    write_mass_advice,
)
from tmsopt.search.policy import Policy, disable_stopping, try_starts
from tmsopt.search.remedies.changes import relax
from tmsopt.search.remedies.conflict import find_conflict
from tmsopt.search.search import POLICY, search_nested
from tmsopt.search.state import SearchState, Start, begin_search
from tmsopt.search.stopping import count_starts

_FEW_STARTS = 6  # of a problem with changed limits
_LEAST_DECAY = 1e-6  # of the roots' mean size: a design that decays this fast counts as stable


def explain_infeasible(problem: Posed, states: Sequence[SearchState], policy: Policy) -> Outcome:
    """The least-violating design with advice; if it violates nothing, the design that the solver reaches from it."""
    options = states[0].options
    ends = [(state, end) for state in states for end in state.ends]
    tried, formulation = count_starts([end for _, end in ends], 0.0).tried, states[0].nlp.formulation
    for state, end in ends:
        if end.crossing and problem.pattern is not None:
            note = f"none of {tried} starts ended at an exceptional point: roots meet with more than one eigenvector"
            design = nearest_crossing(problem, problem.pattern, problem.ordered(state.design_at(end)))
            crossed = assess_design(problem, {n: design[n] for n in problem.free}, note)
            return replace(crossed, status="not_converged", starts=Starts(tried), formulation=formulation)
    begin(options.progress, "searching for the smallest change of limits", "start")
    designs = [design for state in states for design in state.designs]
    relaxation = relax(
        problem,
        options,
        designs,
        partial(find_conflict, search_limits=partial(_search_limits, problem, options)),
        partial(solve_again, asked=problem),
    )
    free = relaxation.parameters if relaxation else middle(problem)
    design = {n: min(max(free[n], lo), hi) for n, (lo, hi) in problem.free.items()}
    none = f"none of {tried} starts"
    if relaxation is None or relaxation.amounts:
        status, note = "infeasible", f"{none} satisfies all constraints"
    else:
        whole = SearchState(problem, problem, formulate(problem, problem.cases), options, policy.tuning)
        whole = policy.accept(
            try_starts(whole, (Start(design, near) for near in (True, False)), disable_stopping(policy))
        )
        if outcome := assess_best(whole, Starts(tried + 2, len(whole.feasible), 1, runs=2)):
            return outcome
        advice = f"try more starts, set a start, or {write_mass_advice(problem)}"
        status, note = "not_converged", f"feasible designs exist, but {none} converged; {advice}"
    least = assess_design(problem, design, note)
    return replace(least, status=status, starts=Starts(tried), formulation=formulation, relaxation=relaxation)


def solve_again(problem: Posed, options: Options, asked: Posed, thorough: bool = False) -> Mapping[str, float] | None:
    """The optimum of a changed problem; {} if it is not stable though `asked` needs that; None without an optimum.

    A few starts suffice if they end at a stable design. They also suffice if all end at one least abscissa that is not
    stable, unless `thorough`. Otherwise the whole search runs.
    """
    stable = _require_stability(problem, asked)
    best: Outcome | None = None
    for state in begin_search(problem, options):
        outcome = None if problem.cases else _search_few_starts(state, stable, thorough)
        outcome = outcome or search_nested(state)
        best = (
            outcome if outcome and (best is None or is_better_outcome(problem, outcome, best, state.tuning)) else best
        )
    if best is None or best.status != "optimal":
        return None
    return best.parameters if _is_met(stable, best) else {}


def _require_stability(problem: Posed, asked: Posed) -> Posed:
    """The limits of a problem, and stability if the original problem needs it."""
    limits = {**problem.constraints, **stability_wanted(asked, _LEAST_DECAY)}
    return problem.derive(constraints=limits, minimize=None, maximize=None)


def _search_few_starts(state: SearchState, stable: Posed, thorough: bool) -> Outcome | None:
    """The outcome of a few starts if it settles the question: a stable design, or one least abscissa for all starts."""
    state = replace(state, sample=POLICY.sample(state))
    state = accept_best(try_starts(state, POLICY.starts(state), POLICY, _FEW_STARTS))
    outcome = assess_best(state, Starts())
    if state.interrupted:
        raise KeyboardInterrupt
    one = all(end.feasible for end in state.ends) and count_starts(state.ends, 0.0).optima == 1
    if (
        outcome is None
        or outcome.status != "optimal"
        or has_runaway_root(outcome.checked.structure.roots, state.tuning.runaway)
    ):
        return None
    agreed = not thorough and bounded(state.part) and one
    return outcome if agreed or _is_met(stable, outcome) else None


def _is_met(problem: Posed, outcome: Outcome) -> bool:
    return not recheck(problem, outcome.parameters, outcome.cases).violations


def _search_limits(problem: Posed, options: Options, names: Sequence[str]) -> tuple[Mapping[str, float] | None, bool]:
    """A design that meets the constraints of these names, by a whole search; and whether the search could tell."""
    options = replace(options, progress=None, near=None)
    kept = problem.derive(constraints={n: text for n, text in problem.constraints.items() if n in names}, pareto=())
    if kept.objective and (RADIUS in kept.objective.names or not (kept.pattern or set(names) & {*kept.asked_of_roots})):
        kept = kept.derive(minimize=None, maximize=None)
    states = begin_search(kept, options)
    about = kept.asked_of_roots or kept.pattern
    if about and any(seen.singular for s in states if (seen := POLICY.sample(s) or s.limits_sample)):
        return None, False
    for state in states:
        outcome = search_nested(state)
        if outcome is not None and not outcome.checked.violations:
            return outcome.parameters, True
    return None, True
