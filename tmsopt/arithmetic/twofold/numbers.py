"""Sums of two doubles by error-free transformations (Dekker, Numer. Math. 18, 224, 1971), with running error bounds."""

from fractions import Fraction
from typing import Any

import flint
import numpy as np

from tmsopt.records import Array, Truth

_ROUNDING = 2.0**-101
"""Of the size of the operands: a sum errs by 4, a product by 8, a quotient by 20 units of 2^-106."""

_LEAST = 1e-290  # of a product: below it the rounding of a product may itself be rounded
_SPLIT = 2.0**27 + 1
_MARGIN = 1 + 1e-9  # of a bound, itself a sum of doubles none of which is negative


class Twofold:
    """Numbers high + low, scalars or arrays of any shapes that broadcast, none farther off than `off`.

    Where a number does not exist or is beyond doubles, `high` or `off` is not finite.
    """

    __slots__ = ("_parts", "high", "low", "off")
    __array_ufunc__ = None  # NumPy's numbers leave the operators to this class

    def __init__(self, high: Any, low: Any = 0.0, off: Any = 0.0) -> None:
        self.high, self.low, self.off = high, low, off
        self._parts: tuple[Any, Any] | None = None

    @property
    def parts(self) -> tuple[Any, Any]:
        """The high part as two numbers of 26 bits, whose products are exact."""
        if self._parts is None:
            scaled = _SPLIT * self.high
            upper = scaled - (scaled - self.high)
            self._parts = upper, self.high - upper
        return self._parts

    def nearest(self) -> tuple[Array, Truth]:
        """The doubles nearest to the numbers, and which of them are so for certain."""
        reach = _MARGIN * self.off + _ROUNDING * np.abs(self.high)
        found, other = self.high + (self.low + reach), self.high + (self.low - reach)
        return np.asarray(found + 0.0), np.asarray((found == other) & np.isfinite(found))

    def where(self, condition: Any, other: "Twofold") -> "Twofold":
        """These numbers where a condition holds, the others elsewhere."""
        pairs = (self.high, other.high), (self.low, other.low), (self.off, other.off)
        return Twofold(*(np.where(condition, a, b) for a, b in pairs))

    def __getitem__(self, rows: Any) -> "Twofold":
        return Twofold(*(x[rows] if np.ndim(x) else x for x in (self.high, self.low, self.off)))

    def __neg__(self) -> "Twofold":
        return Twofold(-self.high, -self.low, self.off)

    def __pos__(self) -> "Twofold":
        return self

    def __abs__(self) -> "Twofold":
        sign = np.where(self.high < 0, -1.0, 1.0)[()]
        return Twofold(sign * self.high, sign * self.low, self.off)

    def __add__(self, other: Any) -> "Twofold":
        b = twofold(other)
        total = self.high + b.high
        gained = total - self.high
        rest = (self.high - (total - gained)) + (b.high - gained) + (self.low + b.low)
        high = total + rest
        off = self.off + b.off + _ROUNDING * (abs(self.high) + abs(b.high))
        return Twofold(high, rest - (high - total), off)

    __radd__ = __add__

    def __sub__(self, other: Any) -> "Twofold":
        return self + -twofold(other)

    def __rsub__(self, other: Any) -> "Twofold":
        return -self + other

    def __mul__(self, other: Any) -> "Twofold":
        b = twofold(other)
        (x, y), (u, v) = self.parts, b.parts
        product = self.high * b.high
        rest = ((x * u - product) + x * v + y * u) + y * v + (self.high * b.low + self.low * b.high)
        high = product + rest
        off = abs(self.high) * b.off + abs(b.high) * self.off + self.off * b.off
        return Twofold(high, rest - (high - product), off + _ROUNDING * abs(product) + _LEAST)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "Twofold":
        b = twofold(other)
        first = np.true_divide(self.high, b.high)
        second = (self - b * first).high / b.high
        high = first + second
        room = abs(b.high) - 2 * b.off  # above 0 unless the divisor may be 0
        off = np.where(room > 0, (self.off + abs(first) * b.off) / np.where(room > 0, room, 1.0) * 2, np.inf)[()]
        return Twofold(high, second - (high - first), off + _ROUNDING * abs(first) + _LEAST)

    def __rtruediv__(self, other: Any) -> "Twofold":
        return twofold(other) / self

    def __pow__(self, power: Any) -> "Twofold":
        if power == Fraction(1, 2):
            return self.sqrt()
        if int(power) != power:
            return NotImplemented
        if power < 0:
            return 1 / self**-power
        found, square, left = twofold(1.0), self, int(power)
        while left:
            found = found * square if left & 1 else found
            square, left = square * square, left >> 1
        return found

    def sqrt(self) -> "Twofold":
        """Square root; nan where the number is negative, without an error bound where it may be 0."""
        first = np.sqrt(self.high)
        safe = np.where(first > 0, first, 1.0)[()]
        second = (self - Twofold(first) * first).high / (2 * safe)
        high = first + second
        off = np.where(self.high > 2 * self.off, self.off / safe, np.inf)[()]
        return Twofold(high, second - (high - first), off + _ROUNDING * first + _LEAST)

    def root(self, degree: int) -> "Twofold":
        """The real root of a degree, positive for a positive number; 0 of a negative one where there is none."""
        size = np.abs(self.high)
        first = np.where(size > 0, size, 1.0)[()] ** (1 / degree)
        power = Twofold(first) ** (degree - 1)
        step = (abs(self) - power * first) / (power * degree)
        found = Twofold(first) + step
        # Newton's step is off by (degree − 1) step²/2 first, and moves with the number.
        off = found.off + degree * step.high * step.high / first + _ROUNDING * first
        found = Twofold(found.high, found.low, np.where(size > 2 * self.off, off, np.inf)[()])
        if degree % 2:
            return (-found).where(self.high < 0, found)
        return Twofold(0.0 * first, 0.0, 0.0).where((self.high < 0) & (size > 2 * self.off), found)

    def sin(self) -> "Twofold":
        """Sine."""
        return _functions().sine_cosine(self)[0]

    def cos(self) -> "Twofold":
        """Cosine."""
        return _functions().sine_cosine(self)[1]

    def tan(self) -> "Twofold":
        """Tangent."""
        sine, cosine = _functions().sine_cosine(self)
        return sine / cosine

    def __getattr__(self, name: str) -> Any:
        if name in ("asin", "acos", "atan", "exp", "log"):
            return lambda: _functions().by_balls(name, self)
        raise AttributeError(name)


def twofold(x: Any) -> Twofold:
    """A number or an array of doubles, or an exact fraction, as such numbers."""
    if isinstance(x, Twofold):
        return x
    if isinstance(x, flint.fmpq | flint.fmpz | Fraction | int) and not isinstance(x, bool):
        exact = x if isinstance(x, Fraction | int) else Fraction(int(flint.fmpq(x).p), int(flint.fmpq(x).q))
        high = float(exact)
        low = float(Fraction(exact) - Fraction(high))
        return Twofold(high, low, _ROUNDING * abs(high) if low else 0.0)
    return Twofold(x)


def _functions() -> Any:
    from tmsopt.arithmetic.twofold import functions

    return functions
