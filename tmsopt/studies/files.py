"""Reads study files: TOML becomes a Study or a Monte Carlo `Sampling`; every fault is reported with its line."""

import csv
import math
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from contextlib import closing
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import Field, StrictBool, StrictInt, StrictStr

from tmsopt.errors import MAX_LISTED, Fault, InputError, count_faults, escape_unprintable, is_number, short, suggest
from tmsopt.files import read_lines
from tmsopt.problem.files import as_solvable, problem_from_tables
from tmsopt.problem.freedom import find_objective_faults
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.toml import Key, Number, Page, Section, read_page, validate_tables
from tmsopt.problem.unit_system import dimension_of, si_units
from tmsopt.problem.units import TABLES, parse_quantity, read_numbers
from tmsopt.program.options import STARTS
from tmsopt.records import Column
from tmsopt.studies.monte_carlo import DISTRIBUTIONS, Sampling
from tmsopt.studies.sampling import (
    MAX_ROWS,
    Span,
    check_size,
    compute_max_rows,
    grid,
    latin_hypercube,
    sobol,
    sobol_note,
    span_faults,
)
from tmsopt.studies.study import METHODS, Study, build_name_check, common_faults

MAX_CSV_BYTES = 1_000_000_000
"""Largest number of bytes of a CSV file."""

MAX_CSV_COLUMNS = 1000
"""Largest number of columns of a CSV file."""

MAX_CSV_LINE = 1_000_000
"""Largest number of characters in a line of a CSV file."""

_MAX_CELL_FAULTS = 20  # largest number of listed faults; a file in another format has a fault in every cell
_SAMPLE_HINT = "; a sample has rows, a key under [study]"
_RANGE = "{ min = 0.1, max = 1 }, with log = true for equal factors"
_VALUE_FORMS = {
    "grid": f"a list of values such as [0.1, 0.2], or {_RANGE.replace(' }', ', points = 10 }')}",
    "list": "a list with a value for every row, such as [0.1, 0.2]",
    "latin_hypercube": _RANGE,
    "sobol": _RANGE,
}
"""Method → the form in which a varied value is written."""


def unit_of(problem: Posed, name: str) -> str:
    """The unit of a varied name; 1 if it is dimensionless."""
    stem, _, end = name.rpartition(".")
    return dimension_of(problem, stem).unit if end == "limit" else si_units(problem).get(stem or name, "1")


def _prefix_keys(faults: Iterable[Fault], *section: str) -> list[Fault]:
    """The faults of a table inside a section; the section is added to their keys."""
    return [replace(f, key=(*section, *f.key)) for f in faults]


def _list_entries(table: Mapping[str, Any]) -> Iterator[tuple[str, Key, Any]]:
    """Yield each varied name, its key in the file, and its value.

    If ``trail.limit = …`` has no quotes, TOML makes it a table ``trail`` with the key ``limit``.
    """
    for name, spec in table.items():
        if isinstance(spec, Mapping) and any(isinstance(value, list | Mapping) for value in spec.values()):
            yield from ((f"{name}.{end}", ("vary", name, end), value) for end, value in spec.items())
        else:
            yield name, ("vary", name), spec


def _read_vary(problem: Posed, content: "_StudyFile", faults: list[Fault]) -> dict[str, Any]:
    """Read the varied values: name → list of numbers, or `Span`; adds to `faults`."""
    method, values, check_name = content.study.method, {}, build_name_check(problem)
    if not content.vary:
        faults.append(Fault(f"nothing varies; add a name under [vary], such as mu = {_VALUE_FORMS[method]}", ("vary",)))
    for name, key, spec in _list_entries(content.vary):
        if message := check_name(name):
            faults.append(Fault(message, key))
        elif isinstance(spec, list) and spec and method in ("grid", "list"):
            unit = unit_of(problem, name)
            values[name] = [_read_number(value, unit, key, faults) for value in spec]
        elif isinstance(spec, Mapping) and method != "list":
            values[name] = _read_range(name, unit_of(problem, name), key, spec, method, faults)
        else:
            faults.append(Fault(f"found {short(spec)}; accepted: {_VALUE_FORMS[method]}", key))
    return values


def _read_range(name: str, unit: str, key: Key, spec: Mapping[str, Any], method: str, faults: list[Fault]) -> Any:
    """Read the span of a range, and check its `points`; adds to `faults`."""
    required, hint = (("min", "max", "points"), "") if method == "grid" else (("min", "max"), _SAMPLE_HINT)
    range_faults = [
        Fault(f"missing {end} of {name}; accepted: {_VALUE_FORMS[method]}", key) for end in required if end not in spec
    ]
    accepted = (*required, "log")
    for end in (end for end in spec if end not in accepted):
        range_faults.append(Fault(f"unknown key {short(end)} of {name}; {suggest(end, accepted)}{hint}", (*key, end)))
    low, high = (_read_number(spec.get(end, 0.0), unit, (*key, end), range_faults) for end in ("min", "max"))
    log = spec.get("log", False)
    if not isinstance(log, bool):
        range_faults.append(Fault(f"found {short(log)}; accepted: true or false", (*key, "log")))
    range_faults += _prefix_keys(count_faults("points", spec.get("points", 2), 2, MAX_ROWS), *key)
    span = Span(low, high, log)
    faults += range_faults or [replace(f, key=key) for f in span_faults(name, span)]
    return span


def _read_number(value: Any, unit: str, key: Key, faults: list[Fault]) -> float:
    """Read a number, or a text with a unit; anything else gives 0 and adds to `faults`."""
    if is_number(value):
        return float(value)
    message = f"found {short(value)}; accepted: a finite number"
    if isinstance(value, str) and len(faults) <= MAX_LISTED:  # further faults are only counted
        try:
            return parse_quantity(value, unit)
        except ValueError as error:
            message = str(error)
    faults.append(Fault(message, key))
    return 0.0


def _make_columns(values: Mapping[str, Any], content: "_StudyFile") -> dict[str, Any]:
    """Make the arguments of a Study from the values of its file: columns, notes and the shape of a grid."""
    options, rows = content.study, content.study.rows or 0
    match options.method:
        case "latin_hypercube":
            return {"columns": latin_hypercube(values, rows, options.seed)}
        case "sobol":
            return {"columns": sobol(values, rows, options.seed), "notes": [*filter(None, [sobol_note(rows)])]}
        case "grid":
            entries = _list_entries(content.vary)
            sizes = {name: spec["points"] if isinstance(spec, Mapping) else len(spec) for name, _, spec in entries}
            check_size(list(sizes.values()))
            axes = {name: axis.points(sizes[name]) if isinstance(axis, Span) else axis for name, axis in values.items()}
            return {"columns": grid(axes), "grid_shape": sizes}
    return {"columns": values}


def read_csv(path: str | PathLike[str], unit_of: Callable[[str], str] = lambda name: "") -> dict[str, Column]:
    """Read the columns of a CSV file; its first line has their names.

    Cells are separated by commas. A cell is a number in rad and SI units, or a text such as ``20 deg`` if the unit of
    its column is known. A byte order mark and empty lines are ignored.

    Args:
        unit_of: name of a column → unit of its numbers; empty if unknown.

    Raises:
        InputError: listing every fault with file, line and column.
    """
    file, faults = str(path), list[Fault]()
    with closing(read_lines(file, "CSV file of numbers", MAX_CSV_BYTES, MAX_CSV_LINE)) as lines:
        reader = csv.reader(lines, strict=True, skipinitialspace=True)

        def fault(message: str, *key: str) -> Fault:
            return Fault(message, key).at(file, max(reader.line_num, 1))

        try:
            names = [name.strip() for name in next(reader, [])]
            if first_faults := [fault(message) for message in _header_faults(names)]:
                raise InputError(first_faults)
            columns, units = [array("d") for _ in names], [unit_of(name) for name in names]
            max_rows = compute_max_rows(len(names))
            for cells in filter(None, reader):
                if len(cells) != len(names):
                    faults.append(fault(f"found {len(cells)} cells; accepted: {len(names)}, with decimal points"))
                    continue
                for column, name, unit, cell in zip(columns, names, units, cells, strict=True):
                    try:
                        column.append(_parse_cell(cell, unit))
                    except ValueError as error:
                        faults.append(fault(str(error), name))
                if len(columns[0]) > max_rows:
                    raise InputError([fault(f"more than {max_rows} rows; accepted: up to {max_rows}")])
                if len(faults) > _MAX_CELL_FAULTS:
                    raise InputError([*faults[:_MAX_CELL_FAULTS], fault("more faults follow")])
        except csv.Error as error:
            raise InputError([fault(f"not CSV: {error}")]) from None
    if not (faults or columns[0]):
        faults.append(fault("no rows below the names"))
    if faults:
        raise InputError(faults)
    return {name: Column(columns.pop(0)) for name in names}


def _header_faults(names: list[str]) -> Iterator[str]:
    header, example = ",".join(names), "accepted: varied names, separated by commas, such as: mu,lambda_s.max"
    for mark, word in ((";", "semicolons"), ("\t", "tabs")):
        if mark in header:
            yield f"columns separated by {word}; separate them by commas, and write numbers with a decimal point"
            return
    if not header:
        yield f"the first line is empty; {example}"
    elif len(names) > MAX_CSV_COLUMNS:
        yield f"found {len(names)} columns; accepted: up to {MAX_CSV_COLUMNS}"
    else:
        for number, name in enumerate(names, start=1):
            if not name:
                yield f"column {number} has no name; {example}"
            elif name in names[: number - 1]:
                yield f"{short(name)} names two columns; leave one out"
            elif math.isfinite(_parse_float(name)):
                yield f"found the number {name[:60]} for the name of column {number}; {example}"


def _parse_float(cell: str) -> float:
    """A number as in TOML, without the underscores that Python accepts; nan for another text."""
    try:
        return math.nan if "_" in cell else float(cell)
    except ValueError:
        return math.nan


def _parse_cell(cell: str, unit: str) -> float:
    """A number, or a text with a unit.

    Raises:
        ValueError: for another text.
    """
    if math.isfinite(number := _parse_float(cell)):
        return number
    if not cell.strip():
        raise ValueError("an empty cell; accepted: a number in every cell")
    if not unit:
        raise ValueError(f"found {short(cell)}; accepted: a finite number")
    return parse_quantity(cell, unit)


_METHODS_OF_KEY: Mapping[Key, tuple[tuple[str, ...], str]] = {
    ("study", "rows"): (("latin_hypercube", "sobol", "monte_carlo"), "rows = 1024"),
    ("study", "csv"): (("csv",), 'csv = "rows.csv"'),
    ("study", "distribution"): (("monte_carlo",), ""),
    ("vary",): (tuple(_VALUE_FORMS), ""),
    ("tolerances",): (("monte_carlo",), ""),
}
"""Key → (methods that accept it, an example if they require it)."""

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
"""Key or section → accepted value."""


class _Options(Section):
    """How the rows of a study are made and solved."""

    method: StrictStr = "grid"
    """How the rows are made."""
    rows: StrictInt | None = None
    """Number of rows, for latin_hypercube, sobol and monte_carlo."""
    csv: StrictStr | None = None
    """Name of a CSV file with a column for each varied name, for method = "csv"."""
    distribution: StrictStr | None = None
    """Distribution of errors within the tolerances, for monte_carlo."""
    seed: StrictInt = 0
    """Seed of the samples and of the starts."""
    starts: StrictInt = STARTS
    """Largest number of starts of a row."""
    warm: StrictBool = False
    """Whether each row starts at the optimum of its neighbour."""
    report: list[StrictStr] = Field(default_factory=list)
    """Expressions recorded for every row, such as ["nu_H", "2*Fr_c"]."""


class _StudyFile(Section):
    """A study: one problem solved for every row of varied values."""

    title: StrictStr = ""
    """One line for reports."""
    problem: StrictStr | dict[str, Any]
    """Name of a problem file, relative to this one, or its tables as [problem.parameters] and so on."""
    study: _Options = Field(default_factory=_Options)
    """How rows are made and solved."""
    vary: dict[str, Any] = Field(default_factory=dict)
    """Varied names: a fixed parameter, "lambda_s.max" of a free one, or "arm.limit" of a constraint."""
    tolerances: dict[str, Number] = Field(default_factory=dict)
    """Tolerances of a Monte Carlo study, in place of those of the problem."""


FILE_SCHEMA: type[Section] = _StudyFile
"""The pydantic model of a study file, from which the JSON Schema for editors is made."""


def load_study(path: str | PathLike[str]) -> Study | Sampling:
    """Read a study file; a Monte Carlo study is a `Sampling`, which `run_study` turns into a Study.

    The file names a problem file, or contains the tables of a problem: [problem.parameters] and so on. Names of files
    are relative to the study file. Units are written as in problem files::

        problem = "realistic.toml"
        [study]
        method = "grid"            # list, latin_hypercube, sobol, csv, monte_carlo
        rows = 1024                # for latin_hypercube, sobol, monte_carlo
        csv = "rows.csv"           # for csv
        distribution = "uniform"   # or normal, for monte_carlo
        seed = 0
        starts = 64                # largest number of starts of a row, or of the nominal design for monte_carlo
        warm = false               # whether each row starts at the optimum of its neighbour
        report = ["nu_H", "2*Fr_c"]
        [vary]
        mu = { min = 0.05, max = 1, points = 20, log = true }   # for a grid; without points for a sample
        zeta_H = [-0.2, -0.25]
        "lambda_s.max" = ["20 deg", "30 deg"]
        "offset.limit" = [0.02, 0.05]
        [tolerances]               # for monte_carlo, in place of those of the problem
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
            f'or write a study file with problem = "{Path(page.file).name}" and the varied names under [vary]'
        )
        raise InputError([Fault(message, file=page.file)])
    faults, content = validate_tables(page.data, _StudyFile, _shape_fault)
    title = escape_unprintable(Path(page.file).stem)
    problem = _read_problem(page, title, faults)
    if content is None or problem is None:
        raise page.error(faults)
    options, posed = content.study, problem.posed
    faults += [
        *_method_faults(content, {f.key for f in faults}),
        *_prefix_keys(common_faults(posed, options.seed, options.starts, options.report), "study"),
    ]
    values: dict[str, Any] = {}
    if options.method == "monte_carlo":
        numbers = dict[str, Any].fromkeys(TABLES) | {"tolerances": content.tolerances}
        tables, _, _, number_faults = read_numbers(numbers, posed.parameter_set)
        values, faults = tables["tolerances"], faults + number_faults
    elif options.method == "csv" and options.csv:
        values = _read_rows(page, options.csv, posed, faults)
    elif options.method in _VALUE_FORMS:
        values = _read_vary(posed, content, faults)
    if faults:
        raise page.error(faults)
    common: dict[str, Any] = options.model_dump(include={"seed", "starts", "report"})
    common |= {"problem": problem, "title": content.title.strip() or title}
    try:
        if options.method == "monte_carlo":
            distribution = options.distribution or DISTRIBUTIONS[0]
            return Sampling(rows=options.rows or 0, distribution=distribution, tolerances=values, **common)
        return Study(warm=options.warm, method=options.method, **_make_columns(values, content), **common)
    except InputError as error:
        file_faults = [replace(f, key=(*_FILE_KEYS.get(f.key[0], f.key[:1]), *f.key[1:])) for f in error.faults]
        raise page.error(file_faults) from None


_FILE_KEYS: Mapping[str, Key] = {
    "columns": ("vary",),
    "ranges": ("vary",),
    "rows": ("study", "rows"),
    "distribution": ("study", "distribution"),
}
"""Argument of a `Study` or a `Sampling` → its section or key in the file."""


def _read_problem(page: Page, title: str, faults: list[Fault]) -> Problem | None:
    """Read the problem of a study; adds to `faults`."""
    source = page.data.get("problem")
    if isinstance(source, dict):
        problem_faults, problem = problem_from_tables(source, str(page.data.get("title", "")).strip() or title)
        faults += _prefix_keys([*problem_faults, *(find_objective_faults(problem.posed) if problem else ())], "problem")
        return problem
    if isinstance(source, str):  # anything else is reported as a fault of shape
        try:
            return as_solvable(Path(page.file).parent / source).problem
        except InputError as error:
            faults += _faults_of_named_file(source, error, ("problem",))
    return None


def _faults_of_named_file(name: str, error: InputError, key: Key) -> list[Fault]:
    """Faults of a file that a study names; a fault without a line gets the line in which the study names the file."""
    hint = "the name is relative to the study file"
    return [f if f.line else Fault(f"'{name}' {f.message}; {hint}", key) for f in error.faults]


def _read_rows(page: Page, name: str, problem: Posed, faults: list[Fault]) -> dict[str, Column]:
    """Read the columns of a CSV file that a study names; adds to `faults`."""
    file, check_name = str(Path(page.file).parent / name), build_name_check(problem)
    try:
        columns = read_csv(file, partial(unit_of, problem))
    except InputError as error:
        faults += _faults_of_named_file(name, error, ("study", "csv"))
        return {}
    faults += [Fault(message, (column,)).at(file, 1) for column in columns if (message := check_name(column))]
    return columns


def _method_faults(content: _StudyFile, fault_keys: Set[Key]) -> Iterator[Fault]:
    """Faults of keys and sections that the method does not accept, or that it requires and that are missing."""
    method = content.study.method
    if method not in METHODS:
        yield Fault(f"unknown method {short(method)}; {suggest(method, METHODS)}", ("study", "method"))
        return
    for key, (methods, example) in _METHODS_OF_KEY.items():
        is_given = getattr(content.study if key[1:] else content, key[-1]) not in (None, {})
        if is_given and method not in methods:
            name = key[-1] if key[1:] else f"[{key[0]}]"
            yield Fault(f'{name} does not go with method = "{method}"; accepted for {" ".join(methods)}', key)
        elif example and method in methods and not is_given and key not in fault_keys:
            message = f'missing {key[-1]}, which method = "{method}" needs; write e.g. {example}'
            yield Fault(message, ("study", "method"))
    if method == "monte_carlo" and content.study.warm:
        yield Fault("a Monte Carlo study has no free parameters to start warm; remove this key", ("study", "warm"))


def _shape_fault(location: tuple[int | str, ...], kind: str, value: Any) -> Fault:
    """Convert an error of pydantic to a fault with the keys of the study file."""
    key = tuple(str(k) for k in location if k not in ("str", "dict[str,any]", "float", "int"))
    name, in_options = key[:2][-1], key[0] == "study" and len(key) > 1
    if kind == "extra_forbidden" and key[0] in ("parameters", "objective", "constraints"):
        return Fault(f"belongs to the problem; write [problem.{name}], or name a problem file", key)
    if kind == "extra_forbidden":
        accepted = (_Options if in_options else _StudyFile).model_fields
        return Fault(f"unknown key {short(name)}; {suggest(name, accepted)}", key)
    if kind == "missing":
        return Fault('missing problem; write e.g. problem = "least_speed.toml", or a table [problem]', key)
    return Fault(f"found {short(value)}; accepted: {_ACCEPTED[name if in_options else key[0]]}", key[:2])
