"""The rows of a study: one as plain data, many as columns of NumPy."""

import json
import math
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import short
from tmsopt.problem.unit_system import unit_of
from tmsopt.records import Table, Truth
from tmsopt.search.solve import UNSTABLE
from tmsopt.studies.study import Study, names_of

STATUSES = ("optimal", "infeasible", "not_converged", "failed", "quarantined")
"""Of a row: those of a solution; ``failed`` where the row cannot be posed or solving it broke; ``quarantined`` where it
ended its worker, twice."""


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
        violations: name → by how much it is violated, in its own units (rad, SI).
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
        kept = {name: value for name, value in self.to_json().items() if name not in ("seconds", "host")}
        return json.dumps(kept, sort_keys=True)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``: None is nan, or no bound; other infinities are text, ``"-inf"``."""
        data = {f.name: _plain(getattr(self, f.name), f.type, _ABSENT.get(f.name, math.nan)) for f in _FIELDS}
        return data | {"stable": self.stable}

    @staticmethod
    def from_json(data: Any) -> "Row":
        """The row that `to_json` was made of.

        Raises:
            ValueError: for data that no row becomes.
        """
        try:
            made = {f.name: _read(f.name, f.type, data[f.name]) for f in _FIELDS if f.name in data}
            row = Row(**made)
        except (AttributeError, OverflowError, TypeError) as error:
            raise ValueError(f"{error}") from error
        if row.status not in STATUSES:
            raise ValueError(f"status: found {short(row.status)}; accepted: {' '.join(STATUSES)}")
        return row


_FIELDS = fields(Row)
_ABSENT = {"bound": -math.inf, "gap": math.inf}


def _plain(value: Any, kind: Any, absent: float) -> Any:
    if kind is float:
        return number if math.isfinite(number := float(value)) else _text(number, absent)
    if isinstance(value, Mapping):
        return {n: v if math.isfinite(v := float(given)) else _text(v, math.nan) for n, given in value.items()}
    return kind(value)  # NumPy's integers and truths are not JSON


def _text(number: float, absent: float) -> str | None:
    return None if number == absent or (math.isnan(number) and math.isnan(absent)) else str(number)


def _read(name: str, kind: Any, value: Any) -> Any:
    if kind is float:
        return _ABSENT.get(name, math.nan) if value is None else float(value)
    if kind in (int, str, bool):
        return kind(value)
    return Table({n: math.nan if x is None else float(x) for n, x in value.items()})


PREFIXES = {"varied": "varied.", "parameters": "", "reports": "report.", "laws": "law.", "violations": "violation."}
"""Of the header for the names in each table of a row. Parameters have none; one called as a field of the row, such as
``seed``, is ``parameter.seed``. The header of a value so depends on nothing but its own name."""

FIELDS: dict[str, Any] = {}
"""Field of a row → its type, in the order of columns; ``stable`` is bool or None."""
for _field in fields(Row):
    FIELDS[_field.name] = _field.type
    if _field.name == "structure":
        FIELDS["stable"] = bool

PLAIN = tuple(name for name in FIELDS if name not in PREFIXES)
"""Fields with one value."""

_DEFAULTS = {float: np.nan, int: 0, bool: False, str: ""}
_LARGEST = 2**63 - 1
Names = Mapping[str, Iterable[str]]
_NO_NAMES: Names = {}


@dataclass(frozen=True)
class PartialColumn:
    """The values of one name, one per row.

    Attributes:
        values: of float, int or bool; an object array of strings; nan where a number is absent.
        present: which rows have a value: nan may also be one.
    """

    values: NDArray[Any]
    present: Truth

    @property
    def numbers(self) -> NDArray[Any]:
        """The values; truths of which some are absent as 1, 0 and nan."""
        lacking = self.values.dtype == np.bool_ and not self.present.all()
        return np.where(self.present, self.values, np.nan) if lacking else self.values


Part = Mapping[str, PartialColumn]
"""Header → column of some rows; what follows from the study is left out (see `RowTable`)."""


def full(values: Any) -> PartialColumn:
    """A column in which every row has a value."""
    return PartialColumn(values, np.broadcast_to(np.True_, len(values)))


def header(table: str, key: str) -> str:
    """Of the values of one name in one table of the rows."""
    return f"parameter.{key}" if table == "parameters" and key in FIELDS else f"{PREFIXES[table]}{key}"


class RowTable(Sequence[Row]):
    """Rows of a study by ascending number.

    What the study gives a row is not kept. Rows without a seed were judged without a solver: their seeds, parameters
    and causes follow from the study too.

    Args:
        parts: columns of some rows each.
    """

    def __init__(self, study: Study, parts: Sequence[Part]) -> None:
        self._study = study
        self._columns = _merged([part for part in parts if len(part["number"].values)])
        self.numbers: NDArray[np.int64] = self._columns["number"].values
        self._judged = ~self._columns["seed"].present if "seed" in self._columns else np.ones(len(self), dtype=bool)
        self._names = {name: tuple(keys) for name, keys in names_of(study).items()}
        known = {header(name, key) for name, keys in self._names.items() for key in keys}
        for name in ("reports", "laws", "violations"):  # a store may have laws that have other labels now
            more = (h for h in self._columns if h.startswith(PREFIXES[name]) and h not in known)
            self._names[name] += tuple(h.removeprefix(PREFIXES[name]) for h in more)

    def __len__(self) -> int:
        return len(self.numbers)

    @overload
    def __getitem__(self, where: int) -> Row: ...

    @overload
    def __getitem__(self, where: slice) -> tuple[Row, ...]: ...

    def __getitem__(self, where: int | slice) -> Row | tuple[Row, ...]:
        places = np.arange(len(self))[where]
        return self._row(int(places)) if isinstance(where, int) else tuple(map(self._row, places.tolist()))

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, RowTable | tuple)
            and len(self) == len(other)
            and all(a == b for a, b in zip(self, other, strict=True))
        )

    def __hash__(self) -> int:
        return hash(len(self))

    def __repr__(self) -> str:
        return f"RowTable({len(self)})"

    def _row(self, k: int) -> Row:
        at = slice(k, k + 1)
        made: dict[str, Any] = {name: _item(self._plain(name, at)) for name in PLAIN if name != "stable"}
        for name, keys in self._names.items():
            some = {key: self._keyed(name, key, at) for key in keys}
            made[name] = Table({key: _item(column) for key, column in some.items() if column.present[0]})
        return Row(**made)

    def columns(self, names: Names = _NO_NAMES) -> "Columns":
        """Header → column, each made when it is asked for; see the function `columns`."""

        def plain(name: str) -> Callable[[], PartialColumn]:
            return lambda: self._plain(name)

        def keyed(name: str, key: str) -> Callable[[], PartialColumn]:
            return lambda: self._keyed(name, key)

        made: dict[str, Callable[[], PartialColumn]] = {}
        for name in FIELDS:
            if name in PLAIN:
                made[name] = plain(name)
                continue
            used = (key for key in self._names[name] if self._keyed(name, key).present.any())
            made |= {header(name, key): keyed(name, key) for key in dict.fromkeys([*names.get(name, ()), *used])}
        return Columns(made)

    def _plain(self, name: str, at: slice = slice(None)) -> PartialColumn:
        """A field of one value in rows at some places."""
        numbers, judged = self.numbers[at], self._judged[at]
        if name == "stable":
            ideal, realised = self._plain("abscissa", at).values, self._plain("abscissa_realised", at).values
            return PartialColumn((ideal < 0) & ~(realised >= 0), np.isfinite(ideal))
        column = self._columns.get(name)
        kind = FIELDS[name]
        values = np.full(len(numbers), _DEFAULTS[kind], dtype=object if kind is str else kind)
        if column is not None:
            values = column.values[at]
        if name == "seed" and judged.any():
            values = values.copy()
            values[judged] = [self._study.seed_of(number) for number in numbers[judged].tolist()]
        if name == "cause" and judged.any():
            values = values.copy()
            values[judged] = self._judged_causes(np.arange(len(self))[at][judged])
        return full(values)

    def _keyed(self, name: str, key: str, at: slice = slice(None)) -> PartialColumn:
        """A name in a table of rows at some places."""
        numbers, varied = self.numbers[at], self._study.columns
        if name == "varied":
            return full(np.asarray(varied[key])[numbers])
        column = self._columns.get(header(name, key))
        if column is None:
            column = PartialColumn(np.full(len(numbers), np.nan), np.zeros(len(numbers), dtype=bool))
        else:
            column = PartialColumn(column.values[at], column.present[at])
        judged = self._judged[at]
        if name != "parameters" or not judged.any():
            return column
        of_study = np.asarray(varied[key])[numbers] if key in varied else float(self._study.problem.fixed[key])
        return PartialColumn(np.where(judged, of_study, column.values), judged | column.present)

    def _judged_causes(self, places: NDArray[np.int64]) -> list[str]:
        """Why judged rows are infeasible; empty where they are not."""
        problem = self._study.problem
        texts, unstable = [""] * len(places), np.zeros(len(places), dtype=bool)
        for name, condition in problem.conditions.items():
            column = self._columns.get(header("violations", name))
            if column is None:
                continue
            present, unit = column.present[places], unit_of(problem, name)
            for k in np.flatnonzero(present).tolist():
                amount = unit.show(float(column.values[places[k]]), 3)
                texts[k] += f"{', ' if texts[k] else 'violated: '}{name} by {amount}"
            if "abscissa" in condition.names:
                unstable |= present
        unstable &= self._columns["abscissa"].values[places] >= 0
        return [f"{text}; {UNSTABLE}" if wrong else text for text, wrong in zip(texts, unstable.tolist(), strict=True)]

    def causes(self) -> list[tuple[str, int]]:
        """Why rows are not optimal, and how many there are: one text for all judged ones that violate the same."""
        wrong = self._plain("status").values != "optimal"
        solved = np.flatnonzero(wrong & ~self._judged)
        found = [(k, 1) for k in solved.tolist()]
        judged = np.flatnonzero(wrong & self._judged)
        if judged.size:
            kinds = (self._columns["abscissa"].values[judged] < 0).astype(np.int64)
            for name in self._names["violations"]:
                kinds = np.unique(2 * kinds + self._keyed("violations", name).present[judged], return_inverse=True)[1]
            first, counts = np.unique(kinds, return_index=True, return_counts=True)[1:]
            found += zip(judged[first].tolist(), counts.tolist(), strict=True)
        return [(self._plain("cause", slice(k, k + 1)).values.item(), count) for k, count in sorted(found)]


def _item(column: PartialColumn) -> Any:
    value = column.values.item()
    return math.nan if value != value else value  # noqa: PLR0124  # one nan, so that rows that are the same are equal


def _merged(parts: Sequence[Part]) -> dict[str, PartialColumn]:
    """Parts as one, by ascending number."""
    if not parts:
        return {"number": full(np.empty(0, dtype=np.int64))}
    counts = [len(part["number"].values) for part in parts]
    numbers = np.concatenate([part["number"].values for part in parts])
    order = slice(None) if np.all(np.diff(numbers) > 0) else np.argsort(numbers, kind="stable")
    merged = {}
    for head in dict.fromkeys(head for part in parts for head in part):
        if head == "stable" or head.startswith(PREFIXES["varied"]):
            continue
        kind = next(part[head].values.dtype for part in parts if head in part)
        absent = _DEFAULTS.get(FIELDS.get(head, float))
        nothing = [PartialColumn(np.full(n, absent, kind), np.zeros(n, dtype=bool)) for n in counts]
        columns = [part.get(head, lacking) for part, lacking in zip(parts, nothing, strict=True)]
        values, present = ([getattr(c, name) for c in columns] for name in ("values", "present"))
        if len(parts) == 1:
            merged[head] = PartialColumn(values[0][order], present[0][order])
        else:
            merged[head] = PartialColumn(np.concatenate(values)[order], np.concatenate(present)[order])
    return merged


@dataclass(frozen=True)
class Columns(Mapping[str, PartialColumn]):
    """Header → column, each made when it is asked for."""

    made: Mapping[str, Callable[[], PartialColumn]]

    def __getitem__(self, name: str) -> PartialColumn:
        return self.made[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self.made)

    def __len__(self) -> int:
        return len(self.made)


class _Sparse:
    def __init__(self) -> None:
        self.values, self.places = array("d"), array("q")

    def full(self, count: int) -> PartialColumn:
        places = np.array(self.places, dtype=np.int64)
        values, present = np.full(count, np.nan), np.zeros(count, dtype=bool)
        values[places], present[places] = np.array(self.values), True
        return PartialColumn(values, present)


def columns(rows: Iterable[Row], names: Names = _NO_NAMES) -> Part:
    """Header → column, in the order of the fields of a row.

    Args:
        names: table of a row, such as ``laws`` → names that have a column whatever the rows have.
    """
    if isinstance(rows, RowTable):
        return rows.columns(names)
    plain: dict[str, Any] = {name: array("d") if FIELDS[name] is float else [] for name in PLAIN}
    tables = {name: {key: _Sparse() for key in names.get(name, ())} for name in PREFIXES}
    count = 0
    for row in rows:
        for name, values in plain.items():
            values.append(getattr(row, name))
        for name, found in tables.items():
            for key, value in getattr(row, name).items():
                sparse = found.setdefault(key, _Sparse())
                sparse.values.append(value)
                sparse.places.append(count)
        count += 1
    made: dict[str, PartialColumn] = {}
    for name, kind in FIELDS.items():
        if name not in plain:
            made |= {header(name, key): sparse.full(count) for key, sparse in tables[name].items()}
        elif name == "stable":
            made[name] = PartialColumn(
                np.array(plain[name], dtype=bool), np.array([v is not None for v in plain[name]], dtype=bool)
            )
        else:
            made[name] = full(_array(plain[name], kind))
    return made


def _array(values: Any, kind: Any) -> NDArray[Any]:
    if kind is int:
        fits = all(-_LARGEST <= v <= _LARGEST for v in values)  # a seed may be longer: then all are text
        return np.array(values, dtype=np.int64) if fits else np.array([str(v) for v in values], dtype=object)
    return np.array(values, dtype=object if kind is str else kind)
