"""How large an expression may become: exact numbers grow with its degree, so this is known before they are computed."""

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.algebra.formula import CONSTANT, INPUT, Constant, Formula, Kind, Step
from tmsopt.algebra.kinds import FLOATS, as_double

LARGEST_EXPONENT = 1023
"""Of a power: 2**1024 is no double any more."""

LARGEST_DEGREE = 10_000
"""Of an expression multiplied out. At a design of doubles it is then a fraction of some million bits at most."""


class DegreeTooHigh(ValueError):
    """An expression that is not computed, with the reason.

    Attributes:
        part: the part of it that is at fault, once that is known.
    """

    part: Any = None


@dataclass(frozen=True)
class Degree:
    """Of a quotient of two polynomials in what an expression names; `+ - * / **` as of the quotients.

    Attributes:
        over, under: degrees of the two, or more.
        number: the value of what names nothing.

    Raises:
        Beyond: for a number that is not finite, an exponent or a degree that is too large.
    """

    over: int = 1
    under: int = 0
    number: float | None = None

    def __post_init__(self) -> None:
        if self.number is not None and not math.isfinite(self.number):
            raise DegreeTooHigh(f"is {self.number:g}; accepted: parts with a finite value")
        if max(self.over, self.under) > LARGEST_DEGREE:
            found = max(self.over, self.under)
            size = f"{found}" if found < 10**18 else f"about 1e{len(str(found)) - 1}"
            raise DegreeTooHigh(f"has the degree {size} when it is multiplied out; accepted: up to {LARGEST_DEGREE}")

    def __add__(self, other: "Degree") -> "Degree":
        return Degree(max(self.over + other.under, other.over + self.under), self.under + other.under)

    def __mul__(self, other: "Degree") -> "Degree":
        return Degree(self.over + other.over, self.under + other.under)

    def __truediv__(self, other: "Degree") -> "Degree":
        if other.number == 0:
            raise DegreeTooHigh("divides by 0; accepted: parts with a finite value")
        return Degree(self.over + other.under, self.under + other.over)

    def __pow__(self, other: "Degree") -> "Degree":
        n = other.number
        if n is None:
            return Degree()  # by logarithms, in numbers of one size
        if abs(n) > LARGEST_EXPONENT:
            accepted = f"from -{LARGEST_EXPONENT} to {LARGEST_EXPONENT}, for 2**{LARGEST_EXPONENT + 1} is no double"
            raise DegreeTooHigh(f"has the exponent {n:.17g}; accepted: {accepted}")
        over, under = (self.over, self.under) if n >= 0 else (self.under, self.over)
        return Degree(math.ceil(abs(n) * over), math.ceil(abs(n) * under))


def _constant(number: Any) -> Degree:
    return Degree(0, 0, float(number))


def _applied(join: Callable[..., Degree], name: str) -> Callable[..., Degree]:
    """An operation on degrees that joins them, and computes with what are numbers."""

    def operation(*operands: Degree) -> Degree:
        joined = join(*operands)
        numbers = [x.number for x in operands if x.number is not None]
        if len(numbers) < len(operands):
            return joined
        with np.errstate(all="ignore"):
            return _constant(FLOATS.operations[name](*map(np.float64, numbers)))

    return operation


def _same(*operands: Degree) -> Degree:
    """Of a root, a magnitude, the lesser of several."""
    return Degree(max(x.over for x in operands), max(x.under for x in operands))


def _alone(*operands: Degree) -> Degree:
    """Of a function that is not rational: its values are numbers of one size, whatever it is applied to."""
    return Degree()


_JOINED: Mapping[str, Callable[..., Degree]] = {
    "add": operator.add,
    "sub": operator.add,
    "mul": operator.mul,
    "div": operator.truediv,
    "square": lambda a: a * a,
    "pow": operator.pow,
    **dict.fromkeys(("neg", "sqrt", "abs", "min", "max"), _same),
    **dict.fromkeys(("exp", "log", "sin", "cos", "tan", "asin", "acos", "atan"), _alone),
}


def _stated(x: Constant) -> Degree:
    number = as_double(x)
    if not math.isfinite(number):
        message = f"contains {number}, as of a division by 0; accepted: finite numbers, and expressions of them"
        raise DegreeTooHigh(message)
    return _constant(number)


DEGREES = Kind({name: _applied(join, name) for name, join in _JOINED.items()}, _stated)


def faulty(formula: Formula) -> tuple[int, str] | None:
    """The first output that is not computed, and why; every step is looked at once.

    Degrees are not summed up: in what a program built, such as an inverse of a matrix, most of them cancel. Those of
    texts are known before there is a formula, see `tmsopt.models.expression`.
    """
    found: list[Degree | str] = []
    for step in formula.steps:
        operands = [found[k] for k in step.operands]
        wrong = next((o for o in operands if isinstance(o, str)), None)
        now = wrong or _stepped(step, operands)
        found.append(now if isinstance(now, str) or now.number is not None else Degree())
    return next(((k, text) for k, o in enumerate(formula.outputs) if isinstance(text := found[o], str)), None)


def _stepped(step: Step, operands: Sequence[Any]) -> Degree | str:
    """The degree of a step, or what is wrong with it."""
    if step.op == INPUT:
        return Degree()
    if step.op not in (*DEGREES.operations, CONSTANT):
        known = "sin cos tan asin acos atan sqrt exp log fabs fmin fmax"
        return f"uses {step.op}; accepted: + - * / ** and {known}"
    try:
        found: Degree = DEGREES.constant(step.value) if step.op == CONSTANT else DEGREES.operations[step.op](*operands)
        return found
    except DegreeTooHigh as error:
        return str(error)
