"""Studies as text for a reader."""

import math
from collections.abc import Iterable, Sequence
from itertools import islice

from tmsopt.models import ParameterSet
from tmsopt.report.text import columns, number, with_unit, yes_no
from tmsopt.studies.row import Row
from tmsopt.studies.study import Study
from tmsopt.studies.summary import Share, Summary

LISTED = 40
"""Rows up to which a study is shown whole."""

_FIRST = 10  # rows of a longer one
_CAUSES = 5
_WORDS = {"not_converged": "not converged"}
_EVALUATED = {"optimal": "feasible"}


def study_table(study: Study, found: Summary, rows: Iterable[Row]) -> str:
    """What varies, how the rows ended, the rows or the first of them, the best one and what the rows say together."""
    listed = list(islice(rows, LISTED + 1))
    whole = len(listed) <= LISTED
    lines = [study.title or study.problem.title or "untitled study", _headline(study, found), ""]
    if listed:
        lines += columns(_row_cells(study, listed if whole else listed[:_FIRST]))
        lines += [] if whole else [f"  … {found.rows} rows in all; --export rows.csv writes them"]
        lines.append("")
    lines += _facts(study, found)
    return "\n".join(line.rstrip() for line in lines).rstrip()


def row_lines(row: Row) -> str:
    """One row in a line: its number, seed, what varies and how it ended."""
    given = ", ".join(f"{name} = {number(value)}" for name, value in row.varied.items())
    parts = [f"row {row.number}: {given}", f"seed {row.seed}", _WORDS.get(row.status, row.status), row.cause]
    return "; ".join(part for part in parts if part)


def _headline(study: Study, found: Summary) -> str:
    """How the rows were made and how they ended."""
    names = ", ".join(study.columns)
    if study.grid_shape is not None:
        names = " × ".join(f"{name} ({size})" for name, size in study.grid_shape.items())
    made = f"{study.method.replace('_', ' ')} over {names}: {found.rows} rows"
    ended = ", ".join(f"{count} {_word(study, status)}" for status, count in found.counts.items())
    missing = found.rows - sum(found.counts.values())
    return f"{made}; {ended or 'none solved'}" + (f", {missing} not yet solved" if missing else "")


def _row_cells(study: Study, rows: Sequence[Row]) -> list[tuple[str, ...]]:
    of = study.problem.parameter_set
    free = [name for name in study.problem.free if name not in study.columns]
    text = study.problem.minimize or study.problem.maximize
    asked = [text] if text and text != "abscissa" and text not in free else []
    heads = ["row", *(_head(of, n) for n in study.columns), "status", *asked, "abscissa", "structure", "stable"]
    heads += [*(_head(of, n) for n in free), *(_report_head(study, text) for text in _reports(study))]
    return [tuple(heads), *(_cells(study, row, bool(asked), free) for row in rows)]


def _cells(study: Study, row: Row, asked: bool, free: Sequence[str]) -> tuple[str, ...]:
    known = row.status in ("optimal", "not_converged") or (row.status == "infeasible" and not study.problem.free)
    return (
        str(row.number), *(_short(row.varied[n]) for n in study.columns), _word(study, row.status),
        *([_short(row.objective) if known else ""] if asked else []), _short(row.abscissa) if known else "",
        row.structure if known else "", yes_no(row.stable) if known else "",
        *(_short(row.parameters[n]) if known and n in row.parameters else "" for n in free),
        *(_short(row.reports[text]) if known and text in row.reports else "" for text in _reports(study)),
    )  # fmt: skip


def _facts(study: Study, found: Summary) -> list[str]:
    lines = []
    if found.best is not None and study.problem.free:
        given = ", ".join(f"{name} = {number(value)}" for name, value in found.best.varied.items())
        lines.append(f"best: row {found.best.number}, {number(found.best.objective)} at {given}")
    same = (study.problem.minimize or "").strip() == "abscissa"
    for name, (least, median, most) in found.spread.items():
        if (same and name == "objective") or found.product is not None:
            continue
        lines.append(f"{name}: {_short(least)} to {_short(most)}, median {_short(median)}")
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
        at = ", ".join(f"{100 * float(q):g} % {number(value)}" for q, value in found.product.abscissa.items())
        lines.append(f"abscissa at most, for a share of all rows: {at}")
    for cause, count in islice(found.causes.items(), _CAUSES):
        lines.append(f"{count} × {cause}")
    if len(found.causes) > _CAUSES:
        lines.append(f"… and {len(found.causes) - _CAUSES} other causes")
    return [*lines, *study.notes]


_SHARES = {"stable": "stable", "feasible": "every constraint met", "good": "both"}


def _share(share: Share) -> str:
    low, high = share.interval
    return (
        f"{share.count} of {share.of} ({100 * share.share:.3g} %; 95 % interval {100 * low:.3g} to {100 * high:.3g} %)"
    )


def _head(of: ParameterSet, name: str) -> str:
    """The name of a column with its unit."""
    stem = name.removesuffix(".min").removesuffix(".max")
    return name if stem not in of.names else with_unit(of, stem).replace(stem, name, 1)


def _reports(study: Study) -> list[str]:
    """What is recorded beside what has a column anyway."""
    return [text for text in study.report if text not in ("abscissa", *study.problem.free, *study.columns)]


def _report_head(study: Study, text: str) -> str:
    """An expression, with its unit where it is a quantity."""
    problem = study.problem
    quantities = {q.name: q.unit for q in (*problem.model.quantities, *problem.parameter_set.quantities)}
    unit = quantities.get(text.strip(), "1")
    return text if unit == "1" else f"{text} {unit}"


def _word(study: Study, status: str) -> str:
    """A status in words; where nothing is free, a row is not optimal but feasible."""
    return _WORDS.get(status, status) if study.problem.free else _EVALUATED.get(status, status)


def _short(value: float) -> str:
    return f"{value:.9g}" if math.isfinite(value) else "none"
