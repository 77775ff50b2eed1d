"""What a model, a problem or a file is made of, from the model's own tables."""

import math
from collections.abc import Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from tmsopt.errors import Fault, InputError, input_error, short
from tmsopt.guide.description import Description, Word, Words
from tmsopt.models import CONSTANTS, FUNCTIONS, MODELS, Model, Parameter, ParameterSet, Quantity, Range
from tmsopt.models.built_in import controlled, gain_names
from tmsopt.models.user_spectrum import pattern_of, patterns_of
from tmsopt.problem import Band, Given, Posed, Problem, Solution, Unit, load, pose, unit_of
from tmsopt.problem.advice.names import vocabulary
from tmsopt.problem.toml import read_page
from tmsopt.records import Table
from tmsopt.studies import load_study

Typed = Mapping[str, Any]
"""The tables of a file as typed; empty for what is no file."""


def describe(given: Given | Model) -> Description:
    """Words, units, signs and meanings of a model (by name too), a problem, a solution, or a problem or study file.

    Raises:
        InputError: for a file with faults, and for anything else.

    Example:
        >>> described = tmsopt.describe("problems/ep4.toml")
        >>> described.model, described.title
        ('tms', 'EP4 of the chi_H = 1 bicycle')

    More: docs/reference/quantities.md
    """
    if isinstance(given, Model):
        return _describe(given, None, {})
    if isinstance(given, str) and given in MODELS:
        return _describe(MODELS[given], None, {})
    if isinstance(given, Problem | Posed | Solution):
        posed = pose(given)
        return _describe(posed.model, posed, {})
    if not isinstance(given, str | PathLike):
        accepted = f"the name of a model ({', '.join(MODELS)}), the path of a file, a Model, a Problem, or a Solution"
        raise input_error(f"found {short(given)}; accepted: {accepted}", "given")
    try:
        problem, typed = _read(given)
    except InputError as error:
        raise _with_models(error, given) from None
    return _describe(problem.model, problem.posed, typed)


def _read(path: str | PathLike[str]) -> tuple[Problem, Typed]:
    """The problem of a file, or the one that a study is of, with the tables in which it stands."""
    data = read_page(path, "problem").data
    if "parameters" in data or not {"problem", "study", "vary"} & set(data):
        return load(path), data
    inner = data.get("problem")
    if isinstance(inner, str):
        return _read(Path(path).parent / inner)
    return load_study(path).problem, inner if isinstance(inner, dict) else {}


def _with_models(error: InputError, given: str | PathLike[str]) -> InputError:
    """For a word that is no file, the error names the models too."""
    if "." in str(given) or len(error.faults) != 1:
        return error
    (fault,) = error.faults
    return InputError([Fault(f"{fault.message}; models: {' '.join(MODELS)}", fault.key, fault.file, fault.line)])


def _describe(model: Model, problem: Posed | None, typed: Typed) -> Description:
    size = model.degree if model.carrier is None else model.degree // 2
    return Description(
        model=model.name,
        meaning=model.title,
        degree=size,
        title=problem.title if problem else "",
        sets=tuple(_words(model, of, problem, typed) for of in ([problem.parameter_set] if problem else model.sets)),
        feedback=() if problem else tuple(_gains(model)),
        patterns=Table({name: pattern_of(model, name).meaning for name in patterns_of(model)}),
        functions=(*FUNCTIONS, *CONSTANTS),
        omits=model.omits,
        conventions=model.conventions,
        sketch=model.sketch,
        matrices=Table(dict(_matrices(model, typed))),
        asked=Table(_list_question(problem, typed) if problem else {}),
    )


def _words(model: Model, of: ParameterSet, problem: Posed | None, typed: Typed) -> Words:
    written = _model_table(typed).get("quantities", (model.statement or {}).get("quantities", {}))
    quantities = [s for n, s in vocabulary(model, of).items() if n not in of.names]
    return Words(
        of.name,
        tuple(_parameter(p, problem, model.statement is not None) for p in of.parameters),
        tuple(_quantity(q, written.get(q.name, "")) for q in quantities),
    )


def _gains(model: Model) -> Iterator[Words]:
    """What [feedback] adds to the sets of a bicycle."""
    if not gain_names(model.name):
        return
    for of, more in zip(model.sets, controlled(model, gain_names(model.name)).sets, strict=True):
        added = [_parameter(p, None, False) for p in more.parameters if p not in of.parameters]
        known = {q.name for q in of.quantities}
        yield Words(of.name, tuple(added), tuple(_quantity(q, "") for q in more.quantities if q.name not in known))


def _quantity(q: Parameter | Quantity, formula: str) -> Word:
    return Word(q.name, q.unit, f"= {formula}" if formula else q.meaning)


def _parameter(p: Parameter, problem: Posed | None, of_user: bool) -> Word:
    meaning = "" if of_user else p.meaning  # only its name is known
    return Word(p.name, p.unit, meaning, _limits(p), _describe_value(p, problem))


def _limits(p: Parameter) -> str:
    """The physical range in words, angles in degrees."""
    if p.range == Range():
        return ""
    if p.unit != "rad":
        return str(p.range)
    return f"{Range(math.degrees(p.range.lower), math.degrees(p.range.upper), p.range.closed)} deg"


def _describe_value(p: Parameter, problem: Posed | None) -> str:
    """What a parameter is, or may be, in the unit in which it was typed."""
    if problem is None:
        return "" if p.default is None else f"{p.default:.12g} if left out"
    unit, free = unit_of(problem, p.name), problem.free.get(p.name)
    return " … ".join(_number(x, unit) for x in free) if free else _number(problem.fixed[p.name], unit)


def _number(value: Any, unit: Unit) -> str:
    """A text as typed, or a number with its unit."""
    return value if isinstance(value, str) else unit.show(value, 12)


def _model_table(typed: Typed) -> Mapping[str, Any]:
    """The table [model] of a file."""
    model = typed.get("model")
    return model if isinstance(model, dict) else {}


def _matrices(model: Model, typed: Typed) -> Iterator[tuple[str, tuple[tuple[str, ...], ...]]]:
    for name, rows in (_model_table(typed) or model.statement or {}).items():
        if isinstance(rows, list) and name not in ("parameters", "shared"):
            listed = rows if all(isinstance(row, list) for row in rows) else [rows]
            yield name, tuple(tuple(str(entry) for entry in row) for row in listed)


def _list_question(problem: Posed, typed: Typed) -> dict[str, Table[str]]:
    """What a problem asks, section by section."""
    if problem.pareto:
        objective = {"pareto": ", ".join(problem.pareto)}
    else:
        senses = ("locate", "minimize", "maximize")
        objective = {n: text for n in senses if (text := getattr(problem, n)) is not None}
    found: dict[str, dict[str, str]] = {"objective": objective, "constraints": dict(problem.constraints)}
    for section in ("scenarios", "tolerances", "weights"):
        own = typed.get(section, {})
        found[section] = {n: _span(own.get(n, v), unit_of(problem, n)) for n, v in getattr(problem, section).items()}
    return {section: Table(keys) for section, keys in found.items() if keys}


def _span(value: Any, unit: Unit) -> str:
    """A scenario, a tolerance or a weight."""
    if isinstance(value, Band | dict):
        low, high = (value["min"], value["max"]) if isinstance(value, dict) else (value.min, value.max)
        return f"{_number(low, unit)} … {_number(high, unit)}"
    return ", ".join(_number(v, unit) for v in value) if isinstance(value, list | tuple) else _number(value, unit)
