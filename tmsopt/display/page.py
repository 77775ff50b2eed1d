"""A result as a fragment of HTML for a notebook: title, badges, a table, the picture, the report.

It has no background and no colour of text of its own, so that it can be read in dark and in light, and needs nothing
from elsewhere.
"""

import base64
import io
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from itertools import islice
from typing import Any

from tmsopt.display.writers import WRITERS, drawn, report, title_of
from tmsopt.models import Parameter
from tmsopt.problem import Posed, unit_of

_ROWS, _COLUMNS = 12, 12  # of a table shown
_BADGE = "border:1px solid currentColor;border-radius:.7em;padding:0 .6em;margin-right:.4em;white-space:nowrap"
_GOOD, _BAD = "rgba(0,158,115,.35)", "rgba(213,94,0,.45)"
_MARKS = {
    "optimal": _GOOD,
    "feasible": _GOOD,
    "proved": _GOOD,
    "stable": _GOOD,
    "strict minimum": _GOOD,
    "proved to be all": _GOOD,
    "infeasible": _BAD,
    "not converged": _BAD,
    "not proved": _BAD,
    "not stable": _BAD,
    "not minimal": _BAD,
}


def page(result: Any) -> str:
    """The whole fragment."""
    name, title, rows = type(result).__name__, title_of(result), _rows(result)
    parts = [
        f"<div><strong>{escape(title or name)}</strong>{f' <small>{name}</small>' if title else ''}</div>",
        f'<div style="margin:.4em 0">{badges(result)}</div>',
        _table(rows),
        _picture(result),
        f"<details{'' if rows else ' open'}><summary>report</summary><pre>{escape(report(result))}</pre></details>",
    ]
    return f'<div class="tmsopt">{"".join(parts)}</div>'


def badges(result: Any) -> str:
    """What it is and how it ended, a mark for each word."""
    words = [*WRITERS[type(result).__name__].words(result)]
    if isinstance(seconds := getattr(result, "seconds", None), float):
        words.append(f"{float(f'{seconds:.2g}'):g} s")  # never 1.1e+02
    return " ".join(map(_badge, words))


def _badge(word: str) -> str:
    return f'<span style="{_BADGE};background:{_MARKS.get(word, "none")}">{escape(word)}</span>'


def _rows(result: Any) -> list[Sequence[str]]:
    """Headings and cells: parameters with unit and meaning of a design, rows of a table; empty for other results."""
    if hasattr(result, "records"):
        return _records(result.records())
    problem, parameters = getattr(result, "problem", None), getattr(result, "parameters", None)
    if problem is None or not isinstance(parameters, Mapping) or not parameters:
        return []
    posed = problem.posed
    rows = [
        (p.name, *_number(posed, p, parameters[p.name]), p.meaning, "free" if p.name in posed.free else "fixed")
        for p in posed.parameter_set.parameters
        if p.name in parameters
    ]
    return [("parameter", "value", "unit", "meaning", ""), *rows]


def _number(problem: Posed, parameter: Parameter, value: Any) -> tuple[str, str]:
    """A value and its unit: as the problem was written; a proved number, which is a decimal, in SI."""
    if isinstance(value, float):
        unit = unit_of(problem, parameter.name)
        return unit.number(value), unit.text
    return str(value.value), "" if parameter.unit == "1" else parameter.unit


def _records(records: Iterable[Mapping[str, Any]]) -> list[Sequence[str]]:
    known = list(islice(records, _ROWS + 1))
    if not known:
        return []
    heads = list(known[0])[:_COLUMNS]
    rows: list[Sequence[str]] = [heads, *([_cell(row.get(n, "")) for n in heads] for row in known[:_ROWS])]
    return rows if len(known) <= _ROWS else [*rows, ["…"] * len(heads)]


def _cell(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _table(rows: Sequence[Sequence[str]]) -> str:
    if not rows:
        return ""
    head, *body = rows
    lines = ["".join(f"<th>{escape(cell)}</th>" for cell in head)]
    lines += ["".join(f"<td>{escape(cell)}</td>" for cell in row) for row in body]
    return f"<table>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def _picture(result: Any) -> str:
    """The picture, inside the page; none where it cannot be drawn: a display must not break over it."""
    try:
        image = io.BytesIO()
        figure: Any = drawn(result).get_figure()
        figure.savefig(image, format="png", dpi=100, bbox_inches="tight")
    except Exception:  # whatever it was, the rest of the page says what the result is
        return ""
    coded = base64.b64encode(image.getvalue()).decode()
    return f'<img alt="{escape(type(result).__name__)}" style="max-width:100%" src="data:image/png;base64,{coded}">'
