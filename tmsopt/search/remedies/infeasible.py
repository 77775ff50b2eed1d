"""Problems without a feasible end: the least-violating design, why none is feasible, and which limits must change."""

from collections.abc import Sequence
from dataclasses import replace

from tmsopt.problem.problem import Posed
from tmsopt.problem.searches import Starts
from tmsopt.problem.verdict.meetings import nearest_crossing
from tmsopt.program.formulate import default_start, formulate
from tmsopt.progress import begin
from tmsopt.search.outcome import (
    Outcome,
    assess_best,
    assess_design,
    write_mass_advice,
)
from tmsopt.search.policy import Policy, disable_stopping, try_starts
from tmsopt.search.remedies.changes import relax
from tmsopt.search.state import SearchState, Start, clip_to_box
from tmsopt.search.stopping import count_starts


def explain_infeasible(problem: Posed, states: Sequence[SearchState], policy: Policy) -> Outcome:
    """The least-violating design with advice; if it violates nothing, the design that the solver reaches from it."""
    options = states[0].options
    ends = [(state, end) for state in states for end in state.ends]
    tried, formulation = count_starts([end for _, end in ends], 0.0).tried, states[0].nlp.formulation
    for state, end in ends:
        if end.crossing and problem.pattern is not None:
            note = f"none of {tried} starts ended at an exceptional point: roots meet with more than one eigenvector"
            design = nearest_crossing(problem, problem.pattern, problem.ordered(state.design_at(end)))
            crossed = assess_design(problem, design, note)
            return replace(crossed, status="not_converged", starts=Starts(tried), formulation=formulation)
    begin(options.progress, "searching for the smallest change of limits", "start")
    designs = [design for state in states for design in state.designs]
    relaxation = relax(problem, options, designs)
    design = clip_to_box(problem, relaxation.parameters if relaxation else default_start(problem))
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
