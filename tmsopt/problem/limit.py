"""The number that a constraint compares with: 0.02 in ``nu_H >= 0.02``."""

import re
from typing import NamedTuple

from tmsopt.models.expression import SIGN, written_sides

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


class WrittenLimit(NamedTuple):
    """A number on one side of a comparison, and the text before and behind it."""

    before: str
    value: float
    behind: str

    def written(self, number: str) -> str:
        """The same comparison with another number."""
        return f"{self.before}{number}{self.behind}"


def split_limit(text: str) -> WrittenLimit | None:
    """The number on one side of a comparison; None where neither side is a number and nothing else.

    Raises:
        ExpressionError: for a text that does not parse.
    """
    left, sign, right = written_sides(text)
    for before, side, behind in (("", left, f" {sign} {right}"), (f"{left} {sign} ", right, "")):
        if _NUMBER.fullmatch(_close(side)):
            return WrittenLimit(before, float(_close(side)), behind)
    return None


def limit_of(text: str) -> float | None:
    """That number alone."""
    limit = split_limit(text)
    return None if limit is None else limit.value


def limit_side(text: str, name: str) -> int:
    """What a comparison of nothing but a quantity with a number makes of it: 1 where it stands left, −1 right; else 0.

    Its parts alone are read: ``(abscissa) <= -0.3``.
    """
    sides = [_close(side).strip("()") for side in SIGN.split(text)]
    if len(sides) != 2 or name not in sides:
        return 0
    left = sides[0] == name
    return (1 if left else -1) if _NUMBER.fullmatch(sides[left]) else 0


def with_limit(text: str, value: float) -> str:
    """The same comparison with another number, to the last bit.

    Raises:
        ValueError: where neither side is a number.
    """
    limit = split_limit(text)
    if limit is None:
        raise ValueError(f"'{text}' compares two expressions; accepted: a number on one side")
    return limit.written(repr(float(value)))


def _close(side: str) -> str:
    return "".join(side.split())
