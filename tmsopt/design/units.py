"""Text such as "40 cm" or "1 deg" as a number in the parameter's own unit, and back in units that a builder reads."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from functools import cache
from types import MappingProxyType
from typing import Any

from tmsopt.models import ParameterSet

Reading = float | tuple[float, ...]
"""A number, or one for each of several roots; nan where it does not exist."""


_LONGEST = 80
_LARGEST_DENOMINATOR = 10**6  # of a factor between units, such as 5/18
_ROUNDED = 4e-16  # relative error of a factor in double precision
_QUANTITY = re.compile(r"(?P<number>[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)\s*(?P<unit>[^\d\s.+-].*)?", re.ASCII)
_POWER = r"(?:\s*(?:\*\*|\^)\s*-?\d)?"
_UNIT = re.compile(rf"[A-Za-zµμ°%]+{_POWER}(?:\s*[*/ ]\s*[A-Za-zµμ°%]+{_POWER})*", re.ASCII)
"""Names with one-digit powers, joined by * / or a space: anything richer could keep a parser busy for ever."""

_EXAMPLES = {
    "1": "a number", "rad": "'5 deg' or '0.1 rad'", "m": "'40 cm' or '1.2 m'", "kg": "'10 kg' or '500 g'",
    "m/s": "'15 km/h' or '4 m/s'", "m/s^2": "'9.81 m/s^2'",
}  # fmt: skip

_READ_IN = MappingProxyType({"m": ("mm", 1000), "m/s": ("km/h", 18), "rad": ("deg", 180)})


READ_DIGITS = 15
"""Digits of a reading in another unit: what was written as 15 km/h reads 15 again, not what roundings made of it."""


def read_in(value: Any, unit: str, pi: Any = math.pi) -> tuple[Any, str, int]:
    """A number in SI as a builder reads it: in mm, km/h and degrees, others as they are.

    Returns:
        The number, of any kind; its unit; and the decimal digits to round it to, 0 where it is not converted.
    """
    if unit not in _READ_IN:
        return value, unit, 0
    name, factor = _READ_IN[unit]
    return value * factor / {"mm": 1, "km/h": 5, "deg": pi}[name], name, READ_DIGITS


def reading(value: float, unit: str) -> tuple[float, str]:
    """A number in SI as a builder reads it, with its unit, to 15 digits where it is converted."""
    value, unit, digits = read_in(value, unit)
    return float(f"{value:.{digits}g}") if digits else value, unit


def with_unit(text: str, unit: str) -> float:
    """The number that a text with a unit stands for, in `unit`.

    Raises:
        ValueError: saying what was found and what is accepted.
    """
    accepted = f"accepted: {_EXAMPLES.get(unit, unit)}"
    if unit != "1":
        accepted += f", or a number without quotes in {unit}"
    parts = _QUANTITY.fullmatch(text.strip()) if len(text) <= _LONGEST else None
    if parts is None:
        raise ValueError(f"found '{text[:_LONGEST]}', not a number with a unit; {accepted}")
    number, written = float(parts["number"]), parts["unit"]
    if not math.isfinite(number):
        raise ValueError(f"found '{text}', a number beyond double precision; {accepted}")
    if not written:
        raise ValueError(f"found '{text}', a number in quotes without a unit; {accepted}")
    if unit == "1":
        raise ValueError(f"found '{text}', but the parameter is dimensionless; {accepted}")
    written = written.replace("²", "^2").replace("³", "^3")
    if not _UNIT.fullmatch(written):
        raise ValueError(f"found the unit '{written}', which does not read as a unit; {accepted}")
    factor = _factor(written.replace("°", "deg"), unit)
    if factor is None:
        raise ValueError(f"found the unit '{written}', which is not known or not a unit of {unit}; {accepted}")
    if not math.isfinite(number * factor):
        raise ValueError(f"found '{text}', a number beyond double precision; {accepted}")
    share = Fraction(factor).limit_denominator(_LARGEST_DENOMINATOR)
    if abs(share - Fraction(factor)) > _ROUNDED * share:  # an angle
        return number * factor
    return float(Fraction(parts["number"]) * share)  # the double nearest to what is written: 70 cm is 0.7 m


@cache
def _factor(written: str, unit: str) -> float | None:
    """How many `unit` one written unit is, or None where it is not one."""
    registry = _registry()
    try:
        # Angles carry no dimension for pint, so their power is compared by name.
        found = registry.parse_units(written)
        powers = dict(registry.Quantity(1.0, found).to_base_units().unit_items())
        if powers.get("radian", 0) != (unit == "rad"):
            return None
        quantity = registry.Quantity(2.0, found).to(unit)
        offset = registry.Quantity(0.0, found).to(unit)
    except Exception:  # pint raises AssertionError, tokenizer and attribute errors on malformed text
        return None
    return float(quantity.magnitude) / 2 if offset.magnitude == 0 else None


@cache
def _registry() -> Any:
    import pint  # a third of a second, paid only where a unit is written

    return pint.UnitRegistry()


def decay_time(abscissa: Any, rate: Any) -> Any:
    """Seconds in which the slowest part of a disturbance falls to 1/e; nan unless it falls.

    Args:
        abscissa: largest real part of the roots, dimensionless.
        rate: how many 1/s a rate of 1 is (`ParameterSet.rate`).
    """
    return 1 / (-abscissa * rate) if abscissa < 0 else math.nan


def growth_time(abscissa: Any, rate: Any) -> Any:
    """Seconds in which the fastest part of a disturbance grows e-fold; nan unless it grows."""
    return decay_time(-abscissa, rate)


def frequencies(roots: Iterable[Any], rate: Any, pi: Any = math.pi) -> tuple[Any, ...]:
    """Frequency in Hz of each distinct oscillating pair of roots, in the order of the roots."""
    return tuple(root.im * rate / (2 * pi) for root in roots if root.im > 0)


def readings(
    of: ParameterSet, parameters: Mapping[str, Any], quantities: Mapping[str, Any], abscissa: Any, roots: Iterable[Any],
    pi: Any = math.pi,
) -> Iterator[tuple[str, Any, int]]:  # fmt: skip
    """Times, frequencies, and everything with a unit, by names that end in the unit: ``v_kmh``, ``x_B_mm``.

    Numbers of any kind, each with the decimal digits to round it to, 0 for none. Nothing for a set that has no unit of
    time.
    """
    if of.rate is None:
        return
    rate = of.rate(parameters)
    yield "decay_time_s", decay_time(abscissa, rate), 0
    yield "growth_time_s", growth_time(abscissa, rate), 0
    yield "frequencies_Hz", frequencies(roots, rate, pi), 0
    units = {p.name: p.unit for p in of.parameters} | {q.name: q.unit for q in of.quantities}
    for name in (n for n, unit in units.items() if unit != "1"):
        value = parameters[name] if name in parameters else quantities[name]
        read, unit, digits = read_in(value, units[name], pi)
        yield f"{name}_{''.join(filter(str.isalnum, unit))}", read, digits
