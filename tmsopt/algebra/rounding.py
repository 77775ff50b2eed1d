"""Arrays of numbers with bounds of their errors, which every operation carries on."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import flint
import numpy as np

from tmsopt.records import Array, Truth

UNIT = 2 * np.finfo(float).eps
"""Bound of the rounding of one operation, relative to its result; the double of it pays for that of the bounds."""

_WHOLE = 64  # exponent up to which a power is a product
_STEEP = 0.1  # of a tangent: relative change within its error, up to which its slope there is known


def _gentle(function: Callable[[Any], Any]) -> Callable[["Bounded"], "Bounded"]:
    """A function whose slope is nowhere beyond 1."""
    return lambda x: rounded(function(x.value), x.error)


@dataclass(frozen=True, eq=False)
class Bounded:
    """Numbers, scalars or arrays that broadcast, none farther off than its error.

    Where a number does not exist or is beyond doubles, it or its error is not finite.
    """

    value: Any
    error: Any = 0.0
    __array_ufunc__ = None  # NumPy's numbers leave the operators to this class

    def holds(self, share: float) -> Truth:
        """Which numbers are known to a share of their size."""
        return np.asarray(np.isfinite(self.value) & (self.error <= share * np.abs(self.value)))

    def where(self, condition: Any, other: "Bounded") -> "Bounded":
        """These numbers where a condition holds, the others elsewhere."""
        return Bounded(np.where(condition, self.value, other.value), np.where(condition, self.error, other.error))

    def __getitem__(self, index: Any) -> "Bounded":
        return Bounded(self.value[index], self.error[index])

    def __neg__(self) -> "Bounded":
        return Bounded(-self.value, self.error)

    def __abs__(self) -> "Bounded":
        return Bounded(np.abs(self.value), self.error)

    def __add__(self, other: Any) -> "Bounded":
        b = as_bounded(other)
        return rounded(self.value + b.value, self.error + b.error)

    def __sub__(self, other: Any) -> "Bounded":
        b = as_bounded(other)
        return rounded(self.value - b.value, self.error + b.error)

    def __rsub__(self, other: Any) -> "Bounded":
        return as_bounded(other) - self

    def __mul__(self, other: Any) -> "Bounded":
        b = as_bounded(other)
        size = np.abs(b.value) + b.error
        return rounded(self.value * b.value, np.abs(self.value) * b.error + size * self.error)

    __radd__, __rmul__ = __add__, __mul__

    def __truediv__(self, other: Any) -> "Bounded":
        b = as_bounded(other)
        quotient = self.value / b.value
        room = np.abs(b.value) - b.error
        error = (self.error + np.abs(quotient) * b.error) / np.where(room > 0, room, np.nan)
        return rounded(quotient, np.where(room > 0, error, np.inf))

    def __rtruediv__(self, other: Any) -> "Bounded":
        return as_bounded(other) / self

    def __pow__(self, power: Any) -> "Bounded":
        exponent = as_bounded(power)
        n = float(exponent.value) if np.ndim(exponent.value) == 0 and not np.any(exponent.error) else np.nan
        if not (n.is_integer() and abs(n) <= _WHOLE):
            return (self.log() * exponent).exp()
        result = math.prod([self] * int(abs(n)), start=Bounded(np.ones_like(self.value)))
        return 1.0 / result if n < 0 else result

    def __rpow__(self, base: Any) -> "Bounded":
        return as_bounded(base) ** self

    def sqrt(self) -> "Bounded":
        """Square roots; of numbers that may be negative nothing is known."""
        root = np.sqrt(self.value)
        return rounded(
            root, np.where(self.value > self.error, self.error / root, np.where(self.error == 0, 0.0, np.inf))
        )

    def root(self, degree: int) -> "Bounded":
        """Roots of a degree: of negative numbers real ones where it is odd, else 0."""
        size = np.abs(self.value)
        root = size ** (1 / degree)
        sign = np.where(self.value < 0, -1.0 if degree % 2 else 0.0, 1.0)
        slope = root / (degree * np.maximum(size - self.error, 0.0))
        return rounded(sign * root, np.where(self.error == 0, 0.0, self.error * slope) + UNIT * root)

    def exp(self) -> "Bounded":
        """Exponentials."""
        value = np.exp(self.value)
        return rounded(value, value * np.expm1(self.error))

    def log(self) -> "Bounded":
        """Logarithms; of numbers that may be negative nothing is known."""
        room = self.value - self.error
        return rounded(np.log(self.value), np.where(room > 0, self.error / np.where(room > 0, room, 1.0), np.inf))

    sin, cos, atan = map(_gentle, (np.sin, np.cos, np.arctan))

    def tan(self) -> "Bounded":
        """Tangents."""
        value = np.tan(self.value)
        moved = self.error * (1 + value * value)
        return rounded(value, np.where(moved <= _STEEP * (1 + np.abs(value)), 2 * moved, np.inf))

    def asin(self) -> "Bounded":
        """Arcsines."""
        return rounded(np.arcsin(self.value), self._from_the_ends())

    def acos(self) -> "Bounded":
        """Arccosines."""
        return rounded(np.arccos(self.value), self._from_the_ends())

    def _from_the_ends(self) -> Array:
        """Error of an arcsine: by its slope, infinite where −1 or 1 may be met."""
        room = 1 - np.abs(self.value) - self.error
        return np.where(room > 0, self.error / np.sqrt(np.where(room > 0, room, 1.0)), np.inf)


def as_bounded(x: Any) -> Bounded:
    """A number of any kind as one with a bound: doubles are exact, fractions and balls as near as doubles come."""
    if isinstance(x, Bounded):
        return x
    if isinstance(x, flint.arb):
        return rounded(float(x.mid()), float(x.rad()))
    if isinstance(x, flint.fmpq | flint.fmpz):
        value = int(x.p) / int(x.q) if isinstance(x, flint.fmpq) else float(int(x))
        return rounded(value, 0.0)
    return Bounded(x)


def rounded(value: Any, error: Any) -> Bounded:
    """A result whose last operation was rounded."""
    return Bounded(value, error + UNIT * np.abs(value))


def greater(a: Any, b: Any) -> Bounded:
    """The greater of two numbers: it is no farther off than the farther one."""
    one, other = as_bounded(a), as_bounded(b)
    return Bounded(np.maximum(one.value, other.value), np.maximum(one.error, other.error))
