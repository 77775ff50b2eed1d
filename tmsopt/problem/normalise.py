"""Turns the arguments of a problem into fields that can be solved: numbers in rad and SI, complete tables.

Lists all faults at once.
"""

from types import SimpleNamespace
from typing import Any

from tmsopt.errors import InputError
from tmsopt.models import controlled
from tmsopt.problem.cases import middle_of, parse_scenario
from tmsopt.problem.units import TABLES, read_numbers
from tmsopt.problem.validate import find_faults, shape_faults

_MIN_WIDTH = 1e-12
"""Least width of a range relative to its ends; a narrower range counts as one value."""


def normalise(**arguments: Any) -> dict[str, Any]:
    """The fields of a problem, from arguments of any type.

    Raises:
        InputError: listing every fault.
    """
    problem = SimpleNamespace(**arguments)
    if faults := list(shape_faults(problem)):
        raise InputError(faults)
    problem.scenarios = {n: parse_scenario(s) for n, s in problem.scenarios.items()}
    names = {**problem.fixed, **problem.free, **problem.scenarios}
    problem.model = controlled(problem.model, names)
    # The parameter set that has most of the names; in case of a tie, the native one.
    parameter_set = max(problem.model.sets, key=lambda s: len(names.keys() & set(s.names)))
    tables = {table: getattr(problem, table) for table in TABLES}
    tables, units, typed, reading_faults = read_numbers(tables, parameter_set)
    vars(problem).update(tables)
    unreadable_keys = {f.key[:2] for f in reading_faults}
    faults = reading_faults + [f for f in find_faults(problem, parameter_set) if f.key[:2] not in unreadable_keys]
    if faults:
        raise InputError(faults)
    problem.units = {**units, **problem.units}
    problem.written = {n: {**typed.get(n, {}), **problem.written.get(n, {})} for n in (*problem.written, *typed)}
    defaults = {p.name: p.default for p in parameter_set.parameters if p.default is not None}
    nominal = {n: middle_of(s) for n, s in problem.scenarios.items()}
    problem.fixed = {n: v for n, v in {**defaults, **nominal, **problem.fixed}.items() if n not in problem.free}
    for table in ("tolerances", "weights"):
        setattr(problem, table, {n: float(v) for n, v in getattr(problem, table).items()})
    problem.minimize, problem.maximize = (text and text.strip() for text in (problem.minimize, problem.maximize))
    problem.constraints = {n: text.strip() for n, text in problem.constraints.items()}
    problem.pareto = tuple(text.strip() for text in problem.pareto)  # reports show each text on one line
    return complete_fields(**vars(problem))


def complete_fields(**fields: Any) -> dict[str, Any]:
    """The complete fields of a problem, from fields with valid numbers and texts.

    A range of one value becomes a fixed parameter. Start values of parameters that are not free are dropped.
    """
    free = fields["free"]
    single_values = {n: lo for n, (lo, hi) in free.items() if hi - lo <= _MIN_WIDTH * max(abs(lo), abs(hi))}
    fixed = {n: float(v) for n, v in {**fields["fixed"], **single_values}.items()}
    free = {n: (float(lo), float(hi)) for n, (lo, hi) in free.items() if n not in single_values}
    start = {n: float(v) for n, v in fields["start"].items() if n in free}
    return fields | {"fixed": fixed, "free": free, "start": start}
