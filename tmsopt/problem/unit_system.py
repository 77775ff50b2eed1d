"""Finds the units of the parameters, quantities and expressions of a problem, as its author typed them."""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Any

from tmsopt.models import Parameter, Quantity
from tmsopt.models.expression import SIGN, Expression, parse_comparison, parse_value
from tmsopt.problem.limit import split_limit
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY
from tmsopt.problem.units import Dimension, dimension, unit_factor
from tmsopt.problem.validate import MIN_SIZE
from tmsopt.records import AnyNumbers, Numbers

_PER_SECOND = "1/s"
_FREQUENCY, _HERTZ = "frequency", "Hz"  # shown in Hz, not in 1/s


@dataclass(frozen=True)
class Unit:
    """A unit for display.

    Attributes:
        text: its name, such as ``km/h``; empty without one.
        factor: a number in this unit, times this factor, is the stored number (SI, rad): 0.01 for cm.
    """

    text: str = ""
    factor: float = 1.0

    def number(self, value: float, digits: int = 5, error: float = 0.0) -> str:
        """A number in this unit as text, without the unit; ``none`` if it is not finite.

        Args:
            digits: greatest number of digits.
            error: error of the value. Uncertain digits are left out, and a value smaller than its error becomes 0.
        """
        if not math.isfinite(value):
            return "none"
        if abs(value) <= max(error, MIN_SIZE):
            return "0"
        if error > 0:
            digits = min(digits, max(math.floor(math.log10(abs(value))) - math.floor(math.log10(error)), 1))
        return f"{value / self.factor + 0.0:.{digits}g}"

    def show(self, value: float, digits: int = 5) -> str:
        """A number with this unit as text."""
        return f"{self.number(value, digits)}{f' {self.text}' if self.text and math.isfinite(value) else ''}"


def round_one_way(x: float, is_upward: bool, digits: int) -> float:
    """Round up, or down, to significant digits: a bound that is proved must be true as it is printed."""
    return float(Context(digits, ROUND_CEILING if is_upward else ROUND_FLOOR).create_decimal_from_float(x))


def unit_of(problem: Posed, text: str) -> Unit:
    """The unit of a parameter, a bound such as ``v.max``, a constraint or any expression of a problem.

    A parameter has the unit that was typed for it, else the model's. Another expression has the unit that most
    parameters of its dimension were typed in, else the model's.
    """
    units = si_units(problem)
    name = text.strip().removesuffix(".min").removesuffix(".max").removesuffix(".limit")
    if name in problem.parameter_set.names:
        return _make_unit(problem.units.get(name, ""), units[name])
    names = set(re.findall(r"[A-Za-z_]\w*", problem.constraints.get(name, name)))
    if units.get(_FREQUENCY) == _HERTZ and names == {_FREQUENCY}:
        return Unit(_HERTZ)
    return _usual_unit(
        problem, Dimension.from_unit(units[name]) if name in units else dimension_of(problem, text, units)
    )


def rate_of(problem: Posed, text: str, parameters: AnyNumbers) -> Any:
    """The factor from √(g/w) to 1/s for an expression in √(g/w); None for other units and for sets without seconds.

    Args:
        parameters: a design, or arrays of designs.
    """
    parameter_set = problem.parameter_set
    rate, root_unit = parameter_set.rate, parameter_set.root_unit
    if rate is None or root_unit == _PER_SECOND or unit_of(problem, text).text != root_unit:
        return None
    return rate(parameters)


def unit_at(problem: Posed, text: str, parameters: Numbers) -> Unit:
    """The unit in which reports show an expression at a design: 1/s for rates, if the parameters define seconds."""
    rate = rate_of(problem, text, parameters)
    return unit_of(problem, text) if rate is None else Unit(_PER_SECOND, 1 / float(rate))


def common_unit(problem: Posed, text: str, shared_parameters: Numbers | None = None) -> Unit:
    """The unit for bounds and differences of designs: by `unit_at` if it is the same for all, else by `unit_of`.

    Args:
        shared_parameters: parameters that the designs share; by default all fixed ones without scenario or tolerance.
    """
    if shared_parameters is None:
        varied_names = {*problem.scenarios, *problem.tolerances}
        shared_parameters = {n: x for n, x in problem.fixed.items() if n not in varied_names}
    try:
        return unit_at(problem, text, shared_parameters)
    except KeyError:
        return unit_of(problem, text)


def show_at(problem: Posed, text: str, parameters: Numbers, value: float, digits: int = 5) -> str:
    """A number in the unit of `unit_at`, followed by the number in the unit of `unit_of` if that differs."""
    display_unit, stored_unit = unit_at(problem, text, parameters), unit_of(problem, text)
    suffix = f" ({stored_unit.show(value, digits)})" if display_unit != stored_unit and math.isfinite(value) else ""
    return f"{display_unit.show(value, digits)}{suffix}"


def si_units(problem: Posed) -> dict[str, str]:
    """Name → unit in which a parameter, quantity or root quantity is computed; ``1`` without a unit."""
    parameter_set = problem.parameter_set
    quantities = (*problem.model.quantities, *parameter_set.quantities)
    items: tuple[Parameter | Quantity, ...] = (*quantities, *parameter_set.parameters)
    rates = {"abscissa": parameter_set.root_unit, ANGULAR_FREQUENCY: parameter_set.root_unit}
    if parameter_set.rate is not None:  # the parameters define seconds
        rates |= {"decay_rate": _PER_SECOND, "decay_time": "s", _FREQUENCY: _HERTZ}
    return dict.fromkeys(problem.vocabulary, "1") | rates | {q.name: q.unit for q in items}


def amounts_text(problem: Posed, amounts: Numbers) -> str:
    """The violation of each limit, in the units of the problem."""
    return ", ".join(f"{name} by {unit_of(problem, name).show(amount, 3)}" for name, amount in amounts.items())


def limit_text(problem: Posed, name: str) -> str:
    """A limit with its number in the unit of the problem; empty if there is no such limit."""
    unit = unit_of(problem, name)
    text = problem.constraints.get(name)
    if text is not None:
        limit = split_limit(text)
        return limit.replace_number(unit.show(limit.value, 9)) if limit and unit.text else text
    parameter, _, end = name.rpartition(".")
    if parameter not in problem.free or end not in ("min", "max"):
        return ""
    return f"{'>=' if end == 'min' else '<='} {unit.show(problem.free[parameter][end == 'max'], 6)}"


def units_of(problem: Posed, texts: Iterable[str] = ()) -> dict[str, str]:
    """Name → unit in which a number is stored and written as data (rad and SI), if it has one.

    Args:
        texts: further expressions, in addition to parameters, quantities and constraints.
    """
    units = si_units(problem)
    texts = (*problem.constraints, *(t for t in texts if t not in units))
    units |= {text: dimension_of(problem, text, units).unit for text in texts}
    return {name: unit for name, unit in units.items() if unit != "1"}


def dimension_of(problem: Posed, text: str, units: Mapping[str, str] | None = None) -> Dimension:
    """The dimension of an expression, or of a constraint given by name or text."""
    text = problem.constraints.get(text, text)
    parse: Callable[..., Expression] = parse_comparison if SIGN.search(text) else parse_value
    try:
        return dimension(parse(text, problem.vocabulary), si_units(problem) if units is None else units)
    except ValueError:  # a pattern, or anything else without a unit
        return Dimension()


def _usual_unit(problem: Posed, dimension: Dimension) -> Unit:
    """The unit that most parameters of a dimension were typed in."""
    parameter_set, unit = problem.parameter_set, dimension.unit
    parameters = (p for p in parameter_set.parameters if p.name in problem.units)
    typed_units = Counter(problem.units[p.name] for p in parameters if Dimension.from_unit(p.unit) == dimension)
    return _make_unit(typed_units.most_common(1)[0][0] if typed_units else "", unit)


def _make_unit(typed_unit: str, unit: str) -> Unit:
    if unit == "1":
        return Unit()
    return Unit(typed_unit, unit_factor(typed_unit, unit)) if typed_unit else Unit(unit)
