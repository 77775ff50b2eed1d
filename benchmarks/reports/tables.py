"""The tables of the solve benchmark."""

import math
import os
import platform
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import click
import numpy as np

from benchmarks.reports.designs.random_designs import REFERENCE_STARTS, Record
from benchmarks.rivals.reduced import FEASIBLE, LOCAL, SCALAR, STARTS, VECTORISED, Found

_PACKAGES = ("casadi", "numpy", "scipy")
_TOLERANCES = (1e-3, 1e-6, 1e-8)

kept = click.option(
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    default=Path("benchmarks/results.md"),
    show_default=True,
    help="file that keeps the table",
)
"""Option of every benchmark that keeps its table."""


def section(records: Sequence[Record], command: str) -> str:
    """The whole report in Markdown."""
    parts = [
        "## Random constrained designs",
        origin(command),
        _counts(records),
        "### Default settings, by number of free parameters",
        _by_freedom(records),
        "### Beside SciPy on the eigenvalues",
        _rivals(records),
        _ratios(records),
        "### Failures",
        _failures(records),
    ]
    return "\n\n".join(parts) + "\n"


def keep(path: Path, name: str, text: str) -> None:
    """Write a section between its markers, in place of an earlier one."""
    first, last = f"<!-- {name} -->", f"<!-- /{name} -->"
    known = path.read_text(encoding="utf-8") if path.exists() else "# Benchmarks\n"
    before, found, rest = known.partition(first)
    after = rest.partition(last)[2] if found else ""
    path.write_text(f"{before.rstrip()}\n\n{first}\n\n{text}\n{last}\n{after.lstrip(chr(10))}", encoding="utf-8")


def origin(command: str) -> str:
    """Where and with what a section was made."""
    versions = ", ".join([f"Python {platform.python_version()}", *(f"{p} {version(p)}" for p in _PACKAGES)])
    return f"`{command}`, {datetime.now(UTC):%Y-%m-%d}, {versions}, {os.cpu_count()} cores."


def _counts(records: Sequence[Record]) -> str:
    solvable = [r for r in records if r.solvable]
    claimed = [r for r in records if r.default.status == "infeasible"]
    solved = sum(r.solved for r in solvable)
    rows = [
        ("problems", len(records)),
        ("solvable: some method found a feasible design", len(solvable)),
        ("of these, no stable design known", sum(r.best >= 0 for r in solvable)),
        ("**solved at default settings, within 1e-8 of the best known**", f"**{share(solved, len(solvable))}**"),
        ("claimed infeasible, and no method found a feasible design", sum(not r.solvable for r in claimed)),
        ("claimed infeasible, but a method found a feasible design", sum(r.contradicted for r in records)),
        ("neither: no feasible design found, none excluded", len(records) - len(solvable) - _excluded(records)),
        ("median time per start", milliseconds(r.default.per_start for r in solvable)),
        ("90 % of times per start below", milliseconds((r.default.per_start for r in solvable), 0.9)),
        ("median time of a solve", milliseconds(r.default.seconds for r in solvable)),
        ("median time of a solve that ends infeasible", milliseconds(r.default.seconds for r in claimed)),
    ]
    note = (
        f"The best known is the least abscissa of {REFERENCE_STARTS} starts with another seed, of solves that start "
        "where a rival ended, of the rivals and of the default solve itself. Errors are relative to it, or to 1e-3 "
        "where it is smaller. A time per start is the time of the whole solve over the starts that it tried."
    )
    return table(("", ""), rows) + "\n\n" + note


def _excluded(records: Iterable[Record]) -> int:
    return sum(not r.solvable and r.default.status == "infeasible" for r in records)


def _by_freedom(records: Sequence[Record]) -> str:
    rows = []
    for free in sorted({len(r.problem.free) for r in records}):
        group = [r for r in records if len(r.problem.free) == free]
        solvable = [r for r in group if r.solvable]
        rows.append(
            (
                free,
                len(group),
                len(solvable),
                sum(r.solved for r in solvable),
                milliseconds(r.default.per_start for r in solvable),
                milliseconds(r.default.seconds for r in solvable),
                _digits(_quantile(r.default.tried for r in solvable)),
            )
        )
    return table(("free", "problems", "solvable", "solved", "time per start", "time", "starts"), rows)


def _rivals(records: Sequence[Record]) -> str:
    solvable = [r for r in records if r.solvable]
    own = [(r.relative(r.default.value) if r.default.optimal else math.inf, r.default.seconds) for r in solvable]
    rows = [_row("default solve", own)]
    for name in (SCALAR, VECTORISED, *LOCAL):
        run = [(r, r.rivals[name]) for r in solvable if name in r.rivals]
        rows.append(_row(name, [(r.relative(f.value) if f.feasible else math.inf, f.seconds) for r, f in run]))
    note = (
        f"A rival minimises the largest real part of the eigenvalues; its design counts if it violates nothing by "
        f"more than {FEASIBLE:.0e}. An equality is solved for a parameter, so that no rival has to follow it. "
        "Differential evolution has the constraints as such (`NonlinearConstraint`), `tol` = 1e-8 and otherwise "
        "SciPy's defaults, polishing included; vectorised, it evaluates a generation at once and is not polished. "
        f"The others start from the first {STARTS} designs of `solve` and their best end counts; Nelder–Mead has a "
        "penalty for violations. Times of these three are taken with all cores busy."
    )
    header = ("method", "solvable problems", "feasible", *(f"within {t:.0e}" for t in _TOLERANCES), "median time")
    return table(header, rows) + "\n\n" + note


def _row(name: str, ends: Sequence[tuple[float, float]]) -> tuple[object, ...]:
    errors = [e for e, _ in ends]
    shares = [share(sum(e <= t for e in errors), len(ends)) for t in (1e300, *_TOLERANCES)]
    return (name, len(ends), *shares, milliseconds(s for _, s in ends))


def _ratios(records: Sequence[Record]) -> str:
    rows = []
    for name in (SCALAR, VECTORISED):
        pairs = [(r, r.rivals[name]) for r in records if r.solvable and r.default.optimal and name in r.rivals]
        fair = [(r, f) for r, f in pairs if not f.feasible or r.relative(r.default.value) <= r.relative(f.value) + 1e-8]
        rows += [
            (f"{name}, all problems", len(pairs), *_speedups(pairs)),
            (f"{name}, where the default solve is equal or better", len(fair), *_speedups(fair)),
        ]
    header = ("time of differential evolution over that of", "problems", "a default solve", "10 % below", "one start")
    return table(header, rows)


def _speedups(pairs: Sequence[tuple[Record, Found]]) -> tuple[str, str, str]:
    solves = [f.seconds / r.default.seconds for r, f in pairs]
    starts = [f.seconds / r.default.per_start for r, f in pairs]
    return _digits(_quantile(solves)), _digits(_quantile(solves, 0.1)), _digits(_quantile(starts))


def _failures(records: Sequence[Record]) -> str:
    failed = [r for r in records if (r.solvable and not r.solved) or r.contradicted or _unsettled(r)]
    if not failed:
        return "None."
    rows = [
        (
            r.index,
            len(r.problem.free),
            r.default.status,
            f"{r.default.value:.10g}",
            f"{r.best:.10g}",
            f"{r.error:.1e}",
            ", ".join(_attained(r)),
        )
        for r in failed
    ]
    return table(("problem", "free", "status", "value", "best known", "error", "reached by"), rows)


def _unsettled(record: Record) -> bool:
    return not record.solvable and record.default.status != "infeasible"


def _attained(record: Record) -> Iterator[str]:
    """Who has the best value, or any feasible design where none is claimed."""
    if record.reference.optimal and record.relative(record.reference.value) <= 1e-8:
        yield "reference"
    for name, found in record.rivals.items():
        if found.feasible and record.relative(found.value) <= 1e-6:
            yield f"{name} (violation {found.violation:.0e})"


def share(part: int, whole: int) -> str:
    """``3 of 4 (75.0 %)``."""
    return f"{part} of {whole} ({100 * part / whole:.1f} %)" if whole else "–"


def _quantile(numbers: Iterable[float], q: float = 0.5) -> float:
    found = list(numbers)
    return float(np.quantile(found, q)) if found else math.nan


def milliseconds(seconds: Iterable[float], q: float = 0.5) -> str:
    """A quantile, by default the median."""
    return _digits(1e3 * _quantile(seconds, q)) + " ms"


def _digits(number: float) -> str:
    return "–" if math.isnan(number) else f"{number:.0f}" if number >= 100 else f"{number:.2g}"


def table(header: Sequence[object], rows: Iterable[Sequence[object]]) -> str:
    """A table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)
