"""Complex numbers as pairs of real ones of any kind: what an entry of a complex matrix is computed in."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import casadi as ca

from tmsopt.models.arithmetics import BINARY, SYMBOLIC, Arithmetic
from tmsopt.models.constants import number_of, number_symbol, number_texts
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
        return self + -pair(other)

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
            return Pair(_quotient(self.re, b.re), self.im if is_real(self) else _quotient(self.im, b.re))
        top, square = self * Pair(b.re, -b.im), b.re * b.re + b.im * b.im
        return Pair(top.re / square, top.im / square)

    def __pow__(self, other: Any) -> "Pair":
        n = pair(other)
        if is_real(self) and is_real(n):
            return Pair(self.re**n.re)
        exponent = _whole(n)
        if exponent is None:
            raise DegreeTooHigh("is a complex number to a power; accepted: whole numbers as exponents, and exp(1j*phi)")
        found, power = Pair(1.0), self
        for bit in bin(abs(exponent))[:1:-1]:
            found, power = (found * power if bit == "1" else found), power * power
        return Pair(1.0) / found if exponent < 0 else found

    __radd__ = __add__
    __rmul__ = __mul__


def pair(x: Any) -> Pair:
    """A number as a pair."""
    if isinstance(x, complex):
        return Pair(x.real, x.imag if x.imag else 0)
    return x if isinstance(x, Pair) else Pair(x)


def is_real(x: Pair) -> bool:
    """Whether a pair has no imaginary part whatever its parameters are."""
    return bool(x.im.is_zero()) if isinstance(x.im, ca.SX) else isinstance(x.im, int | float) and x.im == 0


def _quotient(x: Any, y: Any) -> Any:
    """A quotient; one of two numbers is a number too, such as 1/3, which is taken exactly."""
    a, b = ca.SX(x), ca.SX(y)
    if a.op() == ca.OP_NEG:
        return -_quotient(a.dep(), b)
    texts = [*number_texts(a), *number_texts(b)] if a.is_symbolic() and b.is_symbolic() else []
    if len(texts) < 2:
        return x / y
    return number_symbol("/".join(text if text.replace(".", "").isdigit() else f"({text})" for text in texts))


def _whole(n: Pair) -> int | None:
    if not is_real(n):
        return None
    value = number_of(ca.SX(n.re))
    return int(value) if value is not None and value == int(value) and abs(value) <= LARGEST_EXPONENT else None


def _real(name: str, function: Callable[..., Any]) -> Callable[..., Pair]:
    def applied(*operands: Any) -> Pair:
        if not all(is_real(pair(x)) for x in operands):
            raise DegreeTooHigh(f"takes {name} of a complex number; accepted: + - * / ** and exp of these")
        return Pair(function(*(pair(x).re for x in operands)))

    return applied


def _joined(join: Callable[[Any, Any], Any], a: Any, b: Any) -> Any:
    return join(pair(a), pair(b))


def _exp(x: Any) -> Pair:
    z = pair(x)
    size = ca.exp(ca.SX(z.re))
    return Pair(size) if is_real(z) else Pair(size * ca.cos(ca.SX(z.im)), size * ca.sin(ca.SX(z.im)))


PAIRS = Arithmetic(
    {**{name: _real(name, SYMBOLIC.functions[name]) for name in FUNCTIONS}, "exp": _exp},
    pair,
    {sign: partial(_joined, join) for sign, join in BINARY.items()},
    constant=lambda text: Pair(number_symbol(text)),
)
"""Of CasADi's expressions."""

BESIDE: Mapping[str, Any] = {UNIT: Pair(0, 1.0)}


def real_text(text: str) -> str:
    """A text in which numbers such as 2.5j are written by a name: ``(2.5*_1j)``."""
    return _LITERAL.sub(rf"(\1*{UNIT})", text)


def complex_text(re: str, im: str) -> str:
    """Two real texts as one."""
    return re if im == "0" else f"1j*{im}" if re == "0" else f"{re} + 1j*{im}"


def as_written(message: str) -> str:
    """A message about such a text as about the one that was written."""
    return _STANDING.sub(r"\1j", message)
