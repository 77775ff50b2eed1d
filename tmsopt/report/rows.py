"""The rows of a report for any model: parameters, times, frequencies and quantities, in the units a builder reads.

Of a model that is dimensionless and in SI, the dimensionless number stands first in each row, and what it is in SI
beside it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tmsopt.checks.recheck import FEASIBLE
from tmsopt.design.solution import Solution
from tmsopt.models import Model, Parameter, Quantity, Values
from tmsopt.report.text import number
from tmsopt.units import decay_time, frequencies, growth_time, reading

TableRow = Sequence[str]
Cells = tuple[str, str, str]
"""Symbol, number and unit."""

_FIRST = ("Fr_c", "nu_H", "mass_margin")
"""Quantities that come before those that follow in the order of the model."""
_SHARES = ("load_front", "load_rear")
_DIGITS = {"m/s": 8, "N": 6}
"""Of a quantity beside a dimensionless one, where these are fewer than all."""


def parameter_rows(solution: Solution, si: Mapping[str, float]) -> list[TableRow]:
    """Names, numbers, units, and which are free; those that are 0 as by default are left out.

    Args:
        si: the parameters in SI; of a model without a dimensionless form those of the solution.
    """
    problem = solution.problem
    of = problem.parameter_set
    if not _paired(problem.model):
        listed = [(p, solution.parameters[p.name], _freedom(solution, p.name)) for p in of.parameters]
        return [(*_read(p, x), how) for p, x, how in listed if how != "fixed" or not x == 0 == p.default]
    native, scaled = problem.model.sets[0], problem.model.parameter_set("SI")
    counterpart = {p.counterpart or p.name: p for p in scaled.parameters}
    own = of is scaled
    scale = "SI" if own else f"SI for w = {si['w']:g} m, m_B = {si['m_B']:g} kg"
    rows: list[TableRow] = [("", "dimensionless", "", scale, "", "")]
    for p in native.parameters:
        other = counterpart[p.name]
        how = _freedom(solution, other.name if own else p.name)
        beside = _beside((p.name, number(solution.dimensionless[p.name])), _readings(other, si[other.name]))
        rows += [(*row, how if k == 0 else "") for k, row in enumerate(beside)]
    rest = [p for name, p in counterpart.items() if own and name not in native.names and p.default is None]
    return rows + [("", "", *_read(p, si[p.name]), _freedom(solution, p.name)) for p in rest]


def quantity_rows(solution: Solution, si: Mapping[str, float]) -> list[TableRow]:
    """What the roots and the quantities of a model are; without a dimensionless form, only those that exist."""
    model, found = solution.problem.model, solution.quantities
    paired = _paired(model)
    of = model.parameter_set("SI") if paired else solution.problem.parameter_set
    rows = list(_motion(solution, None if of.rate is None else float(of.rate(si)), paired))
    if not paired:
        every = (*model.quantities, *of.quantities)
        return rows + [_read(q, x) for q in every if math.isfinite(x := float(found.get(q.name, math.nan)))]
    values = Values(model, of, si)
    for q in sorted(model.quantities, key=lambda q: (*_FIRST, q.name).index(q.name)):
        name, value, unit = _read(q, found[q.name])
        other = q.counterpart if math.isfinite(found[q.name]) else None
        cells = _readings(other, float(other.value(values)) if float(value) else 0.0) if other else []
        rows += [] if q.aside else _beside((name, f"{value} {unit}".rstrip()), cells)
    alone = [q for q in of.quantities if not q.aside and q not in [q.counterpart for q in model.quantities]]
    return rows + [("", "", *_read(q, float(values[q.name]))) for q in alone]


def _paired(model: Model) -> bool:
    """Whether a model is dimensionless and in SI."""
    return any(p.counterpart for of in model.sets for p in of.parameters)


def _freedom(solution: Solution, name: str) -> str:
    problem = solution.problem
    return "free" if name in problem.free else "scenario" if name in problem.scenarios else "fixed"


def _motion(solution: Solution, rate: float | None, paired: bool) -> Iterator[TableRow]:
    """Abscissae with the times that they stand for, damping ratio and frequencies; beside each other if paired."""
    hertz = [] if rate is None else frequencies(solution.roots, rate)
    waves = [("frequency", f"{f:.6g}", "Hz") for f in hertz]
    damping = "damping_ratio", number(solution.quantities["damping_ratio"])
    abscissae = ("abscissa", solution.abscissa), ("  as stored", solution.abscissa_realised)
    if paired:
        for name, abscissa in abscissae:
            yield from _beside((name, number(abscissa)), _times(abscissa, rate))
        yield from _beside(damping, waves or [("frequency", "none", "")])
        return
    for name, abscissa in abscissae:
        yield name, number(abscissa), "1/s" if rate == 1 else ""
    yield from _times(solution.abscissa, rate)
    yield *damping, ""
    yield from waves


def _times(abscissa: float, rate: float | None) -> list[Cells]:
    if rate is None:
        return []
    times = ("decay time", decay_time(abscissa, rate)), ("growth time", growth_time(abscissa, rate))
    return [(name, f"{time:.4g}", "s") for name, time in times if math.isfinite(time)]


def _beside(left: tuple[str, str], cells: Sequence[Cells]) -> list[TableRow]:
    """A dimensionless number, and what is beside it: the first in its row, others below."""
    return [(*(left if k == 0 else ("", "")), *cell) for k, cell in enumerate(cells or [("", "", "")])]


def _read(of: Parameter | Quantity, value: float) -> Cells:
    if of.name in _SHARES:
        return of.name, f"{100 * value if abs(value) > FEASIBLE else 0.0:.6g}", "%"
    value, unit = reading(value, of.unit)
    return of.name, number(value), "" if unit == "1" else unit


def _readings(of: Parameter | Quantity, value: float) -> list[Cells]:
    """A speed in m/s too."""
    digits = _DIGITS.get(of.unit, 12) if isinstance(of, Quantity) else 12
    read, unit = reading(value, of.unit)
    if of.unit != "m/s":
        return [(of.name, f"{read:.{digits}g}", unit)]
    return [(of.name, f"{value:.{digits}g}", of.unit), ("", f"{read:.{digits}g}", unit)]


def pitching(solution: Solution, si: Mapping[str, float]) -> str:
    """One line: whether the bicycle pitches over, in any of its cases, and the ballast that prevents it."""
    problem, parameters = solution.problem, solution.parameters
    listed = [case for case in problem.cases if not case.direction]
    listed += [case for case in (solution.worst, solution.least_damped) if case]
    each: list[Mapping[str, Any]] = [problem.values(case.applied(parameters)) for case in listed]
    each = each or [solution.quantities]
    in_case = " in the worst case" if listed else ""
    for lifted, over in (("rear", "front"), ("front", "rear")):
        load = min(float(values[f"load_{lifted}"]) for values in each)
        if abs(load) <= FEASIBLE:  # a limit chi_T <= 1 that binds is met within this
            return (
                f"balance: on the verge of pitching over the {over} wheel{in_case}; the {lifted} wheel carries no load"
            )
        if load < 0:
            return f"balance: pitches over the {over} wheel{in_case}{_prevented(solution, si, each, lifted)}"
    return "balance: stands on both wheels" + (" in every case listed" if listed else "")


def _prevented(solution: Solution, si: Mapping[str, float], each: Sequence[Mapping[str, Any]], lifted: str) -> str:
    """The ballast at a wheel's contact that has no part in the lateral motion: with trail, at the rear one alone."""
    if f"m_ballast_{lifted}" not in (names := solution.problem.vocabulary) and f"ballast_{lifted}" not in names:
        return ""
    if f"m_ballast_{lifted}" in names:
        masses = [float(values[f"m_ballast_{lifted}"]) for values in each]
    else:
        masses = [si["m_B"] * float(values[f"ballast_{lifted}"]) for values in each]
    mass = f"{max(masses):.4g} kg ({max(masses) / si['m_B']:.4g} m_B)"
    return (
        f"; more than {mass} of ballast at the {lifted} contact prevents it, without any effect on the lateral motion"
    )
