"""Complex numbers as pairs of nodes: what an entry of a complex matrix is computed in."""

import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Kind, constant, make_node
from tmsopt.algebra.kinds import NODES
from tmsopt.models.names import FUNCTIONS
from tmsopt.models.stated.degree import LARGEST_EXPONENT, DegreeTooHigh

UNIT = "_1j"
"""Stands for 1j in texts that are parsed; no parameter may have such a name."""

_LITERAL = re.compile(r"(?<![A-Za-z0-9_.])((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)[jJi](?![A-Za-z0-9_])")
_STANDING = re.compile(rf"\(([^()*]+)\*{UNIT}\)")


@dataclass(frozen=True)
class Pair:
    """re + i im; what has no imaginary part has the int 0 there."""

    re: Any
    im: Any = 0

    def __add__(self, other: Any) -> "Pair":
        b = pair(other)
        return Pair(self.re + b.re, self.im + b.im)

    def __neg__(self) -> "Pair":
        return Pair(-self.re, -self.im)

    def __sub__(self, other: Any) -> "Pair":
        b = pair(other)
        return Pair(self.re - b.re, self.im - b.im)

    def __mul__(self, other: Any) -> "Pair":
        b = pair(other)
        if is_real(b):
            return Pair(self.re * b.re, self.im * b.re)
        if is_real(self):
            return Pair(self.re * b.re, self.re * b.im)
        return Pair(self.re * b.re - self.im * b.im, self.re * b.im + self.im * b.re)

    def __truediv__(self, other: Any) -> "Pair":
        b = pair(other)
        if is_real(b):
            return Pair(self.re / b.re, self.im if is_real(self) else self.im / b.re)
        top, square = self * Pair(b.re, -b.im), b.re * b.re + b.im * b.im
        return Pair(top.re / square, top.im / square)

    def __pow__(self, other: Any) -> "Pair":
        n = pair(other)
        if is_real(self) and is_real(n):
            return Pair(self.re**n.re)
        exponent = _whole(n)
        if exponent is None:
            raise DegreeTooHigh("is a complex number to a power; accepted: whole numbers as exponents, and exp(1j*phi)")
        found, power = Pair(constant(1)), self
        for bit in bin(abs(exponent))[:1:-1]:
            found, power = (found * power if bit == "1" else found), power * power
        return Pair(constant(1)) / found if exponent < 0 else found

    __radd__ = __add__
    __rmul__ = __mul__


def pair(x: Any) -> Pair:
    """A number as a pair."""
    if isinstance(x, complex):
        return Pair(constant(x.real), constant(x.imag) if x.imag else 0)
    return x if isinstance(x, Pair) else Pair(constant(x))


def as_pair(x: Any) -> Pair:
    """An entry of a complex matrix, numbers and expressions as they are, as a pair."""
    if isinstance(x, tuple):
        return Pair(*x[:2])
    if isinstance(x, complex | np.complexfloating):
        return Pair(float(x.real), float(x.imag))
    return x if isinstance(x, Pair) else Pair(x)


def is_real(x: Pair) -> bool:
    """Whether a pair has no imaginary part whatever its parameters are."""
    return constant(x.im).fraction == 0


def _whole(n: Pair) -> int | None:
    if not is_real(n):
        return None
    value = constant(n.re).fraction
    known = value is not None and value.denominator == 1 and abs(value) <= LARGEST_EXPONENT
    return int(value) if value is not None and known else None


def _real(name: str) -> Callable[..., Pair]:
    def applied(*operands: Pair) -> Pair:
        if not all(map(is_real, operands)):
            raise DegreeTooHigh(f"takes {name} of a complex number; accepted: + - * / ** and exp of these")
        return Pair(make_node(name, *(x.re for x in operands)))

    return applied


def _exp(x: Pair) -> Pair:
    size = make_node("exp", x.re)
    return Pair(size) if is_real(x) else Pair(size * make_node("cos", x.im), size * make_node("sin", x.im))


PAIRS = Kind(
    {
        **{name: _real(name) for name in FUNCTIONS},
        **{name: getattr(operator, name) for name in ("add", "sub", "mul", "neg", "pow")},
        "div": operator.truediv,
        "square": lambda x: x * x,
        "exp": _exp,
    },
    lambda value: Pair(NODES.constant(value)),
    pair,
)

BESIDE: Mapping[str, Any] = {UNIT: Pair(constant(0), constant(1))}


def real_text(text: str) -> str:
    """A text in which numbers such as 2.5j are written by a name: ``(2.5*_1j)``."""
    return _LITERAL.sub(rf"(\1*{UNIT})", text)


def complex_text(re: str, im: str) -> str:
    """Two real texts as one."""
    return re if im == "0" else f"1j*{im}" if re == "0" else f"{re} + 1j*{im}"


def as_written(message: str) -> str:
    """A message about such a text as about the one that was written."""
    return _STANDING.sub(r"\1j", message)
