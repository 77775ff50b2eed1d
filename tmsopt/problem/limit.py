"""The number that a constraint compares with: 0.02 in ``nu_H >= 0.02``."""

import re

from tmsopt.models.expression import SIGN, written_sides

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def limit_of(text: str) -> float | None:
    """The number on one side of a comparison; None where neither side is a number and nothing else.

    Raises:
        ExpressionError: for a text that does not parse.
    """
    left, _, right = written_sides(text)
    return next((float(_close(side)) for side in (left, right) if _NUMBER.fullmatch(_close(side))), None)


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
    if limit_of(text) is None:
        raise ValueError(f"'{text}' compares two expressions; accepted: a number on one side")
    left, sign, right = written_sides(text)
    if _NUMBER.fullmatch(_close(left)):
        return f"{float(value)!r} {sign} {right}"
    return f"{left} {sign} {float(value)!r}"


def _close(side: str) -> str:
    return "".join(side.split())
