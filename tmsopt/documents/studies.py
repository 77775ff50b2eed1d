"""Studies: how the rows ended, the best one, and what they say together."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

from tmsopt.documents.blocks import Badge, Cell, Chapter, Figure, Level, Sentence, TableBlock, count_things, say_whether
from tmsopt.documents.maker import Maker, remove_titles
from tmsopt.documents.tables import thin_rows, write_question
from tmsopt.problem import show_at, status_text, unit_at, unit_of
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


def summarise_results(results: Results) -> Iterator[Badge]:
    """Rows and how they ended."""
    yield Badge(count_things(len(results.rows), "row"))
    for status, count in results.summary.counts.items():
        yield Badge(f"{count} {status_text(results.study.problem.posed, status)}")


def write_results(results: Results, level: Level) -> Iterator[Chapter]:
    """What varies, how the rows ended, the best one, what they say together, and the first rows."""
    study, found, page = results.study, results.summary, level == "page"
    yield Chapter("answer", (Sentence(_describe_study(study, found), tone="answer"),))
    if page:
        from tmsopt import plots

        random = study.method == "monte_carlo"
        caption = "How the designs are distributed" if random else "The objective over what varies"
        yield Chapter(
            "picture", (Figure(lambda: plots.draw_histogram(remove_titles(results)), caption),), "Rows together"
        )
    if page:
        rows, notes = thin_rows(results.rows, "rows", "tmsopt study FILE --export rows.csv writes all")
    else:
        rows, notes = list(islice(results.rows, _FIRST if level == "brief" else LISTED)), ()
        hidden = found.rows > len(rows)
        notes = (Sentence(f"… {found.rows} rows in all; --export rows.csv writes them"),) if hidden and rows else ()
    cells = list_rows(study, rows)
    needs = [9, 8, *[7] * len(study.columns), 6, *[4] * (len(cells[0]) - len(study.columns) - 3)]
    grid = (TableBlock(cells, "Rows of the study", needs, rest="--export rows.csv"),) if rows else ()
    yield Chapter("rows", (*grid, *notes), "Rows", "whole")
    yield Chapter("facts", tuple(_write_facts(study, found)), "Together")
    if page:
        yield write_question(study.problem.posed)


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
    counts = ", ".join(f"{count} {status_text(study.problem.posed, status)}" for status, count in found.counts.items())
    missing = found.rows - sum(found.counts.values())
    return f"{made}; {counts or 'none solved'}" + (f", {missing} not yet solved" if missing else "")


def list_rows(study: Study, rows: Sequence[Row]) -> list[Sequence[Cell | str]]:
    """Headings, and the cells of each row, in the units in which the problem was written."""
    problem = study.problem.posed
    free = [name for name in problem.free if name not in study.columns]
    text = problem.minimize or problem.maximize
    asked = [text] if text and text != "abscissa" and text not in free else []
    reports = [text for text in study.report if text not in ("abscissa", *study.problem.free, *study.columns)]
    some = dict.fromkeys(problem.parameter_set.names, 1.0)  # a unit has one name for all designs
    names = (*study.columns, *asked, *free, "abscissa", *reports)
    units = {n: f"{n} {unit_at(problem, n, some).text}".rstrip() for n in names}
    varied, objective, rest = ([units[n] for n in listed] for listed in (study.columns, asked, (*free, *reports)))
    head = ["row", "stable", *varied, "status", *objective, units["abscissa"], "structure", *rest]
    return [tuple(head), *(_list_row(study, row, asked, free, reports) for row in rows)]


def _list_row(
    study: Study, row: Row, asked: Sequence[str], free: Sequence[str], reports: Sequence[str]
) -> Sequence[Cell | str]:
    problem = study.problem.posed
    known = row.status in ("optimal", "not_converged") or (row.status == "infeasible" and not problem.free)

    def cell(name: str, values: Mapping[str, float]) -> Cell | str:
        return Cell(values[name], unit_at(problem, name, row.parameters), _DIGITS) if name in values else ""

    found = (row.parameters, row.reports) if known else ({}, {})
    return (
        str(row.number),
        say_whether(row.stable) if known else "",
        *(cell(n, row.varied) for n in study.columns),
        status_text(problem, row.status),
        *(cell(n, {n: row.objective} if known else {}) for n in asked),
        cell("abscissa", {"abscissa": row.abscissa} if known else {}),
        row.structure if known else "",
        *(cell(n, found[0]) for n in free),
        *(cell(n, found[1]) for n in reports),
    )


def _write_facts(study: Study, found: Summary) -> Iterator[Sentence]:
    problem = study.problem.posed
    if found.best is not None and study.problem.free:
        given = ", ".join(f"{n} = {unit_of(problem, n).show(x, _DIGITS)}" for n, x in found.best.varied.items())
        best = show_at(problem, problem.goal or "", found.best.parameters, found.best.objective, _DIGITS)
        yield Sentence(f"row {found.best.number}, {best} at {given}", "best", "answer")
    same = (study.problem.minimize or "").strip() == "abscissa"
    for name, ends in found.spread.items():
        if (same and name == "objective") or found.product is not None:
            continue
        least, median, most = (Cell(x, digits=_DIGITS) for x in found.clocked.get(name, ends))
        unit = " 1/s" if name in found.clocked else ""
        yield Sentence(f"{least} to {most}{unit}, median {median}{unit}", name)
    if found.product is None:
        yield Sentence(f"{found.stable} of {sum(found.counts.values())} rows", "stable")
    if found.structures:
        yield Sentence(", ".join(f"{name} {count}" for name, count in found.structures.items()), "structures")
    if found.proven and study.problem.free:
        yield Sentence(f"{found.proven} rows", "proven globally by the bound")
    if found.laws:
        label, value = max(found.laws.items(), key=lambda law: law[1])
        yield Sentence(f"{len(found.laws)} laws apply; greatest relative residual {value:.0e} ({label})")
    if found.product is not None:
        for name, words in _SHARES.items():
            yield Sentence(_describe_share(getattr(found.product, name)), words)
        values = found.clocked.get("quantiles", tuple(found.product.abscissa.values()))
        each = zip(found.product.abscissa, values, strict=True)
        at = ", ".join(f"{100 * float(q):g} % {Cell(value, digits=_DIGITS)}" for q, value in each)
        unit = "1/s" if "quantiles" in found.clocked else unit_of(problem, "abscissa").text
        yield Sentence(at, f"percentiles of the abscissa{f' in {unit}' if unit else ''}")
    for cause, count in islice(found.causes.items(), _CAUSES):
        yield Sentence(f"{count} × {cause}")
    if len(found.causes) > _CAUSES:
        yield Sentence(f"… and {len(found.causes) - _CAUSES} other causes")
    yield from map(Sentence, study.notes)


def _describe_share(share: Share) -> str:
    if not share.of:
        return "no row so far"
    low, high = share.interval
    return (
        f"{share.count} of {share.of} ({100 * share.share:.3g} %; 95 % interval {100 * low:.3g} to {100 * high:.3g} %)"
    )


MAKERS: Mapping[str, Maker] = {"Results": Maker(summarise_results, write_results, "draw_histogram")}
