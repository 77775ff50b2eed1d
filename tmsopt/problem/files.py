"""Reads problem files: turns TOML into a `Problem`, and reports every fault with its line."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import Field, StrictInt, StrictStr

from tmsopt.errors import Fault, InputError, escape_unprintable, short, suggest
from tmsopt.models import MODELS, Model, gain_names
from tmsopt.models.bicycle_files import read_bicycle
from tmsopt.problem.advice.names import suggest_key
from tmsopt.problem.cases import DEFAULT_POINT_COUNT, Band
from tmsopt.problem.freedom import find_objective_faults
from tmsopt.problem.model_table import read_model_table
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.solution import Solution
from tmsopt.problem.toml import Number, Page, Section, Tables, read_page, validate_tables
from tmsopt.problem.validate import EXTRA_PARAMETER_TABLES

_NO_PARAMETERS = "missing section [parameters]"


class _FreeParameter(Section):
    """Bounds between which a free parameter may move."""

    min: Number
    """The least value."""
    max: Number
    """The greatest value."""
    start: Number | None = None
    """A value to start the search from, among others."""


class _Band(Section):
    """Every value from min to max; the constraints must hold at all of them."""

    min: Number
    """The least value."""
    max: Number
    """The greatest value."""
    points: StrictInt = DEFAULT_POINT_COUNT
    """Number of values in the first search, 2 to 99."""


class _Objective(Section):
    """The objective: minimize or maximize an expression, locate a pattern of roots, both, or a Pareto front."""

    minimize: StrictStr | None = None
    """An expression to minimise, such as "abscissa", the largest real part of the roots."""
    maximize: StrictStr | None = None
    """An expression to maximise, such as "damping_ratio"."""
    pareto: list[StrictStr] | None = None
    """Two or three expressions to minimise, such as ["abscissa", "-lambda_s"]."""
    locate: StrictStr | None = None
    """A pattern of roots to find, such as "EP4" (four equal roots) or "weave"."""


class _File(Section):
    """A design problem: fixed and free parameters, objective and constraints."""

    title: StrictStr = ""
    """One line for reports."""
    model: StrictStr | dict[str, Any] = "tms"
    """The system: a name in quotes, or a table [model] with matrices or coefficients of your own."""
    bicycle: StrictStr | None = None
    """A parameter file of BicycleParameters, relative to this file; [parameters] override it."""
    parameters: dict[str, _FreeParameter | Number]
    """A number fixes a parameter, a table { min = …, max = … } frees it; texts have units, such as "40 cm"."""
    feedback: dict[str, _FreeParameter | Number] = Field(default_factory=dict)
    """Gains of a controller, such as k_phidot for the lean rate, each as in [parameters]."""
    objective: _Objective = Field(default_factory=_Objective)
    """What to optimise; chart and trace need none."""
    constraints: dict[str, StrictStr] = Field(default_factory=dict)
    """Limits such as arm = "u_H >= 0.02", with <=, >= or ==; numbers in m, kg, s, rad and N."""
    scenarios: dict[str, _Band | list[Number]] = Field(default_factory=dict)
    """Values of a parameter that the design must cope with: { min = …, max = … } or a list."""
    tolerances: dict[str, Number] = Field(default_factory=dict)
    """How far a parameter may deviate either way; the worst combination counts."""
    weights: dict[str, Number] = Field(default_factory=dict)
    """Size of a change that counts as 1 in radius, the robustness radius."""


FILE_SCHEMA: type[Section] = _File
"""The schema of a problem file, for editors."""

ProblemSource = Problem | Posed | Solution | str | PathLike[str]
"""Where functions get a problem from: a problem, the path of its file, or a solution, which contains its problem."""


def load(path: str | PathLike[str]) -> Problem:
    """Read a problem file. An objective is optional here; each function decides whether it needs one.

    Raises:
        InputError: listing every fault with file, line, key, what was found and what is accepted.

    Example:
        >>> problem = tmsopt.load("problems/ep4.toml")
        >>> problem.minimize, problem.free["chi_B"]
        ('abscissa', (1.01, 5.0))

    More: docs/reference/problem_file.md
    """
    return _load_problem(path, lambda problem: [])


def pose(source: object) -> Posed:
    """The problem in the form that is solved (`Posed`), from a problem, a problem file, or a solution.

    Raises:
        InputError: for a file with faults, or for anything else.
    """
    return _pose(source, lambda problem: [])


def as_solvable(source: object, allows_front: bool = False) -> Posed:
    """Like `pose`, but the problem must ask for one design. If `allows_front`, it may ask for a Pareto front instead.

    Raises:
        InputError: as for `pose`, and if parameters are free but there is no objective.
    """
    return _pose(source, lambda problem: [] if allows_front and problem.pareto else find_objective_faults(problem))


def _pose(source: object, faults_of: Callable[[Posed], list[Fault]]) -> Posed:
    if isinstance(source, str | PathLike):
        return _load_problem(source, faults_of).posed
    problem = source.problem if isinstance(source, Solution) else source
    if not isinstance(problem, Problem | Posed):
        message = f"found {short(source)}; accepted: a Problem, the path of a problem file, or a Solution"
        raise InputError([Fault(message, ("problem",))])
    posed = problem if isinstance(problem, Posed) else problem.posed
    if faults := faults_of(posed):
        raise InputError(faults)
    return posed


def _load_problem(path: str | PathLike[str], faults_of: Callable[[Posed], list[Fault]]) -> Problem:
    page = read_page(path, "problem")
    if "parameters" not in page.data and {"problem", "study", "vary"} & set(page.data):
        base = page.data.get("problem")
        advice = f"give its problem file, {base}" if isinstance(base, str) else "write its [problem] in a separate file"
        message = f"is a study of many designs, not a problem; run tmsopt study {page.file}, or {advice}"
        raise InputError([Fault(message, file=page.file)])
    faults, problem = problem_from_tables(_add_bicycle_parameters(page), escape_unprintable(Path(page.file).stem))
    if problem is not None and not faults:  # a misspelt [objective] is not a missing objective
        faults = faults_of(problem.posed)
    if problem is None or faults:
        raise page.error(faults)
    return problem


def _add_bicycle_parameters(page: Page) -> Tables:
    """The tables of a file with the parameters of its `bicycle` file; a parameter of the file itself has priority."""
    data, bicycle_file, parameters = page.data, page.data.get("bicycle"), page.data.get("parameters", {})
    if not isinstance(bicycle_file, str) or not isinstance(parameters, dict):
        return data
    try:
        bicycle = read_bicycle(Path(page.file).parent / bicycle_file)
    except InputError as error:
        name = short(bicycle_file)
        raise page.error(
            f if f.line else Fault(f"{name} {f.message}; the name is relative to this file", ("bicycle",))
            for f in error.faults
        ) from None
    bicycle_parameters = {n: v for n, v in bicycle.parameters.items() if n not in data.get("scenarios", {})}
    return {"model": "whipple", **data, "parameters": {**bicycle_parameters, **parameters}}


def problem_from_tables(data: Tables, title: str) -> tuple[list[Fault], Problem | None]:
    """The faults of the tables of a problem file, and the problem; None if a fault prevents it.

    Args:
        title: used if the file has none.
    """
    gain_faults, gains, data = _split_gains(data)
    faults, parsed = validate_tables(data, _File, _explain_shape)
    if any(hint in f.message for f in faults for hint in ("did you mean 'parameters'", "write [parameters]")):
        faults = [f for f in faults if f.message != _NO_PARAMETERS]  # the section has a misspelt name
    model_faults, model = _find_model(data.get("model", "tms"))
    faults += model_faults
    problem = None
    if model is not None and parsed is not None:
        tables = _collect_tables(parsed)
        for fault in faults:
            if fault.key[:1] in (("parameters",), ("scenarios",)) and len(fault.key) > 1:
                tables["fixed"][fault.key[1]] = math.nan  # the parameter is given, and its fault is already reported
        objective = vars(parsed.objective) | {"pareto": parsed.objective.pareto or ()}
        title = parsed.title.strip() or title
        try:
            problem = Problem(model=model, constraints=parsed.constraints, title=title, **tables, **objective)
        except InputError as error:
            reported_keys = {f.key[:2] for f in faults} | {("parameters", *f.key[1:2]) for f in faults}
            reported_keys |= {f.key[:1] for f in faults if f.key[:1] == ("objective",)}
            faults += [f for f in error.faults if f.key[:2] not in reported_keys]
    # The gains were checked as parameters, but the user wrote them in [feedback].
    faults = [replace(f, key=("feedback", *f.key[1:])) if {*f.key[1:2]} & gains else f for f in faults]
    return gain_faults + faults, problem


def _split_gains(data: Tables) -> tuple[list[Fault], set[str], Tables]:
    """Faults of [feedback], names of its valid gains, and the tables of the file with these gains in [parameters]."""
    gains, parameters, model = data.get("feedback", {}), data.get("parameters", {}), data.get("model", "tms")
    if not gains or not isinstance(gains, dict) or not isinstance(parameters, dict):
        return [], set(), data
    remaining_data = {k: v for k, v in data.items() if k != "feedback"}
    accepted = gain_names(model) if isinstance(model, str) else ()
    if not accepted:
        message = "is for the bicycles tms and whipple; write B, C and G in [model] for your own system"
        is_misspelt = isinstance(model, str) and model not in MODELS  # `_find_model` reports it
        return [] if is_misspelt else [Fault(message, ("feedback",))], set(), remaining_data
    faults = []
    for name in gains:
        if name not in accepted:
            faults.append(Fault(f"unknown gain {short(name)}; {suggest(name, accepted)}", ("feedback", name)))
        elif name in parameters:
            faults.append(Fault(f"'{name}' is in [parameters] too; keep one", ("feedback", name)))
    valid_gains = {n: v for n, v in gains.items() if n in accepted}
    if valid_gains:
        remaining_data["parameters"] = {**parameters, **valid_gains}
    return faults, set(valid_gains), remaining_data


def _find_model(entry: Any) -> tuple[list[Fault], Model | None]:
    """The faults of the key ``model``, and the model that its name or table means."""
    if isinstance(entry, dict):
        return read_model_table(entry)
    if not isinstance(entry, str):
        return [], None  # `validate_tables` reports it
    if entry in MODELS:
        return [], MODELS[entry]
    message = f"unknown model {short(entry)}; {suggest(entry, MODELS)}; your own goes in a table [model]"
    return [Fault(message, ("model",))], None


_INLINE_TABLES: Mapping[str, tuple[type[Section], str]] = {
    "parameters": (_FreeParameter, "{ min = …, max = … }"),
    "scenarios": (_Band, "{ min = …, max = …, points = 7 }"),
}
"""Section → schema of its inline tables, and an example."""

_ACCEPTED = {
    "model": "the name of a model in quotes, or a table [model]",
    "parameters": "a number, a text with a unit such as '5 deg', or { min = …, max = …, start = … }",
    "scenarios": "{ min = …, max = …, points = … }, or a list of values such as [1, 2.5]",
    "feedback": "a table of gains, such as k_phidot = -20",
    **dict.fromkeys(("tolerances", "weights"), "a number, or a text with a unit such as '5 mm'"),
    "pareto": "two or three texts, such as ['abscissa', 'Fr']",
    "constraints": "a comparison in quotes, such as 'nu_H >= 0.02'",
}
"""Section or key → accepted values."""


def _explain_shape(location: tuple[int | str, ...], kind: str, value: Any) -> Fault:
    """The fault for an error message of pydantic, in the words of the problem file."""
    # Pydantic adds these names of types to the keys of a location.
    type_names = ("_FreeParameter", "_Band", "float", "int", "str", "dict[str,any]")
    key = tuple(str(k) for k in location if k not in type_names)
    match key:
        case (section,) if kind == "extra_forbidden":
            return Fault(f"unknown key {short(section)}; {suggest_key(section, _File.model_fields)}", key)
        case ("objective", sense, *_) if kind == "extra_forbidden":
            return Fault(f"unknown key {short(sense)}; {suggest_key(sense, _Objective.model_fields, 'objective')}", key)
        case ("parameters",) if kind == "missing":
            return Fault(_NO_PARAMETERS, key)
        case ("parameters" | "scenarios" as table, name, end, *_) if kind == "extra_forbidden":
            return Fault(
                f"unknown key {short(end)} of {name}; {suggest(end, _INLINE_TABLES[table][0].model_fields)}", key
            )
        case ("parameters" | "scenarios" as table, name, end) if kind == "missing":
            return Fault(f"missing {end} of {name}; write {name} = {_INLINE_TABLES[table][1]}", key)
    section, *inner = key
    is_table = section in ("parameters", "objective", *EXTRA_PARAMETER_TABLES)
    accepted = "a table" if is_table else "a text in quotes"
    if inner or not is_table:
        accepted = _ACCEPTED.get("pareto" if inner[:1] == ["pareto"] else section, accepted)
    return Fault(
        f"found {short(value)}; accepted: {accepted}", key[: 3 if section in ("parameters", "constraints") else 2]
    )


def _collect_tables(parsed: _File) -> dict[str, Any]:
    """The tables of a problem, with numbers and texts as they were typed."""
    free = {n: v for n, v in parsed.parameters.items() if isinstance(v, _FreeParameter)}
    bands = {n: Band(**vars(s)) for n, s in parsed.scenarios.items() if isinstance(s, _Band)}
    return {
        "fixed": {n: v for n, v in parsed.parameters.items() if n not in free},
        "free": {n: (v.min, v.max) for n, v in free.items()},
        "start": {n: v.start for n, v in free.items() if v.start is not None},
        "scenarios": {**parsed.scenarios, **bands},
        "tolerances": parsed.tolerances,
        "weights": parsed.weights,
    }
