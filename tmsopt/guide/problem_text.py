"""A problem as the text of a problem file, in the units in which it was typed."""

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

_LARGEST_DENOMINATOR = 10**6  # of a factor between units, such as 5/18
_PLACES = 22  # of a decimal that only one double is nearest to, in any unit


def toml_problem(problem: Posed, comments: Iterable[str] = ()) -> str:
    """A file that is read as the same problem, of one of the bicycles.

    Args:
        comments: lines to begin with.
    """
    gains, senses = gain_names(problem.model.name), ("locate", "minimize", "maximize", "pareto")
    tables: dict[str, dict[str, str]] = {"parameters": {}, "feedback": {}}
    for p in problem.parameter_set.parameters:
        if _is_written(problem, p):
            tables["feedback" if p.name in gains else "parameters"][p.name] = _row(problem, p)
    tables["objective"] = {sense: toml_text(text) for sense in senses if (text := getattr(problem, sense))}
    tables["constraints"] = {name: toml_text(text) for name, text in problem.constraints.items()}
    for table in ("scenarios", "tolerances", "weights"):
        tables[table] = {name: _value(problem, name, value) for name, value in getattr(problem, table).items()}
    lines = ["#:schema ./tmsopt.schema.json", *(f"# {comment}" for comment in comments)]
    lines += [f"title = {toml_text(problem.title)}", f"model = {toml_text(problem.model.name)}"]
    for table, entries in tables.items():
        if entries:
            lines += ["", f"[{table}]", *(f"{toml_key(name)} = {text}" for name, text in entries.items())]
    return "\n".join([*lines, ""])


def toml_text(value: object) -> str:
    """A text, a number, a truth or a list of these as TOML: JSON has the same signs and escapes."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")


def toml_key(name: str) -> str:
    """A name as a key of TOML."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml_text(name)


def exact_value(value: float, written: str, own: str) -> str:
    """A parameter's value in TOML, in the unit that it was written in where that gives back the same double.

    Args:
        written, own: the unit as written, and the one that the value is kept in.
    """
    if not written:
        return repr(value)
    one = unit_factor(written, own)
    share = Fraction(one).limit_denominator(_LARGEST_DENOMINATOR)
    with localcontext(prec=_PLACES):
        long = str(Decimal(repr(value)) * share.denominator / share.numerator)
    near = value / one
    beside = (repr(near + k * math.ulp(near)).removesuffix(".0") for k in (0, 1, -1, 2, -2))
    texts = (f"{number} {written}" for number in (*beside, long))
    return next((toml_text(text) for text in texts if parse_quantity(text, own) == value), repr(value))


def _is_written(problem: Posed, parameter: Parameter) -> bool:
    """Whether a parameter must be in the file: no default, nor the middle of a scenario."""
    name, varied = parameter.name, problem.scenarios.get(parameter.name)
    default = parameter.default if varied is None else middle_of(varied)
    return name in problem.free or problem.fixed[name] != default


def _row(problem: Posed, parameter: Parameter) -> str:
    name = parameter.name
    comment = f"# {parameter.meaning}" + ("" if name in problem.units else f", {parameter.unit}")
    value: Any = problem.fixed.get(name)
    if name in problem.free:
        value = dict(zip(("min", "max"), problem.free[name], strict=True))
        value |= {"start": problem.start[name]} if name in problem.start else {}
    return f"{_value(problem, name, value)}  {comment}"


def _value(problem: Posed, name: str, value: Any) -> str:
    """A number, a list of numbers, or a table of them."""
    if isinstance(value, Band):
        return f"{_value(problem, name, {'min': value.min, 'max': value.max})[:-2]}, points = {value.points} }}"
    if isinstance(value, tuple):
        return f"[{', '.join(_number(problem, name, x) for x in value)}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{end} = {_number(problem, name, x)}' for end, x in value.items())} }}"
    return _number(problem, name, value)


def _number(problem: Posed, name: str, value: float) -> str:
    """As it was typed, where it is exactly that number; in the unit of the file if it reads back so."""
    kept, typed = problem.parameter_set[name].unit, problem.typed({name: value}).get(name, "")
    text = exact_value(value, problem.units.get(name, ""), kept)
    if typed and (text[0] != '"' or str(parse_exact_quantity(text[1:-1], kept)[2]) != typed):
        return toml_text(typed if kept in ("1", "rad") else f"{typed} {kept}")
    return text
