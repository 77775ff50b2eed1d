"""`tmsopt study`: one problem, solved for many rows."""

import math
import sys
import tomllib
from dataclasses import replace
from functools import partial
from os.path import realpath
from pathlib import Path
from typing import Any

import click

import tmsopt
from tmsopt.cli.answers import Reply, answer, answer_rows, check_output, write_file, write_files
from tmsopt.cli.command import OnFile, WithPage, WithPlot, option
from tmsopt.cli.ending import BAD_INPUT, INTERRUPTED, hold_signals
from tmsopt.cli.terminal import progress_listener, show_step
from tmsopt.errors import input_error
from tmsopt.files import read_text
from tmsopt.progress import Progress


class StudyCommand(WithPage, WithPlot, OnFile):
    """Solve the problem of the study FILE for every row of its varied values.

    Examples:
      tmsopt study problems/study_sway.toml --row 7
      tmsopt study problems/study_sway.toml --workers 4 --export rows.csv
      tmsopt study problems/study_built.toml --plot built.png

    After a stop, the same command continues, and shows all rows in the store.

    Exit status: 0 done, failed rows included; 2 bad input.
    """

    store: Path | None = option("SQLite file for the rows.  [default: NAME.sqlite]")
    fresh: bool = option("Start anew; rename an existing store.")
    row: int | None = option("Solve only this row, without a store.", type=click.IntRange(0))
    workers: int | None = option("Number of processes.  [default: one per core]", type=click.IntRange(1))
    scheduler: str | None = option("Dask cluster, instead of processes.", metavar="ADDRESS")
    export: tuple[Path, ...] = option("Write all rows (csv, parquet, nc); repeatable.")

    def run(self) -> int:
        from tmsopt.studies import check_export, load_study

        no_effect = "has no effect with --row, which solves one row and stores nothing; leave one of the two out"
        self.refuse_useless(
            (
                self.scheduler,
                "workers",
                "has no effect with --scheduler; leave one of the two out",
            ),
            (self.row is not None, "store fresh export plot report workers scheduler", no_effect),
        )
        for target in self.export:
            check_export(target)
        path = self.store or Path(f"{self.file.stem}.sqlite")
        if self.row is not None:
            self._answer_row(_prepare_study(load_study(self.file)), self.row)
            return 0
        check_output("--store", path, (path.suffix.lstrip(".").lower(),))
        request = load_study(self.file)
        self._check_distinct_files(path)
        study = _prepare_study(request, None if self.fresh else path)
        path = Path(realpath(path))
        results, is_stopped = self._solve_rows(study, path)
        with hold_signals():
            self._answer(results, path, is_stopped)
        for target in self.export if len(results.rows) else ():
            write_file("--export", target, lambda path: results.export(path, progress_listener()))
        write_files(self, Reply(results), *self._list_files(with_rows=False))
        if is_stopped:
            click.echo(f"stopped: the rows solved so far are in {path}; the same command continues the work", err=True)
        return INTERRUPTED if is_stopped else 0

    def _check_distinct_files(self, store: Path) -> None:
        """Check that no file is written twice, and that no file of the study is overwritten."""
        uses = {realpath(path): "a file of the study" for path in self._list_files(with_rows=True)}
        exports = [("--export", target) for target in self.export]
        for name, path in [("--store", store), *exports, ("--plot", self.plot), ("--report", self.report)]:
            if path and (real_path := realpath(path)) in uses:
                raise input_error(f"'{path}' is {uses[real_path]}; give another name", name)
            if path:
                uses[real_path] = f"the file that {name} writes"

    def _list_files(self, with_rows: bool) -> list[Path]:
        """The study file, the problem file if the study names one, and with `with_rows` the CSV file of the rows."""
        tables = tomllib.loads(read_text(str(self.file), "TOML study file"))
        names = [tables.get("problem"), tables.get("study", {}).get("csv") if with_rows else None]
        return [self.file, *(self.file.parent / name for name in names if isinstance(name, str))]

    def _solve_rows(self, study: "tmsopt.Study", path: Path) -> "tuple[tmsopt.Results, bool]":
        """The study with its rows, and whether the user stopped it."""
        from tmsopt.executor import EngineError
        from tmsopt.studies import read_results

        row_counts: list[float] = []  # number of rows at each report of progress
        listener = progress_listener()

        def update(progress: Progress) -> None:
            if progress.unit == "row" and math.isfinite(progress.most):
                row_counts.append(progress.done)
            if listener:
                listener(progress)

        engine: Any = {"workers": self.workers, "scheduler": self.scheduler, "note": partial(click.echo, err=True)}
        try:
            return tmsopt.run_study(study, path, fresh=self.fresh, progress=update, **engine), False
        except KeyboardInterrupt:
            if not row_counts:  # the study was stopped before the first row
                raise
            return replace(read_results(study, path), found=int(row_counts[0])), True
        except EngineError as error:
            click.echo(f"{error}; the rows solved so far are in {path}", err=True)
            sys.exit(BAD_INPUT)

    def _answer(self, results: "tmsopt.Results", path: Path, is_stopped: bool) -> None:
        solved, seconds = results.solved, results.seconds
        if self.json:
            run: dict[str, Any] = {"store": str(path), "rows_found": results.found}
            if is_stopped:
                run["interrupted"] = True
            elif results.found < len(results.study):
                run |= {"rows_solved": solved, "seconds": round(seconds, 4), "engine": results.engine}
            answer_rows(results.to_json(table=False) | {"run": run}, "table", results.rows)
            return
        content: list[Any] = [results]
        if solved:
            rate = solved / max(seconds, 1e-9)
            engine = f"{rate:.3g} a second, {results.engine}"
            content.append(f"{solved} rows solved in {seconds:.3g} s, {engine}; store: {path}")
        answer(False, content, dict)

    def _answer_row(self, study: "tmsopt.Study", number: int) -> None:
        from tmsopt.documents import describe_row
        from tmsopt.studies import solve_row

        show_step("solving the row")
        solved_row = solve_row(study, number)
        results = {"solution": solved_row.solution} if solved_row.solution is not None else {}
        data = {"schema": 1, **solved_row.row.to_json(), **{name: result.to_json() for name, result in results.items()}}
        answer(self.json, [describe_row(study, solved_row.row), *results.values()], lambda: data)


def _prepare_study(request: "tmsopt.Study | tmsopt.Sampling", store: Path | None = None) -> "tmsopt.Study":
    """The study with its rows; the nominal design of a Monte Carlo study is solved first, if its store matches."""
    from tmsopt.studies import prepare_study

    try:
        return prepare_study(request, progress_listener(), store)
    except tmsopt.NotSolved as error:
        click.echo(f"there is no nominal design: {error}", err=True)
        sys.exit(BAD_INPUT)
