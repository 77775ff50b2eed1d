"""Numbers and columns as text."""

from collections.abc import Collection, Sequence

from tmsopt.models import Model
from tmsopt.problem.unit_system import Unit

WIDTH, HEIGHT = 100, 30
"""Columns of every line; lines of a report, if not full."""

_ALL = 12  # digits


def model_lines(model: Model) -> list[str]:
    """What a model leaves out, in one line; none where nothing need be said."""
    return [f"model: {model.omits}"] if model.omits else []


def number(value: float, error: float = 0.0) -> str:
    """Twelve digits, fewer where its error leaves no more; see `Unit.number`."""
    return Unit().number(value, _ALL, error)


def yes_no(value: bool | None) -> str:
    """In a table; empty where it is not known."""
    return "" if value is None else "yes" if value else "no"


def screen(rows: Sequence[Sequence[str]], height: int, keep: Collection[int] = (), more: str = "--full") -> list[str]:
    """Rows as lines that fit a screen: at most so many besides the head, 100 columns; what is left out is counted.

    Args:
        keep: numbers of rows that stay; the others are thinned evenly.
        more: where all of them are.
    """
    head, *body = rows
    chosen = range(len(body))
    if len(body) > height:
        spread = {round(k * (len(body) - 1) / max(height - len(keep) - 2, 1)) for k in range(height - len(keep) - 1)}
        chosen = sorted({*keep, *spread})[: height - 1]  # type: ignore[assignment]
    shown = [head, *(body[k] for k in chosen)]
    most = len(head)
    while most > 1 and len(max(columns([row[:most] for row in shown]), key=len).rstrip()) > WIDTH:
        most -= 1
    left = [f"{len(body) - len(chosen)} more rows"] if len(chosen) < len(body) else []
    left += [f"more columns: {', '.join(h for h in head[most:] if h)}"] if most < len(head) else []
    return columns([row[:most] for row in shown]) + ([f"  … {'; '.join(left)} ({more})"[:WIDTH]] if left else [])


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of cells as lines, each column as wide as its widest cell."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
