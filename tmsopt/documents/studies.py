"""Studies: how the rows ended, the best one, and what they say together."""

from collections.abc import Sequence
from itertools import islice

from tmsopt import plots
from tmsopt.documents.blocks import (
    Cell,
    Chapter,
    Figure,
    Level,
    Parts,
    Row as TableRow,
    Sentence,
    TableBlock,
    count_things,
    say_whether,
)
from tmsopt.documents.tables import head_numbers, list_numbers, thin_rows, write_question
from tmsopt.problem import show_at, status_text, unit_of
from tmsopt.studies.rows import Row
from tmsopt.studies.run import Results
from tmsopt.studies.study import Study
from tmsopt.studies.summary import Share, Summary

LISTED = 40
"""Rows that are shown where all is wanted."""

_FIRST = 10  # rows of a brief report
_CAUSES = 5
_DIGITS = 6
_SHARES = {"stable": "stable", "feasible": "every constraint met", "good": "both"}


def write_results(results: Results, level: Level) -> Parts:
    """What varies, how the rows ended, the best one, what they say together, and the first rows."""
    yield count_things(results.rows, "row"), *_count_statuses(results.study, results.summary)
    study, found, page = results.study, results.summary, level == "page"
    yield Sentence(_describe_study(study, found), tone="answer")
    if page:
        random = study.method == "monte_carlo"
        caption = "How the designs are distributed" if random else "The objective over what varies"
        yield Chapter("picture", "Rows together")
        yield Figure(plots.draw_histogram, results, caption)
        rows, notes = thin_rows(results.rows, "rows", "tmsopt study FILE --export rows.csv writes all")
    else:
        rows = [*islice(results.rows, _FIRST if level == "brief" else LISTED)]
        hidden = found.rows > len(rows) > 0
        notes = [f"… {found.rows} rows in all; --export rows.csv writes them"] if hidden else []
    yield Chapter("rows", width="whole")
    if rows:
        cells = list_rows(study, rows)
        needs = [9, 8, *[7] * len(study.columns), 6, *[4] * (len(cells[0]) - len(study.columns) - 3)]
        yield TableBlock(cells, "Rows of the study", needs, rest="--export rows.csv")
    yield from notes
    yield Chapter("facts", "Together")
    yield from _write_facts(study, found)
    if page:
        yield from write_question(study.problem.posed)


def describe_row(study: Study, row: Row) -> str:
    """One row: its number, seed, what varies and how it ended."""
    given = ", ".join(f"{name} = {Cell(value)}" for name, value in row.varied.items())
    parts = [f"row {row.number}: {given}", f"seed {row.seed}", status_text(study.problem.posed, row.status), row.cause]
    return "; ".join(part for part in parts if part)


def _describe_study(study: Study, found: Summary) -> str:
    """How the rows were made and how they ended."""
    names = ", ".join(study.columns)
    if study.grid_shape is not None:
        names = " × ".join(f"{name} ({size})" for name, size in study.grid_shape.items())
    made = f"{study.method.replace('_', ' ')} over {names}: {found.rows} rows"
    counts = ", ".join(_count_statuses(study, found))
    missing = found.rows - sum(found.counts.values())
    return f"{made}; {counts or 'none solved'}" + (f", {missing} not yet solved" if missing else "")


def _count_statuses(study: Study, found: Summary) -> list[str]:
    return [f"{count} {status_text(study.problem.posed, status)}" for status, count in found.counts.items()]


def list_rows(study: Study, rows: Sequence[Row]) -> list[TableRow]:
    """Headings, and the cells of each row, in the units in which the problem was written."""
    problem = study.problem.posed
    free = [name for name in problem.free if name not in study.columns]
    text = problem.minimize or problem.maximize
    asked = [text] if text and text != "abscissa" and text not in free else []
    reports = [text for text in study.report if text not in ("abscissa", *study.problem.free, *study.columns)]
    groups = (study.columns, [*asked, "abscissa"], [*free, *reports])

    def list_row(row: Row) -> TableRow:
        known = row.status in ("optimal", "not_converged") or (row.status == "infeasible" and not problem.free)
        found = {**row.reports, **row.parameters, **dict.fromkeys(asked, row.objective), "abscissa": row.abscissa}
        values = {**(found if known else {}), **row.varied}
        varied, ended, rest = (list_numbers(problem, names, values, row.parameters, _DIGITS) for names in groups)
        stable, structure = (say_whether(row.stable), row.structure) if known else ("", "")
        return str(row.number), stable, *varied, status_text(problem, row.status), *ended, structure, *rest

    varied, ended, rest = (head_numbers(problem, names) for names in groups)
    return [("row", "stable", *varied, "status", *ended, "structure", *rest), *map(list_row, rows)]


def _write_facts(study: Study, found: Summary) -> Parts:
    problem = study.problem.posed
    if found.best is not None and study.problem.free:
        given = ", ".join(f"{n} = {unit_of(problem, n).show(x, _DIGITS)}" for n, x in found.best.varied.items())
        best = show_at(problem, problem.goal or "", found.best.parameters, found.best.objective, _DIGITS)
        yield Sentence(f"row {found.best.number}, {best} at {given}", "best", "answer")
    if found.product is None:
        for name, ends in found.spread.items():
            if name != "objective" or (study.problem.minimize or "").strip() != "abscissa":
                least, median, most = (Cell(x, digits=_DIGITS) for x in found.clocked.get(name, ends))
                unit = " 1/s" if name in found.clocked else ""
                yield Sentence(f"{least} to {most}{unit}, median {median}{unit}", name)
        yield Sentence(f"{found.stable} of {sum(found.counts.values())} rows", "stable")
    yield Sentence(", ".join(f"{name} {count}" for name, count in found.structures.items()), "structures")
    if found.proven and study.problem.free:
        yield Sentence(f"{found.proven} rows", "proven globally by the bound")
    if found.laws:
        label, value = max(found.laws.items(), key=lambda law: law[1])
        yield f"{len(found.laws)} laws apply; greatest relative residual {value:.0e} ({label})"
    if found.product is not None:
        for name, words in _SHARES.items():
            share: Share = getattr(found.product, name)
            low, high = share.interval
            within = f"95 % interval {100 * low:.3g} to {100 * high:.3g} %"
            said = f"{share.count} of {share.of} ({100 * share.share:.3g} %; {within})" if share.of else "no row so far"
            yield Sentence(said, words)
        values = found.clocked.get("quantiles", tuple(found.product.abscissa.values()))
        each = zip(found.product.abscissa, values, strict=True)
        at = ", ".join(f"{100 * float(q):g} % {Cell(value, digits=_DIGITS)}" for q, value in each)
        unit = "1/s" if "quantiles" in found.clocked else unit_of(problem, "abscissa").text
        yield Sentence(at, f"percentiles of the abscissa{f' in {unit}' if unit else ''}")
    yield from (f"{count} × {cause}" for cause, count in islice(found.causes.items(), _CAUSES))
    if len(found.causes) > _CAUSES:
        yield f"… and {len(found.causes) - _CAUSES} other causes"
    yield from study.notes
