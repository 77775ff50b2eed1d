"""No start ended feasible: the least-violating design, why there is none, and what would have to give."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from tmsopt.evaluation.bound import bounded
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import RADIUS
from tmsopt.problem.searches import Starts
from tmsopt.problem.verdict.meetings import nearest_crossing
from tmsopt.program.formulate import default_start, formulate
from tmsopt.program.options import Options
from tmsopt.progress import begin
from tmsopt.search.accept import accept_best
from tmsopt.search.enough import count_starts
from tmsopt.search.outcome import Outcome, as_it_is, beats, found, mass_advice, runs_away
from tmsopt.search.policy import Policy, try_all, try_starts
from tmsopt.search.remedies.changes import relax
from tmsopt.search.remedies.needs import irreducible, steady
from tmsopt.search.search import POLICY, search_whole
from tmsopt.search.state import SearchState, Start, begin_search

_SETTLED = 6  # starts of a problem with limits moved


def explain_none(problem: Posed, states: Sequence[SearchState], policy: Policy) -> Outcome:
    """The least-violating design, and what can be reached from it if it violates nothing."""
    options = states[0].options
    ends = [(state, end) for state in states for end in state.ends]
    tried, formulation = count_starts([end for _, end in ends], 0.0).tried, states[0].nlp.formulation
    for state, end in ends:
        if end.crossing and problem.pattern is not None:
            note = f"of {tried} starts, none ended at an exceptional point: roots meet with more than one eigenvector"
            design = nearest_crossing(problem, problem.pattern, problem.ordered(state.design_at(end)))
            crossed = as_it_is(problem, {n: design[n] for n in problem.free}, note)
            return replace(crossed, status="not_converged", starts=Starts(tried), formulation=formulation)
    begin(options.progress, "searching for the least that limits must give", "start")
    designs = [design for state in states for design in state.designs]
    relaxation = relax(
        problem,
        options,
        designs,
        partial(irreducible, reached=partial(_reached, problem, options)),
        partial(answered, asked=problem),
    )
    free = relaxation.parameters if relaxation else default_start(problem)
    design = {n: min(max(free[n], lo), hi) for n, (lo, hi) in problem.free.items()}
    none = f"of {tried} starts, none"
    if relaxation is None or relaxation.amounts:
        status, note = "infeasible", f"{none} satisfies all constraints"
    else:
        whole = SearchState(problem, problem, formulate(problem, problem.cases), options, policy.tuning)
        whole = policy.accept(try_starts(whole, (Start(design, near) for near in (True, False)), try_all(policy)))
        if outcome := found(whole, Starts(tried + 2, len(whole.feasible), 1, runs=2)):
            return outcome
        advice = f"try more starts, give one, or {mass_advice(problem)}"
        status, note = "not_converged", f"feasible designs exist, but {none} converged; {advice}"
    least = as_it_is(problem, design, note)
    return replace(least, status=status, starts=Starts(tried), formulation=formulation, relaxation=relaxation)


def answered(problem: Posed, options: Options, asked: Posed, thorough: bool = False) -> Mapping[str, float] | None:
    """The optimum of a problem that is solved again; {} where it is not stable, though `asked` wants that; or None.

    A few starts are enough where they end at a stable design, or all of them at one least abscissa that is not stable,
    unless a stable design is known and it is to be `thorough`; else the whole search is made.
    """
    stable = steady(problem, asked)
    best: Outcome | None = None
    for state in begin_search(problem, options):
        outcome = None if problem.cases else _settle(state, stable, thorough)
        outcome = outcome or search_whole(state)
        best = outcome if outcome and (best is None or beats(problem, outcome, best, state.tuning)) else best
    if best is None or best.status != "optimal":
        return None
    return best.parameters if _meets(stable, best) else {}


def _settle(state: SearchState, stable: Posed, thorough: bool) -> Outcome | None:
    """Where few starts end that settle it: at what is stable, or all of them at one least abscissa that is not."""
    state = replace(state, sample=POLICY.sample(state))
    state = accept_best(try_starts(state, POLICY.starts(state), POLICY, _SETTLED))
    outcome = found(state, Starts())
    if state.interrupted:
        raise KeyboardInterrupt
    one = all(end.feasible for end in state.ends) and count_starts(state.ends, 0.0).optima == 1
    if (
        outcome is None
        or outcome.status != "optimal"
        or runs_away(outcome.checked.structure.roots, state.tuning.runaway)
    ):
        return None
    agreed = not thorough and bounded(state.part) and one
    return outcome if agreed or _meets(stable, outcome) else None


def _meets(problem: Posed, outcome: Outcome) -> bool:
    return not recheck(problem, outcome.parameters, outcome.cases).violations


def _reached(problem: Posed, options: Options, names: Sequence[str]) -> tuple[Mapping[str, float] | None, bool]:
    """A design that meets the constraints of these names, whatever it does to others; and whether that can be told."""
    options = replace(options, progress=None, near=None)
    kept = problem.derive(constraints={n: text for n, text in problem.constraints.items() if n in names}, pareto=())
    if kept.objective and (RADIUS in kept.objective.names or not (kept.pattern or set(names) & {*kept.asked_of_roots})):
        kept = kept.derive(minimize=None, maximize=None)
    states = begin_search(kept, options)
    about = kept.asked_of_roots or kept.pattern
    if about and any(seen.singular for s in states if (seen := POLICY.sample(s) or s.limits_sample)):
        return None, False
    for state in states:
        outcome = search_whole(state)
        if outcome is not None and not outcome.checked.violations:
            return outcome.parameters, True
    return None, True
