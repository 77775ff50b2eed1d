"""Problems without a feasible end: the least-violating design, why none is feasible, and which limits must change."""

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
"""Factors of an amount, with the digits written: a search misses a narrow feasible region without some room."""

_WORTH_TRYING = 0.999  # of the sum of amounts: a smaller share is worth another solve

_FEW = 3  # starts of the relaxation that includes stability

_NO_GOAL: Mapping[str, Any] = {"minimize": None, "maximize": None, "pareto": ()}


def explain_infeasible(problem: Posed, states: Sequence[SearchState], policy: Policy) -> Outcome:
    """The least-violating design with advice; if it violates nothing, the design that the solver reaches from it."""
    options = states[0].options
    ends = [(state, end) for state in states for end in state.ends]
    tried, formulation = count_starts([end for _, end in ends], 0.0).tried, states[0].nlp.formulation
    none = f"none of {tried} starts"
    for state, end in ends:
        if end.crossing and problem.pattern is not None:
            note = f"{none} ended at an exceptional point: roots meet with more than one eigenvector"
            design = nearest_crossing(problem, problem.pattern, problem.ordered(state.design_at(end)))
            crossed = assess_design(problem, design, note)
            return replace(crossed, status="not_converged", starts=Starts(tried), formulation=formulation)
    begin(options.progress, "searching for the smallest change of limits", "start")
    relaxation = relax(problem, options, [design for state in states for design in state.designs])
    design = clip_to_box(problem, relaxation.parameters if relaxation else default_start(problem))
    if relaxation is None or relaxation.amounts:
        status, note = "infeasible", f"{none} satisfies all constraints"
    else:
        whole = SearchState(problem, problem, formulate(problem, problem.cases), options, policy.tuning)
        starts = (Start(design, near) for near in (True, False))
        whole = policy.accept(try_starts(whole, starts, disable_stopping(policy)))
        if outcome := assess_best(whole, Starts(tried + 2, len(whole.feasible), 1, runs=2)):
            return outcome
        advice = f"try more starts, set a start, or {write_mass_advice(problem)}"
        status, note = "not_converged", f"feasible designs exist, but {none} converged; {advice}"
    least = assess_design(problem, design, note)
    return replace(least, status=status, starts=Starts(tried), formulation=formulation, relaxation=relaxation)


def relax(problem: Posed, options: Options, designs: Sequence[Mapping[str, float]]) -> Relaxation | None:
    """The least relaxation of the constraints, or of the box too if these do not help; None if none is found.

    Amounts are added up relative to the limits as written; those of the box relative to its widths. If one limit alone
    can move by less than all together, the joint search was stuck, and the single limit wins. A better design met on
    the way wins too; its conflict is only the limits that it moves. Remedies are changes that were solved again as
    written. If none can be solved, a relaxation is sought that also makes the design stable and moves constraints and
    ends of the box alike.
    """
    began, original = time.process_time(), problem
    problem = problem.derive(**_NO_GOAL)
    for elastic in list_stages(problem, options):
        relaxation, trial = elastic.find_least(designs)
        if relaxation is None:
            continue
        likely = tuple(dict.fromkeys([*relaxation.amounts, *(elastic.list_holding(trial) if trial else ())]))
        search = partial(search_limits, original, options)
        wide = widen_box(problem, problem.free)
        relaxation = find_conflict(problem, relaxation, likely, wide, options, search)
        if not options.alone or not relaxation.amounts:
            return relaxation
        if trial and len(relaxation.conflict) > 1:
            single = relax_each_alone(problem, options, relaxation.conflict, trial)
            relaxation = replace(relaxation, alone=Table(single))
        short = limit_time(options, time.process_time() - began)
        return _Changes(original, short).add_remedies(relaxation, replace(elastic, options=short))
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
        remedies, enough = dict[Table[str], None](), dict[str, float]()
        wanted = stability_limit(problem)
        stable = replace(elastic, problem=box.derive(constraints={**box.constraints, **wanted}))
        asked = problem.derive(constraints=wanted, **_NO_GOAL)
        joint = [] if recheck(asked, relaxation.parameters).violations else [relaxation.amounts]
        choices = {tuple(each): each for each in (*joint, *({n: a} for n, a in relaxation.alone.items()))}
        with suppress(OutOfTime):
            for names, amounts in choices.items():
                text, design = self.find(amounts)
                if text and joint and names == tuple(relaxation.amounts):
                    text = self.shrink(stable, text, design, amounts)
                if text:
                    remedies[Table(text)] = None
                    enough |= {n: relaxation.alone[n] for n in text if len(text) == 1 and n in relaxation.alone}
            if not remedies:
                remedies |= dict.fromkeys(self.relax_with_stability(box))
        return replace(relaxation, alone=Table(enough), remedies=tuple(remedies))

    def find(
        self, amounts: Mapping[str, float], margins: Sequence[tuple[float, int]] = _MARGINS
    ) -> tuple[dict[str, str], Mapping[str, float]]:
        """Limits moved by amounts, or a little further, as written in a file, and the optimum that they allow; else {}.

        Changes that let unstable designs in where a limit excluded them are skipped.
        """
        tried = list[dict[str, str]]()
        for factor, digits in margins if amounts and all(map(np.isfinite, amounts.values())) else ():
            text = move_limits(self.problem, {n: factor * amount for n, amount in amounts.items()}, digits)
            with suppress(InputError):  # a bound outside the physical range
                moved = replace_limits(self.problem, text)
                untried = text not in tried and not _loses_stability(self.problem, moved, text)
                design = solve_again(moved, self.options, self.problem) if untried else None
                if design:
                    return text, design
                if design is not None:  # an unstable optimum: more room does not help
                    break
            tried.append(text)
        return {}, {}

    def shrink(
        self, elastic: ElasticProblem, text: dict[str, str], design: Mapping[str, float], amounts: Mapping[str, float]
    ) -> dict[str, str]:
        """A smaller change, if the design that the change allows shows that limits moved too far; else the same."""
        with suppress(OutOfTime):
            less = elastic.find_amounts([design])
            share = elastic.sum_amounts(less) / elastic.sum_amounts(amounts)
            return self.find(less, [margin for margin in _MARGINS if share * margin[0] < _WORTH_TRYING])[0] or text
        return text

    def relax_with_stability(self, wide: Posed) -> tuple[Table[str], ...]:
        """The least verified relaxation of constraints and ends of the box that makes the design stable, if any.

        Args:
            wide: the problem in the box that was relaxed already without a remedy.
        """
        stable = stability_limit(self.problem)
        problem = self.problem.derive(constraints={**self.problem.constraints, **stable}, **_NO_GOAL)
        *_, elastic = list_stages(problem, replace(self.options, starts=_FEW))
        if not stable and elastic.problem.free == wide.free:
            return ()
        elastic = replace(elastic, limits=[limit for limit in elastic.limits if limit.name != STABLE])
        relaxation, _ = elastic.find_least()
        if relaxation is None:
            return ()
        text, design = self.find(relaxation.amounts)
        return (Table(self.shrink(elastic, text, design, relaxation.amounts)),) if text else ()


def _loses_stability(problem: Posed, moved: Posed, names: Collection[str]) -> bool:
    """Whether a changed limit admits unstable designs that it excluded before."""

    def needs_stability(text: str) -> bool:
        return bool(stability_limit(problem.derive(constraints={"limit": text}, **_NO_GOAL)))

    about = [name for name in names if name in problem.asked_of_roots]
    return any(needs_stability(problem.constraints[n]) and not needs_stability(moved.constraints[n]) for n in about)
