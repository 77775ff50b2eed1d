"""Readings: numbers in mm, km/h and degrees, and the decay times and frequencies of roots."""

import math
from collections.abc import Iterable, Iterator
from typing import Any

from tmsopt.models import ParameterSet
from tmsopt.records import AnyNumbers

Reading = float | tuple[float, ...]
"""A number, or one number for each root; nan if undefined."""

_READING_UNITS = {"m": ("mm", 1000, 1), "m/s": ("km/h", 18, 5), "rad": ("deg", 180, None)}
"""SI unit → unit of the reading, factor and divisor; the divisor None means π."""

_UNCONVERTED = ("decay_rate", "decay_time", "frequency")
"""Quantities that are not converted, because they already are in 1/s, s and Hz."""

READING_DIGITS = 15
"""Digits of a converted reading; rounding to them makes 15 km/h read as 15 again."""


def convert_exactly(value: Any, unit: str, pi: Any = math.pi) -> tuple[Any, str, int]:
    """Convert an SI number of any kind to mm, km/h or degrees; other units stay.

    Returns:
        The number, its unit, and the decimal digits to round it to: 0 if it was not converted.
    """
    if unit not in _READING_UNITS:
        return value, unit, 0
    name, factor, divisor = _READING_UNITS[unit]
    return value * factor / (divisor or pi), name, READING_DIGITS


def decay_time(abscissa: Any, rate: Any) -> Any:
    """Seconds in which the slowest part of a disturbance decays to 1/e; nan if it does not decay.

    Args:
        abscissa: largest real part of the roots, dimensionless.
        rate: `ParameterSet.rate`, the value in 1/s of a dimensionless rate of 1.
    """
    return 1 / (-abscissa * rate) if abscissa < 0 else math.nan


def frequencies(roots: Iterable[Any], rate: Any, pi: Any = math.pi) -> tuple[Any, ...]:
    """Frequency in Hz of each distinct complex pair of roots, in the order of the roots."""
    return tuple(root.im * rate / (2 * pi) for root in roots if root.im > 0)


def readings(
    parameter_set: ParameterSet,
    parameters: AnyNumbers,
    quantities: AnyNumbers,
    abscissa: Any,
    roots: Iterable[Any],
    pi: Any = math.pi,
) -> Iterator[tuple[str, Any, int]]:
    """Times, frequencies, and all numbers with a unit; nothing for a set of parameters that does not define seconds.

    Yields:
        A name that ends with the unit (``v_kmh``, ``x_B_mm``), a number of any kind, and the decimal digits to round it
        to; 0 for a number that is not rounded.
    """
    if parameter_set.rate is None:
        return
    rate = parameter_set.rate(parameters)
    yield "decay_time_s", decay_time(abscissa, rate), 0
    yield "growth_time_s", decay_time(-abscissa, rate), 0
    yield "frequencies_Hz", frequencies(roots, rate, pi), 0
    units = {p.name: p.unit for p in parameter_set.parameters}
    units |= {q.name: q.unit for q in parameter_set.quantities if q.name not in _UNCONVERTED}
    for name in (n for n, unit in units.items() if unit != "1"):
        value = parameters[name] if name in parameters else quantities[name]
        reading, unit, digits = convert_exactly(value, units[name], pi)
        yield f"{name}_{''.join(filter(str.isalnum, unit))}", reading, digits
