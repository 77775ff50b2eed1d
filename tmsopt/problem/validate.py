"""Validates a problem: finds every fault, and reports it with its key and the accepted values."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

from tmsopt.errors import Fault, limit_advice, short, suggest, table_faults, text_faults
from tmsopt.models import Model, ParameterSet
from tmsopt.models.expression import ExpressionError, UnknownName, parse_comparison, parse_value
from tmsopt.models.names import AMBIGUOUS_NAMES
from tmsopt.models.user_spectrum import pattern_of, patterns_of
from tmsopt.problem.advice.names import example_of, suggest_name
from tmsopt.problem.cases import Band, points_of
from tmsopt.problem.quantities import expand_names, root_names
from tmsopt.records import AnyNumbers

EXTRA_PARAMETER_TABLES = ("scenarios", "tolerances", "weights")
"""Tables of a problem that name parameters and are not `fixed`, `free` or `start`."""

MIN_SIZE = 1e-50
"""Least size of a nonzero parameter; its inverse is the greatest."""

_MAX_TOLERANCES = 8
"""Greatest number of tolerances; their box has 256 corners."""

_MAX_ENTRIES = {"constraints": 1000, "scenarios": 100}
"""Table → greatest number of entries: constraints of a problem, or values of a scenario."""

_MAX_PATTERN_LENGTH = 200  # greatest number of characters of the name of a pattern

StatedProblem = Any
"""A problem as the user stated it; any field may have any type."""

_TABLE_EXAMPLES = {
    "fixed": "{'mu': 0.1}",
    "free": "{'Fr': (0.1, 5)}",
    "constraints": "{'trail': 'nu_H >= 0.02'}",
    "start": "{'Fr': 2}",
    "scenarios": "{'v': Band(2, 6)}",
    "tolerances": "{'lambda_s': 0.01}",
    "weights": "{'v': 1}",
    "units": "{'v': 'km/h'}",
    "written": "{'v': {2.6666666666666665: '8/3'}}",
}
"""Argument that is a table → an example of it."""


def shape_faults(problem: StatedProblem) -> Iterator[Fault]:
    """Faults of arguments that have a wrong type, and of tables that are too large."""
    if not isinstance(problem.model, Model):
        accepted = "a model, such as tmsopt.models.tms"
        yield Fault(f"found {type(problem.model).__name__}; accepted: {accepted}", ("model",))
    for name, example in _TABLE_EXAMPLES.items():
        yield from table_faults(name, getattr(problem, name), example)
    if isinstance(problem.constraints, Mapping):
        yield from _size_faults("constraints", problem.constraints, "constraints")
        for name in (n for n in problem.constraints if isinstance(n, str)):
            yield from text_faults(name, "constraints", name)
    if isinstance(problem.scenarios, Mapping):
        for name, values in problem.scenarios.items():
            yield from _size_faults("scenarios", values, "scenarios", str(name))
    yield from text_faults(problem.title, "title")


def _size_faults(table: str, values: Any, *key: str) -> Iterator[Fault]:
    if isinstance(values, Sequence | Mapping) and not isinstance(values, str) and len(values) > _MAX_ENTRIES[table]:
        yield Fault(f"found {len(values)}; accepted: up to {_MAX_ENTRIES[table]}", key)


def find_faults(problem: StatedProblem, parameter_set: ParameterSet) -> Iterator[Fault]:
    """Every fault of a problem in the parameters of a set; the arguments must have the right types."""
    checks = (_name_faults, _value_faults, _need_faults, _extra_table_faults, _objective_faults, _expression_faults)
    return chain.from_iterable(check(problem, parameter_set) for check in checks)


def _name_faults(problem: StatedProblem, parameter_set: ParameterSet) -> Iterator[Fault]:
    other_sets = {n: s.name for s in problem.model.sets if s is not parameter_set for n in s.names}
    advice = limit_advice(suggest_name)
    tables = {"parameters": {**problem.fixed, **problem.free}} | {
        t: getattr(problem, t) for t in EXTRA_PARAMETER_TABLES
    }
    for table, name in ((t, n) for t, names in tables.items() for n in names if n not in parameter_set.names):
        message = f"unknown parameter {short(name)}; "
        if name in other_sets:
            message = (
                f"{other_sets[name]} parameter '{name}' among {parameter_set.name} ones; do not mix the two sets: "
                f"write all parameters in one ({' '.join(parameter_set.names)})"
            )
        else:
            message += advice(name, problem.model, parameter_set, parameter_set.names)
        yield Fault(message, (table, name))
    for name in problem.fixed:
        if name in problem.free:
            yield Fault(f"'{name}' is both fixed and free; keep one", ("parameters", name))
    given_names = tables["parameters"].keys() | problem.scenarios
    if missing_names := [p.name for p in parameter_set.parameters if p.name not in given_names and p.default is None]:
        example = " or ".join(example_of(parameter_set[missing_names[0]]))
        explanations = "".join(f"; {AMBIGUOUS_NAMES[name]}" for name in missing_names if name in AMBIGUOUS_NAMES)
        yield Fault(
            f"missing parameter {', '.join(missing_names)}; write e.g. {example}{explanations}", ("parameters",)
        )
    for name in problem.start:
        if name not in problem.free:
            yield Fault(f"found a start for '{name}'; accepted: free parameters", ("parameters", name, "start"))


def _value_faults(problem: StatedProblem, parameter_set: ParameterSet) -> Iterator[Fault]:
    for name in parameter_set.names:
        key = ("parameters", name)
        if name in problem.fixed:
            yield from _number_faults(parameter_set, name, problem.fixed[name], *key)
        if name in problem.free:
            try:
                lower, upper = problem.free[name]
            except (TypeError, ValueError):
                yield Fault(f"found {short(problem.free[name])}; accepted: a pair (least, greatest)", key)
                continue
            start = {"start": problem.start[name]} if name in problem.start else {}
            faults = _ends_faults(parameter_set, name, {"min": lower, "max": upper, **start}, *key)
            yield from faults
            if start and not faults and not lower <= start["start"] <= upper:
                message = f"start = {start['start']:.6g} lies outside the bounds {lower:.6g} … {upper:.6g}"
                yield Fault(message, (*key, "start"))


def _ends_faults(parameter_set: ParameterSet, name: str, ends: AnyNumbers, *key: str) -> list[Fault]:
    """Faults of the ends of a range and of its start value; the ends of a band must differ."""
    faults = [f for end, value in ends.items() for f in _number_faults(parameter_set, name, value, *key, end)]
    lower, upper = ends["min"], ends["max"]
    if not faults and (lower > upper or (lower == upper and key[0] == "scenarios")):
        problem = "is greater than max" if lower > upper else "is equal to max"
        advice = "swap them" if lower > upper else "give two different ends, or fix the parameter"
        faults = [Fault(f"min = {lower:.6g} {problem} = {upper:.6g}; {advice}", key)]
    return faults


def _need_faults(problem: StatedProblem, parameter_set: ParameterSet) -> Iterator[Fault]:
    """Faults of parameters that may differ from 0 although another parameter, which they need, may be 0."""
    for name, (needed_name, reason) in parameter_set.needs.items():
        least_needed = min(_possible_values(problem, parameter_set, needed_name), default=1.0)
        if least_needed <= 0 and any(_possible_values(problem, parameter_set, name)):
            message = (
                f"{needed_name} may be 0 while {name} is not: {reason}; keep {needed_name} above 0, or leave {name} out"
            )
            yield Fault(message, ("parameters", needed_name))


def _possible_values(problem: StatedProblem, parameter_set: ParameterSet, name: str) -> list[float]:
    """Extreme values of a parameter: ends of its range, scenario points, or its fixed value; empty if not numeric."""
    try:
        values = problem.free.get(name) or points_of(problem.scenarios.get(name, ()))
        return [float(x) for x in values or (problem.fixed.get(name, parameter_set[name].default),)]
    except (TypeError, ValueError, OverflowError):
        return []


def _extra_table_faults(problem: StatedProblem, parameter_set: ParameterSet) -> Iterator[Fault]:
    """Faults of scenarios, tolerances and weights."""
    for name, scenario in problem.scenarios.items():
        if name in parameter_set.names:
            yield from _scenario_faults(problem, parameter_set, name, scenario)
    for table, accepted in (("tolerances", "greater than 0"), ("weights", "0 or greater")):
        for name, value in getattr(problem, table).items():
            if name not in parameter_set.names:
                continue
            size = _as_float(value)
            if not _has_usable_size(size) or size < 0 or (size == 0 and table == "tolerances"):
                sizes = f"a number {accepted}, of a size from {MIN_SIZE:g} to {1 / MIN_SIZE:g}"
                yield Fault(f"found {short(value)}; accepted: {sizes}", (table, name))
            elif table == "tolerances":
                yield from _tolerance_faults(problem, parameter_set, name, size)
    if (count := len(problem.tolerances)) > _MAX_TOLERANCES:
        message = f"found {count} tolerances; accepted: up to {_MAX_TOLERANCES}; keep those that matter most"
        yield Fault(message, ("tolerances",))


def _scenario_faults(problem: StatedProblem, parameter_set: ParameterSet, name: str, scenario: Any) -> Iterator[Fault]:
    key = ("scenarios", name)
    if name in problem.free:
        yield Fault(f"'{name}' is both free and in scenarios; keep one", key)
    if isinstance(scenario, Band):
        yield from _ends_faults(parameter_set, name, {"min": scenario.min, "max": scenario.max}, *key)
        if isinstance(scenario.points, bool) or not isinstance(scenario.points, int) or not 2 <= scenario.points <= 99:
            yield Fault(f"points = {short(scenario.points)}; accepted: a whole number from 2 to 99", (*key, "points"))
    elif not isinstance(scenario, Sequence) or isinstance(scenario, str) or not scenario:
        yield Fault(f"found {short(scenario)}; accepted: {{ min = …, max = …, points = … }}, or a list of values", key)
    else:
        for value in scenario:
            yield from _number_faults(parameter_set, name, value, *key)


def _tolerance_faults(
    problem: StatedProblem, parameter_set: ParameterSet, name: str, tolerance: float
) -> Iterator[Fault]:
    """Faults of a tolerance that exceeds the physical range of its parameter."""
    parameter, ends = parameter_set[name], _possible_values(problem, parameter_set, name)
    for value in (min(ends) - tolerance, max(ends) + tolerance) if ends else ():
        if value not in parameter.range:
            message = (
                f"with the tolerance {tolerance:.6g}, {name} reaches {value:.6g}, which is not physical: "
                f"{parameter.meaning} is {parameter.range}; keep {name} away from the end of its range by the tolerance"
            )
            yield Fault(message, ("tolerances", name))


def _as_float(value: Any) -> float:
    """A value as a float; nan if it is not a number."""
    try:
        return math.nan if isinstance(value, bool | str) else float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def _has_usable_size(number: float) -> bool:
    """Whether a number is 0, or of a size at which products of a few numbers do not overflow or underflow."""
    return number == 0 or MIN_SIZE <= abs(number) <= 1 / MIN_SIZE


def _number_faults(parameter_set: ParameterSet, name: str, value: Any, *key: str) -> Iterator[Fault]:
    parameter, number = parameter_set[name], _as_float(value)
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    if not math.isfinite(number):
        yield Fault(f"found {short(value)}; accepted: a finite number{unit and ' in' + unit}", key)
    elif not _has_usable_size(number):
        yield Fault(
            f"found {number:g}; accepted: 0, or a size from {MIN_SIZE:g} to {1 / MIN_SIZE:g}{unit}",
            key,
        )
    elif number not in parameter.range:
        hint = f'; write "{number:.6g} deg" for degrees' if parameter.unit == "rad" and abs(number) < 90 else ""
        if -number in parameter.range and parameter.meaning.endswith("downward"):
            hint = f"; z points down: write {-number:.6g}{unit} for a point above the ground"
        message = f"{name} = {number:.6g}{unit} is not physical; {parameter.meaning} is {parameter.range}{unit}{hint}"
        yield Fault(message, key)


def _objective_faults(problem: StatedProblem, parameter_set: ParameterSet) -> Iterator[Fault]:
    key = ("objective",)
    senses = [sense for sense in ("minimize", "maximize") if getattr(problem, sense) is not None]
    if len(senses) > 1:
        yield Fault("found both minimize and maximize; keep one of them", key)
    if problem.pareto and senses:
        yield Fault(f"found both pareto and {senses[0]}; keep one of them", key)
    texts = _list_pareto(problem)
    if texts is None or len(texts) not in (0, 2, 3) or len({str(t).strip() for t in texts}) < len(texts):
        accepted = "two or three different expressions to minimise, such as ['abscissa', 'Fr', '-lambda_s']"
        message = f"found {short(problem.pareto)}; accepted: {accepted}, where a minus sign maximises"
        yield Fault(message, ("objective", "pareto"))
    if problem.locate is not None:
        yield from _pattern_faults(problem.locate, problem.model, (*key, "locate"))


def _list_pareto(problem: StatedProblem) -> Sequence[Any] | None:
    """The expressions of a front; None if they are no list."""
    texts = problem.pareto
    return texts if isinstance(texts, Sequence) and not isinstance(texts, str) else None


def _pattern_faults(name: Any, model: Model, key: tuple[str, ...]) -> Iterator[Fault]:
    try:
        if not isinstance(name, str) or len(name) > _MAX_PATTERN_LENGTH:
            raise ValueError(f"{short(name)} is no pattern")
        data_name = dict(zip(model.words, ("weave", "capsize"), strict=True)).get(name, name)
        if data_name != name and data_name in patterns_of(model):
            yield Fault(f"unknown pattern: '{name}' is called {data_name} in problem files; write {data_name}", key)
        else:
            pattern_of(model, name)
    except ValueError as error:
        hint = ", or several, joined by +" if model.degree > 4 else ""
        yield Fault(f"unknown pattern: {error}; {suggest(str(name), patterns_of(model))}{hint}", key)


def _expression_faults(problem: StatedProblem, parameter_set: ParameterSet) -> Iterator[Fault]:
    accepted = (*parameter_set.names, *problem.model.quantity_names(parameter_set), *root_names(problem.model))
    advice = limit_advice(suggest_name)

    def parse_faults(parse: Any, text: Any, *key: str) -> Iterator[Fault]:
        try:
            parse(text, accepted)
            parse(expand_names(text, parameter_set), accepted)  # may be too long even if the text is not
        except UnknownName as error:
            yield Fault(f"{error.found}; {advice(error.name, problem.model, parameter_set)}", key)
        except ExpressionError as error:
            yield Fault(str(error), key)

    texts = {"minimize": [problem.minimize], "maximize": [problem.maximize], "pareto": _list_pareto(problem) or ()}
    for sense, sense_texts in texts.items():
        for text in sense_texts:
            if text is not None or sense == "pareto":
                yield from parse_faults(parse_value, text, "objective", sense)
    for name, text in problem.constraints.items():
        yield from parse_faults(parse_comparison, text, "constraints", name)
