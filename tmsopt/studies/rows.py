"""The rows of a study: a single row is plain data, many rows are NumPy columns."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import short
from tmsopt.evaluation.law_rows import LAWS
from tmsopt.models import tms
from tmsopt.problem.unit_system import unit_of
from tmsopt.records import Table
from tmsopt.search.solve import UNSTABLE
from tmsopt.studies.study import Study

STATUSES = ("optimal", "infeasible", "not_converged", "failed", "quarantined")
"""Statuses of a row: the three of a solution, ``failed`` for an invalid problem or an error of the solver, and
``quarantined`` for a row that ended its worker process twice."""

CHUNK_ROWS = 10_000
"""Number of rows that are read or written at once."""


@dataclass(frozen=True)
class Row:
    """The result of one row of a study; a failed row has a cause.

    Attributes:
        number: number of the row, from 0.
        seed: seed of its starts.
        varied: name → value in this row (rad, SI units).
        status: one of `STATUSES`.
        cause: why the status is not ``optimal``, or what an optimal row violates when rounded to doubles; else empty.
        objective: value of the objective; nan if there is none.
        abscissa: largest real part of the roots, for the parameters before rounding.
        abscissa_realised: the same for the parameters as stored in double precision; nan in rows of older stores.
        parameters: every parameter of the problem's parameter set.
        reports: values of the reported expressions.
        bound: no design within the limits has a better objective than this value; −inf if unknown.
        method: how the bound was found; ``none`` without a bound.
        laws: label of a law of the paper → relative residual, where the law applies.
        violations: constraint → amount of violation in its unit (rad, SI); inf where the constraint has no value.
        starts: number of starts tried.
        warm: whether the search started from the optimum of a neighbour.
        seconds, host: time and machine; only these two differ when a row is solved again.

    Example:
        >>> row = tmsopt.run_study(tmsopt.over_grid("problems/ep4.toml", {"mu": [0.3]}), workers=1).rows[0]
        >>> row.status, row.structure, row.varied
        ('optimal', 'EP4', {'mu': 0.3})

    More: docs/reference/study_file.md
    """

    number: int
    seed: int
    varied: Table[float]
    status: str
    cause: str = ""
    objective: float = math.nan
    abscissa: float = math.nan
    abscissa_realised: float = math.nan
    damping_ratio: float = math.nan
    structure: str = ""
    parameters: Table[float] = Table()
    reports: Table[float] = Table()
    bound: float = -math.inf
    gap: float = math.inf
    proven: bool = False
    method: str = "none"
    laws: Table[float] = Table()
    violations: Table[float] = Table()
    starts: int = 0
    warm: bool = False
    seconds: float = 0.0
    host: str = ""

    @property
    def stable(self) -> bool | None:
        """Whether all roots lie left of the imaginary axis, before and after rounding; None without roots."""
        return None if not math.isfinite(self.abscissa) else self.abscissa < 0 and not self.abscissa_realised >= 0

    @property
    def identity(self) -> str:
        """All fields except `seconds` and `host`, as text."""
        return json.dumps(self.to_json() | {"seconds": None, "host": None}, sort_keys=True)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; nan and an unknown bound are None, infinity is a text such as ``"-inf"``."""
        data = {f.name: _to_json(f.type(getattr(self, f.name)), f.default) for f in _FIELDS}
        return data | {"stable": self.stable}

    @staticmethod
    def from_json(data: Any) -> "Row":
        """The row from the data of `to_json`.

        Raises:
            ValueError: if the data are not those of a row.
        """
        try:
            row = Row(**{f.name: f.type(_from_json(data[f.name])) for f in _FIELDS if data.get(f.name) is not None})
        except (AttributeError, OverflowError, TypeError) as error:
            raise ValueError(f"{error}") from error
        if row.status not in STATUSES:
            raise ValueError(f"status: found {short(row.status)}; accepted: {' '.join(STATUSES)}")
        return row


_FIELDS: Sequence[Any] = fields(Row)


def _to_json(value: Any, default: Any = math.nan) -> Any:
    if isinstance(value, Mapping):
        return {name: _to_json(number) for name, number in value.items()}
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return None if math.isnan(value) or value == default else str(value)


def _from_json(value: Any) -> Any:
    if not isinstance(value, Mapping):
        return value
    return {name: math.nan if number is None else float(number) for name, number in value.items()}


PREFIXES = {"varied": "varied.", "parameters": "", "reports": "report.", "laws": "law.", "violations": "violation."}
"""Field of a row that is a table → prefix of the headers of its columns. Parameters have no prefix, except a
parameter that has the name of a field: ``seed`` becomes ``parameter.seed``. So a parameter has the same header in every
study."""

SCALAR_FIELDS: Mapping[str, Any] = {f.name: f.type for f in _FIELDS if f.name not in (*PREFIXES, "seed")}
"""Field with a single value → type; the seed is left out, because it follows from the study."""

_COLUMN_ORDER = [f.name for f in _FIELDS]
_COLUMN_ORDER.insert(_COLUMN_ORDER.index("structure") + 1, "stable")

Batch = dict[str, NDArray[Any]]
"""Header → column, for some rows of a study. A batch has all `SCALAR_FIELDS`, and the numbers in the tables of rows;
a missing number is nan. Columns that follow from the study may be missing."""


def header(table: str, key: str) -> str:
    """Header of the column for a key in a table of the rows."""
    return f"parameter.{key}" if table == "parameters" and key in _COLUMN_ORDER else f"{PREFIXES[table]}{key}"


def headers(study: Study) -> dict[str, tuple[str, str]]:
    """Header of every column of a study → (field of the row, key in that field).

    The key is empty if the field is not a table.
    """
    problem = study.problem.posed
    names = {
        "varied": tuple(study.columns),
        "parameters": problem.parameter_set.names,
        "reports": tuple(study.report),
        "laws": LAWS if problem.model is tms else (),
        "violations": (*problem.constraints, *problem.located[1:], "a0", "coefficients"),
    }
    sources: dict[str, tuple[str, str]] = {}
    for name in _COLUMN_ORDER:
        sources |= {header(name, key): (name, key) for key in names[name]} if name in names else {name: (name, "")}
    return sources


def column_of(values: Sequence[Any], kind: type) -> NDArray[Any]:
    """Values of one type as an array; texts become objects."""
    return np.array(values, dtype=object if kind is str else kind)


def blank_batch(count: int) -> Batch:
    """Columns of rows with default values."""
    return {name: column.repeat(count) for name, column in batch_rows([Row(0, 0, Table(), "")]).items()}


def batch_rows(rows: Sequence[Row]) -> Batch:
    """Rows as columns."""
    batch = {name: column_of([getattr(row, name) for row in rows], kind) for name, kind in SCALAR_FIELDS.items()}
    for k, row in enumerate(rows):
        for table in ("parameters", "reports", "laws", "violations"):
            for key, value in getattr(row, table).items():
                batch.setdefault(header(table, key), np.full(len(rows), np.nan))[k] = value
    return batch


def _merge(batches: Sequence[Batch]) -> Batch:
    """Merge batches into one, sorted by row number; empties the batches to save memory."""
    counts = [len(batch["number"]) for batch in batches]
    order = np.argsort(np.concatenate([batch["number"] for batch in batches]), kind="stable")
    return {
        head: np.concatenate(
            [batch.pop(head, np.broadcast_to(np.nan, n)) for batch, n in zip(batches, counts, strict=True)]
        )[order]
        for head in list(dict.fromkeys(head for batch in batches for head in batch))
    }


class RowTable(Sequence[Row]):
    """Rows of a study, sorted by number.

    Values that follow from the study are computed on demand: seeds, varied values, and the parameters of rows evaluated
    without a solver.

    Args:
        batches: columns of the rows; they are emptied.

    Attributes:
        headers: headers of all columns; see `headers`.
        numbers: numbers of the rows.
    """

    def __init__(self, study: Study, batches: Sequence[Batch]) -> None:
        self.study, self.headers = study, headers(study)
        self._columns = _merge([blank_batch(0), *batches])
        self.numbers: NDArray[np.int64] = self._columns["number"]
        status = self._columns["status"]
        self._is_unsolved = (status == "failed") | (status == "quarantined")

    def __len__(self) -> int:
        return len(self.numbers)

    @overload
    def __getitem__(self, index: int) -> Row: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Row, ...]: ...

    def __getitem__(self, index: int | slice) -> Row | tuple[Row, ...]:
        if isinstance(index, slice):
            return tuple(self._rows(index))
        first = range(len(self))[index]
        return self._rows(slice(first, first + 1))[0]

    def __iter__(self) -> Iterator[Row]:
        for first in range(0, len(self), CHUNK_ROWS):
            yield from self._rows(slice(first, first + CHUNK_ROWS))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RowTable | tuple) and list(self) == list(other)

    def __hash__(self) -> int:
        return hash(len(self))

    def __repr__(self) -> str:
        return f"RowTable({len(self)})"

    def _rows(self, part: slice) -> list[Row]:
        columns = [self.column(head, part).tolist() for head in self.headers]
        rows = []
        for values in zip(*columns, strict=True):
            row: dict[str, Any] = {name: {} for name in PREFIXES}
            for (name, key), value in zip(self.headers.values(), values, strict=True):
                if name not in PREFIXES:
                    row[name] = math.nan if value != value else value  # noqa: PLR0124  # one nan object, so that equal rows compare equal
                elif value is not None:
                    row[name][key] = value
            rows.append(Row(**{f.name: f.type(row[f.name]) for f in _FIELDS}))
        return rows

    @cached_property
    def _full_causes(self) -> NDArray[Any]:
        """Why each row is not optimal. If a row was evaluated without a solver, its violations give the cause."""
        texts, problem, is_unstable = self._columns["cause"], self.study.problem.posed, np.zeros(len(self), dtype=bool)
        lacks_cause = (self._columns["status"] == "infeasible") & (texts == "")
        for name, condition in problem.conditions.items():
            unit, amounts = unit_of(problem, name), self.column(header("violations", name))
            indices = np.flatnonzero(lacks_cause & ~amounts.mask)
            for k, amount in zip(indices.tolist(), amounts[indices].tolist(), strict=True):
                texts[k] += f"{', ' if texts[k] else 'violated: '}{name} by {unit.show(amount, 3)}"
            if "abscissa" in condition.names:
                is_unstable[indices] = self._columns["abscissa"][indices] >= 0
        texts[is_unstable] += f"; {UNSTABLE}"
        return texts

    def values(self, head: str) -> NDArray[Any]:
        """One column; nan where a row has no value."""
        column = self.column(head)
        return np.where(column.mask, np.nan, column.data) if column.mask.any() else column.data

    def column(self, head: str, part: slice = slice(None)) -> Any:
        """One column, or a slice of it, as a masked array; a row without a value is masked."""
        (name, key), numbers, study = self.headers[head], self.numbers[part], self.study
        values = self._columns[head][part] if head in self._columns else np.full(len(numbers), np.nan)
        is_absent: Any = False
        match name:
            case "seed":
                values = column_of([study.seed_of(number) for number in numbers.tolist()], int)
            case "cause":
                values = self._full_causes[part]
            case "stable":
                abscissa, rounded_abscissa = (self._columns[name][part] for name in ("abscissa", "abscissa_realised"))
                values, is_absent = (abscissa < 0) & ~(rounded_abscissa >= 0), ~np.isfinite(abscissa)
            case "varied" | "parameters":
                column = study.columns.get(key)
                study_values = study.problem.fixed.get(key, np.nan) if column is None else np.asarray(column)[numbers]
                values = np.where(np.isnan(values), study_values, values)
            case "laws" | "violations":
                is_absent = np.isnan(values)
        return np.ma.array(values, mask=self._is_unsolved[part] if name in ("parameters", "reports") else is_absent)
