"""Dimensions of numbers, so that the unit of an expression follows from the units of what it names."""

import operator
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from tmsopt.algebra.formula import Kind
from tmsopt.algebra.kinds import as_double
from tmsopt.models.expression import Expression

_DERIVED = {"N": "kg m/s^2", "Hz": "1/s", "1": "", "√(g/w)": "√g/√w"}
_NAMED = {"kg m/s^2": "N", "kg m^2/s^2": "N m", "√g/√w": "√(g/w)"}
_POWERS = re.compile(r"(?P<name>[^\s/^*]+)(\^(?P<power>-?\d+))?")


@dataclass(frozen=True)
class Dimension:
    """Base units with their powers, in the order of the alphabet; arithmetic as of the numbers that have them.

    In sums, what has no unit takes that of the rest. Two different units in a sum leave none, whatever is added.
    """

    powers: tuple[tuple[str, Fraction], ...] = ()
    mixed: bool = False

    @classmethod
    def of(cls, unit: str) -> "Dimension":
        """That of a unit, such as ``kg m^2`` or ``1/s``."""
        found: dict[str, Fraction] = {}
        for sign, part in zip((1, -1), (_DERIVED.get(unit, unit) + "/").split("/"), strict=False):
            for one in _POWERS.finditer(part):
                if one["name"] != "1":
                    found[one["name"]] = found.get(one["name"], Fraction(0)) + sign * int(one["power"] or 1)
        return cls(tuple(sorted((n, p) for n, p in found.items() if p)))

    @property
    def unit(self) -> str:
        """As text; ``1`` for none."""
        above = " ".join(_power(n, p) for n, p in self.powers if p > 0)
        below = " ".join(_power(n, -p) for n, p in self.powers if p < 0)
        text = f"{above or '1'}/{below}" if below else above or "1"
        return _NAMED.get(text, text)

    def __mul__(self, other: Any) -> "Dimension":
        return self._joined(other, 1)

    def __truediv__(self, other: Any) -> "Dimension":
        return self._joined(other, -1)

    def __rtruediv__(self, other: Any) -> "Dimension":
        return Dimension(tuple((n, -p) for n, p in self.powers), self.mixed)

    def __add__(self, other: Any) -> "Dimension":
        if not isinstance(other, Dimension):
            return self
        own, others = self.powers, other.powers
        mixed = self.mixed or other.mixed or bool(own and others and own != others)
        return Dimension(() if mixed else own or others, mixed)

    def __neg__(self) -> "Dimension":
        return self

    __rmul__, __radd__, __sub__, __rsub__ = __mul__, __add__, __add__, __add__

    def _joined(self, other: Any, sign: int) -> "Dimension":
        if not isinstance(other, Dimension):
            return self
        if self.mixed or other.mixed:
            return Dimension(mixed=True)
        found = dict(self.powers)
        for name, p in other.powers:
            found[name] = found.get(name, Fraction(0)) + sign * p
        return Dimension(tuple(sorted((n, p) for n, p in found.items() if p)))


def power(base: Any, exponent: Any) -> Any:
    """A power; by an exponent that is no number, none."""
    if not isinstance(base, Dimension):
        return base**exponent if isinstance(exponent, float) and base > 0 else Dimension()
    if isinstance(exponent, Dimension) or not abs(exponent) < float("inf"):
        return Dimension()
    share = Fraction(exponent).limit_denominator(12)
    return Dimension(tuple((n, p * share) for n, p in base.powers if share), base.mixed)


def _same(*values: Any) -> Any:
    return sum(values[1:], Dimension()) + values[0]


def _angle(_: Any) -> Dimension:
    return Dimension.of("rad")


def _none(_: Any) -> Dimension:
    return Dimension()


UNITS = Kind(
    {
        **{name: getattr(operator, name) for name in ("add", "sub", "mul", "neg")},
        "div": operator.truediv,
        "square": lambda x: x * x,
        "pow": power,
        "sqrt": lambda x: power(x, 0.5),
        **dict.fromkeys(("sin", "cos", "tan", "exp", "log"), _none),
        **dict.fromkeys(("asin", "acos", "atan"), _angle),
        **dict.fromkeys(("abs", "min", "max"), _same),
    },
    lambda x: float(as_double(x)),
)
"""What operations make of dimensions; constants are numbers."""


def _power(name: str, p: Fraction) -> str:
    return name if p == 1 else f"{name}^{p}" if p.denominator == 1 else f"{name}^({p})"


def dimension(expression: Expression, units: Mapping[str, str]) -> Dimension:
    """What a value has units of, for the units of what it names; of a comparison, of both sides."""
    try:
        found = expression.of({n: Dimension.of(units.get(n, "1")) for n in expression.names}, UNITS)
    except ArithmeticError:  # a number divided by 0
        found = None
    return found if isinstance(found, Dimension) else Dimension()
