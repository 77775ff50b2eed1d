"""Study files: TOML to a Study, or to the Monte Carlo sampling that becomes one, with every fault at its line."""

from collections.abc import Iterator, Set
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import Field, StrictBool, StrictInt, StrictStr

from tmsopt.design.files import posed, question_of
from tmsopt.design.problem import Problem, unasked
from tmsopt.design.toml import Key, Number, Page, Section, fitted, read_page, within
from tmsopt.errors import Fault, InputError, count_faults, short, suggest, visible
from tmsopt.formulation.options import STARTS
from tmsopt.studies.monte_carlo import DISTRIBUTIONS, Sampling
from tmsopt.studies.study import Study
from tmsopt.studies.validate import METHODS, MOST_ROWS, common_faults, name_faults
from tmsopt.studies.vary import Varied, read_csv, unit_of, varied
from tmsopt.units import with_unit

_NEEDED = {"latin_hypercube": ("rows",), "sobol": ("rows",), "csv": ("csv",), "monte_carlo": ("rows",)}
_OWN = {"rows": ("latin_hypercube", "sobol", "monte_carlo"), "csv": ("csv",), "distribution": ("monte_carlo",)}
"""Keys of [study] that only some methods have."""

_ACCEPTED = {
    "title": "a text in quotes",
    "problem": "the name of a problem file in quotes, or a table [problem] with [problem.parameters] and so on",
    "study": "a table", "vary": "a table", "tolerances": "a number, or a text with a unit such as '5 mm'",
    "method": f"one of {' '.join(METHODS)}", "rows": "a whole number", "csv": "the name of a CSV file in quotes",
    "distribution": f"one of {' '.join(DISTRIBUTIONS)}", "seed": "a whole number, 0 or more",
    "starts": "a whole number, 1 or more", "warm": "true or false",
    "report": "a list of expressions, such as ['nu_H', '2*Fr_c']",
}  # fmt: skip


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
    faults, written = fitted(page.data, _StudyFile, _shape_fault)
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
            problem=problem, columns=found.columns, title=title, seed=options.seed, starts=options.starts,
            warm=options.warm, report=options.report, grid_shape=found.grid_shape, method=options.method,
            notes=found.notes,
        )  # fmt: skip
    except InputError as error:
        columns = {f.key[:1]: ("vary", *f.key[1:]) for f in error.faults if f.key[:1] == ("columns",)}
        raise page.error([replace(f, key=columns.get(f.key[:1], f.key)) for f in error.faults]) from None


def _problem(page: Page) -> tuple[list[Fault], Problem | None]:
    """The problem that a study is of, and what is wrong with it."""
    stated = page.data.get("problem")
    if isinstance(stated, dict):
        faults, problem = posed(stated, str(page.data.get("title", "")).strip() or visible(Path(page.file).stem))
        if problem is not None and not problem.pareto:
            faults += unasked(problem)
        faults = within("problem", faults)
    elif isinstance(stated, str):
        try:
            faults, problem = [], question_of(Path(page.file).parent / stated, front=True)
        except InputError as error:
            faults, problem = [f if f.line else _of_problem_file(stated, f) for f in error.faults], None
    else:
        return [], None  # reported as a fault of shape
    if problem is not None and problem.pareto:
        faults += [Fault(f.message, ("problem",)) for f in unasked(problem)]
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
            problem=problem, rows=options.rows or 0, seed=options.seed,
            distribution=options.distribution or DISTRIBUTIONS[0], tolerances=tolerances, title=title,
            starts=options.starts, report=options.report,
        )  # fmt: skip
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
