"""How large an expression may become: exact numbers grow with its degree, so this is known before they are computed."""

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.algebra.walk import Instruction, operation_name, steps

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

    def __neg__(self) -> "Degree":
        return self if self.number is None else constant(-self.number)

    __sub__ = __add__


def constant(number: Any) -> Degree:
    """A number."""
    return Degree(0, 0, float(number))


def applied(join: Callable[..., Degree], compute: Callable[..., Any]) -> Callable[..., Degree]:
    """An operation on degrees that joins them, and computes with what are numbers."""

    def operation(*operands: Degree) -> Degree:
        joined = join(*operands)
        numbers = [x.number for x in operands if x.number is not None]
        if len(numbers) < len(operands):
            return joined
        with np.errstate(all="ignore"):
            return constant(compute(*map(np.float64, numbers)))

    return operation


def same(*operands: Degree) -> Degree:
    """Of a root, a magnitude, the lesser of several."""
    return Degree(max(x.over for x in operands), max(x.under for x in operands))


def alone(*operands: Degree) -> Degree:
    """Of a function that is not rational: its values are numbers of one size, whatever it is applied to."""
    return Degree()


OPERATIONS: Mapping[int, Callable[..., Degree]] = {
    ca.OP_ADD: operator.add,
    ca.OP_SUB: operator.add,
    ca.OP_MUL: operator.mul,
    ca.OP_DIV: operator.truediv,
    ca.OP_INV: lambda a: constant(1) / a,
    ca.OP_SQ: lambda a: a * a,
    **dict.fromkeys((ca.OP_POW, ca.OP_CONSTPOW), operator.pow),
    **dict.fromkeys((ca.OP_NEG, ca.OP_TWICE, ca.OP_SQRT, ca.OP_FABS, ca.OP_FMIN, ca.OP_FMAX), same),
    **dict.fromkeys((ca.OP_EXP, ca.OP_LOG, ca.OP_SIN, ca.OP_COS, ca.OP_TAN, ca.OP_ASIN, ca.OP_ACOS, ca.OP_ATAN), alone),
}
"""CasADi's, those that balls have."""


def faulty(function: ca.Function) -> tuple[int, str] | None:
    """The first entry of a function of vectors that is not computed, and why; every step is looked at once.

    Degrees are not summed up: in what a program built, such as an inverse of a matrix, most of them cancel. Those of
    texts are known before there is a function, see `texts`.
    """
    found: list[Degree | str] = []
    for step in steps(function):
        operands = [found[k] for k in step.operands]
        wrong = next((o for o in operands if isinstance(o, str)), None)
        if step.operation == ca.OP_OUTPUT and wrong:
            return step.place[1], wrong
        now = wrong or _stepped(step, operands)
        found.append(now if isinstance(now, str) or now.number is not None else Degree())
    return None


def _stepped(step: Instruction, operands: Sequence[Any]) -> Degree | str:
    """The degree of a step, or what is wrong with it."""
    match step.operation:
        case ca.OP_INPUT | ca.OP_OUTPUT:
            return Degree()
        case ca.OP_CONST if not math.isfinite(step.constant):
            return f"contains {step.constant}, as of a division by 0; accepted: finite numbers, and expressions of them"
        case ca.OP_CONST:
            return constant(step.constant)
        case operation if operation not in OPERATIONS:
            known = "sin cos tan asin acos atan sqrt exp log fabs fmin fmax"
            return f"uses {operation_name(operation)}; accepted: + - * / ** and {known}"
    try:
        return OPERATIONS[step.operation](*operands)
    except DegreeTooHigh as error:
        return str(error)
