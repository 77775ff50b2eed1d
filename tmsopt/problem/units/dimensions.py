"""Dimensional analysis: the unit of an expression from the units of its names."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from tmsopt.algebra.formula import Kind
from tmsopt.algebra.kinds import as_double
from tmsopt.models.expression import Expression

_UNITS_IN_BASE_UNITS = {"N": "kg m/s^2", "Hz": "1/s", "1": "", "√(g/w)": "√g/√w"}
_BASE_UNITS_TO_NAMES = {"kg m/s^2": "N", "kg m^2/s^2": "N m", "√g/√w": "√(g/w)"}
_POWERS = re.compile(r"(?P<name>[^\s/^*]+)(\^(?P<power>-?\d+))?")


@dataclass(frozen=True)
class Dimension:
    """Base units with their powers in alphabetical order, and the value of a constant without units.

    In a sum, a term without a unit takes the unit of the other terms. A sum of different units has no unit; its
    dimension `is_mixed`.
    """

    powers: tuple[tuple[str, Fraction], ...] = ()
    is_mixed: bool = False
    number: float = field(default=math.nan, compare=False)

    @classmethod
    def from_unit(cls, unit: str) -> "Dimension":
        """The dimension of a unit such as ``kg m^2`` or ``1/s``."""
        parts = zip((1, -1), (_UNITS_IN_BASE_UNITS.get(unit, unit) + "/").split("/"), strict=False)
        factors = [(factor, sign) for sign, part in parts for factor in _POWERS.finditer(part) if factor["name"] != "1"]
        return _multiply(
            *((cls(((factor["name"], Fraction(1)),)), sign * int(factor["power"] or 1)) for factor, sign in factors)
        )

    @property
    def unit(self) -> str:
        """The unit as text; ``1`` if there is none."""
        numerator = " ".join(_power_text(n, p) for n, p in self.powers if p > 0)
        denominator = " ".join(_power_text(n, -p) for n, p in self.powers if p < 0)
        text = f"{numerator or '1'}/{denominator}" if denominator else numerator or "1"
        return _BASE_UNITS_TO_NAMES.get(text, text)


def _multiply(*factors: tuple[Dimension, Fraction | int]) -> Dimension:
    """The product of dimensions, each raised to a power."""
    if any(factor.is_mixed for factor, _ in factors):
        return Dimension(is_mixed=True)
    powers: dict[str, Fraction] = {}
    for factor, exponent in factors:
        for name, p in factor.powers:
            powers[name] = powers.get(name, Fraction(0)) + exponent * p
    return Dimension(tuple(sorted((n, p) for n, p in powers.items() if p)))


def _raise_power(base: Dimension, exponent: Dimension) -> Dimension:
    """A power of a dimension; it has no unit if the exponent is not constant."""
    if not math.isfinite(exponent.number):
        return Dimension()
    return _multiply((base, Fraction(exponent.number).limit_denominator(12)))


def _add(*terms: Dimension) -> Dimension:
    units = {term.powers for term in terms if term.powers}
    is_mixed = len(units) > 1 or any(term.is_mixed for term in terms)
    return Dimension(() if is_mixed or not units else units.pop(), is_mixed)


UNITS = Kind(
    {
        **dict.fromkeys(("add", "sub", "neg", "abs", "min", "max"), _add),
        "mul": lambda a, b: _multiply((a, 1), (b, 1)),
        "div": lambda a, b: _multiply((a, 1), (b, -1)),
        "square": lambda a: _multiply((a, 2)),
        "sqrt": lambda a: _multiply((a, Fraction(1, 2))),
        "pow": _raise_power,
        **dict.fromkeys(("sin", "cos", "tan", "exp", "log"), lambda a: Dimension()),
        **dict.fromkeys(("asin", "acos", "atan"), lambda a: Dimension.from_unit("rad")),
    },
    lambda x: Dimension(number=float(as_double(x))),
)
"""Kind of numbers that are dimensions, with the operations on them."""


def _power_text(name: str, p: Fraction) -> str:
    return name if p == 1 else f"{name}^{p}" if p.denominator == 1 else f"{name}^({p})"


def dimension(expression: Expression, units: Mapping[str, str]) -> Dimension:
    """The dimension of an expression, or of both sides of a comparison, for the units of its names."""
    result: Dimension = expression.of({n: Dimension.from_unit(units.get(n, "1")) for n in expression.names}, UNITS)
    return result
