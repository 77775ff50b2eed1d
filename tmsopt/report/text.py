"""Numbers and columns as text."""

import math
from collections.abc import Sequence

from tmsopt.models import ParameterSet


def number(value: float) -> str:
    """Twelve digits, or ``none`` for a number that does not exist; no −0."""
    return f"{value + 0.0:.12g}" if math.isfinite(value) else "none"


def yes_no(value: bool | None) -> str:
    """In a table; empty where it is not known."""
    return "" if value is None else "yes" if value else "no"


def with_unit(of: ParameterSet, name: str) -> str:
    """A parameter with the unit of its numbers, e.g. ``v m/s``."""
    unit = of[name].unit
    return name if unit == "1" else f"{name} {unit}"


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of cells as lines, each column as wide as its widest cell."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
