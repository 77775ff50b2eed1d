"""Tables for the pages of several results: the question, and records."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from typing import Any, TypeVar

import numpy as np

from tmsopt.documents.blocks import Cell, Chapter, Listing, Parts, Row, TableBlock, format_bool
from tmsopt.guide import describe
from tmsopt.problem import Posed, unit_at
from tmsopt.records import Numbers

T = TypeVar("T")

MAX_ROWS = 2000
"""Maximum number of rows of a table on a page."""
_DIGITS = 6


def write_question(problem: Posed) -> Parts:
    """Write the question: parameters with values, ranges and meaning, the objective and the limits."""
    described = describe(problem)
    symbols = [w for parameter_set in described.sets for w in parameter_set.parameters]
    head = ("parameter", "value or range", "", "possible", "meaning")
    yield Chapter("parameters", width="wide")
    rows = [(w.name, w.given, "free" if w.name in problem.free else "fixed", w.range, w.meaning) for w in symbols]
    yield TableBlock((head, *rows), "Parameters, with values and ranges")
    yield Listing(
        tuple((part, "; ".join(f"{n}: {text}" for n, text in keys.items())) for part, keys in described.asked.items())
    )


def list_headings(problem: Posed, names: Iterable[str]) -> list[str]:
    """List the headings of columns with their units. A design of ones is enough, because it cannot change the units."""
    ones = dict.fromkeys(problem.parameter_set.names, 1.0)
    return [f"{n} {unit_at(problem, n, ones).text}".rstrip() for n in names]


def list_numbers(
    problem: Posed, names: Iterable[str], values: Numbers, design: Numbers, digits: int
) -> list[Cell | str]:
    """List numbers of a design in the units of their headings; a missing number is an empty text."""
    return [Cell(values[n], unit_at(problem, n, design), digits) if n in values else "" for n in names]


def remove_empty_columns(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of a table without the columns that have a heading and nothing below it."""
    columns = [column for column in zip(*rows, strict=True) if any(map(str, column[1:])) or len(rows) == 1]
    return list(zip(*columns, strict=True))


def tabulate_records(result: Any) -> Parts:
    """Tabulate the records of a result, in rad and SI."""
    records: list[Mapping[str, Any]] = [*islice(result.records(), MAX_ROWS + 1)]
    heads = tuple(records[0]) if records else ("",)
    rows = [tuple(format_value(record.get(n, "")) for n in heads) for record in records[:MAX_ROWS]]
    yield Chapter("rows", width="whole")
    if len(records) > MAX_ROWS:
        yield f"the table shows the first {MAX_ROWS} rows."
    yield TableBlock((heads, *rows), type(result).__name__)


def thin_rows(rows: Sequence[T], noun: str, advice: str, kept_rows: Iterable[int] = ()) -> tuple[list[T], list[str]]:
    """Choose about `MAX_ROWS` rows, spread evenly. Return them, and a sentence that says so if rows are left out.

    Args:
        noun: what the rows are, in the plural.
        advice: how to get all rows, for the sentence.
        kept_rows: indices of rows that must be chosen.
    """
    if len(rows) <= MAX_ROWS:
        return [*rows], []
    chosen = {*np.linspace(0, len(rows) - 1, MAX_ROWS).astype(int).tolist(), *kept_rows}
    thinned = [rows[k] for k in sorted(chosen)]
    return thinned, [f"{len(thinned)} of {len(rows)} {noun}, spread evenly; {advice}."]


def format_value(value: Any) -> str:
    """Write a value of a record as the cell of a table."""
    match value:
        case None | bool():
            return format_bool(value)
        case float():
            return f"{value + 0.0:.{_DIGITS}g}" if math.isfinite(value) else "none"
    return str(value)
