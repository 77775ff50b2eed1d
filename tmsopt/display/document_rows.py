"""Tables of a document that no report has as a whole: limits, points of a branch, designs of a grid, records."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from tmsopt.display.markup import Rows, paragraphs
from tmsopt.guide import describe
from tmsopt.models import in_words_of
from tmsopt.problem import NO_RADIUS, Case, Posed, Unit, unit_of
from tmsopt.problem.unit_system import limit_text
from tmsopt.roots import CLASSES

if TYPE_CHECKING:
    from tmsopt.charts import Chart
    from tmsopt.problem import Solution
    from tmsopt.tracing import Trace

T = TypeVar("T")
Row = tuple[str, ...]

MOST = 2000
"""Rows of a table in a document."""

_DIGITS = 6


def thinned(rows: Sequence[T], name: str, whole: str, keep: Iterable[int] = ()) -> tuple[list[T], str]:
    """At most `MOST` rows, spread evenly, and a paragraph that says so where some are left out.

    Args:
        whole: where all of them are.
        keep: numbers of rows that stay.
    """
    if len(rows) <= MOST:
        return [*rows], ""
    chosen = {*np.linspace(0, len(rows) - 1, MOST).astype(int).tolist(), *keep}
    kept = [rows[k] for k in sorted(chosen)]
    return kept, paragraphs([f"{len(kept)} of {len(rows)} {name}, spread evenly; {whole}."])


def range_rows(problem: Posed) -> Rows:
    """Parameters of a problem: value or range as typed, what is physically possible, and the meaning."""
    given = [w for of in describe(problem).sets for w in of.parameters]
    heads = [("parameter", "value or range", "", "possible", "meaning")]
    return heads + [(w.name, w.given, "free" if w.name in problem.free else "fixed", w.range, w.meaning) for w in given]


def limit_rows(solution: "Solution") -> list[Row]:
    """Constraints, and what else is violated: what each says, and whether it holds, binds or is violated."""
    problem = solution.problem.posed
    others = [name for name in solution.violations if name not in problem.constraints]
    rows: list[Row] = [("limit", "says", "stands")]
    for name in (*problem.constraints, *others):
        said = limit_text(problem, name) or ("pattern" if name in problem.located else "")
        rows.append((name, said, _stands(solution, name)))
    return rows


def _stands(solution: "Solution", name: str) -> str:
    if name in solution.violations:
        by, unit = solution.violations[name], unit_of(solution.problem.posed, name)
        return f"violated by {unit.show(by, 4)}" if math.isfinite(by) else "has no value"
    return "binds" if name in solution.active else f"holds{_margin(solution, name)}"


def _margin(solution: "Solution", name: str) -> str:
    """By how much an inequality holds, the least over the cases of the design; empty where that is no number."""
    problem, condition = solution.problem.posed, solution.problem.posed.conditions[name]
    if condition.equality:
        return ""
    cases = [case for case in problem.cases if not case.direction]
    cases += [case for case in (solution.worst, solution.least_damped, solution.fastest) if case is not None]
    left = math.inf
    radius = {n: x for n, x in solution.quantities.items() if n == NO_RADIUS.name}  # the search for it is over
    for case in cases or [Case()]:
        values = problem.values(case.applied(solution.parameters)).with_known(radius)
        left = min(left, -condition.sign * float(condition(values)))
    shares = {q.name for q in (*problem.model.quantities, *problem.parameter_set.quantities) if q.share}
    unit = unit_of(problem, name)
    unit = Unit("%", 0.01) if not unit.text and shares & {*condition.names} else unit
    return f" by {unit.show(left, 4)}" if math.isfinite(left) else ""


def point_rows(trace: "Trace") -> tuple[list[Row], str]:
    """Points of all branches with their events, in the units of the problem."""
    units = {n: unit_of(trace.problem.posed, n) for n in (*trace.problem.free, "abscissa")}
    heads = ("branch", *(f"{n} {u.text}".rstrip() for n, u in units.items()))
    model = trace.problem.model
    swings = () if model.carrier is not None else ("heavily damped",)
    facts = ("kind", "stable", *swings, "constraints", "event")
    records = [*trace.records()]
    marked = [k for k, record in enumerate(records) if record["event"]]
    kept, note = thinned(records, "points", "tmsopt trace FILE --csv curve.csv writes all", marked)
    rows: list[Row] = [(*heads, *facts)]
    for record in kept:
        numbers = (unit.number(record[n], _DIGITS) for n, unit in units.items())
        said = (in_words_of(model, _cell(record[fact.replace(" ", "_")])) for fact in facts)
        rows.append((str(record["branch"] + 1), *numbers, *said))
    return rows, note


def chart_rows(chart: "Chart") -> tuple[list[Row], str]:
    """Designs of the grid, every so many along each axis where they are too many."""
    problem, shown = chart.problem, spread(chart, MOST)
    units = {n: unit_of(problem.posed, n) for n in (*chart.axes, "abscissa")}
    grid = np.meshgrid(*reversed(shown.grid), indexing="ij")
    columns: dict[str, list[str]] = {
        f"{n} {units[n].text}".rstrip(): [units[n].number(x, _DIGITS) for x in values.ravel().tolist()]
        for n, values in zip(chart.axes, reversed(grid), strict=True)
    }
    left_out = [] if len(problem.constraints) > len(chart.left_aside) else ["satisfied", "margin"]
    left_out += [] if problem.model.carrier is None else ["damping_ratio", "real_roots"]  # eigenfrequencies have none
    for name, layer in ((n, layer) for n, layer in shown.layers.items() if n not in left_out):
        values = np.asarray(layer).ravel().tolist()
        if name == "kind":
            columns["class"] = [in_words_of(problem.model, CLASSES[k]) for k in values]
        elif name == "abscissa":
            columns[f"abscissa {units[name].text}".rstrip()] = [units[name].number(x, _DIGITS) for x in values]
        else:
            columns[name.replace("_", " ")] = [_cell(x) for x in values]
    rows: list[Row] = [tuple(columns), *zip(*columns.values(), strict=True)]
    left = math.prod(map(len, chart.grid))
    note = f"{len(rows) - 1} of {left} designs, spread evenly over each axis; --output writes all."
    return rows, paragraphs([note]) if len(rows) <= left else ""


def spread(chart: "Chart", most: int) -> "Chart":
    """A chart with one in so many designs along each axis that there are no more than `most`."""
    sizes = [len(values) for values in chart.grid]
    step = next(k for k in range(1, max(sizes) + 1) if math.prod(-(-size // k) for size in sizes) <= most)
    if step == 1:
        return chart
    layers = {n: layer[(slice(None, None, step),) * len(sizes)] for n, layer in chart.layers.items()}
    return replace(chart, grid=tuple(values[::step] for values in chart.grid), layers=layers)


def record_rows(result: Any) -> tuple[list[Row], str]:
    """Records of a result as they are, numbers in rad and SI."""
    records: list[Mapping[str, Any]] = [*islice(result.records(), MOST + 1)]
    heads = [tuple(records[0])] if records else [("",)]
    note = f"the first {MOST} rows." if len(records) > MOST else ""
    return heads + [tuple(_cell(record.get(n, "")) for n in heads[0]) for record in records[:MOST]], paragraphs([note])


def _cell(value: Any) -> str:
    match value:
        case None:
            return ""
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value + 0.0:.{_DIGITS}g}" if math.isfinite(value) else "none"
    return str(value)
