"""A study carried out: rows by an engine, into a store."""

import time
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import Fault, InputError, call_faults, count_faults, short, suggest
from tmsopt.executor import Crash, Executor, Note, cluster, cores, here, processes, silent
from tmsopt.files import path_of
from tmsopt.problem.unit_system import units_of
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Printable, frame
from tmsopt.studies.export import export, gridded
from tmsopt.studies.files import load_study
from tmsopt.studies.monte_carlo import Sampling, check_unchanged, planned
from tmsopt.studies.neighbours import blocks
from tmsopt.studies.rows import Part, Row, RowTable, columns
from tmsopt.studies.solving import Solver, applies, judged
from tmsopt.studies.store import Store, open_store, read_store
from tmsopt.studies.study import Study, definition, names_of
from tmsopt.studies.summary import Summary, summary
from tmsopt.versions import SCHEMA

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

_COMMIT = 1.0
"""s of rows in one transaction: what a kill may cost, and some 30 times what a transaction takes."""

_WHAT = "solving rows"
Unit = tuple[int, ...]
"""Numbers of rows that are solved together: usually one, a block where neighbours start each other."""

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
    rows: Sequence[Row] = field(repr=False)
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
        found = columns(self.rows, names_of(self.study))
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
        return frame({name: column.numbers for name, column in columns(self.rows, names_of(self.study)).items()})

    def to_xarray(self) -> "Dataset":
        """The rows over the values that vary, of a study whose rows fill a grid.

        Raises:
            InputError: where they do not, or xarray is not installed.
        """
        made: Dataset | None = gridded(columns(self.rows, names_of(self.study)))
        if made is None:
            message = f"the {len(self.rows)} rows fill no grid; use to_frame"
            raise InputError([Fault(message, ("study",))])
        return made

    def to_json(self, table: bool = True) -> dict[str, Any]:
        """Plain data for ``json.dumps``: the summary, and the rows as ``table``, unless it is to stay empty."""
        head = {"schema": SCHEMA, "title": self.study.title, "model": self.study.problem.model.name}
        rows = [row.to_json() for row in self.rows] if table else []
        return head | {"method": self.study.method} | self.summary.to_json() | {"table": rows}

    def export(self, path: str | PathLike[str], progress: Listener | None = None) -> None:
        """Write the rows to a CSV, Parquet or netCDF file; see `tmsopt.studies.export`."""
        about = dict(self.about or {"definition": definition(self.study)})
        units = units_of(self.study.problem, self.study.report)
        export(self.rows, path_of(path, "the file to write"), about | {"units": units}, names_of(self.study), progress)


def run_study(
    study: Study | Sampling | str | PathLike[str],
    store: str | PathLike[str] | None = None,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    fresh: bool = False,
    progress: Listener | None = None,
    note: Note = silent,
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
        made, seconds, engine = _carried_out(asked, [], workers, scheduler, note, progress)
        rows = RowTable(asked, made)
        return Results(asked, rows, len(rows), seconds, engine)
    start_steps(progress, "waiting for the store")
    with open_store(path_of(store, "an SQLite file"), asked, fresh=fresh) as opened:
        for line in (*opened.warnings, *([f"moved the old store to {opened.moved}"] if opened.moved else [])):
            note(line)
        start_steps(progress, "reading the store")
        there = _held(asked, opened)  # damage is said before any work
        found = _count(there)
        if found:
            note(f"{found} of {len(asked)} rows are in {opened.path}")
        made, seconds, engine = _carried_out(asked, there, workers, scheduler, note, progress, opened)
        return Results(asked, RowTable(asked, [*there, *made]), _count(made), seconds, engine, found, opened.about())


def stored(study: Study, store: str | PathLike[str]) -> Results:
    """The rows that a store has of a study, also while it is being solved; nothing is changed.

    Raises:
        InputError: where there is no store.
    """
    with read_store(path_of(store, "an SQLite file")) as opened:
        rows = RowTable(study, _held(study, opened))
        return Results(study, rows, 0, 0.0, "", len(rows), opened.about())


def _count(parts: Iterable[Part]) -> int:
    return sum(len(part["number"].values) for part in parts)


def _held(study: Study, store: Store) -> list[Part]:
    """All rows of a store.

    Raises:
        InputError: for one that the study cannot have, or that is damaged.
    """
    parts = store.parts()
    for part in parts:
        for number in part["number"].values[[0, -1]].tolist():
            if not 0 <= number < len(study):
                advice = f"--fresh moves the store aside, Store.forget([{number}]) removes the row"
                raise InputError([Fault(f"row {number} is not of this study; {advice}", file=str(store.path))])
    return parts


def _faults(study: object, workers: object, progress: object) -> Iterator[Fault]:
    """What is wrong with the call."""
    if not isinstance(study, Study | Sampling):
        message = f"found {short(study)}; accepted: a Study, as of tmsopt.over_grid, or the path of a study file"
        yield Fault(message, ("study",))
    if workers is not None:
        yield from count_faults("workers", workers, 1)
    yield from call_faults("progress", progress)


def fill(
    study: Study,
    store: Store,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Listener | None = None,
    note: Note = silent,
) -> tuple[int, float, str]:
    """Solve the rows that an open store lacks; how many, in how many seconds, and by which engine."""
    made, seconds, engine = _carried_out(study, _held(study, store), workers, scheduler, note, progress, store)
    return _count(made), seconds, engine


def _carried_out(
    study: Study,
    there: Sequence[Part],
    workers: int | None,
    scheduler: str | None,
    note: Note,
    progress: Listener | None,
    store: Store | None = None,
) -> tuple[list[Part], float, str]:
    """The rows that are not there, in how many seconds, and by which engine; kept in a store as they come."""
    began, made, engine, steps = time.perf_counter(), list[Part](), "", start_steps(progress, _WHAT, "row")
    lacks = np.ones(len(study), dtype=bool)
    for part in there:
        lacks[part["number"].values] = False
    count = len(study) - int(lacks.sum())

    def keep(part: Part) -> None:
        if store is not None:
            store.add_part(part)
        made.append(part)
        lacks[part["number"].values] = False

    def tell(more: int) -> None:
        nonlocal count
        count += more
        if steps:
            steps(count, len(study))

    if lacks.any():
        tell(0)
    if lacks.any() and applies(study):
        engine = "in process"
        for part in judged(study, np.flatnonzero(lacks)):
            keep(part)
            tell(_count([part]))
    if lacks.any():
        rows, engine = _solved(study, set(np.flatnonzero(lacks).tolist()), workers, scheduler, note)
        fresh, last = list[Row](), time.perf_counter()
        try:
            with closing(rows):
                for row in rows:
                    if lacks[row.number]:  # a block may be stored in part
                        fresh.append(row)
                        tell(1)
                    if time.perf_counter() - last >= _COMMIT:
                        keep(columns(fresh))
                        fresh, last = [], time.perf_counter()
        finally:
            if fresh:
                keep(columns(fresh))  # interrupted or not, what was solved is kept
    return made, time.perf_counter() - began if engine else 0.0, engine


def _solved(
    study: Study, left: set[int], workers: int | None, scheduler: str | None, note: Note
) -> tuple[Generator[Row], str]:
    """Rows as they come, and the name of the engine."""
    count = workers or (1 if len(left) <= _FEW else cores())
    if scheduler is not None:
        return _rows(study, left, cluster(scheduler, note), note), scheduler
    if count == 1:
        return _rows(study, left, here(), note), "in process"
    return _rows(study, left, processes(count, note), note), f"{count} processes"


def _rows(study: Study, left: set[int], executor: Executor, note: Note) -> Generator[Row]:
    """Rows as they come. A block that ends its worker is taken apart, a row that does is quarantined."""
    solver, units = Solver(study), list(_units(study, left))
    with executor:
        while units:
            taken_apart: list[Unit] = []
            with closing(executor.map(solver, units)) as answers:
                for place, answer in answers:
                    unit = units[place]
                    if not isinstance(answer, Crash):
                        yield from answer
                    elif len(unit) > 1:
                        taken_apart += [(number,) for number in unit]
                    else:
                        note(f"row {unit[0]} is quarantined")
                        cause = f" ({answer.cause})" if answer.cause else ""
                        yield solver.lost(unit[0], f"ended its worker twice{cause}")
            units = taken_apart


def _units(study: Study, left: set[int]) -> Iterable[Unit]:
    """What is left to be solved; a block of neighbours as a whole."""
    if study.warm:
        return (block for block in blocks(study) if not left.isdisjoint(block))
    return ((number,) for number in sorted(left))
