"""Writes a problem as the text of a problem file, in the units as typed."""

import json
import math
import re
from collections.abc import Iterable
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

from tmsopt.models import Parameter, gain_names
from tmsopt.problem import Band, Posed
from tmsopt.problem.cases import middle_of
from tmsopt.problem.units import parse_quantity, unit_factor
from tmsopt.problem.units.text import parse_exact_quantity

_LARGEST_DENOMINATOR = 10**6  # greatest denominator of a factor between units, such as 5/18
_DECIMAL_DIGITS = 22  # digits with which a decimal in any unit determines one double


def toml_problem(problem: Posed, comments: Iterable[str] = ()) -> str:
    """Write the problem file of a bicycle problem; reading it gives the same problem.

    Args:
        comments: comment lines at the beginning.
    """
    gains, senses = gain_names(problem.model.name), ("locate", "minimize", "maximize", "pareto")
    tables: dict[str, dict[str, str]] = {"parameters": {}, "feedback": {}}
    for p in problem.parameter_set.parameters:
        if _is_written(problem, p):
            tables["feedback" if p.name in gains else "parameters"][p.name] = _format_row(problem, p)
    tables["objective"] = {sense: toml_text(text) for sense in senses if (text := getattr(problem, sense))}
    tables["constraints"] = {name: toml_text(text) for name, text in problem.constraints.items()}
    for table in ("scenarios", "tolerances", "weights"):
        tables[table] = {name: _format_value(problem, name, value) for name, value in getattr(problem, table).items()}
    lines = ["#:schema ./tmsopt.schema.json", *(f"# {comment}" for comment in comments)]
    lines += [f"title = {toml_text(problem.title)}", f"model = {toml_text(problem.model.name)}"]
    for table, entries in tables.items():
        if entries:
            lines += ["", f"[{table}]", *(f"{toml_key(name)} = {text}" for name, text in entries.items())]
    return "\n".join([*lines, ""])


def toml_text(value: object) -> str:
    """Write a text, a number, a truth value or a list of these as TOML, whose signs and escapes are those of JSON."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")


def toml_key(name: str) -> str:
    """Write a name as a key of TOML."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml_text(name)


def exact_value(value: float, typed_unit: str, stored_unit: str) -> str:
    """Write a value in TOML, in the typed unit if reading it back gives the same double.

    Args:
        typed_unit, stored_unit: the unit as typed, and the unit of `value`.
    """
    if not typed_unit:
        return repr(value)
    factor = unit_factor(typed_unit, stored_unit)
    fraction = Fraction(factor).limit_denominator(_LARGEST_DENOMINATOR)
    with localcontext(prec=_DECIMAL_DIGITS):
        decimal = str(Decimal(repr(value)) * fraction.denominator / fraction.numerator)
    quotient = value / factor
    neighbours = (repr(quotient + k * math.ulp(quotient)).removesuffix(".0") for k in (0, 1, -1, 2, -2))
    texts = (f"{number} {typed_unit}" for number in (*neighbours, decimal))
    return next((toml_text(text) for text in texts if parse_quantity(text, stored_unit) == value), repr(value))


def _is_written(problem: Posed, parameter: Parameter) -> bool:
    """Return whether a parameter must be in the file: its value is neither the default nor the middle of a scenario."""
    name, scenario = parameter.name, problem.scenarios.get(parameter.name)
    default = parameter.default if scenario is None else middle_of(scenario)
    return name in problem.free or problem.fixed[name] != default


def _format_row(problem: Posed, parameter: Parameter) -> str:
    name = parameter.name
    comment = f"# {parameter.meaning}" + ("" if name in problem.units else f", {parameter.unit}")
    value: Any = problem.fixed.get(name)
    if name in problem.free:
        value = dict(zip(("min", "max"), problem.free[name], strict=True))
        value |= {"start": problem.start[name]} if name in problem.start else {}
    return f"{_format_value(problem, name, value)}  {comment}"


def _format_value(problem: Posed, name: str, value: Any) -> str:
    """Write a number, a list of numbers, or a table of numbers."""
    if isinstance(value, Band):
        return f"{_format_value(problem, name, {'min': value.min, 'max': value.max})[:-2]}, points = {value.points} }}"
    if isinstance(value, tuple):
        return f"[{', '.join(_format_number(problem, name, x) for x in value)}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{end} = {_format_number(problem, name, x)}' for end, x in value.items())} }}"
    return _format_number(problem, name, value)


def _format_number(problem: Posed, name: str, value: float) -> str:
    """Write a number in its typed unit, or as it was typed if only this gives back exactly the typed number."""
    unit, typed_text = problem.parameter_set[name].unit, problem.typed({name: value}).get(name, "")
    text = exact_value(value, problem.units.get(name, ""), unit)
    if not typed_text:
        return text
    if text.startswith('"'):
        _, _, exact = parse_exact_quantity(text[1:-1], unit)
        if str(exact) == typed_text:
            return text
    return toml_text(typed_text if unit in ("1", "rad") else f"{typed_text} {unit}")
