"""The table [vary] of a study file: what varies, as the columns of a study."""

import csv
import math
from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Any

from tmsopt.design.expression import written_sides
from tmsopt.design.limit import limit_of
from tmsopt.design.problem import Problem
from tmsopt.disk import read_lines
from tmsopt.errors import LISTED, Fault, InputError, count_faults, is_number, short, suggest
from tmsopt.records import Column
from tmsopt.studies.samples import Span, check_size, grid, latin_hypercube, sobol, sobol_note, span_faults
from tmsopt.studies.validate import MOST_NUMBERS, MOST_ROWS, name_faults
from tmsopt.units import with_unit

LARGEST = 1_000_000_000
"""Bytes of a CSV file."""

MOST_COLUMNS, LONGEST_LINE = 1000, 1_000_000
"""Columns of a CSV file, and characters of a line of it."""

_SHOWN = 20  # faults of cells; a file in another format has one in each
_RANGE = "{ min = 0.1, max = 1 }"
_AXIS = "{ min = 0.1, max = 1, points = 10 }"
_ACCEPTED = {
    "grid": f"a list of values such as [0.1, 0.2], or {_AXIS}, with log = true for equal factors",
    "list": "a list with a value for every row, such as [0.1, 0.2]",
    "latin_hypercube": f"{_RANGE}, with log = true for equal factors",
    "sobol": f"{_RANGE}, with log = true for equal factors",
}

Key = tuple[str, ...]


@dataclass(frozen=True)
class Varied:
    """What a table comes to.

    Attributes:
        faults: with keys as written in the table.
        grid_shape: axis → number of values, of a grid.
    """

    faults: list[Fault] = field(default_factory=list)
    columns: Mapping[str, Column] = field(default_factory=dict)
    grid_shape: Mapping[str, int] | None = None
    notes: tuple[str, ...] = ()


def varied(problem: Problem, table: Mapping[str, Any], method: str, rows: int, seed: int, made: bool = True) -> Varied:
    """The columns of a grid, a list or a sample; what is wrong with the table alone where none are to be `made`."""
    entries = _entries(table)
    if not entries:
        message = f"nothing varies; write what does under [vary], such as mu = {_ACCEPTED[method]}"
        return Varied([Fault(message, ("vary",))])
    faults: list[Fault] = []
    read: dict[str, Any] = {}
    wrong_with = name_faults(problem)
    for name, (key, spec) in entries.items():
        if wrong := wrong_with(name):
            faults.append(Fault(wrong, key))
        else:
            read[name] = _VaryReader(problem, name, key, faults).read(spec, method)
    if faults or not made:
        return Varied(faults)
    try:
        return _made(read, method, rows, seed)
    except InputError as error:
        return Varied([Fault(f.message, ("vary",)) for f in error.faults])


def _made(read: Mapping[str, Any], method: str, rows: int, seed: int) -> Varied:
    match method:
        case "list":
            return Varied(columns={name: Column(values) for name, values in read.items()})
        case "latin_hypercube":
            return Varied(columns=latin_hypercube(read, rows, seed))
        case "sobol":
            return Varied(columns=sobol(read, rows, seed), notes=tuple(filter(None, [sobol_note(rows)])))
        case _:
            sizes = {name: axis.count if isinstance(axis, _Points) else len(axis) for name, axis in read.items()}
            check_size(list(sizes.values()))
            axes = {n: axis.span.points(axis.count) if isinstance(axis, _Points) else axis for n, axis in read.items()}
            return Varied(columns=grid(axes), grid_shape=sizes)


def unit_of(problem: Problem, name: str) -> str:
    """The unit in which what varies is a number; empty where that is not known."""
    of = problem.parameter_set
    if name in of.names:
        return of[name].unit
    stem, _, end = name.rpartition(".")
    if end in ("min", "max") and stem in of.names:
        return of[stem].unit
    if end == "limit" and limit_of(problem.constraints.get(stem, "")) is not None:
        left, _, right = written_sides(problem.constraints[stem])
        known = {p.name: p.unit for p in of.parameters}
        known |= {q.name: q.unit for q in (*problem.model.quantities, *of.quantities)}
        return known.get(left) or known.get(right) or ""
    return ""


def _entries(table: Mapping[str, Any]) -> dict[str, tuple[Key, Any]]:
    """Name → its place and what is written there; ``trail.limit = …`` without quotes is a table in TOML."""
    found: dict[str, tuple[Key, Any]] = {}
    for name, spec in table.items():
        if isinstance(spec, Mapping) and any(isinstance(inner, list | Mapping) for inner in spec.values()):
            found |= {f"{name}.{end}": (("vary", name, end), inner) for end, inner in spec.items()}
        else:
            found[name] = (("vary", name), spec)
    return found


@dataclass(frozen=True)
class _Points:
    """An axis of a grid that is written as a range."""

    span: Span
    count: int


@dataclass(frozen=True)
class _VaryReader:
    """Reads one entry; adds what is wrong with it to `faults`."""

    problem: Problem
    name: str
    key: Key
    faults: list[Fault]

    def read(self, spec: Any, method: str) -> Any:
        """A list of numbers, a range with its points, or a span of a sample."""
        if isinstance(spec, list) and spec and method in ("grid", "list"):
            return [self._number(value, self.key) for value in spec]
        if isinstance(spec, Mapping) and method != "list":
            return self._range(spec, points=method == "grid")
        self.faults.append(Fault(f"found {short(spec)}; accepted: {_ACCEPTED[method]}", self.key))
        return None

    def _range(self, spec: Mapping[str, Any], points: bool) -> Any:
        before = len(self.faults)
        accepted = ("min", "max", "points", "log") if points else ("min", "max", "log")
        for end in spec:
            if end not in accepted:
                message = f"unknown key {short(end)} of {self.name}; {suggest(end, accepted)}"
                if end == "points":
                    message = "points are those of a grid; a sample has rows, under [study]"
                self.faults.append(Fault(message, (*self.key, end)))
        for end in accepted[:-1]:
            if end not in spec:
                ends = "min = …, max = …, points = 10" if points else "min = …, max = …"
                self.faults.append(Fault(f"missing {end} of {self.name}; write {self.name} = {{ {ends} }}", self.key))
        low, high = (self._number(spec.get(end, 0.0), (*self.key, end)) for end in ("min", "max"))
        log, count = spec.get("log", False), spec.get("points", 2)
        if not isinstance(log, bool):
            self.faults.append(Fault(f"found {short(log)}; accepted: true or false", (*self.key, "log")))
        faults = count_faults("points", count, 2, MOST_ROWS)
        self.faults.extend(replace(fault, key=(*self.key, *fault.key)) for fault in faults)
        if len(self.faults) > before:
            return None
        span = Span(low, high, log)
        self.faults.extend(Fault(f.message, self.key) for f in span_faults(self.name, span))
        if len(self.faults) > before:
            return None
        return _Points(span, count) if points else span

    def _number(self, value: Any, key: Key) -> float:
        if isinstance(value, str) and len(self.faults) > LISTED:
            self.faults.append(Fault("accepted: as above", key))  # no unit is looked up where it is only counted
        elif isinstance(value, str):
            unit = unit_of(self.problem, self.name)
            try:
                if not unit:
                    raise ValueError(f"found {short(value)}; accepted: a number without quotes, as in the constraint")
                return with_unit(value, unit)
            except ValueError as error:
                self.faults.append(Fault(str(error), key))
        elif not is_number(value):
            self.faults.append(Fault(f"found {short(value)}; accepted: a finite number", key))
        else:
            return float(value)
        return 0.0


def read_csv(path: str | PathLike[str], unit_of: Callable[[str], str] | None = None) -> dict[str, Column]:
    """The columns of a CSV file by the names in its first line, which may vary in a study.

    Cells are numbers in rad and SI units, separated by commas, or texts such as ``20 deg`` where units are known. A
    byte order mark and empty lines at the end do not matter.

    Args:
        unit_of: name of a column → unit of its numbers, empty for one that has none.

    Raises:
        InputError: listing every fault with file, line and column.
    """
    file = str(path)
    lines = read_lines(file, "CSV file of numbers", LARGEST, LONGEST_LINE)
    reader = csv.reader(lines, strict=True, skipinitialspace=True)
    try:
        names = [name.strip() for name in next(reader, [])]
        if found := list(_header_faults(names)):
            raise InputError([f.at(file, 1) for f in found])
        return _columns(file, reader, names, unit_of)
    except csv.Error as error:
        raise InputError([Fault(f"not CSV: {error}").at(file, reader.line_num)]) from None


def _header_faults(names: list[str]) -> Iterator[Fault]:
    header, known = ",".join(names), set()
    example = "accepted: names of what varies, separated by commas, such as: mu,lambda_s.max"
    if not header:
        yield Fault(f"the first line is empty; {example}")
        return
    for mark, word in ((";", "semicolons"), ("\t", "tabs")):
        if mark in header:
            yield Fault(f"columns separated by {word}; separate them by commas, with decimal points in the numbers")
            return
    if len(names) > MOST_COLUMNS:
        yield Fault(f"found {len(names)} columns; accepted: up to {MOST_COLUMNS}")
        return
    for number, name in enumerate(names, start=1):
        if not name:
            yield Fault(f"column {number} has no name; {example}")
        elif _number(name) is not None:
            yield Fault(f"found the number {name[:60]} for the name of column {number}; {example}")
        elif name in known:
            yield Fault(f"{short(name)} names two columns; leave one out")
        known.add(name)


def _columns(
    file: str, reader: Iterator[list[str]], names: list[str], unit_of: Callable[[str], str] | None
) -> dict[str, Column]:
    columns = [array("d") for _ in names]
    units = ["" if unit_of is None else unit_of(name) for name in names]
    faults: list[Fault] = []
    most, empty = min(MOST_ROWS, MOST_NUMBERS // len(names)), 0
    for cells in reader:
        line: int = reader.line_num  # type: ignore[attr-defined]
        if not cells:
            empty = empty or line
            continue
        if empty:
            faults.append(Fault("an empty line among the rows; leave it out").at(file, empty))
            empty = 0
        if len(cells) != len(names):
            message = f"found {len(cells)} cells; accepted: {len(names)}, one per column, with decimal points"
            faults.append(Fault(message).at(file, line))
        else:
            for column, cell, name, unit in zip(columns, cells, names, units, strict=True):
                number = _number(cell)
                if number is None:
                    number = _with_unit(cell, unit, Fault("", (name,)).at(file, line), faults)
                column.append(number)
            if len(columns[0]) > most:
                raise InputError([Fault(f"more than {most} rows; accepted: up to {most}").at(file, line)])
        if len(faults) > _SHOWN:
            faults = [*faults[:_SHOWN], Fault("and more after these").at(file, line)]
            break
    if not faults and not columns[0]:
        faults.append(Fault("no rows below the names").at(file, 1))
    if faults:
        raise InputError(faults)
    return {name: Column(columns.pop(0)) for name in names}


def _number(cell: str) -> float | None:
    """A finite number as TOML and other languages write it; Python takes more."""
    try:
        number = float(cell)
    except ValueError:
        return None
    return number if math.isfinite(number) and "_" not in cell else None


def _with_unit(cell: str, unit: str, place: Fault, faults: list[Fault]) -> float:
    """A cell that is no plain number, in `unit`; a fault is added where it is nothing else either."""
    if not cell.strip():
        message = "an empty cell; accepted: a number in every cell"
    elif not unit:
        message = f"found {short(cell)}; accepted: a finite number"
    else:
        try:
            return with_unit(cell, unit)
        except ValueError as error:
            message = str(error).replace(", or a number without quotes in", ", or a number in")
    faults.append(Fault(message, place.key, place.file, place.line))
    return math.nan
