"""Sums of two doubles by error-free transformations (Dekker, Numer. Math. 18, 224, 1971), with running error bounds."""

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from typing import Any

import flint
import numpy as np

from tmsopt.records import Array, Truth

_ROUNDING = 2.0**-101
"""Of the size of the operands: a sum errs by 4, a product by 8, a quotient by 20 units of 2^-106."""

_LEAST = 1e-290  # of a product: below it the rounding of a product may itself be rounded
_SPLIT = 2.0**27 + 1
_BITS = 160
_PARTS = 16  # of π, between which sine and cosine are tabulated
_FARTHEST = 1e4  # argument of a sine; beyond it the bound on the error is lost
_TRUNCATED = 1e-27  # relative: the fourth terms and those after them are doubles, 2.4e-13 of the sum at most
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

    def chosen(self, sign: int, a: Any, b: Any) -> "Twofold":
        """Of a difference a − b: a where it has the sign, else b; as far off as the other where that is not certain."""
        found = twofold(a).where(sign * self.high >= 0, twofold(b))
        either = ~(np.abs(self.high) > 2 * self.off)  # nor where there is no difference
        return Twofold(found.high, found.low, found.off + np.where(either, np.abs(self.high) + self.off, 0.0))

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
        return self.__add__(-twofold(other))

    def __rsub__(self, other: Any) -> "Twofold":
        return (-self).__add__(other)

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
        return twofold(other).__truediv__(self)

    def __pow__(self, power: Any) -> Any:
        if power == Fraction(1, 2):
            return self.sqrt()
        if int(power) != power:
            return NotImplemented
        found, square, left = twofold(1.0), self, abs(int(power))
        while left:
            found = found * square if left & 1 else found
            square, left = square * square, left >> 1
        return found if power > 0 else 1 / found

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
        return _sine_cosine(self)[0]

    def cos(self) -> "Twofold":
        """Cosine."""
        return _sine_cosine(self)[1]

    def tan(self) -> "Twofold":
        """Tangent."""
        sine, cosine = _sine_cosine(self)
        return sine / cosine

    def __getattr__(self, name: str) -> Any:
        if name in ("asin", "acos", "atan", "exp", "log"):
            return lambda: _by_balls(name, self)
        raise AttributeError(name)


def twofold(x: Any) -> Twofold:
    """A number or an array of doubles, an exact fraction or a ball, as such numbers."""
    if isinstance(x, Twofold):
        return x
    if isinstance(x, flint.arb):
        return Twofold(*_split(x))
    if isinstance(x, flint.fmpq | flint.fmpz | Fraction | int) and not isinstance(x, bool):
        exact = x if isinstance(x, Fraction | int) else Fraction(int(flint.fmpq(x).p), int(flint.fmpq(x).q))
        high = float(exact)
        low = float(Fraction(exact) - Fraction(high))
        return Twofold(high, low, _ROUNDING * abs(high) if low else 0.0)
    return Twofold(x)


def of_balls(balls: Sequence[Any]) -> Twofold:
    """Balls, or doubles among them, as an array of such numbers."""
    return Twofold(*np.array([(x, 0.0, 0.0) if isinstance(x, float) else _split(x) for x in balls]).T)


def _sine_cosine(x: Twofold) -> tuple[Twofold, Twofold]:
    """Sine and cosine: by tables at the nearest sixteenth of π, and power series of what is left."""
    step, sines, cosines = _tables()
    near = np.abs(x.high) < _FARTHEST
    turns = np.rint(np.where(near, x.high, 0.0) * (_PARTS / np.pi))[()]
    place = turns.astype(np.int64) % (2 * _PARTS)
    t = x - step * turns
    square = t * t
    u = square.high
    last = u * u * u * u
    tail = last * (1 / 362880 - u * (1 / 39916800 - u * (1 / 6227020800 - u / 1307674368000)))
    sine = t + t * (square * (square * (square * _SERIES[7] + _SERIES[5]) + _SERIES[3]) + tail)
    tail = last * (1 / 40320 - u * (1 / 3628800 - u * (1 / 479001600 - u / 87178291200)))
    cosine = square * (square * (square * _SERIES[6] + _SERIES[4]) + _SERIES[2]) + tail + 1
    at, along = sines[place], cosines[place]
    lost = np.where(near, _TRUNCATED, np.inf)[()]
    found = [(at * cosine + along * sine, at), (along * cosine - at * sine, along)]
    one, other = (Twofold(f.high, f.low, f.off + lost * (abs(of.high) + abs(sine.high))) for f, of in found)
    return one, other


def _by_balls(name: str, x: Twofold) -> Twofold:
    """A function of each number by ball arithmetic, one after the other."""
    high, low, off = (np.asarray(a, dtype=float) for a in np.broadcast_arrays(x.high, x.low, x.off))
    found = np.empty((3, high.size))
    with flint.ctx.workprec(_BITS):
        for k, (h, rest, r) in enumerate(zip(high.ravel(), low.ravel(), off.ravel(), strict=True)):
            found[:, k] = _split(getattr(flint.arb(float(h)) + flint.arb(float(rest), float(r)), name)())
    return Twofold(*(part.reshape(high.shape)[()] for part in found))


def _split(ball: Any) -> tuple[float, float, float]:
    if not ball.is_finite():
        return np.nan, np.nan, np.inf
    high = float(ball.mid())
    rest = ball - flint.arb(high)
    low = float(rest.mid())
    return high, low, float((rest - flint.arb(low)).abs_upper())


@cache
def _tables() -> tuple[Twofold, Twofold, Twofold]:
    """π/16, and sine and cosine of its multiples."""
    with flint.ctx.workprec(_BITS):
        step = flint.arb.pi() / _PARTS
        angles = [step * k for k in range(2 * _PARTS)]
        return Twofold(*_split(step)), of_balls([a.sin() for a in angles]), of_balls([a.cos() for a in angles])


def _inverse_factorials() -> dict[int, Twofold]:
    found, product = {}, 1
    for k in range(2, 8):
        product *= k
        found[k] = twofold(flint.fmpq((-1) ** (k // 2), product))
    return found


_SERIES: dict[int, Twofold] = _inverse_factorials()
