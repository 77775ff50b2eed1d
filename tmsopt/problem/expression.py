"""Expressions of problems: the language that systems stated in text are written in too, and the units of its values."""

import ast
from collections.abc import Mapping

from tmsopt.models.arithmetics import BINARY, Arithmetic
from tmsopt.models.expression import (
    COMPARISONS,
    Expression,
    ExpressionError,
    UnknownName,
    parse_comparison,
    parse_value,
    written_sides,
)
from tmsopt.problem.units import dimensions

__all__ = [
    "COMPARISONS",
    "Expression",
    "ExpressionError",
    "UnknownName",
    "dimension",
    "parse_comparison",
    "parse_value",
    "written_sides",
]

_DIMENSIONS = Arithmetic(dimensions.FUNCTIONS, lambda x: x, {**BINARY, ast.Pow: dimensions.power}, dimensions.Dimension)


def dimension(expression: Expression, units: Mapping[str, str]) -> dimensions.Dimension:
    """What a value has units of, for the units of what it names; of a comparison, of both sides."""
    try:
        named = {n: dimensions.Dimension.of(units.get(n, "1")) for n in expression.names}
        found = expression.evaluate(named, _DIMENSIONS)
    except ArithmeticError:  # a number divided by 0
        found = None
    return found if isinstance(found, dimensions.Dimension) else dimensions.Dimension()
