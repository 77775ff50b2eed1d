"""Tables that pages of several results have: what was asked, and records as they are."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from typing import Any, TypeVar

import numpy as np

from tmsopt.documents.blocks import Cell, Chapter, Listing, Parts, TableBlock, say_whether
from tmsopt.guide import describe
from tmsopt.problem import Posed, unit_at
from tmsopt.records import Numbers

T = TypeVar("T")

MOST = 2000
"""Rows of a table on a page."""
_DIGITS = 6


def write_question(problem: Posed) -> Parts:
    """The question: parameters, values and ranges with their meaning, objective and limits."""
    described = describe(problem)
    given = [w for of in described.sets for w in of.parameters]
    head = ("parameter", "value or range", "", "possible", "meaning")
    yield Chapter("parameters", width="wide")
    rows = [(w.name, w.given, "free" if w.name in problem.free else "fixed", w.range, w.meaning) for w in given]
    yield TableBlock((head, *rows), "Parameters, with values and ranges")
    yield Listing(
        tuple((part, "; ".join(f"{n}: {text}" for n, text in keys.items())) for part, keys in described.asked.items())
    )


def head_numbers(problem: Posed, names: Iterable[str]) -> list[str]:
    """Headings of columns of numbers: a unit has one name for all designs."""
    some = dict.fromkeys(problem.parameter_set.names, 1.0)
    return [f"{n} {unit_at(problem, n, some).text}".rstrip() for n in names]


def list_numbers(
    problem: Posed, names: Iterable[str], values: Numbers, design: Numbers, digits: int
) -> list[Cell | str]:
    """Numbers of a design, each in the unit that stands in its heading; empty for one that is not there."""
    return [Cell(values[n], unit_at(problem, n, design), digits) if n in values else "" for n in names]


def tabulate_records(result: Any) -> Parts:
    """Records of a result as they are, numbers in rad and SI."""
    records: list[Mapping[str, Any]] = [*islice(result.records(), MOST + 1)]
    heads = tuple(records[0]) if records else ("",)
    rows = [tuple(format_value(record.get(n, "")) for n in heads) for record in records[:MOST]]
    yield Chapter("rows", width="whole")
    if len(records) > MOST:
        yield f"the first {MOST} rows."
    yield TableBlock((heads, *rows), type(result).__name__)


def thin_rows(rows: Sequence[T], name: str, whole: str, keep: Iterable[int] = ()) -> tuple[list[T], list[str]]:
    """At most `MOST` rows, spread evenly, and a sentence that says so where some are left out.

    Args:
        whole: where all of them are.
        keep: numbers of rows that stay.
    """
    if len(rows) <= MOST:
        return [*rows], []
    chosen = {*np.linspace(0, len(rows) - 1, MOST).astype(int).tolist(), *keep}
    kept = [rows[k] for k in sorted(chosen)]
    return kept, [f"{len(kept)} of {len(rows)} {name}, spread evenly; {whole}."]


def format_value(value: Any) -> str:
    """A value of a record as the cell of a table."""
    match value:
        case None | bool():
            return say_whether(value)
        case float():
            return f"{value + 0.0:.{_DIGITS}g}" if math.isfinite(value) else "none"
    return str(value)
