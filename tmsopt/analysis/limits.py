"""What each limit that binds is worth: its multiplier, checked by solving again with the limit moved."""

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tmsopt.analysis.steps import natural_step, step_within
from tmsopt.errors import InputError
from tmsopt.models.expression import written_sides
from tmsopt.problem.limit import split_limit
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, common_unit, dimension_of, limit_text, unit_of
from tmsopt.program.options import DEFAULTS
from tmsopt.progress import Counts
from tmsopt.records import plain
from tmsopt.search.solve import solve_any_status

DIFFERS = 0.2
"""Relative difference of the two gains from which the reader is told why."""

_RETRY = 8  # starts when the optimum as the only start did not lead to one at least as good
_NOISE = 1e-8  # of the objective: differences below it are no loss


@dataclass(frozen=True)
class Lever:
    """A limit that binds, and what moving it buys. Gains are positive where the objective gets better.

    Attributes:
        name: of the constraint, or a bound such as ``Fr.max``.
        kind: ``bound`` or ``constraint``.
        limit: the limit, in the unit in which the problem was written.
        physical: whether the limit is a physical end, such as 0 for a mass, and cannot be moved.
        move: what is done to the limit, e.g. ``1 deg more lambda_s.max``.
        step: change of the limit in the unit of the parameter, with its sign; 0 where it cannot be moved.
        per_unit: gain per unit of that change, to first order (the multiplier).
        resolved: gain found by solving the moved problem; nan where that was not done or failed.
        structure: of the moved optimum; empty without one.
        reason: why the two gains differ, or why there is only one.
        gained: unit of the gains in words.
    """

    name: str
    kind: str
    limit: str
    physical: bool
    move: str
    step: float
    per_unit: float
    resolved: float = math.nan
    structure: str = ""
    reason: str = ""
    gained: Unit = field(default_factory=Unit)

    @property
    def predicted(self) -> float:
        """Gain to first order, multiplier times step."""
        return self.per_unit * abs(self.step)

    @property
    def relative(self) -> float:
        """Re-solved minus first-order gain, relative to the latter."""
        return (self.resolved - self.predicted) / self.predicted if self.predicted else math.nan

    @property
    def sentence(self) -> str:
        """The lever in words."""
        if not self.step:
            return f"{self.name} = {self.limit} binds and cannot be moved: it is a physical end"
        solved = math.isfinite(self.resolved)
        gain = self._gain(self.resolved if solved else self.predicted)
        verb = "buys" if not gain.startswith("-") else "costs"
        order = f"first order {self._gain(self.predicted)}" if solved else "first order"
        return f"{self.move} {verb} {gain.lstrip('-')} ({order})" + (f"; {self.reason}" if self.reason else "")

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        return {
            **plain(self, "name kind limit physical step"),
            "gain_per_unit": self.per_unit,
            "gain_first_order": self.predicted,
            "gain_resolved": self.resolved if math.isfinite(self.resolved) else None,
            "relative_difference": self.relative if math.isfinite(self.relative) else None,
            "structure": self.structure or None,
            **plain(self, "reason sentence"),
        }

    def _gain(self, value: float) -> str:
        return self.gained.show(value, 3)


def levers(solution: Solution, resolve: bool = True, progress: Counts | None = None) -> tuple[Lever, ...]:
    """One lever per limit that binds at an optimum, the most valuable step first."""
    if solution.status != "optimal":
        return ()
    found = [_unresolved(solution, name) for name in solution.active]
    look = resolve and (len(found) == 1 or _lets_in(solution, found))
    for k, lever in enumerate(found):
        found[k] = _resolved(solution, lever, look) if resolve and lever.step else lever
        if progress:
            progress(k + 1, len(found))
    return tuple(sorted(found, key=lambda v: -(v.resolved if math.isfinite(v.resolved) else v.predicted)))


def is_physical(problem: Posed, bound: str) -> bool:
    """Whether a bound such as ``mu.min`` is a physical end of its parameter."""
    name, end = bound.rsplit(".", 1)
    allowed = problem.parameter_set[name].range
    return problem.free[name][end == "max"] == (allowed.upper if end == "max" else allowed.lower)


def moved(problem: Posed, name: str, step: float) -> Posed:
    """The problem with one limit changed by a step: a bound, or the right-hand side of a constraint."""
    if name in problem.constraints:
        text = problem.constraints[name]
        limit = split_limit(text)
        if limit and not limit.behind:  # the number on the right
            text = limit.replace_number(repr(limit.value + step))
        else:
            left, sign, right = written_sides(text)
            text = f"({left}) {sign} ({right}) {'+' if step > 0 else '-'} {abs(step)!r}"
        return replace(problem.problem, constraints={**problem.constraints, name: text}).posed
    parameter, end = name.rsplit(".", 1)
    lower, upper = problem.free[parameter]
    ends = (lower, upper + step) if end == "max" else (lower + step, upper)
    return replace(problem.problem, free={**problem.free, parameter: ends}).posed


def _unresolved(solution: Solution, name: str) -> Lever:
    """The lever of a bound or a constraint, to first order."""
    problem = solution.problem.posed
    gained, worth = common_unit(problem, problem.goal) if problem.goal else Unit(), solution.active[name]
    if name in problem.constraints:
        condition, shown = problem.conditions[name], limit_text(problem, name)
        sides = [abs(float(side)) for side in condition.sides(problem.values(solution.parameters))]
        size = max(filter(math.isfinite, sides), default=1.0)  # they are equal but for rounding
        natural = natural_step(unit_of(problem, name), dimension_of(problem, name).unit, size)
        sign, words = condition.sign, f"relaxing {name} ({shown}) by {natural.text}"
        if condition.equality:  # the right-hand side moves to where the objective is better
            sign = math.copysign(1.0, -problem.sign * worth)
            words = f"moving {name} ({shown}) by {'' if sign > 0 else '-'}{natural.text}"
        return Lever(name, "constraint", shown, False, words, sign * natural.size, abs(worth), gained=gained)
    parameter, end = problem.parameter_set[name.rsplit(".", 1)[0]], name.endswith(".max")
    limit, width = problem.free[parameter.name][end], float(np.ptp(problem.free[parameter.name]))
    # an angle is measured by its box, for 0 is a tilt like any other
    size = width if parameter.unit == "rad" or not limit else min(abs(limit), width)
    unit, direction = unit_of(problem, parameter.name), 1.0 if end else -1.0
    step = step_within(unit, parameter.unit, size, limit, direction, parameter.range)
    words = f"{step.text if step else 'nothing'} {'more' if end else 'less'} {name}"
    change, shown = direction * step.size if step else 0.0, unit.show(limit, 10)
    return Lever(name, "bound", shown, is_physical(problem, name), words, change, abs(worth), gained=gained)


def _solved_again(solution: Solution, problem: Posed, starts: int, look: bool) -> Solution:
    """The solution of a moved problem from the optimum; `look`: also for better designs in the whole box."""
    options = replace(DEFAULTS, starts=starts, near={n: solution.parameters[n] for n in problem.free})
    return solve_any_status(problem, options, without_sample=not look, bound=False)


def _lets_in(solution: Solution, found: Sequence[Lever]) -> bool:
    """Whether a better design than the optimum leads to is let in elsewhere where all limits are moved at once."""
    problem = solution.problem.posed
    for lever in found:
        with suppress(InputError):
            problem = moved(problem, lever.name, lever.step)
    near, whole = (_solved_again(solution, problem, 1, look) for look in (False, True))
    return near.status != "optimal" or problem.sign * (near.value - whole.value) > _NOISE * (1 + abs(solution.value))


def _resolved(solution: Solution, lever: Lever, look: bool) -> Lever:
    """A lever with the gain found by solving again from the optimum."""
    try:
        problem = moved(solution.problem.posed, lever.name, lever.step)
    except InputError:
        return replace(lever, reason="the moved problem cannot be written down")
    best = None
    for starts in (1, _RETRY):
        ended = _solved_again(solution, problem, starts, look or starts > 1)
        if ended.status == "optimal" and not (best and problem.sign * (ended.value - best.value) >= 0):
            best = ended
            gain = -problem.sign * (best.value - solution.value)
            lever = replace(lever, resolved=gain, structure=best.structure)
            if abs(lever.relative) <= DIFFERS:
                return lever
    if best is None:
        return replace(lever, reason=f"the moved problem is {ended.status.replace('_', ' ')}")
    return replace(lever, reason=", ".join(_reasons(solution, best)))


def _reasons(solution: Solution, found: Solution) -> Iterator[str]:
    """Why the gain is not what the multiplier says."""
    if found.structure != solution.structure:
        yield f"the structure changes from {solution.structure} to {found.structure}"
    for words, names, others in (
        ("no longer binds", solution.active, found.active),
        ("binds instead", found.active, solution.active),
    ):
        if gone := [n for n in names if n not in others]:
            yield f"{' and '.join(gone)} {words}"
    if found.structure == solution.structure and set(found.active) == set(solution.active):
        yield f"the gain is not linear over this step ({found.structure} before and after)"
