"""Runs a study: an executor solves its rows, and a store saves them."""

import time
from collections.abc import Generator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import Fault, InputError, callback_faults, count_faults, input_error, short, suggest
from tmsopt.executor import Crash, Executor, Note, cluster, cores, ignore_note, in_process, processes
from tmsopt.files import as_path
from tmsopt.problem.unit_system import units_of
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Printable, Table, frame
from tmsopt.studies.export import build_grid_dataset, export
from tmsopt.studies.files import load_study
from tmsopt.studies.monte_carlo import Sampling, prepare_study
from tmsopt.studies.rows import Batch, Row, RowTable, batch_rows
from tmsopt.studies.solving import Solver, can_evaluate, evaluate_rows, split_into_blocks
from tmsopt.studies.store import Store, open_store, store_error, view_store
from tmsopt.studies.study import Study, definition
from tmsopt.studies.summary import Summary, summarise
from tmsopt.versions import SCHEMA

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

_COMMIT_SECONDS = 1.0
"""Seconds between transactions. A kill loses at most the rows of this time; a transaction takes about 1/30 of it."""

_MAX_ROWS_WITHOUT_WORKERS = 32  # up to this number of rows, starting workers would take longer than solving the rows


@dataclass(frozen=True, repr=False)
class Results(Printable):
    """A study with its rows.

    Attributes:
        rows: all rows; if the study was stopped, the rows solved until then.
        solved: number of rows solved by this call; the others were in the store.
        seconds: time taken by the rows that this call solved.
        engine: ``in process``, ``2 processes`` or the address of a cluster; empty if no row was solved.
        found: number of rows that were in the store.
        about: metadata for exports: the definition of the study, and the time, machine and versions of its store.

    Example:
        >>> study = tmsopt.over_grid("problems/ep4.toml", {"zeta_B": [-0.45, -0.8]})
        >>> results = tmsopt.run_study(study, workers=1)
        >>> [f"{row.parameters['chi_B']:.6f}" for row in results.rows]  # sqrt(zeta_B/zeta_H), zeta_H = -0.2
        ['1.500000', '2.000000']

    More: docs/reference/study_file.md
    """

    study: Study
    rows: RowTable = field(repr=False)
    solved: int
    seconds: float
    engine: str
    found: int = 0
    about: Mapping[str, Any] = field(default=Table(), repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.rows, RowTable):
            vars(self).update(rows=RowTable(self.study, [batch_rows(self.rows)]))

    def column(self, name: str) -> NDArray[Any]:
        """The values of one column, one for each row; nan where a row has none.

        Args:
            name: header of an exported file: a field such as ``status`` or ``abscissa``, a parameter, or
                ``varied.mu``, ``report.2*Fr``, ``law.chib``, ``violation.trail``.

        Raises:
            InputError: for an unknown header.
        """
        if name not in self.rows.headers:
            raise input_error(f"no column '{name}'; {suggest(name, self.rows.headers)}", "column")
        return self.rows.values(name)

    @property
    def summary(self) -> Summary:
        """Counts, best row, spread and causes, and for a Monte Carlo study the yield."""
        return summarise(self.rows)

    def to_frame(self) -> "DataFrame":
        """The rows as a pandas table with the headers of an exported file.

        Raises:
            InputError: if pandas is not installed.
        """
        return frame({head: self.rows.values(head) for head in self.rows.headers})

    def to_xarray(self) -> "Dataset":
        """The rows as a dataset over the varied values, if they fill a grid.

        Raises:
            InputError: if the rows do not fill a grid, or xarray is not installed.
        """
        dataset: Dataset | None = build_grid_dataset(self.rows)
        if dataset is None:
            raise input_error(f"the {len(self.rows)} rows do not fill a grid; use to_frame", "study")
        return dataset

    def to_json(self, table: bool = True) -> dict[str, Any]:
        """Plain data for ``json.dumps``: the summary, and the rows as ``table``, which is empty without `table`."""
        head = {"schema": SCHEMA, "title": self.study.title, "model": self.study.problem.model.name}
        rows = [row.to_json() for row in self.rows] if table else []
        return head | {"method": self.study.method} | self.summary.to_json() | {"table": rows}

    def export(self, path: str | PathLike[str], progress: Listener | None = None) -> None:
        """Write the rows to a CSV, Parquet or netCDF file; see `tmsopt.studies.export`."""
        about = dict(self.about or {"definition": definition(self.study)})
        about["units"] = units_of(self.study.problem.posed, self.study.report)
        export(self.rows, as_path(path, "the file to write"), about, progress)


def run_study(
    study: Study | Sampling | str | PathLike[str],
    store: str | PathLike[str] | None = None,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    fresh: bool = False,
    progress: Listener | None = None,
    note: Note = ignore_note,
) -> Results:
    """Solve every row of a study that is not in its store yet.

    The rows do not depend on the number of workers, nor on the order in which they are solved.

    Args:
        study: a study, or the path of its file.
        store: path of an SQLite file that saves solved rows once a second, so that the same call continues after an
            interruption; without a store, rows are kept in memory only.
        workers: number of processes on this machine; 1 solves in this process. The default is one per core, or 1 for
            few rows.
        scheduler: address of a Dask scheduler, such as ``tcp://host:8786``; it replaces the workers.
        fresh: move an existing store aside and start a new one.
        progress: called from time to time with a `tmsopt.Progress`, first with the number of rows in the store.
        note: called with lines about the store, and about workers that end unexpectedly.

    Raises:
        InputError: if the store belongs to another study, or an argument is invalid.
        NotSolved: if the nominal design of a Monte Carlo study is not found.

    Example:
        >>> study = tmsopt.over_grid("problems/ep4.toml", {"zeta_B": [-0.3, -0.5]})
        >>> [f"{row.abscissa:.6f}" for row in tmsopt.run_study(study, workers=1).rows]
        ['-2.020516', '-1.778279']
        >>> [f"{tmsopt.laws.w01(zeta_B, -0.2):.6f}" for zeta_B in (-0.3, -0.5)]  # the law of the paper
        ['-2.020516', '-1.778279']

    More: docs/tutorials/study.md
    """
    request = load_study(study) if isinstance(study, str | PathLike) else study
    faults = callback_faults("progress", progress)
    if not isinstance(request, Study | Sampling):
        accepted = "a Study, such as from tmsopt.over_grid, or the path of a study file"
        faults.append(Fault(f"found {short(request)}; accepted: {accepted}", ("study",)))
    if workers is not None:
        faults += count_faults("workers", workers, 1)
    if faults:
        raise InputError(faults)
    path = None if store is None else as_path(store, "an SQLite file")
    full_study = prepare_study(request, progress, None if fresh else path)
    if path is None:
        return _complete_rows(full_study, None, workers, scheduler, note, progress)
    start_steps(progress, "waiting for the store")
    with open_store(path, full_study, fresh=fresh) as opened_store:
        for line in opened_store.warnings:
            note(line)
        return _complete_rows(full_study, opened_store, workers, scheduler, note, progress)


def read_results(study: Study, store: str | PathLike[str]) -> Results:
    """Read the rows of a study from its store; another process may write it at the same time.

    Raises:
        InputError: if there is no store.
    """
    with view_store(as_path(store, "an SQLite file")) as opened_store:
        rows = RowTable(study, _read_batches(study, opened_store))
        return Results(study, rows, 0, 0.0, "", len(rows), opened_store.about())


def _read_batches(study: Study, store: Store) -> list[Batch]:
    """Read all rows of a store.

    Raises:
        InputError: for a row number outside the study, or a damaged store.
    """
    batches = store.read_batches()
    for number in (number for batch in batches for number in batch["number"][[0, -1]].tolist()):
        if not 0 <= number < len(study):
            advice = f"--fresh moves the store aside, Store.forget([{number}]) removes the row"
            raise store_error(store.path, f"row {number} does not belong to this study; {advice}")
    return batches


def _complete_rows(
    study: Study,
    store: Store | None,
    workers: int | None,
    scheduler: str | None,
    note: Note,
    progress: Listener | None,
) -> Results:
    """Read the rows of the store, if there is one; solve the missing rows and store them."""
    batches, is_missing, engine = list[Batch](), np.ones(len(study), dtype=bool), ""
    if store is not None:
        start_steps(progress, "reading the store")
        batches = _read_batches(study, store)  # a damaged store is reported before any work
        for batch in batches:
            is_missing[batch["number"]] = False
    stored_count = done_count = len(study) - int(is_missing.sum())
    if stored_count and store is not None:
        note(f"{stored_count} of {len(study)} rows are in {store.path}")
    start_time, steps = time.perf_counter(), start_steps(progress, "solving rows", "row")

    def report_rows(increment: int) -> None:
        nonlocal done_count
        done_count += increment
        if steps:
            steps(done_count, len(study))

    def save_batch(batch: Batch) -> None:
        if store is not None:
            store.add(batch)
        batches.append(batch)
        is_missing[batch["number"]] = False

    if stored_count < len(study):
        report_rows(0)
        if can_evaluate(study):
            engine = "in process"
            for batch in evaluate_rows(study, np.flatnonzero(is_missing)):
                save_batch(batch)
                report_rows(len(batch["number"]))
    if is_missing.any():
        remaining, new_rows, last_commit = set(np.flatnonzero(is_missing).tolist()), list[Row](), time.perf_counter()
        executor = _choose_executor(len(remaining), workers, scheduler, note)
        engine = executor.name
        try:
            with executor, closing(_solve_rows(study, remaining, executor, note)) as rows:
                for row in rows:
                    new_rows.append(row)
                    report_rows(1)
                    if time.perf_counter() - last_commit >= _COMMIT_SECONDS:
                        save_batch(batch_rows(new_rows))
                        new_rows, last_commit = [], time.perf_counter()
        finally:
            save_batch(batch_rows(new_rows))  # also after an interruption
    seconds = time.perf_counter() - start_time if engine else 0.0
    about = {} if store is None else store.about()
    return Results(study, RowTable(study, batches), done_count - stored_count, seconds, engine, stored_count, about)


def _choose_executor(row_count: int, workers: int | None, scheduler: str | None, note: Note) -> Executor:
    """The executor for a number of rows."""
    if scheduler is not None:
        return cluster(scheduler, note)
    workers = workers or (1 if row_count <= _MAX_ROWS_WITHOUT_WORKERS else cores())
    return in_process() if workers == 1 else processes(workers, note)


def _solve_rows(study: Study, remaining: set[int], executor: Executor, note: Note) -> Generator[Row]:
    """Yield rows when they are solved.

    If a block crashes its worker process, its rows are solved one by one; a row that crashes its worker is quarantined.
    """
    blocks = split_into_blocks(study) if study.warm else [(number,) for number in sorted(remaining)]
    solver, tasks = Solver(study), [block for block in blocks if not remaining.isdisjoint(block)]
    while tasks:
        single_rows: list[tuple[int, ...]] = []
        with closing(executor.map(solver, tasks)) as answers:
            for index, answer in answers:
                task = tasks[index]
                if not isinstance(answer, Crash):
                    yield from (row for row in answer if row.number in remaining)  # part of a block may be in the store
                elif len(task) > 1:
                    single_rows += [(number,) for number in task if number in remaining]
                else:
                    note(f"row {task[0]} is quarantined")
                    cause = f"ended its worker twice{f' ({answer.cause})' if answer.cause else ''}"
                    yield solver.row(task[0], status="quarantined", cause=cause)
        tasks = single_rows
