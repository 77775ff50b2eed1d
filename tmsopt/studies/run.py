"""A study carried out: rows by an engine, into a store."""

import time
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from tmsopt.design.unit_system import units_of
from tmsopt.disk import path_of
from tmsopt.errors import Fault, InputError, count_faults, short, suggest
from tmsopt.records import SCHEMA, Progress, Shown, frame
from tmsopt.studies.engines import Note, Unit, cluster, cores, in_process, processes
from tmsopt.studies.engines.work import silent
from tmsopt.studies.export import columns, export, gridded
from tmsopt.studies.load import load_study
from tmsopt.studies.monte_carlo import Sampling, planned
from tmsopt.studies.neighbours import blocks
from tmsopt.studies.row import Row
from tmsopt.studies.solving import Solver
from tmsopt.studies.store.store import Store, open_store, read_store
from tmsopt.studies.study import Study, definition
from tmsopt.studies.summary import Summary, summary

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

_COMMIT = 1.0
"""s of rows in one transaction: what a kill may cost, and some 30 times what a transaction takes."""

_FEW = 32  # rows for which no workers are started unless asked for: they take seconds to come up


@dataclass(frozen=True, repr=False)
class Results(Shown):
    """A study with its rows.

    Attributes:
        rows: all of them; what a store had so far, of a study that was stopped.
        solved: rows solved now; the others were in the store.
        seconds: that they took.
        engine: ``in process``, ``2 processes`` or the address of a cluster; empty where nothing was left to solve.
        found: rows that were in the store.
        about: what exports say of the study: its definition, and of a store when, where and with what it was made.
    """

    study: Study
    rows: tuple[Row, ...] = field(repr=False)
    solved: int
    seconds: float
    engine: str
    found: int = 0
    about: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def column(self, name: str) -> NDArray[Any]:
        """The values of one column, one per row, nan where a row has none: by a header of an exported file.

        Fields such as ``status`` and ``abscissa``, parameters by their names, and ``varied.mu``, ``report.2*Fr``,
        ``law.chib``, ``violation.trail``.

        Raises:
            InputError: for a name that no row has.
        """
        found = columns(self.rows)
        if name not in tuple(found):
            raise InputError([Fault(f"no column '{name}'; {suggest(name, found)}", ("column",))])
        return found[name].numbers

    @property
    def summary(self) -> Summary:
        """What the rows say together: counts, best, spread, causes, and of a Monte Carlo study its shares."""
        return summary(self.study, self.rows)

    def to_frame(self) -> "DataFrame":
        """The rows as a table of pandas, with the headers of an exported file.

        Raises:
            InputError: where pandas is not installed.
        """
        return frame({name: column.numbers for name, column in columns(self.rows).items()})

    def to_xarray(self) -> "Dataset":
        """The rows over the values that vary, of a study whose rows fill a grid.

        Raises:
            InputError: where they do not, or xarray is not installed.
        """
        made: Dataset | None = gridded(columns(self.rows))
        if made is None:
            message = f"the {len(self.rows)} rows fill no grid; use to_frame"
            raise InputError([Fault(message, ("study",))])
        return made

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``: the summary, and the rows as ``table``."""
        head = {"schema": SCHEMA, "title": self.study.title, "model": self.study.problem.model.name}
        table = [row.to_json() for row in self.rows]
        return head | {"method": self.study.method} | self.summary.to_json() | {"table": table}

    def export(self, path: str | PathLike[str]) -> None:
        """Write the rows to a CSV, Parquet or netCDF file; see `tmsopt.studies.export`."""
        about = dict(self.about or {"definition": definition(self.study)})
        units = units_of(self.study.problem, self.study.report)
        export(self.rows, path_of(path, "the file to write"), about | {"units": units})


def run_study(
    study: Study | Sampling | str | PathLike[str], store: str | PathLike[str] | None = None, *,
    workers: int | None = None, scheduler: str | None = None, fresh: bool = False, progress: Progress | None = None,
    note: Note = silent,
) -> Results:  # fmt: skip
    """Solve every row of a study that its store does not have yet.

    The rows are the same, bit by bit, whoever solves them and in whatever order.

    Args:
        study: or the path of its file.
        store: path of an SQLite file that keeps the rows as they are solved, once a second; the same call goes on after
            an interruption. Rows are held in memory only, without it.
        workers: processes of this machine; 1 solves in this one. By default as many as cores, or 1 for few rows.
        scheduler: address of a Dask scheduler, such as ``tcp://host:8786``, in place of workers.
        fresh: move a store that is there aside, and start anew.
        progress: called with rows done and in all, first with those found.
        note: called with a line about the store, and about workers that end.

    Raises:
        InputError: for a store of another study, and whatever else cannot be done as asked.
        NotSolved: where a Monte Carlo study has no design to draw around.
    """
    stated = load_study(study) if isinstance(study, str | PathLike) else study
    if faults := list(_faults(stated, workers)):
        raise InputError(faults)
    asked = planned(stated)
    if store is None:
        kept: list[Row] = []
        began, engine, solved = time.perf_counter(), "", 0
        rows, engine = _solved(asked, set(), workers, scheduler, note)
        with closing(rows):
            for row in _counted(rows, 0, len(asked), progress):
                kept.append(row)
                solved += 1
        kept.sort(key=lambda row: row.number)
        return Results(asked, tuple(kept), solved, time.perf_counter() - began, engine)
    with open_store(path_of(store, "an SQLite file"), definition(asked), fresh=fresh) as opened:
        for line in (*opened.warnings, *([f"moved the old store to {opened.moved}"] if opened.moved else [])):
            note(line)
        there = _rows(asked, opened)  # damage is said before any work
        if found := len(there):
            note(f"{found} of {len(asked)} rows are in {opened.path}")
        if found < len(asked):
            there = ()  # not in memory twice: they are read again with the others
        made = fill(asked, opened, workers=workers, scheduler=scheduler, progress=progress, note=note)
        return Results(asked, there or _rows(asked, opened), *made, found, opened.about())


def stored(study: Study, store: str | PathLike[str]) -> Results:
    """The rows that a store has of a study, also while it is being solved; nothing is changed.

    Raises:
        InputError: where there is no store.
    """
    with read_store(path_of(store, "an SQLite file")) as opened:
        rows = _rows(study, opened)
        return Results(study, rows, 0, 0.0, "", len(rows), opened.about())


def _rows(study: Study, store: Store) -> tuple[Row, ...]:
    """All rows of a store.

    Raises:
        InputError: for one that the study cannot have, or that is damaged.
    """
    number, rows = store.outside(len(study)), []
    if number is None:
        for row in store.rows():
            rows.append(row)
            if row.varied != study.varied(row.number):
                number = row.number
    if number is None:
        return tuple(rows)
    message = (
        f"row {number} is not of this study; --fresh moves the store aside, Store.forget([{number}]) removes the row"
    )
    raise InputError([Fault(message, file=str(store.path))])


def _faults(study: object, workers: object) -> Iterator[Fault]:
    """What is wrong with the call."""
    if not isinstance(study, Study | Sampling):
        message = f"found {short(study)}; accepted: a Study, as of tmsopt.over_grid, or the path of a study file"
        yield Fault(message, ("study",))
    if workers is not None:
        yield from count_faults("workers", workers, 1)


def fill(
    study: Study, store: Store, *, workers: int | None = None, scheduler: str | None = None,
    progress: Progress | None = None, note: Note = silent,
) -> tuple[int, float, str]:  # fmt: skip
    """Solve the rows that an open store lacks; how many, in how many seconds, and by which engine."""
    began = time.perf_counter()
    done = store.done()
    if len(done) == len(study):
        return 0, 0.0, ""
    rows, engine = _solved(study, done, workers, scheduler, note)
    fresh: list[Row] = []
    solved, last = 0, began
    with closing(rows):
        try:
            for row in _counted(rows, len(done), len(study), progress):
                if row.number in done:
                    continue  # of a block that had been stored in part
                fresh.append(row)
                solved += 1
                if time.perf_counter() - last >= _COMMIT:
                    store.add(fresh)
                    fresh, last = [], time.perf_counter()
        finally:
            store.add(fresh)  # interrupted or not, what was solved is kept
    return solved, time.perf_counter() - began, engine


def _solved(
    study: Study, done: set[int], workers: int | None, scheduler: str | None, note: Note
) -> tuple[Generator[Row], str]:
    """Rows as they come, and the name of the engine."""
    units = list(_units(study, done))
    work = Solver(study)
    if scheduler is not None:
        return cluster(work, units, scheduler, note), scheduler
    missing = len(study) - len(done)
    count = workers or (1 if missing <= _FEW else cores())
    if count == 1:
        return in_process(work, units, note), "in process"
    return processes(work, units, count, note), f"{count} processes"


def _units(study: Study, done: set[int]) -> Iterable[Unit]:
    """What is left to be solved; a block of neighbours as a whole."""
    if study.warm:
        return (block for block in blocks(study) if not done.issuperset(block))
    return ((number,) for number in range(len(study)) if number not in done)


def _counted(rows: Iterable[Row], done: int, most: int, progress: Progress | None) -> Iterator[Row]:
    if progress:
        progress(done, most)
    for row in rows:
        yield row
        done += 1
        if progress:
            progress(min(done, most), most)
