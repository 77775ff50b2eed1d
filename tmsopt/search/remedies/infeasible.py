"""Advice for problems without a feasible end: the design that violates least, and which limits must change.

A *relaxation* is a set of limits with the amounts by which they must move. A *remedy* is a change of limits that is
verified: the changed problem has a solution.
"""

import time
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from tmsopt.chains.meetings import nearest_crossing
from tmsopt.errors import InputError
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem import Posed, Relaxation, Starts, move_limits, replace_limits
from tmsopt.problem.advice.remedies import DIGITS
from tmsopt.problem.dependence import STABILITY_CONSTRAINT, stability_limit
from tmsopt.program import Options
from tmsopt.program.formulate import default_start, formulate
from tmsopt.progress import begin
from tmsopt.records import Table
from tmsopt.search.outcome import Outcome, assess_best, assess_design, write_mass_advice
from tmsopt.search.policy import Policy, disable_stopping, try_starts
from tmsopt.search.remedies.changed_problem import OutOfTime, limit_time, solve_again
from tmsopt.search.remedies.conflict import find_conflict, search_limits
from tmsopt.search.remedies.relaxation import ElasticProblem, list_stages, relax_each_alone, widen_box
from tmsopt.search.state import SearchState, Start, clip_to_box
from tmsopt.search.stopping import count_starts

_MARGINS = ((1.0, DIGITS), (1.2, 2))
"""(Factor on an amount, digits to round it to): if the first leaves too little room for the search, try the second."""

_MAX_SHARE = 0.999  # relative to the sum of amounts: only a smaller change is worth another solve
_FEW_STARTS = 3  # starts of the relaxation that includes stability
_NO_GOAL: Mapping[str, Any] = {"minimize": None, "maximize": None, "pareto": ()}


def explain_infeasible(problem: Posed, states: Sequence[SearchState], policy: Policy) -> Outcome:
    """Return the design that violates least, with advice; if it violates nothing, return the optimum near it."""
    options = states[0].options
    ends = [(state, end) for state in states for end in state.ends]
    start_count, formulation = count_starts([end for _, end in ends], 0.0).tried, states[0].nlp.formulation
    no_start = f"none of {start_count} starts"
    for state, end in ends:
        if end.crossing and problem.pattern is not None:
            note = f"{no_start} ended at an exceptional point: roots meet with more than one eigenvector"
            design = nearest_crossing(problem, problem.pattern, problem.ordered(state.design_at(end)))
            crossing = assess_design(problem, design, note)
            return replace(crossing, status="not_converged", starts=Starts(start_count), formulation=formulation)
    begin(options.progress, "searching for the smallest change of limits", "start")
    relaxation = relax(problem, options, [design for state in states for design in state.designs])
    design = clip_to_box(problem, relaxation.parameters if relaxation else default_start(problem))
    if relaxation is None or relaxation.amounts:
        status, note = "infeasible", f"{no_start} satisfies all constraints"
    else:
        box_state = SearchState(problem, problem, formulate(problem, problem.cases), options, policy.tuning)
        starts = (Start(design, near) for near in (True, False))
        box_state = policy.accept(try_starts(box_state, starts, disable_stopping(policy)))
        if outcome := assess_best(box_state, Starts(start_count + 2, len(box_state.feasible), 1, runs=2)):
            return outcome
        advice = f"try more starts, set a start, or {write_mass_advice(problem)}"
        status, note = "not_converged", f"feasible designs exist, but {no_start} converged; {advice}"
    best = assess_design(problem, design, note)
    return replace(best, status=status, starts=Starts(start_count), formulation=formulation, relaxation=relaxation)


def relax(problem: Posed, options: Options, designs: Sequence[Mapping[str, float]]) -> Relaxation | None:
    """Find the least relaxation of the constraints, or also of the box if that is not enough; None if none is found.

    The amounts are summed, each relative to the limit as written, or to the width of a range. If a known design needs
    less, its relaxation is returned. A remedy is added only if the changed problem, as written, has a solution. If none
    has, constraints and ends of ranges may move together, and stability is one of the constraints.
    """
    began, original_problem = time.process_time(), problem
    problem = problem.derive(**_NO_GOAL)
    for elastic in list_stages(problem, options):
        relaxation, trial = elastic.find_least_relaxation(designs)
        if relaxation is None:
            continue
        likely_names = tuple(
            dict.fromkeys([*relaxation.amounts, *(elastic.list_active_limits(trial) if trial else ())])
        )
        search = partial(search_limits, original_problem, options)
        wide_problem = widen_box(problem, problem.free)
        relaxation = find_conflict(problem, relaxation, likely_names, wide_problem, options, search)
        if not options.alone or not relaxation.amounts:
            return relaxation
        if trial and len(relaxation.conflict) > 1:
            amounts = relax_each_alone(problem, options, relaxation.conflict, trial)
            relaxation = replace(relaxation, alone=Table(amounts))
        limited_options = limit_time(options, time.process_time() - began)
        return _RemedySearch(original_problem, limited_options).add_remedies(
            relaxation, replace(elastic, options=limited_options)
        )
    return None


@dataclass(frozen=True)
class _RemedySearch:
    """Finds changes of limits and verifies each one by solving the changed problem."""

    problem: Posed
    options: Options

    def add_remedies(self, relaxation: Relaxation, elastic: ElasticProblem) -> Relaxation:
        """Add remedies to a relaxation while there is time; its `alone` keeps only the verified limits.

        The change of all limits together is skipped if its design is unstable although stability is needed.
        """
        problem, box = self.problem, elastic.problem
        remedies, verified_alone = dict[Table[str], None](), dict[str, float]()
        stability = stability_limit(problem)
        stable_elastic = replace(elastic, problem=box.derive(constraints={**box.constraints, **stability}))
        stable_problem = problem.derive(constraints=stability, **_NO_GOAL)
        joint_changes = [] if recheck(stable_problem, relaxation.parameters).violations else [relaxation.amounts]
        changes = {tuple(c): c for c in (*joint_changes, *({n: a} for n, a in relaxation.alone.items()))}
        with suppress(OutOfTime):
            for names, amounts in changes.items():
                text, design = self.find_change(amounts)
                if text and joint_changes and names == tuple(relaxation.amounts):
                    text = self.shrink_change(stable_elastic, text, design, amounts)
                if text:
                    remedies[Table(text)] = None
                    verified_alone |= {n: relaxation.alone[n] for n in text if len(text) == 1 and n in relaxation.alone}
            if not remedies:
                remedies |= dict.fromkeys(self.relax_with_stability(box))
        return replace(relaxation, alone=Table(verified_alone), remedies=tuple(remedies))

    def find_change(
        self, amounts: Mapping[str, float], margins: Sequence[tuple[float, int]] = _MARGINS
    ) -> tuple[dict[str, str], Mapping[str, float]]:
        """Return the limits, moved by these amounts or slightly more, as texts, and the optimum; {} if there is none.

        A change is skipped if it admits unstable designs that a limit excluded.
        """
        tried_texts = list[dict[str, str]]()
        for factor, digits in margins if amounts and all(map(np.isfinite, amounts.values())) else ():
            text = move_limits(self.problem, {n: factor * amount for n, amount in amounts.items()}, digits)
            with suppress(InputError):  # an end may be outside the physical range
                new_problem = replace_limits(self.problem, text)
                is_new = text not in tried_texts and not _can_lose_stability(self.problem, new_problem, text)
                design = solve_again(new_problem, self.options, self.problem) if is_new else None
                if design:
                    return text, design
                if design is not None:  # the optimum is unstable: a larger change does not help
                    break
            tried_texts.append(text)
        return {}, {}

    def shrink_change(
        self, elastic: ElasticProblem, text: dict[str, str], design: Mapping[str, float], amounts: Mapping[str, float]
    ) -> dict[str, str]:
        """Return a smaller change if the design of this change does not need all of it; else return this change."""
        with suppress(OutOfTime):
            smaller_amounts = elastic.find_amounts([design])
            share = elastic.sum_amounts(smaller_amounts) / elastic.sum_amounts(amounts)
            return (
                self.find_change(smaller_amounts, [margin for margin in _MARGINS if share * margin[0] < _MAX_SHARE])[0]
                or text
            )
        return text

    def relax_with_stability(self, wide_problem: Posed) -> tuple[Table[str], ...]:
        """Return the least verified change of constraints and ends of ranges that makes the design stable, if any.

        Args:
            wide_problem: the problem in the box whose relaxation already led to no remedy.
        """
        stability = stability_limit(self.problem)
        problem = self.problem.derive(constraints={**self.problem.constraints, **stability}, **_NO_GOAL)
        *_, elastic = list_stages(problem, replace(self.options, starts=_FEW_STARTS))
        if not stability and elastic.problem.free == wide_problem.free:
            return ()
        elastic = replace(elastic, limits=[limit for limit in elastic.limits if limit.name != STABILITY_CONSTRAINT])
        relaxation, _ = elastic.find_least_relaxation()
        if relaxation is None:
            return ()
        text, design = self.find_change(relaxation.amounts)
        return (Table(self.shrink_change(elastic, text, design, relaxation.amounts)),) if text else ()


def _can_lose_stability(problem: Posed, new_problem: Posed, names: Collection[str]) -> bool:
    """Whether a changed limit admits unstable designs that it excluded before."""

    def has_stability_limit(text: str) -> bool:
        return bool(stability_limit(problem.derive(constraints={"limit": text}, **_NO_GOAL)))

    pairs = ((problem.constraints[n], new_problem.constraints[n]) for n in names if n in problem.asked_of_roots)
    return any(has_stability_limit(old) and not has_stability_limit(new) for old, new in pairs)
