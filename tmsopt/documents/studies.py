"""Documents of studies: the rows, the best one, and their statistics."""

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
    format_bool,
)
from tmsopt.documents.tables import list_headings, list_numbers, thin_rows, write_question
from tmsopt.problem import show_at, status_text, unit_of
from tmsopt.studies.rows import Row
from tmsopt.studies.run import Results
from tmsopt.studies.study import Study
from tmsopt.studies.summary import Share, Summary

_MAX_FULL_ROWS = 40
"""Maximum number of rows of a full report."""

_MAX_BRIEF_ROWS = 10
"""Maximum number of rows of a brief report."""
_MAX_CAUSES = 5
_DIGITS = 6
_SHARES = {"stable": "stable", "feasible": "every constraint met", "good": "stable, and every constraint met"}
"""Name of a share of the rows → its label."""


def write_results(results: Results, level: Level) -> Parts:
    """Write the varied parameters, the status of the rows, the first rows, the best row, and statistics."""
    yield count_things(results.rows, "row"), *_count_statuses(results.study, results.summary)
    study, summary, page = results.study, results.summary, level == "page"
    yield Sentence(_describe_study(study, summary), tone="answer")
    if page:
        is_random = study.method == "monte_carlo"
        caption = "Distribution of the designs" if is_random else "The objective over the varied parameters"
        yield Chapter("picture", "All rows")
        yield Figure(plots.draw_histogram, results, caption)
        rows, notes = thin_rows(results.rows, "rows", "tmsopt study FILE --export rows.csv writes all")
    else:
        rows = [*islice(results.rows, _MAX_BRIEF_ROWS if level == "brief" else _MAX_FULL_ROWS)]
        has_hidden_rows = summary.rows > len(rows) > 0
        notes = [f"… {summary.rows} rows in all; --export rows.csv writes them"] if has_hidden_rows else []
    yield Chapter("rows", width="whole")
    if rows:
        cells = list_rows(study, rows)
        priorities = [9, 8, *[7] * len(study.columns), 6, *[4] * (len(cells[0]) - len(study.columns) - 3)]
        yield TableBlock(cells, "Rows of the study", priorities, hint="--export rows.csv")
    yield from notes
    yield Chapter("facts", "Statistics")
    yield from _write_facts(study, summary)
    if page:
        yield from write_question(study.problem.posed)


def describe_row(study: Study, row: Row) -> str:
    """Describe one row: its number, varied parameters, seed and status."""
    values = ", ".join(f"{name} = {Cell(value)}" for name, value in row.varied.items())
    parts = [f"row {row.number}: {values}", f"seed {row.seed}", status_text(study.problem.posed, row.status), row.cause]
    return "; ".join(part for part in parts if part)


def _describe_study(study: Study, summary: Summary) -> str:
    """Describe the method that made the rows, and count the statuses."""
    names = ", ".join(study.columns)
    if study.grid_shape is not None:
        names = " × ".join(f"{name} ({size})" for name, size in study.grid_shape.items())
    method_text = f"{study.method.replace('_', ' ')} over {names}: {summary.rows} rows"
    counts = ", ".join(_count_statuses(study, summary))
    missing_count = summary.rows - sum(summary.counts.values())
    return f"{method_text}; {counts or 'none solved'}" + (f", {missing_count} not yet solved" if missing_count else "")


def _count_statuses(study: Study, summary: Summary) -> list[str]:
    return [f"{count} {status_text(study.problem.posed, status)}" for status, count in summary.counts.items()]


def list_rows(study: Study, rows: Sequence[Row]) -> list[TableRow]:
    """List headings and the cells of each row, in the units of the problem file."""
    problem = study.problem.posed
    free = [name for name in problem.free if name not in study.columns]
    text = problem.minimize or problem.maximize
    objectives = [text] if text and text != "abscissa" and text not in free else []
    reports = [text for text in study.report if text not in ("abscissa", *study.problem.free, *study.columns)]
    groups = (study.columns, [*objectives, "abscissa"], [*free, *reports])

    def list_row(row: Row) -> TableRow:
        has_design = row.status in ("optimal", "not_converged") or (row.status == "infeasible" and not problem.free)
        row_values = {**row.reports, **row.parameters, "abscissa": row.abscissa}
        row_values |= dict.fromkeys(objectives, row.objective)
        values = {**(row_values if has_design else {}), **row.varied}
        inputs, outcomes, outputs = (list_numbers(problem, names, values, row.parameters, _DIGITS) for names in groups)
        stable, structure = (format_bool(row.stable), row.structure) if has_design else ("", "")
        return str(row.number), stable, *inputs, status_text(problem, row.status), *outcomes, structure, *outputs

    inputs, outcomes, outputs = (list_headings(problem, names) for names in groups)
    return [("row", "stable", *inputs, "status", *outcomes, "structure", *outputs), *map(list_row, rows)]


def _write_facts(study: Study, summary: Summary) -> Parts:
    problem = study.problem.posed
    if summary.best is not None and study.problem.free:
        inputs = ", ".join(f"{n} = {unit_of(problem, n).show(x, _DIGITS)}" for n, x in summary.best.varied.items())
        best = show_at(problem, problem.goal or "", summary.best.parameters, summary.best.objective, _DIGITS)
        yield Sentence(f"row {summary.best.number}, {best} at {inputs}", "best", "answer")
    if summary.product is None:
        for name, spread in summary.spread.items():
            if name != "objective" or (study.problem.minimize or "").strip() != "abscissa":
                lowest, median, highest = (Cell(x, digits=_DIGITS) for x in summary.clocked.get(name, spread))
                unit = " 1/s" if name in summary.clocked else ""
                yield Sentence(f"{lowest} to {highest}{unit}, median {median}{unit}", name)
        yield Sentence(f"{summary.stable} of {sum(summary.counts.values())} rows", "stable")
    yield Sentence(", ".join(f"{name} {count}" for name, count in summary.structures.items()), "structures")
    if summary.proven and study.problem.free:
        yield Sentence(f"{summary.proven} rows", "proven globally by the bound")
    if summary.laws:
        label, value = max(summary.laws.items(), key=lambda law: law[1])
        yield f"{len(summary.laws)} laws apply; greatest relative residual {value:.0e} ({label})"
    if summary.product is not None:
        for name, share_label in _SHARES.items():
            share: Share = getattr(summary.product, name)
            low, high = share.interval
            interval_text = f"95 % interval {100 * low:.3g} to {100 * high:.3g} %"
            share_text = f"{share.count} of {share.of} ({100 * share.share:.3g} %; {interval_text})"
            yield Sentence(share_text if share.of else "no row so far", share_label)
        values = summary.clocked.get("quantiles", tuple(summary.product.abscissa.values()))
        quantiles = zip(summary.product.abscissa, values, strict=True)
        percentiles = ", ".join(f"{100 * float(q):g} % {Cell(value, digits=_DIGITS)}" for q, value in quantiles)
        unit = "1/s" if "quantiles" in summary.clocked else unit_of(problem, "abscissa").text
        yield Sentence(percentiles, f"percentiles of the abscissa{f' in {unit}' if unit else ''}")
    yield from (f"{count} × {cause}" for cause, count in islice(summary.causes.items(), _MAX_CAUSES))
    if len(summary.causes) > _MAX_CAUSES:
        yield f"… and {len(summary.causes) - _MAX_CAUSES} other causes"
    yield from study.notes
