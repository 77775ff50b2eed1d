"""Reads the tables of a problem, in which any number may be a text with a unit."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import is_dataclass, replace
from fractions import Fraction
from typing import Any

from tmsopt.errors import Fault
from tmsopt.models import ParameterSet, decimal
from tmsopt.models.exact import Exact
from tmsopt.problem.units.text import MAX_LENGTH, parse_exact_quantity
from tmsopt.records import AnyNumbers

TABLES = ("free", "fixed", "start", "scenarios", "tolerances", "weights")
"""Tables of a problem that contain numbers. A parameter has the first unit that was typed for it, in this order."""

TypedNumbers = dict[str, dict[float, str]]
"""Parameter → double → the exact number that was typed, if the decimal of the double differs from it."""


def read_numbers(
    tables: AnyNumbers, parameter_set: ParameterSet
) -> tuple[dict[str, Any], dict[str, str], TypedNumbers, list[Fault]]:
    """Convert texts such as "25 cm" in the tables of a problem to numbers.

    Args:
        tables: the tables named in `TABLES`, of numbers and texts.

    Returns:
        The tables with numbers only, parameter → typed unit, the exact numbers that were typed, and the faults.
    """
    units: dict[str, str] = {}
    typed: TypedNumbers = {}
    faults: list[Fault] = []

    def number(value: Any, table: str, name: str, *end: str) -> Any:
        if name not in parameter_set.names or not isinstance(value, str | Fraction | int) or isinstance(value, bool):
            return value
        is_size, unit = table in ("tolerances", "weights"), parameter_set[name].unit
        if unit == "1" and is_size:
            unit = parameter_set[name].multiple_of or unit  # 5 mm is 0.005 of a wheelbase of 1 m
        try:
            result: Any
            if isinstance(value, str):
                result, typed_unit, exact = parse_exact_quantity(value, unit)
            else:
                result, typed_unit, exact = value, "", Exact.from_fraction(Fraction(value))
            if not is_size and exact and exact.fraction != decimal(float(result)):
                typed.setdefault(name, {})[float(result)] = str(exact)
        except OverflowError:  # an integer too large for a double
            return value
        except ValueError as error:
            faults.append(Fault(f"{error}{_suggest_text(value)}", (table, name, *end)))
            return value
        if typed_unit and not is_size:
            units.setdefault(name, typed_unit)
        return result

    def read_table(table: str, key: str) -> Iterator[tuple[str, Any]]:
        for name, value in tables[table].items():
            is_list = isinstance(value, Sequence) and not isinstance(value, str)
            if is_dataclass(value) and not isinstance(value, type):  # a band
                ends = {end: number(getattr(value, end), key, name, end) for end in ("min", "max")}
                yield name, replace(value, **ends)
            elif table == "free" and is_list and len(value) == 2:
                yield name, tuple(number(x, key, name, end) for x, end in zip(value, ("min", "max"), strict=True))
            elif table == "scenarios" and is_list:
                yield name, tuple(number(x, key, name) for x in value)
            else:
                yield name, number(value, key, name, *(["start"] if table == "start" else []))

    keys = dict.fromkeys(("fixed", "free", "start"), "parameters")
    results = {t: dict(read_table(t, keys.get(t, t))) if isinstance(tables[t], Mapping) else tables[t] for t in TABLES}
    return results, units, typed, faults


def _suggest_text(text: object) -> str:
    """The end of an error message that says what to write; empty without a suggestion."""
    if not isinstance(text, str) or len(text) > MAX_LENGTH:
        return ""
    if comma := re.fullmatch(r"\s*([+-]?\d+),(\d+.*)", text):
        return f'; write a decimal point: "{comma[1]}.{comma[2]}"'
    if percent := re.fullmatch(r"\s*([+-]?\d+\.?\d*)\s*%\s*", text):
        share = f"{percent[1]} %"
        return f"; for {share}, write {float(percent[1]) / 100:.12g}; for {share} of a value, write the amount"
    return ""
