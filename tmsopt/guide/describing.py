"""What a model, a problem or a file is made of, from the model's own tables."""

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
        problem, typed = _read(given)
    except InputError as error:
        if "." in str(given) or len(error.faults) != 1:
            raise
        (fault,) = error.faults  # of a word that is no file: it may be meant for a model
        message = f"{fault.message}; models: {' '.join(MODELS)}"
        raise InputError([replace(fault, message=message)]) from None
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


def _describe(model: Model, problem: Posed | None = None, typed: Typed = Table()) -> Description:
    stated = typed.get("model")
    stated = stated if isinstance(stated, dict) else model.statement or {}
    return Description(
        model=model.name,
        meaning=model.title,
        degree=model.degree if model.carrier is None else model.degree // 2,
        title=problem.title if problem else "",
        sets=tuple(_words(model, of, problem, stated) for of in ([problem.parameter_set] if problem else model.sets)),
        feedback=() if problem else tuple(_gains(model)),
        patterns=Table({name: pattern_of(model, name).meaning for name in patterns_of(model)}),
        functions=(*FUNCTIONS, *CONSTANTS),
        omits=model.omits,
        conventions=model.conventions,
        sketch=model.sketch,
        matrices=Table(dict(_matrices(stated))),
        asked=Table(_list_question(problem, typed) if problem else {}),
    )


def _words(model: Model, of: ParameterSet, problem: Posed | None, stated: Typed) -> Words:
    written = stated.get("quantities", {})
    quantities = [s for n, s in vocabulary(model, of).items() if n not in of.names]
    return Words(
        of.name,
        tuple(_parameter(p, problem, model.statement is not None) for p in of.parameters),
        tuple(Word(q.name, q.unit, f"= {written[q.name]}" if q.name in written else q.meaning) for q in quantities),
    )


def _gains(model: Model) -> Iterator[Words]:
    """What [feedback] adds to the sets of a bicycle."""
    if not gain_names(model.name):
        return
    for of, more in zip(model.sets, controlled(model, gain_names(model.name)).sets, strict=True):
        known = {q.name for q in of.quantities}
        added = (_parameter(p) for p in more.parameters if p not in of.parameters)
        quantities = (Word(q.name, q.unit, q.meaning) for q in more.quantities if q.name not in known)
        yield Words(of.name, tuple(added), tuple(quantities))


def _parameter(p: Parameter, problem: Posed | None = None, of_user: bool = False) -> Word:
    """Its meaning, its physical range in words, angles in degrees, and what it is or may be, in the unit as typed."""
    possible = "" if p.range == Range() else str(p.range)
    if possible and p.unit == "rad":
        possible = f"{Range(math.degrees(p.range.lower), math.degrees(p.range.upper), p.range.closed)} deg"
    given = "" if p.default is None else f"{p.default:.12g} if left out"
    if problem is not None:
        values = problem.free.get(p.name) or (problem.fixed[p.name],)
        given = " … ".join(_number(x, unit_of(problem, p.name)) for x in values)
    return Word(p.name, p.unit, "" if of_user else p.meaning, possible, given)


def _number(value: Any, unit: Unit) -> str:
    """A text as typed, or a number with its unit."""
    return value if isinstance(value, str) else unit.show(value, 12)


def _matrices(stated: Typed) -> Iterator[tuple[str, tuple[tuple[str, ...], ...]]]:
    for name, rows in stated.items():
        if isinstance(rows, list) and name not in ("parameters", "shared"):
            listed = rows if all(isinstance(row, list) for row in rows) else [rows]
            yield name, tuple(tuple(map(str, row)) for row in listed)


def _list_question(problem: Posed, typed: Typed) -> dict[str, Table[str]]:
    """What a problem asks, section by section."""
    senses = {n: getattr(problem, n) or "" for n in ("locate", "minimize", "maximize")}
    objective = {"pareto": ", ".join(problem.pareto)} if problem.pareto else {n: t for n, t in senses.items() if t}
    found: dict[str, dict[str, str]] = {"objective": objective, "constraints": dict(problem.constraints)}
    for section in ("scenarios", "tolerances", "weights"):
        own = typed.get(section, {})
        found[section] = {n: _span(own.get(n, v), unit_of(problem, n)) for n, v in getattr(problem, section).items()}
    return {section: Table(keys) for section, keys in found.items() if keys}


def _span(value: Any, unit: Unit) -> str:
    """A scenario, a tolerance or a weight."""
    if isinstance(value, Band):
        value = {"min": value.min, "max": value.max}
    if isinstance(value, dict):
        return f"{_number(value['min'], unit)} … {_number(value['max'], unit)}"
    return ", ".join(_number(v, unit) for v in (value if isinstance(value, list | tuple) else [value]))
