"""Describes a model, a problem or a file by the tables of the model."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from tmsopt.errors import InputError, input_error, short
from tmsopt.guide.description import Description, Word, Words
from tmsopt.models import CONSTANTS, FUNCTIONS, MODELS, Model, Parameter, ParameterSet, Range
from tmsopt.models.built_in import controlled, gain_names
from tmsopt.models.user_spectrum import pattern_of, patterns_of
from tmsopt.problem import Band, Posed, Problem, ProblemSource, Solution, Unit, load, pose, unit_of
from tmsopt.problem.advice.names import vocabulary
from tmsopt.problem.toml import read_page
from tmsopt.records import Table

TypedTables = Mapping[str, Any]
"""The tables of a file as typed; empty if there is no file."""


def describe(given: ProblemSource | Model) -> Description:
    """Describe the names, units, signs and meanings of a model or its name, a problem, a solution, or a file.

    Raises:
        InputError: for a file with faults, or if `given` is none of these.

    Example:
        >>> described = tmsopt.describe("problems/ep4.toml")
        >>> described.model, described.title
        ('tms', 'EP4 of the chi_H = 1 bicycle')

    More: docs/reference/quantities.md
    """
    if isinstance(given, Problem | Posed | Solution):
        posed = pose(given)
        return _describe(posed.model, posed)
    model = MODELS.get(given, given) if isinstance(given, str) else given
    if isinstance(model, Model):
        return _describe(model)
    if not isinstance(given, str | PathLike):
        accepted = f"the name of a model ({', '.join(MODELS)}), the path of a file, a Model, a Problem, or a Solution"
        raise input_error(f"found {short(given)}; accepted: {accepted}", "given")
    try:
        problem, tables = _read(given)
    except InputError as error:
        if "." in str(given) or len(error.faults) != 1:
            raise
        (fault,) = error.faults  # a word that is no file may be the misspelt name of a model
        message = f"{fault.message}; models: {' '.join(MODELS)}"
        raise InputError([replace(fault, message=message)]) from None
    return _describe(problem.model, problem.posed, tables)


def _read(path: str | PathLike[str]) -> tuple[Problem, TypedTables]:
    """Read the problem of a problem file or study file, with its tables."""
    data = read_page(path, "problem").data
    if "parameters" in data or not {"problem", "study", "vary"} & set(data):
        return load(path), data
    base = data.get("problem")
    if isinstance(base, str):
        return _read(Path(path).parent / base)
    from tmsopt.studies import load_study  # imported here, because a solve describes parameters without studies

    return load_study(path).problem, base if isinstance(base, dict) else {}


def _describe(model: Model, problem: Posed | None = None, tables: TypedTables = Table()) -> Description:
    model_table = tables.get("model")
    model_table = model_table if isinstance(model_table, dict) else model.statement or {}
    return Description(
        model=model.name,
        meaning=model.title,
        degree=model.degree,
        title=problem.title if problem else "",
        sets=tuple(
            _list_words(model, parameter_set, problem, model_table)
            for parameter_set in ([problem.parameter_set] if problem else model.sets)
        ),
        feedback=() if problem else tuple(_list_gains(model)),
        patterns=Table({name: pattern_of(model, name).meaning for name in patterns_of(model)}),
        functions=(*FUNCTIONS, *CONSTANTS),
        omits=model.omits,
        conventions=model.conventions,
        sketch=model.sketch,
        matrices=Table(dict(_list_matrices(model_table))),
        asked=Table(_list_request(problem, tables) if problem else {}),
    )


def _list_words(model: Model, parameter_set: ParameterSet, problem: Posed | None, model_table: TypedTables) -> Words:
    expressions = model_table.get("quantities", {})
    quantities = [s for n, s in vocabulary(model, parameter_set).items() if n not in parameter_set.names]
    return Words(
        parameter_set.name,
        tuple(_describe_parameter(p, problem, model.statement is not None) for p in parameter_set.parameters),
        tuple(
            Word(q.name, q.unit, f"= {expressions[q.name]}" if q.name in expressions else q.meaning) for q in quantities
        ),
    )


def _list_gains(model: Model) -> Iterator[Words]:
    """List the parameters and quantities that [feedback] adds to each parameter set of a bicycle."""
    if not gain_names(model.name):
        return
    for parameter_set, controlled_set in zip(model.sets, controlled(model, gain_names(model.name)).sets, strict=True):
        names = {q.name for q in parameter_set.quantities}
        gains = (_describe_parameter(p) for p in controlled_set.parameters if p not in parameter_set.parameters)
        quantities = (Word(q.name, q.unit, q.meaning) for q in controlled_set.quantities if q.name not in names)
        yield Words(parameter_set.name, tuple(gains), tuple(quantities))


def _describe_parameter(p: Parameter, problem: Posed | None = None, is_user_model: bool = False) -> Word:
    """Describe a parameter: its meaning, its possible range (angles in degrees), and its value or bounds as typed."""
    range_text = "" if p.range == Range() else str(p.range)
    if range_text and p.unit == "rad":
        range_text = f"{Range(math.degrees(p.range.lower), math.degrees(p.range.upper), p.range.closed)} deg"
    value_text = "" if p.default is None else f"{p.default:.12g} if left out"
    if problem is not None:
        values = problem.free.get(p.name) or (problem.fixed[p.name],)
        value_text = " … ".join(_format_number(x, unit_of(problem, p.name)) for x in values)
    return Word(p.name, p.unit, "" if is_user_model else p.meaning, range_text, value_text)


def _format_number(value: Any, unit: Unit) -> str:
    """Return a text unchanged, or write a number with its unit."""
    return value if isinstance(value, str) else unit.show(value, 12)


def _list_matrices(model_table: TypedTables) -> Iterator[tuple[str, tuple[tuple[str, ...], ...]]]:
    for name, rows in model_table.items():
        if isinstance(rows, list) and name not in ("parameters", "shared"):
            matrix = rows if all(isinstance(row, list) for row in rows) else [rows]
            yield name, tuple(tuple(map(str, row)) for row in matrix)


def _list_request(problem: Posed, tables: TypedTables) -> dict[str, Table[str]]:
    """List what a problem asks for: section → key → text."""
    senses = {n: getattr(problem, n) or "" for n in ("locate", "minimize", "maximize")}
    objective = {"pareto": ", ".join(problem.pareto)} if problem.pareto else {n: t for n, t in senses.items() if t}
    sections: dict[str, dict[str, str]] = {"objective": objective, "constraints": dict(problem.constraints)}
    for section in ("scenarios", "tolerances", "weights"):
        typed_values = tables.get(section, {})
        sections[section] = {
            n: _format_span(typed_values.get(n, v), unit_of(problem, n)) for n, v in getattr(problem, section).items()
        }
    return {section: Table(keys) for section, keys in sections.items() if keys}


def _format_span(value: Any, unit: Unit) -> str:
    """Write a scenario, a tolerance or a weight."""
    if isinstance(value, Band):
        value = {"min": value.min, "max": value.max}
    if isinstance(value, dict):
        return f"{_format_number(value['min'], unit)} … {_format_number(value['max'], unit)}"
    return ", ".join(_format_number(v, unit) for v in (value if isinstance(value, list | tuple) else [value]))
