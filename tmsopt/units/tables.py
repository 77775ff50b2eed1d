"""The tables of a problem, in which any number may be a text with a unit."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import is_dataclass, replace
from typing import Any

from tmsopt.errors import Fault
from tmsopt.models import ParameterSet
from tmsopt.units.text import LONGEST, read

TABLES = ("free", "fixed", "start", "scenarios", "tolerances", "weights")
"""Tables of a problem that hold numbers; a unit that is typed first stands."""


def numbers(tables: Mapping[str, Any], of: ParameterSet) -> tuple[dict[str, Any], dict[str, str], list[Fault]]:
    """The tables of a problem with texts such as "25 cm" as numbers, the units that were typed, and what is wrong.

    Args:
        tables: those of `TABLES`, of numbers and texts.
    """
    units: dict[str, str] = {}
    faults: list[Fault] = []

    def number(value: Any, table: str, name: str, *end: str) -> Any:
        if not isinstance(value, str) or name not in of.names:
            return value
        unit = of[name].unit
        sizes = table in ("tolerances", "weights")
        if unit == "1" and sizes:
            unit = of[name].multiple_of or unit  # a tolerance of 5 mm is one of 0.005 wheelbases of 1 m
        try:
            found, written = read(value, unit)
        except ValueError as error:
            faults.append(Fault(f"{error}{_meant(value)}", (table, name, *end)))
            return value
        if not sizes:
            units.setdefault(name, written)
        return found

    def read_table(table: str, key: str) -> Iterator[tuple[str, Any]]:
        for name, value in tables[table].items():
            if is_dataclass(value) and not isinstance(value, type):  # a band
                ends = {end: number(getattr(value, end), key, name, end) for end in ("min", "max")}
                yield name, replace(value, **ends)
            elif table == "free" and isinstance(value, Sequence) and not isinstance(value, str) and len(value) == 2:
                yield name, tuple(number(x, key, name, end) for x, end in zip(value, ("min", "max"), strict=True))
            elif table == "scenarios" and isinstance(value, Sequence) and not isinstance(value, str):
                yield name, tuple(number(x, key, name) for x in value)
            else:
                yield name, number(value, key, name, *(["start"] if table == "start" else []))

    keys = dict.fromkeys(("fixed", "free", "start"), "parameters")
    found = {t: dict(read_table(t, keys.get(t, t))) if isinstance(tables[t], Mapping) else tables[t] for t in TABLES}
    return found, units, faults


def _meant(text: str) -> str:
    """The end of a sentence that says what to write for a text that is refused; empty where that is not known."""
    if len(text) > LONGEST:
        return ""
    if comma := re.fullmatch(r"\s*([+-]?\d+),(\d+.*)", text):
        return f'; write a decimal point: "{comma[1]}.{comma[2]}"'
    if share := re.fullmatch(r"\s*([+-]?\d+\.?\d*)\s*%\s*", text):
        return f"; write {float(share[1]) / 100:.12g} for {share[1]} %"
    return ""
