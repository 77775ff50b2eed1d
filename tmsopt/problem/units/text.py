"""Parses a text such as "40 cm", "1/3 m" or "8/3" as a number in the unit of its parameter."""

import math
import re
from collections.abc import Mapping
from fractions import Fraction
from functools import cache
from typing import Any

from tmsopt.models.exact import Exact, constant
from tmsopt.models.tables import read_table
from tmsopt.records import Numbers

MAX_LENGTH = 80
"""Greatest number of characters of a number with its unit."""

_LARGEST_DENOMINATOR = 10**6  # greatest denominator of an exact factor between two units, such as 5/18
_ROUNDING = 4e-16  # relative error of a factor in double precision
_DECIMAL = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"(?P<number>(?>{_DECIMAL}|pi\b|[a-z]+\(|[-+](?!\s*[-+])|[*/()\s])*+)(?P<unit>.*)", re.A | re.S)
_POWER = r"(?: ?(?:\*\*|\^) ?-?\d)?"
_UNIT = re.compile(rf"[A-Za-zµμ°%]+{_POWER}(?:(?: ?[*/] ?| )[A-Za-zµμ°%]+{_POWER})*", re.ASCII)
"""Names with one-digit powers, joined by * / or one blank. Matching is fast: a text matches in only one way."""

_TWO_PARAMETERS = "write its parts as two parameters, kr + 1j*ki in H"

_UNITS = read_table("units")
COMMON_UNITS: Mapping[str, Numbers] = _UNITS["usual"]
"""Unit → another common unit → factor to the first unit. For these units pint is not loaded."""


def parse_quantity(text: str, unit: str) -> float:
    """The number in `unit` that a text with a unit means.

    Raises:
        ValueError: with the text found and what is accepted.
    """
    number, _, _ = parse_exact_quantity(text, unit)
    return number


def _is_complex(text: str) -> bool:
    try:
        return complex(text.replace(" ", "")).imag != 0
    except ValueError:
        return False


def parse_exact_quantity(text: str, unit: str) -> tuple[float, str, Exact | None]:  # noqa: PLR0912 - a branch for each fault
    """The number in `unit`, the typed unit, and the exact number (None if the factor of the units is not exact).

    Raises:
        ValueError: with the text found and what is accepted.
    """
    accepted = f"accepted: {_UNITS['examples'].get(unit, unit)}"
    if unit != "1":
        accepted += f", or a number without quotes in {unit}"
    if len(text) > MAX_LENGTH:
        raise ValueError(f"found '{text[:MAX_LENGTH]}…', {len(text)} characters; write up to {MAX_LENGTH}; {accepted}")
    if _is_complex(text):
        raise ValueError(f"found '{text}', a complex number, but parameters are real; {_TWO_PARAMETERS}")
    parts = _QUANTITY.fullmatch(text.strip())
    assert parts  # any text matches: either part may be empty
    number, typed_unit = parts["number"].strip(), parts["unit"]
    if not number:
        raise ValueError(f"found '{text}', not a number{'' if unit == '1' else ' with a unit'}; {accepted}")
    try:
        exact_number = constant(number)
    except ValueError as error:
        raise ValueError(f"found '{text}', no number: {str(error).partition('; accepted')[0]}; {accepted}") from None
    if not typed_unit and unit != "1":
        raise ValueError(f"found '{text}', a number in quotes without a unit; {accepted}")
    if not typed_unit:
        return float(exact_number), "", exact_number
    if unit == "1":
        raise ValueError(f"found '{text}', but the parameter is dimensionless; {accepted}")
    typed_unit = " ".join(typed_unit.replace("²", "^2").replace("³", "^3").replace("·", "*").split())
    if not _UNIT.fullmatch(typed_unit):
        raise ValueError(f"found the unit '{typed_unit}', which does not read as a unit; {accepted}")
    factor = _known_factor(typed_unit.replace("°", "deg"), unit)
    if factor is None:
        raise ValueError(f"found the unit '{typed_unit}', which is not known or not a unit of {unit}; {accepted}")
    exact_factor, exact = _exact_factor(factor), None
    if exact_factor is not None:
        exact = exact_number.times(exact_factor)
        value = float(exact)  # correctly rounded: 70 cm is 0.7 m
    else:  # an angle
        value = float(exact_number) * factor
        if factor == COMMON_UNITS["rad"]["deg"]:
            exact = exact_number.to_radians()
    if not math.isfinite(value) or (value == 0) != (float(exact_number) == 0):
        raise ValueError(f"found '{text}', a number beyond double precision; {accepted}")
    return value, typed_unit, exact


def unit_factor(typed_unit: str, unit: str) -> float:
    """The factor from a valid unit to `unit`; the nearest double if it is a fraction."""
    factor = _known_factor(typed_unit.replace("°", "deg"), unit)
    assert factor is not None, typed_unit
    return float(_exact_factor(factor) or factor)


def _exact_factor(factor: float) -> Fraction | None:
    """The fraction that a factor is up to rounding; None for an irrational factor."""
    fraction = Fraction(factor).limit_denominator(_LARGEST_DENOMINATOR)
    return None if abs(fraction - Fraction(factor)) > _ROUNDING * fraction else fraction


@cache
def _known_factor(typed_unit: str, unit: str) -> float | None:
    """The factor from a typed unit to `unit`; None if they do not match."""
    return COMMON_UNITS.get(unit, {}).get(typed_unit) or pint_factor(typed_unit, unit)


def pint_factor(typed_unit: str, unit: str) -> float | None:
    """The factor from a unit that pint knows to `unit`; None if they do not match."""
    registry = _registry()
    try:
        # Angles have no dimension in pint, so their powers are compared by name.
        pint_unit = registry.parse_units(typed_unit)
        powers = dict(registry.Quantity(1.0, pint_unit).to_base_units().unit_items())
        if powers.get("radian", 0) != {"rad": 1}.get(unit, -int(unit.endswith("/rad"))):
            return None
        quantity = registry.Quantity(2.0, pint_unit).to(unit)
        offset = registry.Quantity(0.0, pint_unit).to(unit)
    except Exception:  # pint raises AssertionError, tokenizer and attribute errors on malformed text
        return None
    return float(quantity.magnitude) / 2 if offset.magnitude == 0 else None


@cache
def _registry() -> Any:
    import pint  # this takes a third of a second, so it is done for uncommon units only

    return pint.UnitRegistry()
