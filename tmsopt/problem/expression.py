"""The language of expressions as the face of this package hands it on; systems stated in text are written in it too."""

from tmsopt.models.expression import Expression, ExpressionError, parse_comparison, parse_value

__all__ = ["Expression", "ExpressionError", "parse_comparison", "parse_value"]
