"""Advice for problems without a feasible end: the design that violates least, and which limits must change.

A *relaxation* is a set of limits with the amounts by which they must move; a *remedy* is such a change, verified
by solving the changed problem.
"""

import time
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from tmsopt.errors import InputError
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem import Posed, Relaxation, Starts, move_limits, replace_limits
from tmsopt.problem.advice.remedies import DIGITS
from tmsopt.problem.dependence import STABLE, stability_limit
from tmsopt.problem.verdict.meetings import nearest_crossing
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
"""Factors of an amount, each with the number of digits: without some room a search misses a narrow feasible region."""

_MAX_SHARE = 0.999  # of the sum of amounts: a smaller share is worth another solve

_FEW_STARTS = 3  # of the relaxation that includes stability

_NO_GOAL: Mapping[str, Any] = {"minimize": None, "maximize": None, "pareto": ()}


def explain_infeasible(problem: Posed, states: Sequence[SearchState], policy: Policy) -> Outcome:
    """Return the design that violates least, with advice; if it violates nothing, the solver's design from there."""
    options = states[0].options
    ends = [(state, end) for state in states for end in state.ends]
    start_count, formulation = count_starts([end for _, end in ends], 0.0).tried, states[0].nlp.formulation
    none = f"none of {start_count} starts"
    for state, end in ends:
        if end.crossing and problem.pattern is not None:
            note = f"{none} ended at an exceptional point: roots meet with more than one eigenvector"
            design = nearest_crossing(problem, problem.pattern, problem.ordered(state.design_at(end)))
            crossing = assess_design(problem, design, note)
            return replace(crossing, status="not_converged", starts=Starts(start_count), formulation=formulation)
    begin(options.progress, "searching for the smallest change of limits", "start")
    relaxation = relax(problem, options, [design for state in states for design in state.designs])
    design = clip_to_box(problem, relaxation.parameters if relaxation else default_start(problem))
    if relaxation is None or relaxation.amounts:
        status, note = "infeasible", f"{none} satisfies all constraints"
    else:
        box_state = SearchState(problem, problem, formulate(problem, problem.cases), options, policy.tuning)
        starts = (Start(design, near) for near in (True, False))
        box_state = policy.accept(try_starts(box_state, starts, disable_stopping(policy)))
        if outcome := assess_best(box_state, Starts(start_count + 2, len(box_state.feasible), 1, runs=2)):
            return outcome
        advice = f"try more starts, set a start, or {write_mass_advice(problem)}"
        status, note = "not_converged", f"feasible designs exist, but {none} converged; {advice}"
    best = assess_design(problem, design, note)
    return replace(best, status=status, starts=Starts(start_count), formulation=formulation, relaxation=relaxation)


def relax(problem: Posed, options: Options, designs: Sequence[Mapping[str, float]]) -> Relaxation | None:
    """Find the least relaxation of the constraints, or also of the box if that is not enough; None if none is found.

    The amounts are summed, each relative to the limit as written, or to the width of a range. A known design wins if it
    needs less. Remedies are changes that were solved again as written. If no change can be solved, a relaxation is
    sought that also makes the design stable, and that moves constraints and ends of ranges alike.
    """
    began, original = time.process_time(), problem
    problem = problem.derive(**_NO_GOAL)
    for elastic in list_stages(problem, options):
        relaxation, trial = elastic.find_least_relaxation(designs)
        if relaxation is None:
            continue
        likely = tuple(dict.fromkeys([*relaxation.amounts, *(elastic.list_active_limits(trial) if trial else ())]))
        search = partial(search_limits, original, options)
        wide_problem = widen_box(problem, problem.free)
        relaxation = find_conflict(problem, relaxation, likely, wide_problem, options, search)
        if not options.alone or not relaxation.amounts:
            return relaxation
        if trial and len(relaxation.conflict) > 1:
            amounts_alone = relax_each_alone(problem, options, relaxation.conflict, trial)
            relaxation = replace(relaxation, alone=Table(amounts_alone))
        limited_options = limit_time(options, time.process_time() - began)
        return _Changes(original, limited_options).add_remedies(relaxation, replace(elastic, options=limited_options))
    return None


@dataclass(frozen=True)
class _Changes:
    """Changes of limits, each verified by solving the changed problem again."""

    problem: Posed
    options: Options

    def add_remedies(self, relaxation: Relaxation, elastic: ElasticProblem) -> Relaxation:
        """Add remedies to a relaxation while there is time; `alone` keeps the single limits that were verified.

        The joint change is skipped if its design is unstable although stability is needed.
        """
        problem, box = self.problem, elastic.problem
        remedies, verified_alone = dict[Table[str], None](), dict[str, float]()
        stability = stability_limit(problem)
        stable = replace(elastic, problem=box.derive(constraints={**box.constraints, **stability}))
        stable_problem = problem.derive(constraints=stability, **_NO_GOAL)
        joint = [] if recheck(stable_problem, relaxation.parameters).violations else [relaxation.amounts]
        choices = {tuple(each): each for each in (*joint, *({n: a} for n, a in relaxation.alone.items()))}
        with suppress(OutOfTime):
            for names, amounts in choices.items():
                text, design = self.find_change(amounts)
                if text and joint and names == tuple(relaxation.amounts):
                    text = self.shrink_change(stable, text, design, amounts)
                if text:
                    remedies[Table(text)] = None
                    verified_alone |= {n: relaxation.alone[n] for n in text if len(text) == 1 and n in relaxation.alone}
            if not remedies:
                remedies |= dict.fromkeys(self.relax_with_stability(box))
        return replace(relaxation, alone=Table(verified_alone), remedies=tuple(remedies))

    def find_change(
        self, amounts: Mapping[str, float], margins: Sequence[tuple[float, int]] = _MARGINS
    ) -> tuple[dict[str, str], Mapping[str, float]]:
        """Return limits moved by amounts or a bit further, as written in a file, and their optimum; {} if none.

        A change is skipped if it admits unstable designs that a limit excluded.
        """
        tried_texts = list[dict[str, str]]()
        for factor, digits in margins if amounts and all(map(np.isfinite, amounts.values())) else ():
            text = move_limits(self.problem, {n: factor * amount for n, amount in amounts.items()}, digits)
            with suppress(InputError):  # a bound outside the physical range
                new_problem = replace_limits(self.problem, text)
                is_new = text not in tried_texts and not _loses_stability(self.problem, new_problem, text)
                design = solve_again(new_problem, self.options, self.problem) if is_new else None
                if design:
                    return text, design
                if design is not None:  # an unstable optimum: more room does not help
                    break
            tried_texts.append(text)
        return {}, {}

    def shrink_change(
        self, elastic: ElasticProblem, text: dict[str, str], design: Mapping[str, float], amounts: Mapping[str, float]
    ) -> dict[str, str]:
        """Return a smaller change if the design of this change shows that limits moved too far; else this change."""
        with suppress(OutOfTime):
            smaller_amounts = elastic.find_amounts([design])
            share = elastic.sum_amounts(smaller_amounts) / elastic.sum_amounts(amounts)
            return (
                self.find_change(smaller_amounts, [margin for margin in _MARGINS if share * margin[0] < _MAX_SHARE])[0]
                or text
            )
        return text

    def relax_with_stability(self, wide: Posed) -> tuple[Table[str], ...]:
        """Return the least verified change of constraints and ends of ranges that makes the design stable, if any.

        Args:
            wide: the problem in the box whose relaxation already led to no remedy.
        """
        stable = stability_limit(self.problem)
        problem = self.problem.derive(constraints={**self.problem.constraints, **stable}, **_NO_GOAL)
        *_, elastic = list_stages(problem, replace(self.options, starts=_FEW_STARTS))
        if not stable and elastic.problem.free == wide.free:
            return ()
        elastic = replace(elastic, limits=[limit for limit in elastic.limits if limit.name != STABLE])
        relaxation, _ = elastic.find_least_relaxation()
        if relaxation is None:
            return ()
        text, design = self.find_change(relaxation.amounts)
        return (Table(self.shrink_change(elastic, text, design, relaxation.amounts)),) if text else ()


def _loses_stability(problem: Posed, new_problem: Posed, names: Collection[str]) -> bool:
    """Whether a changed limit admits unstable designs that it excluded before."""

    def needs_stability(text: str) -> bool:
        return bool(stability_limit(problem.derive(constraints={"limit": text}, **_NO_GOAL)))

    root_limits = [name for name in names if name in problem.asked_of_roots]
    pairs = ((problem.constraints[n], new_problem.constraints[n]) for n in root_limits)
    return any(needs_stability(old) and not needs_stability(new) for old, new in pairs)
