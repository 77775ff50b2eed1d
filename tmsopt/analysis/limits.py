"""Computes the value of each active limit: its multiplier, which is checked by moving the limit and solving again."""

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
from tmsopt.progress import ReportCount
from tmsopt.records import plain
from tmsopt.search.solve import solve_any_status

_MAX_DIFFERENCE = 0.2
"""Relative difference between predicted and resolved gain above which the report gives a reason."""

_RETRY_STARTS = 8  # starts of the second search, after a first search from the optimum that gives a different gain
_NOISE = 1e-8  # largest difference of two objectives, relative to 1 + |objective|, that is not significant


@dataclass(frozen=True)
class Lever:
    """An active limit and the gain from moving it. A gain is positive where the objective improves.

    Attributes:
        name: name of the constraint, or a bound such as ``Fr.max``.
        kind: ``bound`` or ``constraint``.
        limit: the limit, in the unit in which the problem is written.
        physical: whether the limit is a physical end, such as 0 for a mass, and cannot be moved.
        move: the change of the limit in words, e.g. ``raising lambda_s.max by 1 deg``.
        step: signed change of the limit in the unit of the parameter; 0 if the limit cannot be moved.
        per_unit: gain per unit of this change, to first order (the multiplier).
        resolved: gain after solving the problem with the moved limit; nan if this was not done or failed.
        structure: structure of the new optimum; empty without a new optimum.
        reason: why the two gains differ, or why there is only one gain.
        gained: unit of the gains.
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
        """First-order gain: multiplier times step."""
        return self.per_unit * abs(self.step)

    @property
    def relative(self) -> float:
        """Resolved gain minus first-order gain, relative to the first-order gain."""
        return (self.resolved - self.predicted) / self.predicted if self.predicted else math.nan

    @property
    def sentence(self) -> str:
        """The lever in words."""
        if not self.step:
            return f"{self.name} = {self.limit} is active and cannot be moved: it is a physical limit"
        is_resolved = math.isfinite(self.resolved)
        predicted = self.gained.show(self.predicted, 3)
        gain = self.gained.show(self.resolved, 3) if is_resolved else predicted
        verb = "worsens" if gain.startswith("-") else "improves"
        order = f"first-order estimate {predicted}" if is_resolved else "first-order estimate"
        return f"{self.move} {verb} the objective by {gain.lstrip('-')} ({order})" + (
            f"; {self.reason}" if self.reason else ""
        )

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


def find_levers(solution: Solution, resolve: bool = True, progress: ReportCount | None = None) -> tuple[Lever, ...]:
    """One lever for each active limit of an optimum; the most valuable lever comes first."""
    if solution.status != "optimal":
        return ()
    levers = [_first_order_lever(solution, name) for name in solution.active]
    with_sample = resolve and (len(levers) == 1 or _has_remote_optimum(solution, levers))
    for k, lever in enumerate(levers):
        levers[k] = _resolve_lever(solution, lever, with_sample) if resolve and lever.step else lever
        if progress:
            progress(k + 1, len(levers))
    return tuple(sorted(levers, key=lambda v: -(v.resolved if math.isfinite(v.resolved) else v.predicted)))


def split_bound(problem: Posed, bound: str) -> tuple[str, bool, float]:
    """The parameter of a bound such as ``mu.min``, whether it is the upper bound, and its value."""
    name, end = bound.rsplit(".", 1)
    return name, end == "max", problem.free[name][end == "max"]


def is_physical(problem: Posed, bound: str) -> bool:
    """Whether a bound such as ``mu.min`` is a physical end of its parameter's range."""
    name, is_upper, value = split_bound(problem, bound)
    physical_range = problem.parameter_set[name].range
    return value == (physical_range.upper if is_upper else physical_range.lower)


def move_limit(problem: Posed, name: str, step: float) -> Posed:
    """The problem with one limit changed by a step: a bound, or the right-hand side of a constraint."""
    if name in problem.constraints:
        text = problem.constraints[name]
        limit = split_limit(text)
        if limit and not limit.text_after:  # the number is the right-hand side
            text = limit.replace_number(repr(limit.value + step))
        else:
            left, sign, right = written_sides(text)
            text = f"({left}) {sign} ({right}) {'+' if step > 0 else '-'} {abs(step)!r}"
        return replace(problem.problem, constraints={**problem.constraints, name: text}).posed
    parameter, end = name.rsplit(".", 1)
    lower, upper = problem.free[parameter]
    ends = (lower, upper + step) if end == "max" else (lower + step, upper)
    return replace(problem.problem, free={**problem.free, parameter: ends}).posed


def _first_order_lever(solution: Solution, name: str) -> Lever:
    """The lever of a bound or a constraint, to first order."""
    problem = solution.problem.posed
    gained, multiplier = common_unit(problem, problem.goal) if problem.goal else Unit(), solution.active[name]
    if name in problem.constraints:
        condition, limit_shown = problem.conditions[name], limit_text(problem, name)
        sides = [abs(float(side)) for side in condition.sides(problem.values(solution.parameters))]
        size = max(filter(math.isfinite, sides), default=1.0)  # the sides are equal within rounding
        constraint_step = natural_step(unit_of(problem, name), dimension_of(problem, name).unit, size)
        sign, move = condition.sign, f"relaxing {name} ({limit_shown}) by {constraint_step.text}"
        if condition.equality:  # the right-hand side moves in the direction that improves the objective
            sign = math.copysign(1.0, -problem.sign * multiplier)
            move = f"moving {name} ({limit_shown}) by {'' if sign > 0 else '-'}{constraint_step.text}"
        return Lever(
            name, "constraint", limit_shown, False, move, sign * constraint_step.size, abs(multiplier), gained=gained
        )
    parameter_name, is_upper, limit = split_bound(problem, name)
    parameter, width = problem.parameter_set[parameter_name], float(np.ptp(problem.free[parameter_name]))
    # the size of an angle is the width of its range, because a tilt of 0 is not special
    size = width if parameter.unit == "rad" or not limit else min(abs(limit), width)
    unit, direction = unit_of(problem, parameter_name), 1.0 if is_upper else -1.0
    step = step_within(unit, parameter.unit, size, limit, direction, parameter.range)
    move = f"{'raising' if is_upper else 'lowering'} {name} by {step.text}" if step else ""
    signed_step, limit_shown = direction * step.size if step else 0.0, unit.show(limit, 10)
    return Lever(
        name, "bound", limit_shown, is_physical(problem, name), move, signed_step, abs(multiplier), gained=gained
    )


def _solve_moved(solution: Solution, problem: Posed, starts: int, with_sample: bool) -> Solution:
    """Solve a problem with moved limits, starting at the optimum; if `with_sample`, also search the whole box."""
    options = replace(DEFAULTS, starts=starts, near={n: solution.parameters[n] for n in problem.free})
    return solve_any_status(problem, options, without_sample=not with_sample, with_bound=False)


def _has_remote_optimum(solution: Solution, levers: Sequence[Lever]) -> bool:
    """Whether, after all limits are moved, a search of the box finds a better design than a search from the optimum."""
    problem = solution.problem.posed
    for lever in levers:
        with suppress(InputError):
            problem = move_limit(problem, lever.name, lever.step)
    near_solution, box_solution = (_solve_moved(solution, problem, 1, with_sample) for with_sample in (False, True))
    return near_solution.status != "optimal" or problem.sign * (near_solution.value - box_solution.value) > _NOISE * (
        1 + abs(solution.value)
    )


def _resolve_lever(solution: Solution, lever: Lever, with_sample: bool) -> Lever:
    """The lever with the gain that is found by moving its limit and solving again from the optimum."""
    try:
        problem = move_limit(solution.problem.posed, lever.name, lever.step)
    except InputError:
        return replace(lever, reason="the problem with this limit moved is not valid")
    best_solution = None
    for starts in (1, _RETRY_STARTS):
        new_solution = _solve_moved(solution, problem, starts, with_sample or starts > 1)
        if new_solution.status == "optimal" and not (
            best_solution and problem.sign * (new_solution.value - best_solution.value) >= 0
        ):
            best_solution = new_solution
            gain = -problem.sign * (best_solution.value - solution.value)
            lever = replace(lever, resolved=gain, structure=best_solution.structure)
            if abs(lever.relative) <= _MAX_DIFFERENCE:
                return lever
    if best_solution is None:
        return replace(lever, reason=f"the problem with this limit moved is {new_solution.status.replace('_', ' ')}")
    return replace(lever, reason=", ".join(_explain_difference(solution, best_solution)))


def _explain_difference(solution: Solution, new_solution: Solution) -> Iterator[str]:
    """Reasons why the gain differs from the prediction of the multiplier."""
    if new_solution.structure != solution.structure:
        yield f"the structure changes from {solution.structure} to {new_solution.structure}"
    for words, names, other_names in (
        ("no longer active", solution.active, new_solution.active),
        ("newly active", new_solution.active, solution.active),
    ):
        if changed := [n for n in names if n not in other_names]:
            yield f"{words}: {' and '.join(changed)}"
    if new_solution.structure == solution.structure and set(new_solution.active) == set(solution.active):
        yield f"the gain is not linear over this step ({new_solution.structure} before and after)"
