"""The language of expressions, as this package offers it."""

from tmsopt.models.expression import Expression, ExpressionError, parse_comparison, parse_value

__all__ = ["Expression", "ExpressionError", "parse_comparison", "parse_value"]
