"""Complex numbers as pairs of nodes, for the entries of a complex matrix."""

import operator
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.balls import complex_ball, is_ball
from tmsopt.algebra.formula import Kind, Node, constant, make_node
from tmsopt.algebra.kinds import NODES
from tmsopt.models.names import FUNCTIONS
from tmsopt.models.stated.degree import LARGEST_EXPONENT, DegreeTooHigh
from tmsopt.records import AnyNumbers

UNIT = "_1j"
"""Name for 1j in parsed texts; no parameter may begin with an underscore."""

_LITERAL = re.compile(r"(?<![A-Za-z0-9_.])((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)[jJi](?![A-Za-z0-9_])")
_REPLACED = re.compile(rf"\(([^()*]+)\*{UNIT}\)")


@dataclass(frozen=True)
class Pair:
    """The complex number re + i im. The imaginary part of a real number is the int 0."""

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
        numerator, denominator = self * Pair(b.re, -b.im), b.re * b.re + b.im * b.im
        return Pair(numerator.re / denominator, numerator.im / denominator)

    def __pow__(self, other: Any) -> "Pair":
        n = pair(other)
        if is_real(self) and is_real(n):
            return Pair(self.re**n.re)
        exponent = _whole_exponent(n)
        if exponent is None:
            raise DegreeTooHigh("raises a complex number to a power; accepted: whole exponents, and exp(1j*phi)")
        result, power = Pair(constant(1)), self
        for bit in bin(abs(exponent))[:1:-1]:
            result, power = (result * power if bit == "1" else result), power * power
        return Pair(constant(1)) / result if exponent < 0 else result

    __radd__ = __add__
    __rmul__ = __mul__


def pair(x: Any) -> Pair:
    """A number as a pair."""
    if isinstance(x, complex):
        return Pair(constant(x.real), constant(x.imag) if x.imag else 0)
    return x if isinstance(x, Pair) else Pair(constant(x))


def entry_pair(x: Any) -> Pair:
    """An entry of a complex matrix as a pair. Its numbers and expressions stay unchanged."""
    if isinstance(x, tuple):
        return Pair(*x[:2])
    if isinstance(x, complex | np.complexfloating):
        return Pair(float(x.real), float(x.imag))
    return x if isinstance(x, Pair) else Pair(x)


def join(re: Any, im: Any) -> Any:
    """The complex number of two real numbers: of two nodes a `Pair`, of balls or series a complex one."""
    if isinstance(re, Node):
        return Pair(re, im)
    if is_ball(re) or is_ball(im):
        return complex_ball(re) + complex_ball(im) * flint.acb(0, 1)
    return re + 1j * im


def is_complex_entry(x: Any) -> bool:
    """Whether an entry as the user wrote it is complex: a number, a pair, or a text with 1j."""
    return isinstance(x, complex | np.complexfloating | tuple | Pair) or (
        isinstance(x, str) and replace_literals(x) != x
    )


def list_parts(matrices: Iterable[Iterable[Iterable[Any]]]) -> list[Any]:
    """Real and imaginary part of each entry of some matrices, in order."""
    entries = (entry_pair(x) for P in matrices for row in P for x in row)
    return [part for entry in entries for part in (entry.re, entry.im)]


def is_real(x: Pair) -> bool:
    """True if the imaginary part of a pair is 0 for all parameters."""
    return constant(x.im).fraction == 0


def is_zero(x: Pair) -> bool:
    """True if a pair is 0 for all parameters."""
    return is_real(x) and constant(x.re).fraction == 0


def _whole_exponent(n: Pair) -> int | None:
    if not is_real(n):
        return None
    value = constant(n.re).fraction
    is_whole = value is not None and value.denominator == 1 and abs(value) <= LARGEST_EXPONENT
    return int(value) if value is not None and is_whole else None


def _real_function(name: str) -> Callable[..., Pair]:
    def operate(*operands: Pair) -> Pair:
        if not all(map(is_real, operands)):
            raise DegreeTooHigh(f"takes {name} of a complex number; accepted for complex numbers: + - * / ** and exp")
        return Pair(make_node(name, *(x.re for x in operands)))

    return operate


def _exp(x: Pair) -> Pair:
    size = make_node("exp", x.re)
    return Pair(size) if is_real(x) else Pair(size * make_node("cos", x.im), size * make_node("sin", x.im))


PAIRS = Kind(
    {
        **{name: _real_function(name) for name in FUNCTIONS},
        **{name: getattr(operator, name) for name in ("add", "sub", "mul", "neg", "pow")},
        "div": operator.truediv,
        "square": lambda x: x * x,
        "exp": _exp,
    },
    lambda value: Pair(NODES.constant(value)),
    pair,
)

IMAGINARY_UNIT: AnyNumbers = {UNIT: Pair(constant(0), constant(1))}


def replace_literals(text: str) -> str:
    """The text in which a number such as 2.5j becomes ``(2.5*_1j)``, with a name for the imaginary unit."""
    return _LITERAL.sub(rf"(\1*{UNIT})", text)


def complex_text(re: str, im: str) -> str:
    """The text of a complex number from the texts of its parts."""
    return re if im == "0" else f"1j*{im}" if re == "0" else f"{re} + 1j*{im}"


def restore_literals(message: str) -> str:
    """The message in which ``(2.5*_1j)`` becomes 2.5j again, as the user wrote it."""
    return _REPLACED.sub(r"\1j", message)
