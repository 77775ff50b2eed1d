"""Changes of limits that make an infeasible problem feasible, written as in a file and verified by solving again."""

import time
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from tmsopt.errors import InputError
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem.advice.remedies import DIGITS, Relaxation, move_limits, replace_limits
from tmsopt.problem.dependence import STABLE, stability_limit
from tmsopt.problem.problem import Posed
from tmsopt.program.options import Options
from tmsopt.records import Table
from tmsopt.search.remedies.allowance import OutOfTime, limit_time
from tmsopt.search.remedies.changed_problem import solve_again
from tmsopt.search.remedies.conflict import find_conflict, search_limits
from tmsopt.search.remedies.relaxation import (
    Limit,
    find_holding_limits,
    find_least_relaxation,
    find_relaxation_near,
    list_stages,
    relax_each_alone,
    sum_amounts,
    widen_box,
)

_MARGINS = ((1.0, DIGITS), (1.2, 2))
"""Factors of an amount, with the digits written: a search misses a narrow feasible region without some room."""

_WORTH_TRYING = 0.999  # of the sum of amounts: a smaller share is worth another solve

_FEW = 3  # starts of the relaxation that includes stability

_NO_GOAL: Mapping[str, Any] = {"minimize": None, "maximize": None, "pareto": ()}


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
    for wide, limits in list_stages(problem):
        relaxation, trial, nlp = find_least_relaxation(problem, options, wide, limits, designs)
        if relaxation is None:
            continue
        held = find_holding_limits(nlp, limits, trial) if trial and nlp else []
        likely = tuple(dict.fromkeys([*relaxation.amounts, *held]))
        wide_box = widen_box(problem, problem.free)
        search = partial(search_limits, original, options)
        relaxation = find_conflict(problem, relaxation, likely, wide_box, options, search)
        if not options.alone or not relaxation.amounts:
            return relaxation
        single: dict[str, float] = {}
        if trial and nlp and len(relaxation.conflict) > 1:
            single = relax_each_alone(problem, options, relaxation.conflict, trial, nlp.cases)
        short = limit_time(options, time.process_time() - began)
        return _Changes(original, short).add_remedies(replace(relaxation, alone=Table(single)), wide, limits)
    return None


@dataclass(frozen=True)
class _Changes:
    """Changes of limits, each verified by solving the changed problem again."""

    original: Posed
    options: Options

    def add_remedies(self, relaxation: Relaxation, wide: Posed, limits: Sequence[Limit]) -> Relaxation:
        """Add remedies to a relaxation while there is time; `alone` keeps the single limits that were verified.

        The joint change is skipped if its design is unstable although stability is needed.
        """
        problem = self.original
        remedies, enough = dict[Table[str], None](), dict[str, float]()
        wanted = stability_limit(problem)
        stable = problem.derive(constraints=wanted, **_NO_GOAL)
        box = wide.derive(constraints={**wide.constraints, **wanted})
        joint = [] if recheck(stable, relaxation.parameters).violations else [relaxation.amounts]
        choices = {tuple(each): each for each in (*joint, *({n: a} for n, a in relaxation.alone.items()))}
        with suppress(OutOfTime):
            for names, amounts in choices.items():
                text, design = self.find(problem, amounts)
                if text and joint and names == tuple(relaxation.amounts):
                    text = self.shrink(problem, box, limits, text, design, amounts)
                if text:
                    remedies[Table(text)] = None
                    enough |= {n: relaxation.alone[n] for n in text if len(text) == 1 and n in relaxation.alone}
            if not remedies:
                remedies |= dict.fromkeys(self.relax_with_stability(wide))
        return replace(relaxation, alone=Table(enough), remedies=tuple(remedies))

    def find(
        self, problem: Posed, amounts: Mapping[str, float], margins: Sequence[tuple[float, int]] = _MARGINS
    ) -> tuple[dict[str, str], Mapping[str, float]]:
        """Limits moved by amounts, or a little further, as written in a file, and the optimum that they allow; else {}.

        Changes that let unstable designs in where a limit excluded them are skipped.
        """
        tried = list[dict[str, str]]()
        for factor, digits in margins if amounts and all(map(np.isfinite, amounts.values())) else ():
            text = move_limits(problem, {n: factor * amount for n, amount in amounts.items()}, digits)
            with suppress(InputError):  # a bound outside the physical range
                moved = replace_limits(problem, text)
                untried = text not in tried and not _loses_stability(problem, moved, text)
                design = solve_again(moved, self.options, self.original) if untried else None
                if design:
                    return text, design
                if design is not None:  # an unstable optimum: more room does not help
                    break
            tried.append(text)
        return {}, {}

    def shrink(
        self,
        problem: Posed,
        box: Posed,
        limits: Sequence[Limit],
        text: dict[str, str],
        design: Mapping[str, float],
        amounts: Mapping[str, float],
    ) -> dict[str, str]:
        """A smaller change, if the design that the change allows shows that limits moved too far; else the same."""
        with suppress(OutOfTime):
            less = find_relaxation_near(self.options, box, limits, design)
            share = sum_amounts(limits, less) / sum_amounts(limits, amounts)
            margins = [margin for margin in _MARGINS if share * margin[0] < _WORTH_TRYING]
            return self.find(problem, less, margins)[0] or text
        return text

    def relax_with_stability(self, wide: Posed) -> tuple[Table[str], ...]:
        """The least verified relaxation of constraints and ends of the box that makes the design stable, if any.

        Args:
            wide: the problem in the box that was relaxed already without a remedy.
        """
        stable = stability_limit(self.original)
        problem = self.original.derive(constraints={**self.original.constraints, **stable}, **_NO_GOAL)
        *_, (box, movable) = list_stages(problem)
        if not stable and box.free == wide.free:
            return ()
        limits = [limit for limit in movable if limit.name != STABLE]
        relaxation, *_ = find_least_relaxation(problem, replace(self.options, starts=_FEW), box, limits)
        if relaxation is None:
            return ()
        text, design = self.find(problem, relaxation.amounts)
        return (Table(self.shrink(problem, box, limits, text, design, relaxation.amounts)),) if text else ()


def _loses_stability(problem: Posed, moved: Posed, names: Collection[str]) -> bool:
    """Whether a changed limit admits unstable designs that it excluded before."""

    def needs_stability(text: str) -> bool:
        return bool(stability_limit(problem.derive(constraints={"limit": text}, **_NO_GOAL)))

    about = [name for name in names if name in problem.asked_of_roots]
    return any(needs_stability(problem.constraints[n]) and not needs_stability(moved.constraints[n]) for n in about)
