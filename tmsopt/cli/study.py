"""The command that solves a problem many times over."""

import math
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import tmsopt
from tmsopt.cli.common import (
    check_output,
    file_argument,
    json_option,
    plot_option,
    report_option,
    saving,
    write_file,
    write_json,
    write_json_rows,
    write_report,
)
from tmsopt.cli.ending import BAD_INPUT, INTERRUPTED, answering
from tmsopt.cli.terminal import doing, quiet, shown
from tmsopt.errors import refusal
from tmsopt.files import read_text
from tmsopt.progress import Progress

if TYPE_CHECKING:
    from tmsopt.studies import Results, Sampling, Study

_EXAMPLES = """
\b
Examples:
  tmsopt study problems/study_sway.toml
  tmsopt study problems/study_sway.toml --row 7
  tmsopt study problems/study_sway.toml --workers 4 --export rows.csv
  tmsopt study problems/study_built.toml --plot built.png
  tmsopt study problems/study_built.toml --json
  tmsopt study problems/study_sway.toml --scheduler tcp://host:8786

FILE names a problem and what varies: title, problem = "ep4.toml" (or a table [problem]), then

\b
  [study]   method = "grid" (default), "list", "latin_hypercube", "sobol", "csv" or "monte_carlo"
            rows = 1000 (of a sample), csv = "rows.csv", distribution = "uniform" (default) or "normal",
            seed = 0, starts = 64 (a row, at most), warm = false, report = ["nu_H", "2*Fr_c"]
  [vary]    mu = [0.1, 0.2], mu = { min = 0.05, max = 1, points = 20, log = true }, "lambda_s.max" = ["20 deg"],
            "steer_arm.limit" = [0.02, 0.05]: fixed parameters, ends of free ones, numbers of constraints
  [tolerances]  of monte_carlo, by default those of the problem

Rows go to the store, an SQLite file, as they are solved, once a second. The same command goes on where it was stopped,
and shows the rows that are there already. A row solved again, by --row, processes or a cluster, is the same.

A Dask cluster needs the same tmsopt on every worker, and one thread each: dask worker HOST:8786 --nthreads 1.

Exit status: 0 done, failed rows included; 2 bad input.
"""


@click.command(epilog=_EXAMPLES)
@file_argument
@click.option(
    "--store", type=click.Path(path_type=Path), help="SQLite file of the rows. [default: FILE's name.sqlite, here]"
)
@click.option("--fresh", is_flag=True, help="Move a store that is there aside, and start anew.")
@click.option("--row", type=click.IntRange(min=0), default=None, help="Solve this row alone and show it; no store.")
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=None,
    help="Processes of this machine. [default: as many as cores; 1 for few rows]",
)
@click.option("--scheduler", metavar="ADDRESS", help="Of a Dask cluster, in place of workers.")
@click.option(
    "--export",
    "exports",
    type=click.Path(path_type=Path),
    multiple=True,
    help="Write all rows; the ending says how, as in rows.csv, rows.parquet, rows.nc. May be given again.",
)
@plot_option("Draw how the rows are distributed, or the objective over what varies")
@report_option
@json_option
def study(
    file: Path,
    store: Path | None,
    fresh: bool,
    row: int | None,
    workers: int | None,
    scheduler: str | None,
    exports: tuple[Path, ...],
    plot: Path | None,
    report: Path | None,
    as_json: bool,
) -> None:
    """Solve the problem of the study FILE for every row of what varies in it."""
    from tmsopt.studies import check_export, check_unchanged, load_study

    kept = {"--store": store, "--fresh": fresh, "--export": exports, "--plot": plot, "--report": report}
    _check_together(row, scheduler, workers, kept)
    for target in exports:
        check_export(target)
    path = store or Path(f"{file.stem}.sqlite")
    if row is None:
        check_output("--store", path, (path.suffix.lstrip(".").lower(),))
    stated = load_study(file)
    written = [("--store", path), *(("--export", target) for target in exports), ("--plot", plot), ("--report", report)]
    _check_apart(file, [(option, place) for option, place in written if place and row is None])
    if row is None and not fresh:
        check_unchanged(stated, path)
    asked = _planned(stated)
    if row is not None:
        _show_row(asked, row, as_json)
        return
    path = Path(realpath(path))
    results, stopped = _carried_out(asked, path, fresh, {"workers": workers, "scheduler": scheduler})
    with answering():
        _show(results, path, stopped, as_json)
    for target in exports if len(results.rows) else ():
        with saving("--export", target):
            results.export(target, shown())
    write_file("--plot", plot, lambda path: tmsopt.plots.save(results.plot(), path))
    write_report(results, report, *_files(file))
    if stopped:
        click.echo(f"stopped: the rows solved so far are in {path}; the same command goes on", err=True)
        sys.exit(INTERRUPTED)


def _files(file: Path) -> list[Path]:
    """The study, and the problem where it names one."""
    named = _tables(file).get("problem")
    return [file, *([file.parent / named] if isinstance(named, str) else [])]


def _tables(file: Path) -> dict[str, Any]:
    return tomllib.loads(read_text(str(file), "TOML study file"))


def _check_apart(file: Path, written: Sequence[tuple[str, Path]]) -> None:
    """Refuse to write one file twice, or one that the study is read from."""
    rows = _tables(file).get("study", {}).get("csv")
    read = [*_files(file), *([file.parent / rows] if isinstance(rows, str) else [])]
    taken = {realpath(path): "what the study is read from" for path in read}
    for option, path in written:
        if (place := realpath(path)) in taken:
            raise refusal(f"'{path}' is {taken[place]}; give another name", option)
        taken[place] = f"what {option} writes"


def _check_together(row: int | None, scheduler: str | None, workers: int | None, kept: Mapping[str, object]) -> None:
    """Refuse options that would have no effect."""
    given = [*(name for name, value in kept.items() if value)]
    given += [name for name, value in (("--scheduler", scheduler), ("--workers", workers)) if value is not None]
    if row is not None and given:
        message = f"solves one row in this process and keeps nothing; leave out {', '.join(given)}"
        raise refusal(message, "--row")
    if scheduler is not None and workers is not None:
        raise refusal("is for processes of this machine; leave it out with --scheduler", "--workers")


def _planned(asked: "Study | Sampling") -> "Study":
    """The study, with the design of a Monte Carlo one solved first."""
    from tmsopt import NotSolved
    from tmsopt.studies import plan_study

    try:
        return plan_study(asked, shown())
    except NotSolved as error:
        click.echo(f"there is no design to draw around: {error}", err=True)
        sys.exit(BAD_INPUT)


def _carried_out(asked: "Study", path: Path, fresh: bool, where: Mapping[str, Any]) -> "tuple[Results, bool]":
    """The study with its rows, and whether it was stopped on the way."""
    from tmsopt import run_study
    from tmsopt.executor import EngineError
    from tmsopt.studies import read_results

    there: list[float] = []  # rows, when it began

    def told(now: Progress) -> None:
        if now.unit == "row" and math.isfinite(now.most):
            there.append(now.done)
        if listener:
            listener(now)

    listener = shown()
    try:
        return run_study(asked, path, fresh=fresh, progress=told, note=_said, **where), False
    except KeyboardInterrupt:
        if not there:  # before the first row
            raise
        return replace(read_results(asked, path), found=int(there[0])), True
    except EngineError as error:
        click.echo(f"{error}; the rows solved so far are in {path}", err=True)
        sys.exit(BAD_INPUT)


def _said(line: str) -> None:
    click.echo(line, err=True)


def _show(results: "Results", path: Path, stopped: bool, as_json: bool) -> None:
    from tmsopt.report import study_table

    asked, solved, seconds = results.study, results.solved, results.seconds
    if as_json:
        run: dict[str, Any] = {"store": str(path), "rows_found": results.found}
        if stopped:
            run["interrupted"] = True
        elif results.found < len(asked):
            run |= {"rows_solved": solved, "seconds": round(seconds, 4), "engine": results.engine}
        write_json_rows(results.to_json(table=False) | {"run": run}, "table", results.rows)
        return
    text = study_table(asked, results.summary, results.rows)
    with quiet():
        click.echo(text)
        if solved:
            rate = solved / max(seconds, 1e-9)
            click.echo(f"{solved} rows solved in {seconds:.3g} s, {rate:.3g} a second, {results.engine}; store: {path}")


def _show_row(asked: "Study", number: int, as_json: bool) -> None:
    """One row, solved alone."""
    from tmsopt.studies import solve_row

    doing("solving the row")
    solved = solve_row(asked, number)
    if as_json:
        solution = {} if solved.solution is None else {"solution": solved.solution.to_json()}
        write_json({"schema": 1, **solved.row.to_json(), **solution})
        return
    from tmsopt.report import design_report, row_lines

    said = [row_lines(asked, solved.row)]
    if solved.solution is not None:
        said.append(design_report(solved.solution))
    with quiet():
        click.echo("\n\n".join(said))
