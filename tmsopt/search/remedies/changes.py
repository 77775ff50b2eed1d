"""What frees a problem without an answer: limits moved as a file would write them, each change solved again."""

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from tmsopt.errors import InputError
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem.advice.remedies import DIGITS, Relaxation, move_limits, replace_limits
from tmsopt.problem.dependence import STABLE, stability_limit
from tmsopt.problem.problem import Posed
from tmsopt.program.options import Options
from tmsopt.records import Table
from tmsopt.search.remedies.allowance import Spent, within
from tmsopt.search.remedies.needs import Answered
from tmsopt.search.remedies.relaxation import (
    Limit,
    alone,
    holding,
    least_near,
    least_relaxation,
    stages,
    total,
    widened,
)

_ROOM = ((1.0, DIGITS), (1.2, 2))
"""Times an amount, and digits of what is written: where the design is a needle, room shows it to a search."""

_LESS = 0.999  # of the sum of amounts: what is worth being solved again

_FEW = 3  # starts of a relaxation that is sought besides

_NO_GOAL: Mapping[str, Any] = {"minimize": None, "maximize": None, "pareto": ()}

Named = Callable[[Posed, Relaxation, Sequence[str], Posed, Options], Relaxation]
"""A relaxation with the limits that exclude each other; see `needs.irreducible`."""


def relax(
    problem: Posed, options: Options, designs: Sequence[Mapping[str, float]], named: Named, answered: Answered
) -> Relaxation | None:
    """The least relaxation: of the constraints, or of the box too where these alone cannot help; None if none is found.

    Amounts are added up relative to the limits as written, those of the box in its widths. One limit that can do it
    alone for less than all together shows that the search for these was caught, and wins; so does a design that was
    met on the way, of whose conflict no more is known than what it moves. Remedies are what was solved again as written
    and answered; where none of these is, a design is sought that is stable too, with the ends of the box as free to
    move as constraints.
    """
    began, asked = time.process_time(), problem
    problem = problem.derive(**_NO_GOAL)  # what else is asked plays no part
    for wide, limits in stages(problem):
        relaxation, trial, nlp = least_relaxation(problem, options, wide, limits, designs)
        if relaxation is None:
            continue
        held = holding(nlp, limits, trial) if trial and nlp else []
        likely = tuple(dict.fromkeys([*relaxation.amounts, *held]))
        relaxation = named(problem, relaxation, likely, widened(problem, problem.free), options)
        if not options.alone or not relaxation.amounts:
            return relaxation
        single: dict[str, float] = {}
        if trial and nlp and len(relaxation.conflict) > 1:
            single = alone(problem, options, relaxation.conflict, trial, nlp.cases)
        short = within(options, time.process_time() - began)
        return _tried(asked, short, replace(relaxation, alone=Table(single)), wide, limits, answered)
    return None


def _tried(
    problem: Posed, options: Options, relaxation: Relaxation, wide: Posed, limits: Sequence[Limit], answered: Answered
) -> Relaxation:
    """A relaxation with remedies, as long as there is time to try them; alone are limits that were tried.

    Where the relaxed design is not stable though that is wanted, so is none of the few that are left beside it.
    """
    remedies, enough = dict[Table[str], None](), dict[str, float]()
    wanted = stability_limit(problem)
    stable = problem.derive(constraints=wanted, **_NO_GOAL)
    box = wide.derive(constraints={**wide.constraints, **wanted})
    joint = [] if recheck(stable, relaxation.parameters).violations else [relaxation.amounts]
    choices = {tuple(each): each for each in (*joint, *({n: a} for n, a in relaxation.alone.items()))}
    with suppress(Spent):
        for names, amounts in choices.items():
            together = bool(joint) and names == tuple(relaxation.amounts)
            text, design = _written(problem, options, amounts, answered)
            if (
                text := _less(problem, options, box, limits, text, design, amounts, answered)
                if text and together
                else text
            ):
                remedies[Table(text)] = None
                enough |= {n: relaxation.alone[n] for n in text if len(text) == 1 and n in relaxation.alone}
        if not remedies:
            remedies |= dict.fromkeys(_steadied(problem, options, wide, answered))
    return replace(relaxation, alone=Table(enough), remedies=tuple(remedies))


def _less(
    problem: Posed,
    options: Options,
    box: Posed,
    limits: Sequence[Limit],
    text: dict[str, str],
    design: Mapping[str, float],
    amounts: Mapping[str, float],
    answered: Answered,
) -> dict[str, str]:
    """What is written, or less where the design that answers shows that limits are moved too far, or for nothing."""
    with suppress(Spent):
        less = least_near(options, box, limits, design)
        share = total(limits, less) / total(limits, amounts)
        return (
            _written(problem, options, less, answered, [room for room in _ROOM if share * room[0] < _LESS])[0] or text
        )
    return text


def _written(
    problem: Posed,
    options: Options,
    amounts: Mapping[str, float],
    answered: Answered,
    rooms: Sequence[tuple[float, int]] = _ROOM,
) -> tuple[dict[str, str], Mapping[str, float]]:
    """Limits moved by amounts, or a little further, as they may be written, and the design that then answers; or {}.

    None that moves limits on the roots as far as to let in what is not stable.
    """
    tried = list[dict[str, str]]()
    for more, digits in rooms if amounts and all(map(np.isfinite, amounts.values())) else ():
        text = move_limits(problem, {n: more * amount for n, amount in amounts.items()}, digits)
        with suppress(InputError):  # no end of a range is beyond what is physical
            moved = replace_limits(problem, text)
            fresh = text not in tried and not _unsettled(problem, moved, text)
            design = answered(moved, options) if fresh else None
            if design:
                return text, design
            if design is not None:  # found, but not stable: room shows a search nothing that it did not see
                break
        tried.append(text)
    return {}, {}


def _unsettled(problem: Posed, moved: Posed, names: Collection[str]) -> bool:
    """Whether a limit that kept designs stable no longer does."""

    def settles(text: str) -> bool:
        return bool(stability_limit(problem.derive(constraints={"limit": text}, **_NO_GOAL)))

    about = [name for name in names if name in problem.asked_of_roots]
    return any(settles(problem.constraints[n]) and not settles(moved.constraints[n]) for n in about)


def _steadied(problem: Posed, options: Options, wide: Posed, answered: Answered) -> tuple[Table[str], ...]:
    """The least relaxation after which a design is stable, of constraints and ends of the box alike, if it is answered.

    Args:
        wide: in whose box no relaxation of the problem was answered.
    """
    stable = stability_limit(problem)
    limits = {**problem.constraints, **stable}
    asked = problem.derive(constraints=limits, **_NO_GOAL)
    *_, (box, movable) = stages(asked)
    if not stable and box.free == wide.free:
        return ()
    moved = [limit for limit in movable if limit.name != STABLE]
    few = replace(options, starts=_FEW)
    relaxation, *_ = least_relaxation(asked, few, box, moved)
    if relaxation is None:
        return ()
    text, design = _written(asked, options, relaxation.amounts, answered)
    return (Table(_less(asked, options, box, moved, text, design, relaxation.amounts, answered)),) if text else ()
