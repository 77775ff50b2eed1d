"""Results on the way to SCIP's expressions, and numbers that it cannot be trusted with."""

import math
from dataclasses import dataclass
from typing import Any

import flint

from tmsopt.arithmetic.intervals import Interval, interval
from tmsopt.arithmetic.walk import NotAccepted

_LEAST_POWER = -60  # of two, of a scale: what is smaller is as good as 0
_HUGE = 1e15  # beyond which numbers are left to nobody: from 1e20 SCIP takes them for infinite

CANCELLED = 2.0**-10
"""Of the largest summand: rows are not scaled by less, lest they be held to less than a rounding."""


@dataclass(frozen=True)
class Term:
    """A result on the way: an expression of SCIP with its degree and range.

    Attributes:
        expression: a number where it is constant.
        degree: 0, 1 or 2.
        ball: its range.
        size: bound on its summands, which may cancel.
        tangent: what it is the arctangent of.
        symbol, scale: of a variable, which is the expression divided by its scale.
    """

    expression: Any
    degree: int
    ball: Any
    size: float
    tangent: "Term | None" = None
    symbol: Any = None
    scale: float = 1.0

    @property
    def ends(self) -> Interval:
        return interval(self.ball) if self.degree else (self.expression, self.expression)

    @property
    def unit(self) -> float:
        """What a row of it is divided by to be about 1, a power of two; never more than 1."""
        return max(scale_of(max(map(abs, self.ends))), min(CANCELLED * scale_of(self.size), 1.0))


def constant(value: float) -> Term:
    if math.isfinite(value) and abs(value) > _HUGE:
        raise NotAccepted(f"numbers beyond {_HUGE:g}")
    return Term(float(value), 0, flint.arb(value), abs(float(value)))


def refuse_huge(over: Any, name: str, most: float = _HUGE) -> None:
    if over.is_finite() and max(map(abs, interval(over))) > most:
        raise NotAccepted(f"{name} of numbers beyond {most:g}")


def scale_of(size: float) -> float:
    """What to divide a variable or row by that is at most so large."""
    if not (math.isfinite(size) and size > 0):
        return 1.0
    return float(2.0 ** min(max(math.ceil(math.log2(size)), _LEAST_POWER), 0))
