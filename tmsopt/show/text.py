"""Numbers and columns as text."""

import math
from collections.abc import Sequence


def number(value: float) -> str:
    """Twelve digits, or ``none`` for a number that does not exist."""
    return f"{value:.12g}" if math.isfinite(value) else "none"


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of cells as lines, each column as wide as its widest cell."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
