"""What would free a problem without an answer: limits moved as a file would write them, and the speed that it takes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from tmsopt.models.expression import written_sides
from tmsopt.problem.limit import split_limit
from tmsopt.problem.problem import Posed
from tmsopt.problem.unit_system import unit_of
from tmsopt.records import Table, plain

DIGITS = 5
"""Significant digits of a limit that is to be written."""

_LEFT = 1e-11  # of a limit: what rounding, also that of amounts upwards, leaves of it


@dataclass(frozen=True)
class Relaxation:
    """The smallest move of limits that leaves a feasible design.

    Attributes:
        parameters: a design that is feasible once the limits are moved.
        amounts: limit → how far it is moved, in its own units; signed for an equality, else towards what it forbids.
        conflict: limits that no design was found to meet together in the box, and ends beyond which the others are met.
        alone: limit → how far it must be moved if it is the only one, where the problem with it was solved again.
        irreducible: whether designs were found that meet the others without any one of the conflict, and a whole search
            found none for it; never where limits about the roots leave a0 free to vanish, for needles hide there.
        remedies: limits as a file would write them, each set enough: the problem was solved again with it, and where
            stability is wanted the answer is stable. The smallest change comes first; none where none was found.
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
    """What a parameter that is fixed, or held below or above it, would have to be for a design that meets all else.

    Attributes:
        parameter: such as the speed; everything else may move as the problem says.
        value: the nearest at which such a design was found; nan where none was.
        most: whether it is a greatest value, and not a least one.
        looked: from where to where it was looked for.
        design: every parameter of that design; empty where none was found.
        shown: the value rounded to where designs are, at which the problem was solved again.
    """

    parameter: str
    value: float
    most: bool
    looked: tuple[float, float]
    design: Table[float] = Table()
    shown: float = math.nan

    @property
    def found(self) -> bool:
        """Whether there is such a value."""
        return math.isfinite(self.value)

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; a value that was not found is None."""
        return plain(self, "parameter value shown most looked design")


def round_outwards(x: float, up: bool, digits: int = DIGITS) -> float:
    """A number rounded up, or down, to significant digits; 0 for what is no number."""
    if not x or not math.isfinite(x):
        return 0.0
    step = 10.0 ** (math.floor(math.log10(abs(x))) - digits + 1)
    return (math.ceil if up else math.floor)(round(x / step, 6)) * step


def move_limits(problem: Posed, amounts: Mapping[str, float], digits: int = DIGITS) -> dict[str, str]:
    """Limits moved by amounts, as a file would write them, rounded so that they suffice.

    Of an end of a range, such as ``v.max``, the number with its unit; of a constraint its whole text, in which numbers
    have no units.
    """
    return {name: _move_limit(problem, name, amount, digits) for name, amount in amounts.items()}


def replace_limits(problem: Posed, written: Mapping[str, str]) -> Posed:
    """The problem with limits as they are written.

    Raises:
        InputError: for an end that its parameter cannot have.
    """
    ends: dict[str, Any] = dict(problem.free)
    for name, text in written.items():
        parameter, _, end = name.rpartition(".")
        if name not in problem.constraints:
            (low, high), new = ends[parameter], text if unit_of(problem, name).text else float(text)
            ends[parameter] = (low, new) if end == "max" else (new, high)
    kept = {name: written.get(name, text) for name, text in problem.constraints.items()}
    return replace(problem.problem, constraints=kept, free=ends, start={}).posed


def _move_limit(problem: Posed, name: str, amount: float, digits: int) -> str:
    if name not in problem.constraints:
        parameter, _, end = name.rpartition(".")
        up, unit = end == "max", unit_of(problem, name)
        new = round_outwards((problem.free[parameter][up] + (amount if up else -amount)) / unit.one, up, digits)
        return f"{new:.{DIGITS}g} {unit.text}".rstrip()
    text = problem.constraints[name]
    left, sign, right = written_sides(text)
    limit = split_limit(text)
    if limit is None:
        more = round_outwards(abs(amount), True, digits)
        return f"{left} {sign} {right} {'-' if sign == '>=' or amount < 0 else '+'} {more:.{DIGITS}g}"
    change = -amount if (sign == ">=") == bool(limit.before) else amount
    new, left_of_it = limit.value + change, _LEFT * abs(limit.value)
    return limit.replace_number(
        f"{round_outwards(new, change > 0, digits) if abs(new) > left_of_it else 0.0:.{DIGITS}g}"
    )
