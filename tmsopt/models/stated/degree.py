"""Degrees of expressions. They are checked before exact values are computed, whose digits grow with the degree."""

import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.algebra.formula import CONSTANT, INPUT, Constant, Formula, Kind
from tmsopt.algebra.kinds import FLOATS, as_double

LARGEST_EXPONENT = 1023
"""Largest exponent of a power: 2**1024 is not a double."""

LARGEST_DEGREE = 10_000
"""Largest degree of an expression that is multiplied out. Its exact value for doubles has at most some million bits."""


class DegreeTooHigh(ValueError):
    """An expression is too large or not finite; the message says why.

    Attributes:
        part: the part of the expression that is too large; None until the parser sets it.
    """

    part: Any = None


@dataclass(frozen=True)
class Degree:
    """Degrees of an expression as a quotient of two polynomials; `+ - * / **` give the degrees of their results.

    Attributes:
        numerator, denominator: upper bounds of the degrees of the two polynomials.
        number: the value of a constant expression; None for other expressions.

    Raises:
        DegreeTooHigh: if a number is not finite, or an exponent or a degree is too large.
    """

    numerator: int = 1
    denominator: int = 0
    number: float | None = None

    def __post_init__(self) -> None:
        if self.number is not None and not math.isfinite(self.number):
            raise DegreeTooHigh(f"is {self.number:g}; accepted: parts with a finite value")
        if max(self.numerator, self.denominator) > LARGEST_DEGREE:
            degree = max(self.numerator, self.denominator)
            size = f"{degree}" if degree < 10**18 else f"about 1e{len(str(degree)) - 1}"
            raise DegreeTooHigh(f"has the degree {size} when multiplied out; accepted: up to {LARGEST_DEGREE}")

    def __add__(self, other: "Degree") -> "Degree":
        return Degree(
            max(self.numerator + other.denominator, other.numerator + self.denominator),
            self.denominator + other.denominator,
        )

    def __mul__(self, other: "Degree") -> "Degree":
        return Degree(self.numerator + other.numerator, self.denominator + other.denominator)

    def __truediv__(self, other: "Degree") -> "Degree":
        if other.number == 0:
            raise DegreeTooHigh("divides by 0; accepted: parts with a finite value")
        return Degree(self.numerator + other.denominator, self.denominator + other.numerator)

    def __pow__(self, other: "Degree") -> "Degree":
        n = other.number
        if n is None:
            return Degree()  # a power with a variable exponent is computed by logarithms, in numbers of fixed size
        if abs(n) > LARGEST_EXPONENT:
            accepted = (
                f"from -{LARGEST_EXPONENT} to {LARGEST_EXPONENT}, because 2**{LARGEST_EXPONENT + 1} is not a double"
            )
            raise DegreeTooHigh(f"has the exponent {n:.17g}; accepted: {accepted}")
        numerator, denominator = (self.numerator, self.denominator) if n >= 0 else (self.denominator, self.numerator)
        return Degree(math.ceil(abs(n) * numerator), math.ceil(abs(n) * denominator))


def _operation(join: Callable[..., Degree], name: str) -> Callable[..., Degree]:
    """An operation on degrees. If all operands have a `number`, the result has one, too.

    Args:
        join: function that joins the degrees.
        name: operation that computes the number.
    """

    def operation(*operands: Degree) -> Degree:
        joined = join(*operands)
        numbers = [x.number for x in operands if x.number is not None]
        if len(numbers) < len(operands):
            return joined
        with np.errstate(all="ignore"):
            return Degree(0, 0, float(FLOATS.operations[name](*map(np.float64, numbers))))

    return operation


_OPERATIONS: Mapping[str, Callable[..., Degree]] = {
    "add": operator.add,
    "sub": operator.add,
    "mul": operator.mul,
    "div": operator.truediv,
    "square": lambda a: a * a,
    "pow": operator.pow,
    **dict.fromkeys(
        ("neg", "sqrt", "abs", "min", "max"),
        lambda *operands: Degree(max(x.numerator for x in operands), max(x.denominator for x in operands)),
    ),
    # Values of these functions have a fixed number of digits.
    **dict.fromkeys(("exp", "log", "sin", "cos", "tan", "asin", "acos", "atan"), lambda *operands: Degree()),
}


def _constant_degree(x: Constant) -> Degree:
    number = as_double(x)
    if not math.isfinite(number):
        message = f"contains {number}, e.g. from a division by 0; accepted: finite numbers, and expressions of them"
        raise DegreeTooHigh(message)
    return Degree(0, 0, number)


DEGREES = Kind({name: _operation(join, name) for name, join in _OPERATIONS.items()}, _constant_degree)


def first_fault(formula: Formula) -> tuple[int, str] | None:
    """The index of the first output that cannot be computed, and the reason; None if there is none.

    Degrees do not accumulate here, because in formulas built by a program, such as a matrix inverse, most terms cancel.
    `tmsopt.models.expression` checks the degrees of texts.
    """
    results: list[Degree | str] = []
    for step in formula.steps:
        operands = [results[k] for k in step.operands]
        reason = next((o for o in operands if isinstance(o, str)), "")
        degree = Degree()
        if step.op not in (*DEGREES.operations, CONSTANT, INPUT):
            functions = "sin cos tan asin acos atan sqrt exp log fabs fmin fmax"
            reason = reason or f"uses {step.op}; accepted: + - * / ** and {functions}"
        elif step.op != INPUT and not reason:
            try:
                degree = DEGREES.constant(step.value) if step.op == CONSTANT else DEGREES.operations[step.op](*operands)
            except DegreeTooHigh as error:
                reason = str(error)
        results.append(reason or (degree if degree.number is not None else Degree()))
    return next(((k, text) for k, o in enumerate(formula.outputs) if isinstance(text := results[o], str)), None)
