"""Study files: TOML to a Study, or to the Monte Carlo sampling that becomes one, with every fault at its line."""

import csv
import math
from array import array
from collections.abc import Callable, Iterator, Mapping, Set
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import Field, StrictBool, StrictInt, StrictStr

from tmsopt.errors import LISTED, Fault, InputError, count_faults, is_number, short, suggest, visible
from tmsopt.files import read_lines
from tmsopt.problem.expression import written_sides
from tmsopt.problem.files import as_solvable, problem_from_tables
from tmsopt.problem.limit import limit_of
from tmsopt.problem.problem import Problem, question_faults
from tmsopt.problem.toml import Key, Number, Page, Section, read_page, validate_tables, within
from tmsopt.problem.units import with_unit
from tmsopt.program.options import STARTS
from tmsopt.records import Column
from tmsopt.studies.monte_carlo import DISTRIBUTIONS, Sampling
from tmsopt.studies.sampling import (
    MOST_NUMBERS,
    MOST_ROWS,
    Span,
    check_size,
    grid,
    latin_hypercube,
    sobol,
    sobol_note,
    span_faults,
)
from tmsopt.studies.study import METHODS, Study, common_faults, name_faults

LARGEST = 1_000_000_000
"""Bytes of a CSV file."""

MOST_COLUMNS, LONGEST_LINE = 1000, 1_000_000
"""Columns of a CSV file, and characters of a line of it."""

_SHOWN = 20  # faults of cells; a file in another format has one in each
_RANGE = "{ min = 0.1, max = 1 }"
_AXIS = "{ min = 0.1, max = 1, points = 10 }"
_ACCEPTED_BY = {
    "grid": f"a list of values such as [0.1, 0.2], or {_AXIS}, with log = true for equal factors",
    "list": "a list with a value for every row, such as [0.1, 0.2]",
    "latin_hypercube": f"{_RANGE}, with log = true for equal factors",
    "sobol": f"{_RANGE}, with log = true for equal factors",
}


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
        message = f"nothing varies; write what does under [vary], such as mu = {_ACCEPTED_BY[method]}"
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
        self.faults.append(Fault(f"found {short(spec)}; accepted: {_ACCEPTED_BY[method]}", self.key))
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


_NEEDED = {"latin_hypercube": ("rows",), "sobol": ("rows",), "csv": ("csv",), "monte_carlo": ("rows",)}
_OWN = {"rows": ("latin_hypercube", "sobol", "monte_carlo"), "csv": ("csv",), "distribution": ("monte_carlo",)}
"""Keys of [study] that only some methods have."""

_ACCEPTED = {
    "title": "a text in quotes",
    "problem": "the name of a problem file in quotes, or a table [problem] with [problem.parameters] and so on",
    "study": "a table",
    "vary": "a table",
    "tolerances": "a number, or a text with a unit such as '5 mm'",
    "method": f"one of {' '.join(METHODS)}",
    "rows": "a whole number",
    "csv": "the name of a CSV file in quotes",
    "distribution": f"one of {' '.join(DISTRIBUTIONS)}",
    "seed": "a whole number, 0 or more",
    "starts": "a whole number, 1 or more",
    "warm": "true or false",
    "report": "a list of expressions, such as ['nu_H', '2*Fr_c']",
}


class _Options(Section):
    """How the rows of a study are made and solved."""

    method: StrictStr = Field(default="grid", description="How rows are made of what varies.")
    rows: StrictInt | None = Field(default=None, description="How many, of latin_hypercube, sobol and monte_carlo.")
    csv: StrictStr | None = Field(
        default=None, description='A CSV file beside this one with a column for all that varies, of method = "csv".'
    )
    distribution: StrictStr | None = Field(default=None, description="Of errors within the tolerances, of monte_carlo.")
    seed: StrictInt = Field(default=0, description="Other numbers draw other samples.")
    starts: StrictInt = Field(default=STARTS, description="Of a row, at most.")
    warm: StrictBool = Field(default=False, description="Whether neighbours start each other.")
    report: list[StrictStr] = Field(
        default_factory=list, description='Expressions recorded for every row, such as ["nu_H", "2*Fr_c"].'
    )


class _StudyFile(Section):
    """A study: one problem solved for every row of what varies."""

    title: StrictStr = Field(default="", description="One line for reports.")
    problem: StrictStr | dict[str, Any] = Field(
        description="A problem file beside this one, or its tables as [problem.parameters] and so on."
    )
    study: _Options = Field(default_factory=_Options, description="How rows are made and solved.")
    vary: dict[str, Any] = Field(
        default_factory=dict,
        description='What varies from row to row: mu, "lambda_s.max" of a free one, "arm.limit" of a constraint.',
    )
    tolerances: dict[str, Number] = Field(
        default_factory=dict, description="Errors that a Monte Carlo draws from, in place of those of the problem."
    )


SHAPE: type[Section] = _StudyFile
"""The shape of a study file, for editors."""


def load_study(path: str | PathLike[str]) -> Study | Sampling:
    """Read a study file; a Monte Carlo study is a `Sampling`, of which `planned` makes a Study.

    Such a file names a problem file, or has its tables as [problem.parameters] and so on; names of files in it are
    relative to its own place. Units are written as in problem files::

        problem = "realistic.toml"
        [study]
        method = "grid"            # list, latin_hypercube, sobol, csv, monte_carlo
        rows = 1024                # of latin_hypercube, sobol, monte_carlo
        csv = "rows.csv"           # of csv
        distribution = "uniform"   # or normal, of monte_carlo
        seed = 0
        starts = 64                # of a row, at most; of monte_carlo, of its nominal design
        warm = false               # neighbours start each other
        report = ["nu_H", "2*Fr_c"]
        [vary]
        mu = { min = 0.05, max = 1, points = 20, log = true }   # of a grid; samples have no points, lists only values
        zeta_H = [-0.2, -0.25]
        "lambda_s.max" = ["20 deg", "30 deg"]
        "offset.limit" = [0.02, 0.05]
        [tolerances]               # of monte_carlo, in place of those of the problem
        chi_B = "5 mm"

    Raises:
        InputError: listing every fault with file, line, key, what was found and what is accepted.

    Example:
        >>> study = tmsopt.load_study("problems/study_heights.toml")
        >>> len(study.columns["mu"]), study.method
        (32, 'sobol')

    More: docs/reference/study_file.md
    """
    page = read_page(path, "study")
    if "parameters" in page.data and not {"problem", "study", "vary"} & set(page.data):
        message = (
            f"is one problem, not a study; run tmsopt solve {page.file}, "
            f'or write a study file with problem = "{Path(page.file).name}" and what varies under [vary]'
        )
        raise InputError([Fault(message, file=page.file)])
    faults, written = validate_tables(page.data, _StudyFile, _shape_fault)
    problem_faults, problem = _problem(page)
    faults += problem_faults
    if written is None or problem is None:
        raise page.error(faults)
    faults += [*_method_faults(written, {f.key for f in faults}), *within("study", _option_faults(written, problem))]
    title = written.title.strip() or visible(Path(page.file).stem)
    if written.study.method == "monte_carlo":
        return _sampling(page, written, problem, title, faults)
    return _study(page, written, problem, title, faults)


def _study(page: Page, written: _StudyFile, problem: Problem, title: str, faults: list[Fault]) -> Study:
    """The study of a file whose rows are given by rule."""
    options = written.study
    found = Varied()
    if not {("study", "method"), ("study", "csv"), ("vary",)} & {f.key for f in faults}:
        found = _varied(page, written, problem, made=not faults)
    faults += found.faults
    if faults:
        raise page.error(faults)
    try:
        return Study(
            problem=problem,
            columns=found.columns,
            title=title,
            seed=options.seed,
            starts=options.starts,
            warm=options.warm,
            report=options.report,
            grid_shape=found.grid_shape,
            method=options.method,
            notes=found.notes,
        )
    except InputError as error:
        columns = {f.key[:1]: ("vary", *f.key[1:]) for f in error.faults if f.key[:1] == ("columns",)}
        raise page.error([replace(f, key=columns.get(f.key[:1], f.key)) for f in error.faults]) from None


def _problem(page: Page) -> tuple[list[Fault], Problem | None]:
    """The problem that a study is of, and what is wrong with it."""
    stated = page.data.get("problem")
    if isinstance(stated, dict):
        faults, problem = problem_from_tables(
            stated, str(page.data.get("title", "")).strip() or visible(Path(page.file).stem)
        )
        if problem is not None and not problem.pareto:
            faults += question_faults(problem)
        faults = within("problem", faults)
    elif isinstance(stated, str):
        try:
            faults, problem = [], as_solvable(Path(page.file).parent / stated, front=True)
        except InputError as error:
            faults, problem = [f if f.line else _of_problem_file(stated, f) for f in error.faults], None
    else:
        return [], None  # reported as a fault of shape
    if problem is not None and problem.pareto:
        faults += [Fault(f.message, ("problem",)) for f in question_faults(problem)]
    return faults, problem


def _of_problem_file(name: str, fault: Fault) -> Fault:
    """A fault of a whole file, told where it is named."""
    return Fault(f"'{name}' {fault.message}; the name is relative to the study file", ("problem",))


def _method_faults(written: _StudyFile, reported: Set[Key]) -> Iterator[Fault]:
    """Keys and sections that do not go with the method, or that it needs."""
    options, method = written.study, written.study.method
    if method not in METHODS:
        yield Fault(f"unknown method {short(method)}; {suggest(method, METHODS)}", ("study", "method"))
        return
    for key in _NEEDED.get(method, ()):
        if getattr(options, key) is None and ("study", key) not in reported:
            example = '"rows.csv"' if key == "csv" else "1024"
            message = f'missing {key}, which method = "{method}" needs; write e.g. {key} = {example}'
            yield Fault(message, ("study", "method"))
    for key, methods in _OWN.items():
        if getattr(options, key) is not None and method not in methods:
            message = f'{key} does not go with method = "{method}"; it is for {" ".join(methods)}'
            yield Fault(message, ("study", key))
    if method in ("csv", "monte_carlo") and written.vary:
        instead = "the names in the CSV file say" if method == "csv" else "the tolerances of the problem say"
        yield Fault(f'[vary] does not go with method = "{method}": {instead} what varies', ("vary",))
    if method != "monte_carlo" and written.tolerances:
        message = "[tolerances] of a study are those that monte_carlo draws from; others belong to the problem"
        yield Fault(message, ("tolerances",))
    if method == "monte_carlo" and options.warm:
        yield Fault("nothing is free in a Monte Carlo study, so nothing starts warm; leave it out", ("study", "warm"))


def _option_faults(written: _StudyFile, problem: Problem) -> Iterator[Fault]:
    options = written.study
    if options.rows is not None:
        yield from count_faults("rows", options.rows, 1, MOST_ROWS)
    if options.distribution is not None and options.distribution not in DISTRIBUTIONS:
        found = options.distribution
        yield Fault(f"unknown distribution {short(found)}; {suggest(found, DISTRIBUTIONS)}", ("distribution",))
    yield from common_faults(problem, options.seed, options.starts, options.report)


def _varied(page: Page, written: _StudyFile, problem: Problem, made: bool) -> Varied:
    options = written.study
    if options.method != "csv":
        rows, seed = (max(1, min(options.rows or 1, MOST_ROWS)), max(0, options.seed))  # others are reported already
        return varied(problem, written.vary, options.method, rows, seed, made)
    name = options.csv or ""
    file = str(Path(page.file).parent / name)
    try:
        columns = read_csv(file, lambda column: unit_of(problem, column))
    except InputError as error:
        message = "; the name is relative to the study file"
        return Varied(
            [f if f.line else Fault(f"'{name}' {f.message}{message}", ("study", "csv")) for f in error.faults]
        )
    wrong_with = name_faults(problem)
    unknown = {column: wrong_with(column) for column in columns}
    return Varied([Fault(text, (column,)).at(file, 1) for column, text in unknown.items() if text], columns)


def _sampling(page: Page, written: _StudyFile, problem: Problem, title: str, faults: list[Fault]) -> Sampling:
    """The Monte Carlo study of a file."""
    options = written.study
    tolerances: dict[str, Any] = {}
    for name, value in written.tolerances.items():
        tolerances[name] = value
        if isinstance(value, str) and name in problem.parameter_set.names:
            parameter = problem.parameter_set[name]
            unit = parameter.multiple_of or "1" if parameter.unit == "1" else parameter.unit
            try:
                tolerances[name] = with_unit(value, unit)
            except ValueError as error:
                faults.append(Fault(str(error), ("tolerances", name)))
    if faults:
        raise page.error(faults)
    try:
        return Sampling(
            problem=problem,
            rows=options.rows or 0,
            seed=options.seed,
            distribution=options.distribution or DISTRIBUTIONS[0],
            tolerances=tolerances,
            title=title,
            starts=options.starts,
            report=options.report,
        )
    except InputError as error:
        raise page.error(error.faults) from None


def _shape_fault(where: tuple[int | str, ...], kind: str, found: Any) -> Fault:
    """One pydantic complaint in the words of the study file."""
    key = tuple(str(k) for k in where if k not in ("str", "dict[str,any]", "float", "int"))
    match key:
        case ("parameters" | "objective" | "constraints" as section,) if kind == "extra_forbidden":
            message = f"belongs to the problem; write [problem.{section}], or name a problem file"
            return Fault(message, key)
        case (section,) if kind == "extra_forbidden":
            return Fault(f"unknown key {short(section)}; {suggest(section, _StudyFile.model_fields)}", key)
        case ("study", name) if kind == "extra_forbidden":
            return Fault(f"unknown key {short(name)}; {suggest(name, _Options.model_fields)}", key)
        case ("problem",) if kind == "missing":
            return Fault('missing problem; write e.g. problem = "least_speed.toml", or a table [problem]', key)
        case _:
            last = key[1] if key[0] == "study" and len(key) > 1 else key[0]
            return Fault(f"found {short(found)}; accepted: {_ACCEPTED[last]}", key[:2])
