"""Arrays of numbers with error bounds; every operation computes the error bound of its result."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import flint
import numpy as np

from tmsopt.records import Array, Truth

UNIT = 2 * np.finfo(float).eps
"""Relative rounding error of one operation, doubled to cover the rounding of the bounds themselves."""

_MAX_EXPONENT = 64  # a power with a larger exponent is computed by logarithms
_MAX_TANGENT_CHANGE = 0.1  # if a tangent may change more than this, relative to 1 + |tangent|, its error is infinite


def _make_lipschitz(function: Callable[[Any], Any]) -> Callable[["Bounded"], "Bounded"]:
    """Extend a function to numbers with error bounds; its slope must be at most 1 everywhere."""
    return lambda x: add_rounding(function(x.value), x.error)


@dataclass(frozen=True, eq=False)
class Bounded:
    """Numbers with error bounds, as scalars or arrays that broadcast.

    If a number does not exist or exceeds the range of doubles, its value or its error is not finite.
    """

    value: Any
    error: Any = 0.0
    __array_ufunc__ = None  # so that the operators of NumPy's numbers defer to this class

    def is_known_within(self, tolerance: float) -> Truth:
        """Which numbers have a relative error of at most a tolerance."""
        return np.asarray(np.isfinite(self.value) & (self.error <= tolerance * np.abs(self.value)))

    def where(self, condition: Any, other: "Bounded") -> "Bounded":
        """These numbers where a condition holds, and the numbers of `other` where it fails."""
        return Bounded(np.where(condition, self.value, other.value), np.where(condition, self.error, other.error))

    def __getitem__(self, index: Any) -> "Bounded":
        return Bounded(self.value[index], self.error[index])

    def __neg__(self) -> "Bounded":
        return Bounded(-self.value, self.error)

    def __abs__(self) -> "Bounded":
        return Bounded(np.abs(self.value), self.error)

    def __add__(self, other: Any) -> "Bounded":
        b = as_bounded(other)
        return add_rounding(self.value + b.value, self.error + b.error)

    def __sub__(self, other: Any) -> "Bounded":
        b = as_bounded(other)
        return add_rounding(self.value - b.value, self.error + b.error)

    def __rsub__(self, other: Any) -> "Bounded":
        return as_bounded(other) - self

    def __mul__(self, other: Any) -> "Bounded":
        b = as_bounded(other)
        size = np.abs(b.value) + b.error
        return add_rounding(self.value * b.value, np.abs(self.value) * b.error + size * self.error)

    __radd__, __rmul__ = __add__, __mul__

    def __truediv__(self, other: Any) -> "Bounded":
        b = as_bounded(other)
        quotient = self.value / b.value
        min_size = np.abs(b.value) - b.error
        error = (self.error + np.abs(quotient) * b.error) / np.where(min_size > 0, min_size, np.nan)
        return add_rounding(quotient, np.where(min_size > 0, error, np.inf))

    def __rtruediv__(self, other: Any) -> "Bounded":
        return as_bounded(other) / self

    def __pow__(self, power: Any) -> "Bounded":
        exponent = as_bounded(power)
        n = float(exponent.value) if np.ndim(exponent.value) == 0 and not np.any(exponent.error) else np.nan
        if not (n.is_integer() and abs(n) <= _MAX_EXPONENT):
            return (self.log() * exponent).exp()
        result = math.prod([self] * int(abs(n)), start=Bounded(np.ones_like(self.value)))
        return 1.0 / result if n < 0 else result

    def __rpow__(self, base: Any) -> "Bounded":
        return as_bounded(base) ** self

    def sqrt(self) -> "Bounded":
        """Square roots; the error is infinite for numbers that may be negative."""
        root = np.sqrt(self.value)
        error_near_zero = np.where(self.error == 0, 0.0, np.inf)
        return add_rounding(root, np.where(self.value > self.error, self.error / root, error_near_zero))

    def root(self, degree: int) -> "Bounded":
        """Real roots of a degree; 0 for negative numbers if the degree is even."""
        size = np.abs(self.value)
        root = size ** (1 / degree)
        sign = np.where(self.value < 0, -1.0 if degree % 2 else 0.0, 1.0)
        slope = root / (degree * np.maximum(size - self.error, 0.0))
        return add_rounding(sign * root, np.where(self.error == 0, 0.0, self.error * slope) + UNIT * root)

    def exp(self) -> "Bounded":
        """Exponential."""
        value = np.exp(self.value)
        return add_rounding(value, value * np.expm1(self.error))

    def log(self) -> "Bounded":
        """Natural logarithm; the error is infinite for numbers that may be negative."""
        least = self.value - self.error
        error = np.where(least > 0, self.error / np.where(least > 0, least, 1.0), np.inf)
        return add_rounding(np.log(self.value), error)

    sin, cos, atan = map(_make_lipschitz, (np.sin, np.cos, np.arctan))

    def tan(self) -> "Bounded":
        """Tangent."""
        value = np.tan(self.value)
        change = self.error * (1 + value * value)
        is_small = change <= _MAX_TANGENT_CHANGE * (1 + np.abs(value))
        return add_rounding(value, np.where(is_small, 2 * change, np.inf))

    def asin(self) -> "Bounded":
        """Arcsine."""
        return add_rounding(np.arcsin(self.value), self._arcsine_error())

    def acos(self) -> "Bounded":
        """Arccosine."""
        return add_rounding(np.arccos(self.value), self._arcsine_error())

    def _arcsine_error(self) -> Array:
        """Error by the slope of the arcsine, infinite if the number may reach −1 or 1."""
        distance_to_one = 1 - np.abs(self.value) - self.error
        is_inside = distance_to_one > 0
        return np.where(is_inside, self.error / np.sqrt(np.where(is_inside, distance_to_one, 1.0)), np.inf)


def as_bounded(x: Any) -> Bounded:
    """A number with its error bound: 0 for doubles, the rounding to double for fractions and balls."""
    if isinstance(x, Bounded):
        return x
    if isinstance(x, flint.arb):
        return add_rounding(float(x.mid()), float(x.rad()))
    if isinstance(x, flint.fmpq | flint.fmpz):
        value = int(x.p) / int(x.q) if isinstance(x, flint.fmpq) else float(int(x))
        return add_rounding(value, 0.0)
    return Bounded(x)


def add_rounding(value: Any, error: Any) -> Bounded:
    """A result with the rounding error of its last operation added to its error."""
    return Bounded(value, error + UNIT * np.abs(value))


def maximum(a: Any, b: Any) -> Bounded:
    """The greater of two numbers, with the larger of the two errors."""
    a, b = as_bounded(a), as_bounded(b)
    return Bounded(np.maximum(a.value, b.value), np.maximum(a.error, b.error))
