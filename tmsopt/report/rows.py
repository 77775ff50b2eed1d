"""The rows of a report for any model: parameters, times, frequencies and quantities, in the units a builder reads."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tmsopt.checks.recheck import FEASIBLE
from tmsopt.design.solution import Solution
from tmsopt.design.units import decay_time, frequencies, growth_time, reading
from tmsopt.models import Parameter, Quantity, Values
from tmsopt.models.tms import tms
from tmsopt.report.text import number

_SI = tms.parameter_set("SI")


Row = Sequence[str]

_SHARES = ("load_front", "load_rear")


def parameter_rows(solution: Solution) -> list[Row]:
    """Rows of four cells: name, number, unit, and whether it is free; those that are 0 as by default are left out."""
    problem = solution.problem
    rows: list[Row] = []
    for parameter in problem.parameter_set.parameters:
        value = solution.parameters[parameter.name]
        if parameter.name in problem.free:
            how = "free"
        elif parameter.name in problem.scenarios:
            how = "scenario"
        elif value == 0 == parameter.default:
            continue
        else:
            how = "fixed"
        rows.append((parameter.name, *_read(value, parameter), how))
    return rows


def quantity_rows(solution: Solution) -> list[Row]:
    """Rows of three cells: what, number, unit. Quantities that do not exist are left out."""
    of, model = solution.problem.parameter_set, solution.problem.model
    rows: list[Row] = [*_motion(solution)]
    for quantity in (*model.quantities, *of.quantities):
        value = float(solution.quantities.get(quantity.name, math.nan))
        if quantity.name in _SHARES:
            rows.append((quantity.name, f"{100 * (value if abs(value) > FEASIBLE else 0.0):.6g}", "%"))
        elif math.isfinite(value):
            rows.append((quantity.name, *_read(value, quantity)))
    return rows


def _motion(solution: Solution) -> Iterator[Row]:
    of = solution.problem.parameter_set
    rate = None if of.rate is None else float(of.rate(solution.parameters))
    timed = "1/s" if rate == 1 else ""
    yield "abscissa", number(solution.abscissa), timed
    yield "  as stored", number(solution.abscissa_realised), timed
    if rate is not None:
        for name, time in (
            ("decay time", decay_time(solution.abscissa, rate)),
            ("growth time", growth_time(solution.abscissa, rate)),
        ):
            if math.isfinite(time):
                yield name, f"{time:.4g}", "s"
    yield "damping_ratio", number(solution.quantities["damping_ratio"]), ""
    if rate is not None:
        for hertz in frequencies(solution.roots, rate):
            yield "frequency", f"{hertz:.6g}", "Hz"


def _read(value: float, of: Parameter | Quantity) -> tuple[str, str]:
    value, unit = reading(value, of.unit)
    return number(value), "" if unit == "1" else unit


def skate_rows(solution: Solution, si: Mapping[str, float]) -> list[Row]:
    """Rows of five cells: a dimensionless quantity with its number, and its counterpart in SI with number and unit.

    Args:
        si: the SI parameters of the design.
    """
    assert _SI.rate is not None
    rate = float(_SI.rate(si))
    q, values = solution.quantities, Values(tms, _SI, si)
    return [
        ("abscissa", number(solution.abscissa), *_time(solution.abscissa, rate)),
        ("  as stored", number(solution.abscissa_realised), *_time(solution.abscissa_realised, rate)),
        *_oscillation(q["damping_ratio"], frequencies(solution.roots, rate)),
        *_critical_speed(q["Fr_c"], float(values["v_c"])),
        ("nu_H", number(q["nu_H"]), "u_H", *_in_units(float(values["u_H"]), "m")),
        ("mass_margin", number(q["mass_margin"]), "", "", ""),
        ("chi_T", number(q["chi_T"]), "x_T", *_in_units(q["chi_T"] * si["w"], "m")),
        _load("load_front", q["load_front"], "N_F", float(values["N_F"])),
        _load("load_rear", q["load_rear"], "N_R", float(values["N_R"])),
    ]


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


def _in_units(value: float, unit: str) -> tuple[str, str]:
    value, unit = reading(value, unit)
    return number(value), unit


def _time(abscissa: float, rate: float) -> tuple[str, str, str]:
    for name, time in (("decay time", decay_time(abscissa, rate)), ("growth time", growth_time(abscissa, rate))):
        if math.isfinite(time):
            return name, f"{time:.4g}", "s"
    return "", "", ""


def _oscillation(damping_ratio: float, hertz: Sequence[float]) -> list[Row]:
    cells = [("frequency", f"{f:.6g}", "Hz") for f in hertz] or [("frequency", "none", "")]
    return [("damping_ratio", number(damping_ratio), *cells[0]), *(("", "", *cell) for cell in cells[1:])]


def _critical_speed(Fr_c: float, v_c: float) -> list[Row]:
    if not math.isfinite(Fr_c):
        return [("Fr_c", number(Fr_c), "", "", "")]
    kmh, unit = reading(v_c, "m/s")
    return [("Fr_c", number(Fr_c), "v_c", f"{v_c:.8g}", "m/s"), ("", "", "", f"{kmh:.8g}", unit)]


def _load(name: str, share: float, symbol: str, newtons: float) -> Row:
    """One wheel; what is only rounding reads as 0."""
    if abs(share) <= FEASIBLE:
        share = newtons = 0.0
    return name, f"{100 * share:.6g} %", symbol, f"{newtons:.6g}", "N"
