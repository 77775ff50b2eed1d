"""The number that a constraint compares with: 0.02 in ``nu_H >= 0.02``."""

import re
from typing import NamedTuple

from tmsopt.models.expression import SIGN, written_sides

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


class WrittenLimit(NamedTuple):
    """A number on one side of a comparison, with the text before and after it."""

    text_before: str
    value: float
    text_after: str

    def replace_number(self, number: str) -> str:
        """The comparison with another number."""
        return f"{self.text_before}{number}{self.text_after}"


def split_limit(text: str) -> WrittenLimit | None:
    """Split a comparison at the number on one side; None if neither side is a number.

    Raises:
        ExpressionError: for a text that does not parse.
    """
    left, sign, right = written_sides(text)
    for text_before, side, text_after in (("", left, f" {sign} {right}"), (f"{left} {sign} ", right, "")):
        if _NUMBER.fullmatch(number := _remove_blanks(side)):
            return WrittenLimit(text_before, float(number), text_after)
    return None


def limit_value(text: str) -> float | None:
    """The number on one side of a comparison; None if neither side is a number."""
    limit = split_limit(text)
    return None if limit is None else limit.value


def limit_side(text: str, name: str) -> int:
    """1 for a name on the left and a number on the right, −1 for the reverse, 0 for any other comparison.

    The sign of the comparison may be ``<=``, ``>=`` or ``==``. Parentheses are ignored, as in ``(abscissa) <= -0.3``.
    """
    sides = [_remove_blanks(side).strip("()") for side in SIGN.split(text)]
    if len(sides) != 2 or name not in sides:
        return 0
    is_left = sides[0] == name
    return (1 if is_left else -1) if _NUMBER.fullmatch(sides[is_left]) else 0


def replace_limit(text: str, value: float) -> str:
    """A comparison with another number, exact to the last bit.

    Raises:
        ValueError: if neither side is a number.
    """
    limit = split_limit(text)
    if limit is None:
        raise ValueError(f"'{text}' compares two expressions; accepted: a number on one side")
    return limit.replace_number(repr(float(value)))


def _remove_blanks(side: str) -> str:
    return "".join(side.split())
