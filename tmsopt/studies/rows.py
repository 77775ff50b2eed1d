"""The rows of a study: one as plain data, many as columns of NumPy."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import short
from tmsopt.evaluation.law_rows import LAWS
from tmsopt.models import tms
from tmsopt.problem.problem import Posed
from tmsopt.problem.unit_system import unit_of
from tmsopt.records import Table
from tmsopt.search.solve import UNSTABLE
from tmsopt.studies.study import Study

STATUSES = ("optimal", "infeasible", "not_converged", "failed", "quarantined")
"""Of a row: those of a solution; ``failed`` where the row cannot be posed or solving it broke; ``quarantined`` where it
ended its worker, twice."""

BLOCK = 10_000
"""Rows that are read, written or made at once."""


@dataclass(frozen=True)
class Row:
    """What one row of a study came to; a failure is a row with a cause.

    Attributes:
        number: of the row, from 0.
        seed: of its starts.
        varied: name → value that the study gave it (rad, SI units).
        status: one of `STATUSES`.
        cause: why the status is not ``optimal``; empty where it is.
        objective: value of the objective expression; nan where there is none.
        abscissa, abscissa_realised: as in `Solution`; rows of older stores have the first alone.
        parameters: every parameter of the set the problem is written in.
        reports: the expressions that the study asked for.
        bound: a value that no design in the box can beat; −inf where none is known.
        method: how the bound was found; ``none``.
        laws: label of a law of the paper → relative residual, where the law applies.
        violations: name → by how much it is violated, in its own units (rad, SI); inf where it has no value.
        starts: tried.
        warm: whether it was started from a neighbour's optimum.
        seconds, host: how long it took and where; the only ones that differ when a row is solved again.

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
    parameters: Table[float] = field(default_factory=Table)
    reports: Table[float] = field(default_factory=Table)
    bound: float = -math.inf
    gap: float = math.inf
    proven: bool = False
    method: str = "none"
    laws: Table[float] = field(default_factory=Table)
    violations: Table[float] = field(default_factory=Table)
    starts: int = 0
    warm: bool = False
    seconds: float = 0.0
    host: str = ""

    @property
    def stable(self) -> bool | None:
        """Whether all roots lie left of the axis, ideal and as stored; None where there are none."""
        return None if not math.isfinite(self.abscissa) else self.abscissa < 0 and not self.abscissa_realised >= 0

    @property
    def identity(self) -> str:
        """Everything but `seconds` and `host`, as text."""
        return json.dumps(self.to_json() | {"seconds": None, "host": None}, sort_keys=True)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``: None is nan, or no bound; other infinities are text, ``"-inf"``."""
        made = {f.name: _to_json(f.type(getattr(self, f.name)), f.default) for f in _FIELDS}
        return made | {"stable": self.stable}

    @staticmethod
    def from_json(data: Any) -> "Row":
        """The row that `to_json` was made of.

        Raises:
            ValueError: for data that no row becomes.
        """
        try:
            given = {f: _from_json(data[f.name]) for f in _FIELDS if data.get(f.name) is not None}
            row = Row(**{f.name: f.type(value) for f, value in given.items()})
        except (AttributeError, OverflowError, TypeError) as error:
            raise ValueError(f"{error}") from error
        if row.status not in STATUSES:
            raise ValueError(f"status: found {short(row.status)}; accepted: {' '.join(STATUSES)}")
        return row


_FIELDS: Sequence[Any] = fields(Row)


def _to_json(value: Any, absent: Any = math.nan) -> Any:
    if isinstance(value, Mapping):
        return {name: _to_json(number) for name, number in value.items()}
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return None if math.isnan(value) or value == absent else str(value)


def _from_json(value: Any) -> Any:
    if not isinstance(value, Mapping):
        return value
    return {name: math.nan if number is None else float(number) for name, number in value.items()}


PREFIXES = {"varied": "varied.", "parameters": "", "reports": "report.", "laws": "law.", "violations": "violation."}
"""Of the header for the names in each table of a row. Parameters have none; one called as a field of the row, such as
``seed``, is ``parameter.seed``. The header of a value so depends on nothing but its own name."""

SAVED: Mapping[str, Any] = {f.name: f.type for f in _FIELDS if f.name not in (*PREFIXES, "seed")}
"""Fields with one value, but the seed, which follows from the study → type."""

_ORDER = [f.name for f in _FIELDS]
_ORDER.insert(_ORDER.index("structure") + 1, "stable")

Part = dict[str, NDArray[Any]]
"""Columns of some rows by header: all of `SAVED`, and numbers of the tables, nan where a row has none; what follows
from the study may be left out."""


def header(table: str, key: str) -> str:
    """Of the values of one name in one table of the rows."""
    return f"parameter.{key}" if table == "parameters" and key in _ORDER else f"{PREFIXES[table]}{key}"


def headers(study: Study) -> dict[str, tuple[str, str]]:
    """Header of every column that rows of a study have → field of the row, and name in it where that is a table."""
    problem = study.problem.posed
    names = {
        "varied": tuple(study.columns),
        "parameters": problem.parameter_set.names,
        "reports": tuple(study.report),
        "laws": LAWS if problem.model is tms else (),
        "violations": (*problem.constraints, *problem.located[1:], "a0", "coefficients"),
    }
    found: dict[str, tuple[str, str]] = {}
    for name in _ORDER:
        found |= {header(name, key): (name, key) for key in names[name]} if name in names else {name: (name, "")}
    return found


def column_of(values: Sequence[Any], kind: type) -> NDArray[Any]:
    """Values of one type as an array; texts as objects."""
    return np.array(values, dtype=object if kind is str else kind)


def blank(count: int) -> Part:
    """So many rows that say nothing."""
    return {name: column.repeat(count) for name, column in part_of([Row(0, 0, Table(), "")]).items()}


def part_of(rows: Sequence[Row]) -> Part:
    """Rows as columns."""
    part = {name: column_of([getattr(row, name) for row in rows], kind) for name, kind in SAVED.items()}
    for k, row in enumerate(rows):
        for table in ("parameters", "reports", "laws", "violations"):
            for key, value in getattr(row, table).items():
                part.setdefault(header(table, key), np.full(len(rows), np.nan))[k] = value
    return part


def _merged(parts: Sequence[Part]) -> Part:
    """Parts as one, by ascending number; they are left empty, so that no number is held twice."""
    counts = [len(part["number"]) for part in parts]
    order = np.argsort(np.concatenate([part["number"] for part in parts]), kind="stable")
    return {
        head: np.concatenate(
            [part.pop(head, np.broadcast_to(np.nan, n)) for part, n in zip(parts, counts, strict=True)]
        )[order]
        for head in list(dict.fromkeys(head for part in parts for head in part))
    }


def _judged_causes(problem: Posed, judged: Part) -> NDArray[Any]:
    """Why rows are infeasible that were judged without a solver."""
    texts, unstable = judged["cause"], np.zeros(len(judged["cause"]), dtype=bool)
    for name, condition in problem.conditions.items():
        unit, amounts = unit_of(problem, name), judged.get(header("violations", name), np.empty(0))
        violated = np.flatnonzero(~np.isnan(amounts))
        for k, amount in zip(violated.tolist(), amounts[violated].tolist(), strict=True):
            texts[k] += f"{', ' if texts[k] else 'violated: '}{name} by {unit.show(amount, 3)}"
        if "abscissa" in condition.names:
            unstable[violated] |= judged["abscissa"][violated] >= 0
    texts[unstable] += f"; {UNSTABLE}"
    return texts


class RowTable(Sequence[Row]):
    """Rows of a study by ascending number.

    What the study gives a row is not kept: its seed and what varies; of rows that were judged without a solver the
    parameters too.

    Args:
        parts: columns of some rows each, which are taken over.

    Attributes:
        headers: of all columns; see `headers`.
        numbers: of the rows.
    """

    def __init__(self, study: Study, parts: Sequence[Part]) -> None:
        self.study, self.headers = study, headers(study)
        self._kept = _merged([blank(0), *parts])
        self.numbers: NDArray[np.int64] = self._kept["number"]
        status = self._kept["status"]
        self._unsolved = (status == "failed") | (status == "quarantined")

    def __len__(self) -> int:
        return len(self.numbers)

    @overload
    def __getitem__(self, where: int) -> Row: ...

    @overload
    def __getitem__(self, where: slice) -> tuple[Row, ...]: ...

    def __getitem__(self, where: int | slice) -> Row | tuple[Row, ...]:
        if isinstance(where, slice):
            return tuple(self._rows(where))
        place = range(len(self))[where]
        return self._rows(slice(place, place + 1))[0]

    def __iter__(self) -> Iterator[Row]:
        for first in range(0, len(self), BLOCK):
            yield from self._rows(slice(first, first + BLOCK))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RowTable | tuple) and list(self) == list(other)

    def __hash__(self) -> int:
        return hash(len(self))

    def __repr__(self) -> str:
        return f"RowTable({len(self)})"

    def _rows(self, at: slice) -> list[Row]:
        columns = [self.column(head, at).tolist() for head in self.headers]
        made = []
        for values in zip(*columns, strict=True):
            row: dict[str, Any] = {name: {} for name in PREFIXES}
            for (name, key), value in zip(self.headers.values(), values, strict=True):
                if name not in PREFIXES:
                    row[name] = math.nan if value != value else value  # noqa: PLR0124  # one nan: equal rows are equal
                elif value is not None:
                    row[name][key] = value
            made.append(Row(**{f.name: f.type(row[f.name]) for f in _FIELDS}))
        return made

    @cached_property
    def _causes(self) -> NDArray[Any]:
        """Why rows are not optimal; of those that were judged without a solver it follows from their numbers."""
        texts = self._kept["cause"]
        judged = np.flatnonzero((self._kept["status"] == "infeasible") & (texts == ""))
        texts[judged] = _judged_causes(self.study.problem.posed, {head: x[judged] for head, x in self._kept.items()})
        return texts

    def values(self, head: str) -> NDArray[Any]:
        """One column; nan where a row has no value."""
        column = self.column(head)
        return np.where(column.mask, np.nan, column.data) if column.mask.any() else column.data

    def column(self, head: str, at: slice = slice(None)) -> Any:
        """One column of the rows at some places, as a masked array: a row without a value is masked."""
        (name, key), numbers, study = self.headers[head], self.numbers[at], self.study
        values = self._kept[head][at] if head in self._kept else np.full(len(numbers), np.nan)
        absent: Any = False
        match name:
            case "seed":
                values = column_of([study.seed_of(number) for number in numbers.tolist()], int)
            case "cause":
                values = self._causes[at]
            case "stable":
                ideal, realised = self._kept["abscissa"][at], self._kept["abscissa_realised"][at]
                values, absent = (ideal < 0) & ~(realised >= 0), ~np.isfinite(ideal)
            case "varied" | "parameters":
                varied = key in study.columns
                given = np.asarray(study.columns[key])[numbers] if varied else study.problem.fixed.get(key, np.nan)
                values = np.where(np.isnan(values), given, values)
                absent = self._unsolved[at] & (name == "parameters")
            case "reports":
                absent = self._unsolved[at]
            case "laws" | "violations":
                absent = np.isnan(values)
        return np.ma.array(values, mask=absent)
