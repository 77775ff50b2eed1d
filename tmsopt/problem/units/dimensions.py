"""Dimensional analysis: the unit of an expression from the units of its names."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from tmsopt.algebra.formula import Kind
from tmsopt.algebra.kinds import as_double
from tmsopt.models.expression import Expression

_DERIVED = {"N": "kg m/s^2", "Hz": "1/s", "1": "", "√(g/w)": "√g/√w"}
_NAMED = {"kg m/s^2": "N", "kg m^2/s^2": "N m", "√g/√w": "√(g/w)"}
_POWERS = re.compile(r"(?P<name>[^\s/^*]+)(\^(?P<power>-?\d+))?")


@dataclass(frozen=True)
class Dimension:
    """Base units with their powers in alphabetical order, and the value of a constant without units.

    In a sum, terms without a unit take the unit of the others. Two different units make it `mixed`, without a unit.
    """

    powers: tuple[tuple[str, Fraction], ...] = ()
    mixed: bool = False
    number: float = field(default=math.nan, compare=False)

    @classmethod
    def of(cls, unit: str) -> "Dimension":
        """The dimension of a unit such as ``kg m^2`` or ``1/s``."""
        parts = zip((1, -1), (_DERIVED.get(unit, unit) + "/").split("/"), strict=False)
        each = [(one, sign) for sign, part in parts for one in _POWERS.finditer(part) if one["name"] != "1"]
        return _multiply(*((cls(((one["name"], Fraction(1)),)), sign * int(one["power"] or 1)) for one, sign in each))

    @property
    def unit(self) -> str:
        """The unit as text; ``1`` without one."""
        above = " ".join(_power_text(n, p) for n, p in self.powers if p > 0)
        below = " ".join(_power_text(n, -p) for n, p in self.powers if p < 0)
        text = f"{above or '1'}/{below}" if below else above or "1"
        return _NAMED.get(text, text)


def _multiply(*factors: tuple[Dimension, Fraction | int]) -> Dimension:
    """The product of dimensions, each raised to a power."""
    if any(factor.mixed for factor, _ in factors):
        return Dimension(mixed=True)
    found: dict[str, Fraction] = {}
    for factor, share in factors:
        for name, p in factor.powers:
            found[name] = found.get(name, Fraction(0)) + share * p
    return Dimension(tuple(sorted((n, p) for n, p in found.items() if p)))


def _raise_power(base: Dimension, exponent: Dimension) -> Dimension:
    """A power of a dimension; no unit if the exponent is not constant."""
    if not math.isfinite(exponent.number):
        return Dimension()
    return _multiply((base, Fraction(exponent.number).limit_denominator(12)))


def _add(*terms: Dimension) -> Dimension:
    known = {term.powers for term in terms if term.powers}
    mixed = len(known) > 1 or any(term.mixed for term in terms)
    return Dimension(() if mixed or not known else known.pop(), mixed)


UNITS = Kind(
    {
        **dict.fromkeys(("add", "sub", "neg", "abs", "min", "max"), _add),
        "mul": lambda a, b: _multiply((a, 1), (b, 1)),
        "div": lambda a, b: _multiply((a, 1), (b, -1)),
        "square": lambda a: _multiply((a, 2)),
        "sqrt": lambda a: _multiply((a, Fraction(1, 2))),
        "pow": _raise_power,
        **dict.fromkeys(("sin", "cos", "tan", "exp", "log"), lambda a: Dimension()),
        **dict.fromkeys(("asin", "acos", "atan"), lambda a: Dimension.of("rad")),
    },
    lambda x: Dimension(number=float(as_double(x))),
)
"""Operations on dimensions."""


def _power_text(name: str, p: Fraction) -> str:
    return name if p == 1 else f"{name}^{p}" if p.denominator == 1 else f"{name}^({p})"


def dimension(expression: Expression, units: Mapping[str, str]) -> Dimension:
    """The dimension of an expression, or of both sides of a comparison, for the units of its names."""
    found: Dimension = expression.of({n: Dimension.of(units.get(n, "1")) for n in expression.names}, UNITS)
    return found
