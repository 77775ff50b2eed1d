"""A study carried out: rows by an engine, into a store."""

import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.design.unit_system import units_of
from tmsopt.disk import path_of
from tmsopt.errors import Fault, InputError, call_faults, count_faults, short, suggest
from tmsopt.executor import Crash, Executor, Note, cluster, cores, here, processes, silent
from tmsopt.progress import Listener, counted
from tmsopt.records import Shown, Truth, frame
from tmsopt.studies.export import columns, export, gridded
from tmsopt.studies.judging import RowBlock, applies, gathered, judged, shared_by
from tmsopt.studies.load import load_study
from tmsopt.studies.monte_carlo import Sampling, check_unchanged, planned
from tmsopt.studies.neighbours import blocks
from tmsopt.studies.row import Row
from tmsopt.studies.solving import Solver
from tmsopt.studies.store.definition import doubles
from tmsopt.studies.store.opening import open_store, read_store
from tmsopt.studies.store.store import Store
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
class Results(Shown):
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
    study: Study | Sampling | str | PathLike[str], store: str | PathLike[str] | None = None, *,
    workers: int | None = None, scheduler: str | None = None, fresh: bool = False, progress: Listener | None = None,
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
        found, seconds, engine = _carried_out(asked, _none(asked), workers, scheduler, note, progress)
        return Results(asked, gathered(found.blocks, found.rows), found.count, seconds, engine)
    stated_as = definition(asked, doubles)
    counted(progress, "waiting for the store")
    with open_store(path_of(store, "an SQLite file"), stated_as, fresh=fresh) as opened:
        for line in (*opened.warnings, *([f"moved the old store to {opened.moved}"] if opened.moved else [])):
            note(line)
        counted(progress, "reading the store")
        there = _held(asked, opened)  # damage is said before any work
        if there.count:
            note(f"{there.count} of {len(asked)} rows are in {opened.path}")
        made, seconds, engine = _carried_out(asked, there.done(asked), workers, scheduler, note, progress, opened)
        rows = gathered([*there.blocks, *made.blocks], [*there.rows, *made.rows])
        return Results(asked, rows, made.count, seconds, engine, there.count, opened.about())


def stored(study: Study, store: str | PathLike[str]) -> Results:
    """The rows that a store has of a study, also while it is being solved; nothing is changed.

    Raises:
        InputError: where there is no store.
    """
    with read_store(path_of(store, "an SQLite file")) as opened:
        held = _held(study, opened)
        return Results(study, gathered(held.blocks, held.rows), 0, 0.0, "", held.count, opened.about())


@dataclass
class _Held:
    """Rows of a study in memory."""

    blocks: list[RowBlock] = field(default_factory=list)
    rows: list[Row] = field(default_factory=list)

    @property
    def count(self) -> int:
        """How many there are."""
        return sum(map(len, self.blocks)) + len(self.rows)

    def done(self, study: Study) -> Truth:
        """Of each row of the study, whether it is here."""
        found = _none(study)
        for block in self.blocks:
            found[block.numbers] = True
        found[[row.number for row in self.rows]] = True
        return found


def _none(study: Study) -> Truth:
    return np.zeros(len(study), dtype=bool)


def _held(study: Study, store: Store) -> _Held:
    """All rows of a store.

    Raises:
        InputError: for one that the study cannot have, or that is damaged.
    """
    number, held = store.outside(len(study)), _Held()
    if number is None:
        held = _Held(list(store.blocks()), list(store.singles()))
        wrong = [row.number for row in held.rows if row.varied != study.varied(row.number)]
        wrong += [n for block in held.blocks if (n := _unlike(study, block)) is not None]
        number = wrong[-1] if wrong else None
    if number is None:
        return held
    message = (
        f"row {number} is not of this study; --fresh moves the store aside, Store.forget([{number}]) removes the row"
    )
    raise InputError([Fault(message, file=str(store.path))])


def _unlike(study: Study, block: RowBlock) -> int | None:
    """The number of a row that the study gave other values; None where there is none."""
    if block.shared != shared_by(study) or block.named("varied") != list(study.columns):
        return int(block.numbers[0])
    wrong = np.zeros(len(block), dtype=bool)
    for name, column in study.columns.items():
        wrong |= np.asarray(column)[block.numbers] != block.columns[f"varied.{name}"]
    return int(block.numbers[wrong.argmax()]) if wrong.any() else None


def _faults(study: object, workers: object, progress: object) -> Iterator[Fault]:
    """What is wrong with the call."""
    if not isinstance(study, Study | Sampling):
        message = f"found {short(study)}; accepted: a Study, as of tmsopt.over_grid, or the path of a study file"
        yield Fault(message, ("study",))
    if workers is not None:
        yield from count_faults("workers", workers, 1)
    yield from call_faults("progress", progress)


def fill(
    study: Study, store: Store, *, workers: int | None = None, scheduler: str | None = None,
    progress: Listener | None = None, note: Note = silent,
) -> tuple[int, float, str]:  # fmt: skip
    """Solve the rows that an open store lacks; how many, in how many seconds, and by which engine."""
    done = _none(study)
    done[list(store.done())] = True
    made, seconds, engine = _carried_out(study, done, workers, scheduler, note, progress, store)
    return made.count, seconds, engine


def _carried_out(
    study: Study, done: Truth, workers: int | None, scheduler: str | None, note: Note, progress: Listener | None,
    store: Store | None = None,
) -> tuple[_Held, float, str]:  # fmt: skip
    """The rows that are not done, in how many seconds, and by which engine; kept in a store as they come."""
    began = time.perf_counter()
    made, engine, left, before = _Held(), "", np.flatnonzero(~done), int(done.sum())
    steps = counted(progress, _WHAT, "row")

    def told() -> None:
        if steps:
            steps(before + made.count, len(study))

    if left.size:
        told()
    if left.size and applies(study):
        engine, left = "in process", _judged(study, left, made, store, told)
    if left.size:
        wanted = set(left.tolist())
        rows, engine = _solved(study, wanted, workers, scheduler, note)
        with closing(rows):
            _kept((row for row in rows if row.number in wanted), made, store, told)  # a block may be stored in part
    return made, time.perf_counter() - began if engine else 0.0, engine


def _judged(
    study: Study, left: NDArray[np.int64], made: _Held, store: Store | None, told: Callable[[], None]
) -> NDArray[np.int64]:
    """Judge rows in blocks; the numbers of those that are still left."""
    remaining = []
    for block, some in judged(study, left):
        if store is not None and len(block):
            store.add_block(block)
        made.blocks.append(block)
        remaining.append(some)
        told()
    return np.concatenate(remaining)


def _kept(rows: Iterable[Row], made: _Held, store: Store | None, told: Callable[[], None]) -> None:
    """Take rows as they come, into a store once in a while."""
    fresh, last = list[Row](), time.perf_counter()
    try:
        for row in rows:
            made.rows.append(row)
            fresh.append(row)
            told()
            if store is not None and time.perf_counter() - last >= _COMMIT:
                store.add(fresh)
                fresh, last = [], time.perf_counter()
    finally:
        if store is not None:
            store.add(fresh)  # interrupted or not, what was solved is kept


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
