"""A study carried out: rows by an engine, into a store."""

import time
from collections.abc import Generator, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import Fault, InputError, call_faults, count_faults, input_error, short, suggest
from tmsopt.executor import Crash, Executor, Note, cluster, cores, here, ignore_note, processes
from tmsopt.files import as_path
from tmsopt.problem.unit_system import units_of
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Printable, frame
from tmsopt.studies.export import export, gridded
from tmsopt.studies.files import load_study
from tmsopt.studies.monte_carlo import Sampling, check_unchanged, planned
from tmsopt.studies.neighbours import blocks
from tmsopt.studies.rows import Part, Row, RowTable, part_of
from tmsopt.studies.solving import Solver, applies, judged
from tmsopt.studies.store import Store, open_store, refuse, view_store
from tmsopt.studies.study import Study, definition
from tmsopt.studies.summary import Summary, summary
from tmsopt.versions import SCHEMA

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

_COMMIT = 1.0
"""s of rows in one transaction: what a kill may cost, and some 30 times what a transaction takes."""

_FEW = 32  # rows for which no workers are started unless asked for: they take seconds to come up


@dataclass(frozen=True, repr=False)
class Results(Printable):
    """A study with its rows.

    Attributes:
        rows: all of them; what a store had so far, of a study that was stopped.
        solved: rows solved now; the others were in the store.
        seconds: that they took.
        engine: ``in process``, ``2 processes`` or the address of a cluster; empty where nothing was left to solve.
        found: rows that were in the store.
        about: what exports say of the study: its definition, and of a store when, where and with what it was made.

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
    about: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.rows, RowTable):
            object.__setattr__(self, "rows", RowTable(self.study, [part_of(self.rows)]))

    def column(self, name: str) -> NDArray[Any]:
        """The values of one column, one per row, nan where a row has none: by a header of an exported file.

        Fields such as ``status`` and ``abscissa``, parameters by their names, and ``varied.mu``, ``report.2*Fr``,
        ``law.chib``, ``violation.trail``.

        Raises:
            InputError: for a name that no row has.
        """
        if name not in self.rows.headers:
            raise input_error(f"no column '{name}'; {suggest(name, self.rows.headers)}", "column")
        return self.rows.values(name)

    @property
    def summary(self) -> Summary:
        """What the rows say together: counts, best, spread, causes, and of a Monte Carlo study its shares."""
        return summary(self.rows)

    def to_frame(self) -> "DataFrame":
        """The rows as a table of pandas, with the headers of an exported file.

        Raises:
            InputError: where pandas is not installed.
        """
        return frame({head: self.rows.values(head) for head in self.rows.headers})

    def to_xarray(self) -> "Dataset":
        """The rows over the values that vary, of a study whose rows fill a grid.

        Raises:
            InputError: where they do not, or xarray is not installed.
        """
        made: Dataset | None = gridded(self.rows)
        if made is None:
            raise input_error(f"the {len(self.rows)} rows fill no grid; use to_frame", "study")
        return made

    def to_json(self, table: bool = True) -> dict[str, Any]:
        """Plain data for ``json.dumps``: the summary, and the rows as ``table``, unless it is to stay empty."""
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
    """Solve every row of a study that its store does not have yet.

    The rows are the same whoever solves them and in whatever order.

    Args:
        study: or the path of its file.
        store: path of an SQLite file that keeps the rows as they are solved, once a second; the same call goes on after
            an interruption. Rows are held in memory only, without it.
        workers: processes of this machine; 1 solves in this one. By default as many as cores, or 1 for few rows.
        scheduler: address of a Dask scheduler, such as ``tcp://host:8786``, in place of workers.
        fresh: move a store that is there aside, and start anew.
        progress: called with a `tmsopt.Progress` now and then; of rows, first with those found.
        note: called with a line about the store, and about workers that end.

    Raises:
        InputError: for a store of another study, and whatever else cannot be done as asked.
        NotSolved: where a Monte Carlo study has no design to draw around.

    Example:
        >>> study = tmsopt.over_grid("problems/ep4.toml", {"zeta_B": [-0.3, -0.5]})
        >>> [f"{row.abscissa:.6f}" for row in tmsopt.run_study(study, workers=1).rows]
        ['-2.020516', '-1.778279']
        >>> [f"{tmsopt.laws.w01(zeta_B, -0.2):.6f}" for zeta_B in (-0.3, -0.5)]  # the law of the paper
        ['-2.020516', '-1.778279']

    More: docs/tutorials/study.md
    """
    stated = load_study(study) if isinstance(study, str | PathLike) else study
    if faults := list(_faults(stated, workers, progress)):
        raise InputError(faults)
    if store is not None and not fresh:
        check_unchanged(stated, store)
    asked = planned(stated, progress)
    if store is None:
        return _completed(asked, None, workers, scheduler, note, progress)
    start_steps(progress, "waiting for the store")
    with open_store(as_path(store, "an SQLite file"), asked, fresh=fresh) as opened:
        for line in opened.warnings:
            note(line)
        return _completed(asked, opened, workers, scheduler, note, progress)


def stored(study: Study, store: str | PathLike[str]) -> Results:
    """The rows that a store has of a study, also while it is being solved; nothing is changed.

    Raises:
        InputError: where there is no store.
    """
    with view_store(as_path(store, "an SQLite file")) as opened:
        rows = RowTable(study, _held(study, opened))
        return Results(study, rows, 0, 0.0, "", len(rows), opened.about())


def _held(study: Study, store: Store) -> list[Part]:
    """All rows of a store.

    Raises:
        InputError: for one that the study cannot have, or that is damaged.
    """
    parts = store.parts()
    for number in (number for part in parts for number in part["number"][[0, -1]].tolist()):
        if not 0 <= number < len(study):
            advice = f"--fresh moves the store aside, Store.forget([{number}]) removes the row"
            raise refuse(store.path, f"row {number} is not of this study; {advice}")
    return parts


def _faults(study: object, workers: object, progress: object) -> Iterator[Fault]:
    """What is wrong with the call."""
    if not isinstance(study, Study | Sampling):
        message = f"found {short(study)}; accepted: a Study, as of tmsopt.over_grid, or the path of a study file"
        yield Fault(message, ("study",))
    if workers is not None:
        yield from count_faults("workers", workers, 1)
    yield from call_faults("progress", progress)


def _completed(
    study: Study,
    store: Store | None,
    workers: int | None,
    scheduler: str | None,
    note: Note,
    progress: Listener | None,
) -> Results:
    """The rows of a store, if there is one, and those that it lacks, which it is given as they come."""
    parts, lacks, engine = list[Part](), np.ones(len(study), dtype=bool), ""
    if store is not None:
        start_steps(progress, "reading the store")
        parts = _held(study, store)  # damage is said before any work
        for part in parts:
            lacks[part["number"]] = False
    found = count = len(study) - int(lacks.sum())
    if found and store is not None:
        note(f"{found} of {len(study)} rows are in {store.path}")
    began, steps = time.perf_counter(), start_steps(progress, "solving rows", "row")

    def keep(part: Part) -> None:
        if store is not None:
            store.add(part)
        parts.append(part)
        lacks[part["number"]] = False

    def show(more: int) -> None:
        nonlocal count
        count += more
        if steps:
            steps(count, len(study))

    if found < len(study):
        show(0)
        if applies(study):
            engine = "in process"
            for part in judged(study, np.flatnonzero(lacks)):
                keep(part)
                show(len(part["number"]))
    if lacks.any():
        left, fresh, last = set(np.flatnonzero(lacks).tolist()), list[Row](), time.perf_counter()
        executor, engine = _engine(len(left), workers, scheduler, note)
        try:
            with closing(_rows(study, left, executor, note)) as rows:
                for row in rows:
                    fresh.append(row)
                    show(1)
                    if time.perf_counter() - last >= _COMMIT:
                        keep(part_of(fresh))
                        fresh, last = [], time.perf_counter()
        finally:
            if fresh:
                keep(part_of(fresh))  # interrupted or not, what was solved is kept
    seconds = time.perf_counter() - began if engine else 0.0
    about = {} if store is None else store.about()
    return Results(study, RowTable(study, parts), count - found, seconds, engine, found, about)


def _engine(count: int, workers: int | None, scheduler: str | None, note: Note) -> tuple[Executor, str]:
    """Who solves so many rows, and its name."""
    workers = workers or (1 if count <= _FEW else cores())
    if scheduler is not None:
        return cluster(scheduler, note), scheduler
    return (here(), "in process") if workers == 1 else (processes(workers, note), f"{workers} processes")


def _rows(study: Study, left: set[int], executor: Executor, note: Note) -> Generator[Row]:
    """Rows as they come. A block that ends its worker is taken apart, a row that does is quarantined."""
    every = blocks(study) if study.warm else [(number,) for number in sorted(left)]
    solver, units = Solver(study), [unit for unit in every if not left.isdisjoint(unit)]
    with executor:
        while units:
            taken_apart: list[tuple[int, ...]] = []
            with closing(executor.map(solver, units)) as answers:
                for place, answer in answers:
                    unit = units[place]
                    if not isinstance(answer, Crash):
                        yield from (row for row in answer if row.number in left)  # a block may be stored in part
                    elif len(unit) > 1:
                        taken_apart += [(number,) for number in unit if number in left]
                    else:
                        note(f"row {unit[0]} is quarantined")
                        cause = f" ({answer.cause})" if answer.cause else ""
                        yield solver.lost(unit[0], f"ended its worker twice{cause}")
            units = taken_apart
