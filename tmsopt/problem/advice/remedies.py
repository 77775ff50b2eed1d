"""Remedies for infeasible problems: relaxed limits as a file would write them, and the required speed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from tmsopt.models.expression import written_sides
from tmsopt.problem.limit import split_limit
from tmsopt.problem.problem import Posed
from tmsopt.problem.unit_system import unit_of
from tmsopt.records import Numbers, Table, plain

DIGITS = 5
"""Significant digits of a suggested limit."""

_NEGLIGIBLE = 1e-11  # a new limit below this share of the old limit counts as 0, because it may come from rounding


@dataclass(frozen=True)
class Relaxation:
    """The smallest relaxation of limits that makes a problem feasible.

    Attributes:
        parameters: a design that is feasible with the relaxed limits.
        amounts: limit → how far it is relaxed, in its own units; the amount has a sign for an equality.
        conflict: limits that no design was found to meet together. An end of a range is one of them if a design beyond
            it meets the other limits.
        alone: limit → how far it must be relaxed if no other limit is relaxed; confirmed by solving again.
        irreducible: whether each limit of the conflict is necessary for it: without this limit a design meets the
            others, and a full search found none that meets all. Always false if limits on the roots allow a0 = 0,
            because a search may miss narrow regions there.
        remedies: sets of limits as a file would write them, the smallest change first. Each set is sufficient: the
            problem was solved again with it, and the answer is stable if stability was sought. Empty if none was found.
    """

    parameters: Table[float] = Table()
    amounts: Table[float] = Table()
    conflict: tuple[str, ...] = ()
    alone: Table[float] = Table()
    irreducible: bool = False
    remedies: tuple[Table[str], ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self, "amounts conflict irreducible alone remedies parameters")


@dataclass(frozen=True)
class RequiredValue:
    """The value of a fixed or bounded parameter that allows a design to meet every other limit.

    Attributes:
        parameter: name of the parameter, such as ``v``; the other parameters vary as the problem says.
        value: the nearest value with such a design; nan if none was found.
        most: whether it is the greatest such value; otherwise it is the least.
        looked: the range that was searched.
        design: every parameter of the design at this value; empty if none was found.
        shown: the value rounded to the feasible side; the problem was solved again there.
    """

    parameter: str
    value: float
    most: bool
    looked: tuple[float, float]
    design: Table[float] = Table()
    shown: float = math.nan

    @property
    def found(self) -> bool:
        """Whether such a value was found."""
        return math.isfinite(self.value)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; a missing value is None."""
        return plain(self, "parameter value shown most looked design")


def round_outwards(x: float, is_upward: bool, digits: int = DIGITS) -> float:
    """Round a number up or down to significant digits; 0 if it is not finite."""
    if not x or not math.isfinite(x):
        return 0.0
    step = 10.0 ** (math.floor(math.log10(abs(x))) - digits + 1)
    return (math.ceil if is_upward else math.floor)(round(x / step, 6)) * step


def move_limits(problem: Posed, amounts: Numbers, digits: int = DIGITS) -> dict[str, str]:
    """Move limits by amounts and write them as a file would, rounded outwards.

    Returns:
        Name → text: a number with its unit for an end of a range, such as ``v.max``; a whole comparison for a
        constraint, in which numbers have no units.
    """
    return {name: _move_limit(problem, name, amount, digits) for name, amount in amounts.items()}


def replace_limits(problem: Posed, limit_texts: Mapping[str, str]) -> Posed:
    """The problem with other limits, written as by `move_limits`.

    Raises:
        InputError: for an end outside the physical range of its parameter.
    """
    ends: dict[str, Any] = dict(problem.free)
    for name, text in limit_texts.items():
        parameter, _, end = name.rpartition(".")
        if name not in problem.constraints:
            (low, high), end_value = ends[parameter], text if unit_of(problem, name).text else float(text)
            ends[parameter] = (low, end_value) if end == "max" else (end_value, high)
    constraints = {name: limit_texts.get(name, text) for name, text in problem.constraints.items()}
    return replace(problem.problem, constraints=constraints, free=ends, start={}).posed


def _move_limit(problem: Posed, name: str, amount: float, digits: int) -> str:
    if name not in problem.constraints:
        parameter, _, end = name.rpartition(".")
        is_upper, unit = end == "max", unit_of(problem, name)
        end_value = problem.free[parameter][is_upper] + (amount if is_upper else -amount)
        new_limit = round_outwards(end_value / unit.factor, is_upper, digits)
        return f"{new_limit:.{DIGITS}g} {unit.text}".rstrip()
    text = problem.constraints[name]
    left, sign, right = written_sides(text)
    limit = split_limit(text)
    if limit is None:
        increase = round_outwards(abs(amount), True, digits)
        return f"{left} {sign} {right} {'-' if sign == '>=' or amount < 0 else '+'} {increase:.{DIGITS}g}"
    change = -amount if (sign == ">=") == bool(limit.text_before) else amount
    new_limit, negligible = limit.value + change, _NEGLIGIBLE * abs(limit.value)
    return limit.replace_number(
        f"{round_outwards(new_limit, change > 0, digits) if abs(new_limit) > negligible else 0.0:.{DIGITS}g}"
    )
