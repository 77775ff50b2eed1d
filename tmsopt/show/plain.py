"""The rows of a report for any model: parameters, times, frequencies and quantities, in the units a builder reads."""

import math
from collections.abc import Iterator, Sequence

from tmsopt.checks.recheck import FEASIBLE
from tmsopt.design.solution import Solution
from tmsopt.design.units import decay_time, frequencies, growth_time, reading
from tmsopt.models import Parameter, Quantity
from tmsopt.show.text import number

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
