"""Steps in the unit that a reader thinks in: 1 deg of tilt, 10 mm of length, 1 km/h of speed."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from tmsopt.design.expression import Expression
from tmsopt.design.problem import Problem
from tmsopt.models import Range

_PART = 0.01  # of a number without a natural unit
_SMALLEST = 1e-9  # of the natural step: closer to the physical end a limit has nowhere to go
_TINY = 1e-9  # a limit so small has no size of its own
_LARGEST = {"rad": 0.2, "m": 0.05, "m/s": 0.2}
"""Largest natural step as a part of the size of what is moved."""

_NATURAL = {"rad": ("deg", math.pi / 180, 1.0), "m": ("mm", 1e-3, 10.0), "m/s": ("km/h", 1 / 3.6, 1.0)}
"""Unit of the parameter → unit of the step, what one of those is, and the natural step in it."""

_REPORTED = {"rad": ("deg", math.pi / 180)}
"""Unit of the parameter → unit in which it is reported, and what one of those is; others are reported as they are."""


@dataclass(frozen=True)
class LimitStep:
    """A change of a limit.

    Attributes:
        size: in the unit of the parameter, positive.
        text: in the unit a reader thinks in, e.g. ``1 deg``.
    """

    size: float
    text: str


def natural_step(unit: str, size: float) -> LimitStep:
    """The natural step for something of a unit and a size, e.g. the limit or the width of its box."""
    return next(_steps(unit, size))


def step_within(unit: str, size: float, limit: float, direction: float, allowed: Range) -> LimitStep | None:
    """The largest natural step that keeps a moved limit physically possible; None at a physical end."""
    return next((step for step in _steps(unit, size) if limit + direction * step.size in allowed), None)


def with_reported_unit(value: float, unit: str, digits: int = 10) -> str:
    """A number in the unit in which it is reported, e.g. ``30 deg``."""
    name, one = reported_unit(unit)
    text = f"{value / one:.{digits}g}"
    return text if name == "1" else f"{text} {name}"


def reported_unit(unit: str) -> tuple[str, float]:
    """The unit in which a parameter is reported, and what one of those is in the parameter's own."""
    return _REPORTED.get(unit, (unit, 1.0))


def unit_of(problem: Problem, expression: Expression) -> str:
    """The unit of both sides of a constraint, where sums of names of one unit show it; else ``1``."""
    units = {p.name: p.unit for p in problem.parameter_set.parameters}
    units |= {q.name: q.unit for q in (*problem.model.quantities, *problem.parameter_set.quantities)}
    found = {units.get(name, "1") for name in expression.names}
    product = re.search(r"[*/(]", expression.text)
    return found.pop() if len(found) == 1 and not product else "1"


def _steps(unit: str, size: float) -> Iterator[LimitStep]:
    """Ever smaller steps, from the natural one down."""
    size = abs(size) if abs(size) > _TINY else 1.0
    name, one, first = _NATURAL.get(unit, (unit, 1.0, 0.0))
    largest = first if unit in _NATURAL else _one_two_five(_PART * size)
    while unit in _NATURAL and largest * one > _LARGEST[unit] * size:
        largest /= 10
    step = largest
    while step >= _SMALLEST * largest:
        yield LimitStep(step * one, f"{step:.4g}" if name == "1" else f"{step:.4g} {name}")
        step = _one_two_five(step / 2.2)


def _one_two_five(x: float) -> float:
    """The number 1, 2 or 5 times a power of ten nearest to x by ratio."""
    decade = math.floor(math.log10(x))
    choices = [k * 10.0**d for d in (decade, decade + 1) for k in (1, 2, 5)]
    nearest = min(choices, key=lambda c: abs(math.log(c / x)))
    return float(f"{nearest:.1g}")
