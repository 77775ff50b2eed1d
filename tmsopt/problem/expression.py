"""Expressions of problems: the language that systems stated in text are written in too, and the units of its values."""

from collections.abc import Mapping

from tmsopt.models.expression import (
    COMPARISONS,
    SIGN,
    Expression,
    ExpressionError,
    UnknownName,
    parse_comparison,
    parse_value,
    written_sides,
)
from tmsopt.problem.units.dimensions import UNITS, Dimension

__all__ = [
    "COMPARISONS",
    "SIGN",
    "Expression",
    "ExpressionError",
    "UnknownName",
    "dimension",
    "parse_comparison",
    "parse_value",
    "written_sides",
]


def dimension(expression: Expression, units: Mapping[str, str]) -> Dimension:
    """What a value has units of, for the units of what it names; of a comparison, of both sides."""
    try:
        found = expression.of({n: Dimension.of(units.get(n, "1")) for n in expression.names}, UNITS)
    except ArithmeticError:  # a number divided by 0
        found = None
    return found if isinstance(found, Dimension) else Dimension()
