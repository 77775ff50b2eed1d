"""Steps of limits, in the unit in which a problem is written: 1 deg of tilt, 1 cm of length, 1 km/h of speed."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from tmsopt.models import Range
from tmsopt.problem.unit_system import Unit

_STEP_SHARE = 0.01  # step relative to the size of a number without a natural unit
_MIN_SHARE = 1e-9  # smallest step, relative to the natural step; a limit closer to its physical end cannot move
_ZERO_SIZE = 1e-9  # a smaller limit counts as 0, and then its size is 1
_MAX_SHARES = {"rad": 0.2, "m": 0.05, "m/s": 0.2}
"""Unit → largest natural step, relative to the size of the moved number."""

_NATURAL_STEPS = {"rad": math.pi / 180, "m": 1e-2, "m/s": 1 / 3.6}
"""Unit → natural step."""


@dataclass(frozen=True)
class LimitStep:
    """A change of a limit.

    Attributes:
        size: size of the step, positive, in the unit in which the parameter is stored.
        text: the step in the unit in which the problem is written, e.g. ``1 deg``.
    """

    size: float
    text: str


def natural_step(unit: Unit, stored_unit: str, size: float) -> LimitStep:
    """The natural step of a limit.

    Args:
        unit: the unit in which the problem is written.
        stored_unit: the unit in which the number is stored.
        size: a typical size of the number, such as the limit or the width of its range.
    """
    return next(_list_steps(unit, stored_unit, size))


def step_within(
    unit: Unit, stored_unit: str, size: float, limit: float, direction: float, physical_range: Range
) -> LimitStep | None:
    """The largest natural step that keeps the moved limit physical; None at a physical end."""
    return next(
        (step for step in _list_steps(unit, stored_unit, size) if limit + direction * step.size in physical_range), None
    )


def _list_steps(unit: Unit, stored_unit: str, size: float) -> Iterator[LimitStep]:
    """The natural step, and then smaller and smaller steps."""
    size = abs(size) if abs(size) > _ZERO_SIZE else 1.0
    largest_step = _round_to_1_2_5(_NATURAL_STEPS.get(stored_unit, _STEP_SHARE * size) / unit.factor)
    while stored_unit in _NATURAL_STEPS and largest_step * unit.factor > _MAX_SHARES[stored_unit] * size:
        largest_step /= 10
    step = largest_step
    while step >= _MIN_SHARE * largest_step:
        yield LimitStep(step * unit.factor, unit.show(step * unit.factor, 4))
        step = _round_to_1_2_5(step / 2.2)


def _round_to_1_2_5(x: float) -> float:
    """The number 1, 2 or 5 times a power of ten whose ratio to x is nearest to 1."""
    decade = math.floor(math.log10(x))
    choices = [k * 10.0**d for d in (decade, decade + 1) for k in (1, 2, 5)]
    nearest_choice = min(choices, key=lambda c: abs(math.log(c / x)))
    return float(f"{nearest_choice:.1g}")
