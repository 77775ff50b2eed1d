"""Turns a problem as stated into one that can be solved: numbers in rad and SI, complete tables, all faults at once."""

from types import SimpleNamespace
from typing import Any

from tmsopt.errors import InputError
from tmsopt.models import controlled
from tmsopt.problem.cases import middle_of, parse_scenario, points_of
from tmsopt.problem.units import TABLES, read_numbers
from tmsopt.problem.validate import find_faults, shape_faults

_POINT = 1e-12
"""A range narrower than this, relative to its ends, is a single value."""


def normalise(**stated: Any) -> dict[str, Any]:
    """The fields of a problem from stated values of any type.

    Raises:
        InputError: listing every fault.
    """
    problem = SimpleNamespace(**stated)
    if found := list(shape_faults(problem)):
        raise InputError(found)
    problem.scenarios = {n: parse_scenario(s) for n, s in problem.scenarios.items()}
    names = {**problem.fixed, **problem.free, **problem.scenarios}
    problem.model = controlled(problem.model, names)
    # The parameter set with most of the names; the native one in case of a tie.
    of = max(problem.model.sets, key=lambda s: len(names.keys() & set(s.names)))
    read, units, typed, unreadable = read_numbers({table: getattr(problem, table) for table in TABLES}, of)
    vars(problem).update(read)
    places = {f.key[:2] for f in unreadable}
    if found := [*unreadable, *(f for f in find_faults(problem, of) if f.key[:2] not in places)]:
        raise InputError(found)
    problem.units = {**units, **problem.units}
    problem.written = {n: {**typed.get(n, {}), **problem.written.get(n, {})} for n in (*problem.written, *typed)}
    defaults = {p.name: p.default for p in of.parameters if p.default is not None}
    nominal = {n: middle_of(s) for n, s in problem.scenarios.items()}
    problem.fixed = {n: v for n, v in {**defaults, **nominal, **problem.fixed}.items() if n not in problem.free}
    for table in ("tolerances", "weights"):
        setattr(problem, table, {n: float(v) for n, v in getattr(problem, table).items()})
    problem.minimize, problem.maximize = (text and text.strip() for text in (problem.minimize, problem.maximize))
    problem.constraints = {n: text.strip() for n, text in problem.constraints.items()}
    problem.pareto = tuple(text.strip() for text in problem.pareto)  # reports show it on one line
    return complete_fields(**vars(problem))


def complete_fields(**given: Any) -> dict[str, Any]:
    """The fields of a problem from valid numbers and texts.

    A range of one value becomes a fixed parameter, starts are kept for free parameters only, and a complex H gets a
    carrier for the ranges.
    """
    free = given["free"]
    pinned = {n: lo for n, (lo, hi) in free.items() if hi - lo <= _POINT * max(abs(lo), abs(hi))}
    fixed = {n: float(v) for n, v in {**given["fixed"], **pinned}.items()}
    free = {n: (float(lo), float(hi)) for n, (lo, hi) in free.items() if n not in pinned}
    start = {n: float(v) for n, v in given["start"].items() if n in free}
    reach = {n: (x, x) for n, x in fixed.items()} | free  # least and greatest value over all cases
    for name, scenario in given["scenarios"].items():
        points = [*points_of(scenario), fixed[name]]
        reach[name] = min(points), max(points)
    rooms = {n: given["tolerances"].get(n, 0.0) for n in reach}
    within = given["model"].within({n: (lo - rooms[n], hi + rooms[n]) for n, (lo, hi) in reach.items()})
    return given | {"model": within, "fixed": fixed, "free": free, "start": start}
