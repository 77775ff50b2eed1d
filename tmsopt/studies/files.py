"""Study files: TOML to a Study, or to the Monte Carlo sampling that becomes one, with every fault at its line."""

import csv
import math
from array import array
from collections.abc import Callable, Iterator, Mapping, Set
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import Field, StrictBool, StrictInt, StrictStr

from tmsopt.errors import LISTED, Fault, InputError, count_faults, is_number, short, suggest, visible
from tmsopt.files import read_lines
from tmsopt.models import Parameter, Quantity
from tmsopt.models.expression import written_sides
from tmsopt.problem.files import as_solvable, problem_from_tables
from tmsopt.problem.freedom import question_faults
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.toml import Key, Number, Page, Section, read_page, validate_tables, within
from tmsopt.problem.units import TABLES, numbers, with_unit
from tmsopt.program.options import STARTS
from tmsopt.records import Column
from tmsopt.studies.monte_carlo import DISTRIBUTIONS, Sampling
from tmsopt.studies.sampling import (
    MOST_ROWS,
    Span,
    check_size,
    grid,
    latin_hypercube,
    most_rows,
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
_RANGE = "{ min = 0.1, max = 1 }, with log = true for equal factors"
_VARIED = {
    "grid": f"a list of values such as [0.1, 0.2], or {_RANGE.replace(' }', ', points = 10 }')}",
    "list": "a list with a value for every row, such as [0.1, 0.2]",
    "latin_hypercube": _RANGE,
    "sobol": _RANGE,
}
"""How what varies is written, by method."""


def unit_of(problem: Posed, name: str) -> str:
    """The unit in which what varies is a number; empty where that is not known."""
    of, (stem, _, end) = problem.parameter_set, name.rpartition(".")
    named: tuple[Quantity | Parameter, ...] = (*problem.model.quantities, *of.quantities, *of.parameters)
    known = {each.name: each.unit for each in named}
    limited = end == "limit" and stem in problem.constraints
    names = written_sides(problem.constraints[stem]) if limited else (name, stem)
    return next((known[n] for n in names if n in known), "")


def _entries(table: Mapping[str, Any]) -> dict[str, tuple[Key, Any]]:
    """Name → its place and what is written there; ``trail.limit = …`` without quotes is a table in TOML."""
    found: dict[str, tuple[Key, Any]] = {}
    for name, spec in table.items():
        if isinstance(spec, Mapping) and any(isinstance(inner, list | Mapping) for inner in spec.values()):
            found |= {f"{name}.{end}": (("vary", name, end), inner) for end, inner in spec.items()}
        else:
            found[name] = (("vary", name), spec)
    return found


def _read_vary(problem: Posed, written: "_StudyFile", faults: list[Fault]) -> dict[str, Any]:
    """Name → list of numbers, `Span` of a sample, or span and points of an axis; adds what is wrong to `faults`."""
    entries, method, read = _entries(written.vary), written.study.method, {}
    if not entries:
        faults.append(Fault(f"nothing varies; write what does under [vary], such as mu = {_VARIED[method]}", ("vary",)))
    wrong_with = name_faults(problem)
    for name, (key, spec) in entries.items():
        if wrong := wrong_with(name):
            faults.append(Fault(wrong, key))
        elif isinstance(spec, list) and spec and method in ("grid", "list"):
            unit = unit_of(problem, name)
            read[name] = [_number(value, unit, key, faults) for value in spec]
        elif isinstance(spec, Mapping) and method != "list":
            read[name] = _range(name, unit_of(problem, name), key, spec, method, faults)
        else:
            faults.append(Fault(f"found {short(spec)}; accepted: {_VARIED[method]}", key))
    return read


def _range(name: str, unit: str, key: Key, spec: Mapping[str, Any], method: str, faults: list[Fault]) -> Any:
    """A span; of a grid with the number of its points."""
    found, needed = list[Fault](), {"min": "…", "max": "…"} | ({"points": "10"} if method == "grid" else {})
    for end in (end for end in spec if end not in (*needed, "log")):
        message = f"unknown key {short(end)} of {name}; {suggest(end, (*needed, 'log'))}"
        if end == "points":
            message = "points are those of a grid; a sample has rows, under [study]"
        found.append(Fault(message, (*key, end)))
    example = ", ".join(f"{end} = {value}" for end, value in needed.items())
    missing = [end for end in needed if end not in spec]
    found += [Fault(f"missing {end} of {name}; write {name} = {{ {example} }}", key) for end in missing]
    low, high = (_number(spec.get(end, 0.0), unit, (*key, end), found) for end in ("min", "max"))
    log, count = spec.get("log", False), spec.get("points", 2)
    if not isinstance(log, bool):
        found.append(Fault(f"found {short(log)}; accepted: true or false", (*key, "log")))
    found += [replace(f, key=(*key, "points")) for f in count_faults("points", count, 2, MOST_ROWS)]
    span = Span(low, high, log)
    faults += found or [Fault(f.message, key) for f in span_faults(name, span)]
    return (span, count) if method == "grid" else span


def _number(value: Any, unit: str, key: Key, faults: list[Fault]) -> float:
    """A number, or a text with a unit; 0 and a fault for anything else."""
    try:
        if isinstance(value, str):
            if len(faults) > LISTED:  # no unit is looked up where it is only counted
                raise ValueError("accepted: as above")
            if not unit:
                raise ValueError(f"found {short(value)}; accepted: a number without quotes, as in the constraint")
            return with_unit(value, unit)
        if is_number(value):
            return float(value)
        raise ValueError(f"found {short(value)}; accepted: a finite number")
    except ValueError as error:
        faults.append(Fault(str(error), key))
        return 0.0


def _rows(read: Mapping[str, Any], options: "_Options") -> dict[str, Any]:
    """What a study has of the rows that are written so: its columns, and what else there is to say."""
    method, rows, seed = options.method, options.rows or 0, options.seed
    if method == "list":
        return {"columns": read}
    if method == "latin_hypercube":
        return {"columns": latin_hypercube(read, rows, seed)}
    if method == "sobol":
        return {"columns": sobol(read, rows, seed), "notes": tuple(filter(None, [sobol_note(rows)]))}
    sizes = {name: axis[1] if isinstance(axis, tuple) else len(axis) for name, axis in read.items()}
    check_size(list(sizes.values()))
    axes = {name: axis[0].points(axis[1]) if isinstance(axis, tuple) else axis for name, axis in read.items()}
    return {"columns": grid(axes), "grid_shape": sizes}


def read_csv(path: str | PathLike[str], unit_of: Callable[[str], str] = lambda name: "") -> dict[str, Column]:
    """The columns of a CSV file by the names in its first line, which may vary in a study.

    Cells are numbers in rad and SI units, separated by commas, or texts such as ``20 deg`` where units are known. A
    byte order mark and empty lines do not matter.

    Args:
        unit_of: name of a column → unit of its numbers, empty for one that has none.

    Raises:
        InputError: listing every fault with file, line and column.
    """
    file, faults = str(path), list[Fault]()
    lines = read_lines(file, "CSV file of numbers", LARGEST, LONGEST_LINE)
    reader = csv.reader(lines, strict=True, skipinitialspace=True)
    try:
        names = [name.strip() for name in next(reader, [])]
        if found := list(_header_faults(names)):
            raise InputError([f.at(file, 1) for f in found])
        columns, units = [array("d") for _ in names], [unit_of(name) for name in names]
        most = most_rows(len(names))
        for cells in filter(None, reader):
            each = zip(columns, names, units, cells, strict=False) if len(cells) == len(names) else ()
            if not each:
                message = f"found {len(cells)} cells; accepted: {len(names)}, one per column, with decimal points"
                faults.append(Fault(message).at(file, reader.line_num))
            for column, name, unit, cell in each:
                try:
                    column.append(_cell(cell, unit))
                except ValueError as error:
                    faults.append(Fault(str(error), (name,)).at(file, reader.line_num))
            if len(columns[0]) > most:
                faults = [Fault(f"more than {most} rows; accepted: up to {most}").at(file, reader.line_num)]
                break
            if len(faults) > _SHOWN:
                faults[_SHOWN:] = [Fault("and more after these").at(file, reader.line_num)]
                break
    except csv.Error as error:
        raise InputError([Fault(f"not CSV: {error}").at(file, reader.line_num)]) from None
    if not faults and not columns[0]:
        faults.append(Fault("no rows below the names").at(file, 1))
    if faults:
        raise InputError(faults)
    return {name: Column(columns.pop(0)) for name in names}


def _header_faults(names: list[str]) -> Iterator[Fault]:
    header, example = ",".join(names), "accepted: names of what varies, separated by commas, such as: mu,lambda_s.max"
    if not header:
        yield Fault(f"the first line is empty; {example}")
    elif mark := next((word for mark, word in ((";", "semicolons"), ("\t", "tabs")) if mark in header), ""):
        yield Fault(f"columns separated by {mark}; separate them by commas, with decimal points in the numbers")
    elif len(names) > MOST_COLUMNS:
        yield Fault(f"found {len(names)} columns; accepted: up to {MOST_COLUMNS}")
    else:
        for number, name in enumerate(names, start=1):
            if not name:
                yield Fault(f"column {number} has no name; {example}")
            elif name in names[: number - 1]:
                yield Fault(f"{short(name)} names two columns; leave one out")
            elif math.isfinite(_float(name)):
                yield Fault(f"found the number {name[:60]} for the name of column {number}; {example}")


def _float(cell: str) -> float:
    """A number as TOML and other languages write it, Python takes more; nan for another text."""
    try:
        return math.nan if "_" in cell else float(cell)
    except ValueError:
        return math.nan


def _cell(cell: str, unit: str) -> float:
    """A number, or a text with a unit.

    Raises:
        ValueError: for anything else.
    """
    if math.isfinite(number := _float(cell)):
        return number
    if unit and cell.strip():
        return with_unit(cell, unit)
    raise ValueError(f"found {short(cell)}; accepted: a finite number" if cell.strip() else _EMPTY)


_EMPTY = "an empty cell; accepted: a number in every cell"
_OWN = {"rows": ("latin_hypercube", "sobol", "monte_carlo"), "csv": ("csv",), "distribution": ("monte_carlo",)}
"""Keys of [study] that only some methods have."""

_NEEDED = {"rows": "1024", "csv": '"rows.csv"'}
"""Those that they need, each with an example."""

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
    title = visible(Path(page.file).stem)
    problem = _problem(page, title, faults)
    if written is None or problem is None:
        raise page.error(faults)
    options = written.study
    common: dict[str, Any] = {"title": written.title.strip() or title, "seed": options.seed, "starts": options.starts}
    common |= {"problem": problem, "report": options.report}
    faults += [
        *_method_faults(written, {f.key for f in faults}),
        *within("study", _option_faults(options, problem.posed)),
    ]
    wrong = {f.key for f in faults} & {("study", "method"), ("study", "csv"), ("vary",)}
    read: dict[str, Any] = {}
    if options.method == "monte_carlo":
        tables = {table: written.tolerances if table == "tolerances" else {} for table in TABLES}
        read, _, _, unreadable = numbers(tables, problem.posed.parameter_set)
        faults += unreadable
    elif options.method == "csv" and not wrong:
        read = _read_rows(page, options.csv or "", problem.posed, faults)
    elif not wrong:
        read = _read_vary(problem.posed, written, faults)
    if faults:
        raise page.error(faults)
    try:
        if options.method == "monte_carlo":
            distribution = options.distribution or DISTRIBUTIONS[0]
            return Sampling(rows=options.rows or 0, distribution=distribution, tolerances=read["tolerances"], **common)
        given = {"columns": read} if options.method == "csv" else _rows(read, options)
        return Study(**common, **given, warm=options.warm, method=options.method)
    except InputError as error:
        places = {"columns": ("vary",), "ranges": ("vary",), "rows": ("study", "rows")}
        raise page.error(
            [replace(f, key=(*places.get(f.key[0], f.key[:1]), *f.key[1:])) for f in error.faults]
        ) from None


def _problem(page: Page, title: str, faults: list[Fault]) -> Problem | None:
    """The problem that a study is of; adds what is wrong with it to `faults`."""
    stated = page.data.get("problem")
    if isinstance(stated, dict):
        found, problem = problem_from_tables(stated, str(page.data.get("title", "")).strip() or title)
        faults += within("problem", [*found, *(question_faults(problem.posed) if problem else ())])
        return problem
    if isinstance(stated, str):  # anything else is reported as a fault of shape
        try:
            return as_solvable(Path(page.file).parent / stated).problem
        except InputError as error:
            faults += _named(stated, error, ("problem",))
    return None


def _named(name: str, error: InputError, key: Key) -> list[Fault]:
    """Faults of a file that a study names; those of the whole file where it is named."""
    more = "the name is relative to the study file"
    return [f if f.line else Fault(f"'{name}' {f.message}; {more}", key) for f in error.faults]


def _read_rows(page: Page, name: str, problem: Posed, faults: list[Fault]) -> dict[str, Column]:
    """The columns of a CSV file that a study names; adds what is wrong with them to `faults`."""
    file, columns = str(Path(page.file).parent / name), dict[str, Column]()
    try:
        columns = read_csv(file, lambda column: unit_of(problem, column))
    except InputError as error:
        faults += _named(name, error, ("study", "csv"))
    wrong_with = name_faults(problem)
    unknown = {column: wrong_with(column) for column in columns}
    faults += [Fault(text, (column,)).at(file, 1) for column, text in unknown.items() if text]
    return columns


def _method_faults(written: _StudyFile, reported: Set[Key]) -> Iterator[Fault]:
    """Keys and sections that do not go with the method, or that it needs."""
    options, method = written.study, written.study.method
    if method not in METHODS:
        yield Fault(f"unknown method {short(method)}; {suggest(method, METHODS)}", ("study", "method"))
        return
    for key, methods in _OWN.items():
        given = getattr(options, key) is not None
        if given and method not in methods:
            message = f'{key} does not go with method = "{method}"; it is for {" ".join(methods)}'
            yield Fault(message, ("study", key))
        elif not given and method in methods and key in _NEEDED and ("study", key) not in reported:
            message = f'missing {key}, which method = "{method}" needs; write e.g. {key} = {_NEEDED[key]}'
            yield Fault(message, ("study", "method"))
    if method in ("csv", "monte_carlo") and written.vary:
        instead = "the names in the CSV file say" if method == "csv" else "the tolerances of the problem say"
        yield Fault(f'[vary] does not go with method = "{method}": {instead} what varies', ("vary",))
    if method != "monte_carlo" and written.tolerances:
        message = "[tolerances] of a study are those that monte_carlo draws from; others belong to the problem"
        yield Fault(message, ("tolerances",))
    if method == "monte_carlo" and options.warm:
        yield Fault("nothing is free in a Monte Carlo study, so nothing starts warm; leave it out", ("study", "warm"))


def _option_faults(options: _Options, problem: Posed) -> Iterator[Fault]:
    if options.rows is not None:
        yield from count_faults("rows", options.rows, 1, MOST_ROWS)
    if options.distribution not in (None, *DISTRIBUTIONS):
        message = f"unknown distribution {short(options.distribution)}; {suggest(options.distribution, DISTRIBUTIONS)}"
        yield Fault(message, ("distribution",))
    yield from common_faults(problem, options.seed, options.starts, options.report)


def _shape_fault(where: tuple[int | str, ...], kind: str, found: Any) -> Fault:
    """One pydantic complaint in the words of the study file."""
    key = tuple(str(k) for k in where if k not in ("str", "dict[str,any]", "float", "int"))
    last, inner = key[:2][-1], key[0] == "study" and len(key) > 1
    if kind == "extra_forbidden" and key[0] in ("parameters", "objective", "constraints"):
        return Fault(f"belongs to the problem; write [problem.{last}], or name a problem file", key)
    if kind == "extra_forbidden":
        accepted = (_Options if inner else _StudyFile).model_fields
        return Fault(f"unknown key {short(last)}; {suggest(last, accepted)}", key)
    if kind == "missing":
        return Fault('missing problem; write e.g. problem = "least_speed.toml", or a table [problem]', key)
    return Fault(f"found {short(found)}; accepted: {_ACCEPTED[last if inner else key[0]]}", key[:2])
