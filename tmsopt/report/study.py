"""Studies as text for a reader."""

import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice

from tmsopt.problem import show_at, status_text, unit_at, unit_of
from tmsopt.report.text import HEIGHT, WIDTH, columns, number, screen, yes_no
from tmsopt.studies.rows import Row
from tmsopt.studies.study import Study
from tmsopt.studies.summary import Share, Summary

LISTED = 40
"""Rows that are shown where all is wanted."""

_FIRST = 10  # rows that are shown
_CAUSES = 5
_DIGITS = 6


def study_table(study: Study, found: Summary, rows: Iterable[Row], full: bool = False) -> str:
    """What varies, how the rows ended, the first rows, the best one and what the rows say together.

    Args:
        full: up to `LISTED` rows, with every column.

    Example:
        >>> found = tmsopt.run_study(tmsopt.over_grid("problems/ep4.toml", {"zeta_B": [-0.4, -0.6]}), workers=1)
        >>> print(tmsopt.report.study_table(found.study, found.summary, found.rows).splitlines()[1])
        grid over zeta_B (2): 2 rows; 2 optimal

    More: docs/tutorials/study.md
    """
    listed = list(islice(rows, LISTED if full else _FIRST))
    title = study.title or study.problem.title or "untitled study"
    lines = [*textwrap.wrap(title, WIDTH), *textwrap.wrap(_headline(study, found), WIDTH, subsequent_indent="  "), ""]
    if listed:
        cells = study_rows(study, listed)
        lines += columns(cells) if full else screen(cells, _FIRST, more="--export rows.csv")
        lines += [f"  … {found.rows} rows in all; --export rows.csv writes them"] if found.rows > len(listed) else []
        lines.append("")
    for fact in _facts(study, found):
        lines += [fact] if full else textwrap.wrap(fact, WIDTH, subsequent_indent="  ")
    text = "\n".join(line.rstrip() for line in (lines if full else lines[:HEIGHT])).rstrip()
    return "".join(c if c.isprintable() or c == "\n" else "\ufffd" for c in text)  # rows may come from anybody's store


def row_lines(study: Study, row: Row) -> str:
    """One row in a line: its number, seed, what varies and how it ended.

    Example:
        >>> study = tmsopt.over_grid("problems/ep4.toml", {"zeta_B": [-0.4, -0.6]})
        >>> print(tmsopt.report.row_lines(study, tmsopt.run_study(study, workers=1).rows[0]))
        row 0: zeta_B = -0.4; seed ...; optimal

    More: docs/tutorials/study.md
    """
    given = ", ".join(f"{name} = {number(value)}" for name, value in row.varied.items())
    parts = [f"row {row.number}: {given}", f"seed {row.seed}", status_text(study.problem.posed, row.status), row.cause]
    return "; ".join(part for part in parts if part)


def _headline(study: Study, found: Summary) -> str:
    """How the rows were made and how they ended."""
    names = ", ".join(study.columns)
    if study.grid_shape is not None:
        names = " × ".join(f"{name} ({size})" for name, size in study.grid_shape.items())
    made = f"{study.method.replace('_', ' ')} over {names}: {found.rows} rows"
    counts = ", ".join(f"{count} {status_text(study.problem.posed, status)}" for status, count in found.counts.items())
    missing = found.rows - sum(found.counts.values())
    return f"{made}; {counts or 'none solved'}" + (f", {missing} not yet solved" if missing else "")


def study_rows(study: Study, rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Headings, and the cells of each row, in the units in which the problem was written.

    Example:
        >>> study = tmsopt.over_grid("problems/ep4.toml", {"zeta_B": [-0.4, -0.6]})
        >>> rows = tmsopt.report.study_rows(study, tmsopt.run_study(study, workers=1).rows)
        >>> [row[2:6] for row in rows]  # the abscissa is -(zeta_B zeta_H)^(-1/4)
        [('zeta_B', 'status', 'abscissa', 'structure'), ('-0.4', 'optimal', '-1.8803', 'EP4'),
         ('-0.6', 'optimal', '-1.69904', 'EP4')]

    More: docs/tutorials/study.md
    """
    problem = study.problem.posed
    free = [name for name in problem.free if name not in study.columns]
    text = problem.minimize or problem.maximize
    asked = [text] if text and text != "abscissa" and text not in free else []
    some = dict.fromkeys(problem.parameter_set.names, 1.0)  # a unit has one name for all designs
    names = (*study.columns, *asked, *free, "abscissa", *_reports(study))
    units = {n: f"{n} {unit_at(problem, n, some).text}".rstrip() for n in names}
    varied, objective, rest = ([units[n] for n in names] for names in (study.columns, asked, (*free, *_reports(study))))
    heads = ["row", "stable", *varied, "status", *objective, units["abscissa"], "structure", *rest]
    return [tuple(heads), *(_cells(study, row, asked, free) for row in rows)]


def _cells(study: Study, row: Row, asked: Sequence[str], free: Sequence[str]) -> tuple[str, ...]:
    problem = study.problem.posed
    known = row.status in ("optimal", "not_converged") or (row.status == "infeasible" and not problem.free)

    def shown(name: str, values: Mapping[str, float]) -> str:
        return unit_at(problem, name, row.parameters).number(values[name], _DIGITS) if name in values else ""

    found = (row.parameters, row.reports) if known else ({}, {})
    return (
        str(row.number),
        yes_no(row.stable) if known else "",
        *(shown(n, row.varied) for n in study.columns),
        status_text(problem, row.status),
        *(shown(n, {n: row.objective} if known else {}) for n in asked),
        shown("abscissa", {"abscissa": row.abscissa} if known else {}),
        row.structure if known else "",
        *(shown(n, found[0]) for n in free),
        *(shown(n, found[1]) for n in _reports(study)),
    )


def _facts(study: Study, found: Summary) -> list[str]:
    lines = []
    if found.best is not None and study.problem.free:
        problem = study.problem.posed
        given = ", ".join(f"{n} = {unit_of(problem, n).show(x, _DIGITS)}" for n, x in found.best.varied.items())
        text = problem.minimize or problem.maximize or ""
        best = show_at(problem, text, found.best.parameters, found.best.objective, _DIGITS)
        lines.append(f"best: row {found.best.number}, {best} at {given}")
    same = (study.problem.minimize or "").strip() == "abscissa"
    for name, ends in found.spread.items():
        if (same and name == "objective") or found.product is not None:
            continue
        least, median, most = found.clocked.get(name, ends)
        unit = " 1/s" if name in found.clocked else ""
        lines.append(f"{name}: {_short(least)} to {_short(most)}{unit}, median {_short(median)}{unit}")
    if found.product is None:
        lines.append(f"stable: {found.stable} of {sum(found.counts.values())} rows")
    if found.structures:
        lines.append("structures: " + ", ".join(f"{name} {count}" for name, count in found.structures.items()))
    if found.proven and study.problem.free:
        lines.append(f"proven globally by the bound: {found.proven} rows")
    if found.laws:
        label, value = max(found.laws.items(), key=lambda law: law[1])
        lines.append(f"{len(found.laws)} laws apply; greatest relative residual {value:.0e} ({label})")
    if found.product is not None:
        for name in ("stable", "feasible", "good"):
            lines.append(f"{_SHARES[name]}: {_share(getattr(found.product, name))}")
        values = found.clocked.get("quantiles", tuple(found.product.abscissa.values()))
        each = zip(found.product.abscissa, values, strict=True)
        at = ", ".join(f"{100 * float(q):g} % {_short(value)}" for q, value in each)
        unit = "1/s" if "quantiles" in found.clocked else unit_of(study.problem.posed, "abscissa").text
        lines.append(f"abscissa{f' in {unit}' if unit else ''} at most, for a share of all rows: {at}")
    for cause, count in islice(found.causes.items(), _CAUSES):
        lines.append(f"{count} × {cause}")
    if len(found.causes) > _CAUSES:
        lines.append(f"… and {len(found.causes) - _CAUSES} other causes")
    return [*lines, *study.notes]


_SHARES = {"stable": "stable", "feasible": "every constraint met", "good": "both"}


def _share(share: Share) -> str:
    if not share.of:
        return "no row so far"
    low, high = share.interval
    return (
        f"{share.count} of {share.of} ({100 * share.share:.3g} %; 95 % interval {100 * low:.3g} to {100 * high:.3g} %)"
    )


def _reports(study: Study) -> list[str]:
    """What is recorded beside what has a column anyway."""
    return [text for text in study.report if text not in ("abscissa", *study.problem.free, *study.columns)]


def _short(value: float) -> str:
    return f"{value + 0.0:.{_DIGITS}g}" if math.isfinite(value) else "none"
