"""Fractions and balls, what they are made of, and as data that lasts: decimals with a radius, and roots of them.

A ball is an exact fraction (`flint.fmpq`), an interval with a middle and a radius (`flint.arb`), a power series of
these (`flint.arb_series`), a polynomial, or an array of numbers with bounds of their errors
(`rounding.Bounded`). A value that does not exist, or that the balls are too wide to tell, is a ball nan.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_UP, Context, Decimal
from fractions import Fraction
from itertools import count
from typing import Any

import flint

from tmsopt.algebra.rounding import Bounded

DIGITS = 60
_FARTHEST = 2**20  # exponent of two of a fraction made of a ball

GUARD = 5
"""Decimal digits written beyond those asked for."""


@dataclass(frozen=True)
class Number:
    """A real number known to lie within a radius of a decimal.

    Attributes:
        value: the decimal.
        radius: upper bound of the error, ``0`` where the decimal is exact.
    """

    value: str
    radius: str

    def __float__(self) -> float:
        return float(self.value)

    def contains(self, x: Any) -> bool:
        """Whether an exact number (a decimal in text, a Fraction) is within the radius."""
        return abs(Fraction(x) - Fraction(self.value)) <= Fraction(self.radius)


@dataclass(frozen=True)
class ProvedRoot:
    """A root with its exact multiplicity; a complex pair is two of these. A real root has the imaginary part 0."""

    re: Number
    im: Number
    multiplicity: int


def number(ball: Any, digits: int) -> Number:
    """A ball as a decimal with `digits` digits and a few more, or fewer where its radius says so."""
    if not ball.is_finite():
        return Number("nan", "inf")
    if ball == 0:
        return Number("0", "0")
    middle, radius, exponent = (int(x) for x in ball.mid_rad_10exp(digits + 2 * GUARD))
    drop = max(len(str(abs(middle))) - digits - GUARD, len(str(radius)) - 2, 0)
    unit = 10**drop
    kept = (middle + unit // 2) // unit
    radius += abs(middle - kept * unit)
    return Number(_decimal(kept, exponent + drop), _rounded_up(radius, exponent))


def fraction(value: Fraction, digits: int) -> Number:
    """An exact fraction as a decimal; one that ends is exact."""
    under = value.denominator
    if pow(10, under.bit_length(), under) == 0:
        places = next(n for n in count() if 10**n % under == 0)
        return Number(_decimal(int(value * 10**places), -places), "0")
    return number(flint.arb(rational(value)), digits)


def _decimal(middle: int, exponent: int) -> str:
    """middle · 10^exponent in plain digits, or with an exponent where these would be many."""
    exact, figures = Decimal(f"{middle}e{exponent}"), str(abs(middle))
    leading = exact.adjusted()
    if leading >= -6 and (exponent <= 0 or leading < 20):
        return f"{exact:f}"
    return f"{'-' * (middle < 0)}{figures[0]}.{figures[1:] or '0'}e{leading}"


def _rounded_up(radius: int, exponent: int) -> str:
    """radius · 10^exponent to two digits."""
    if radius == 0:
        return "0"
    upper = Context(prec=2, rounding=ROUND_UP).create_decimal(radius)
    return f"{'.'.join(map(str, upper.as_tuple().digits))}e{upper.adjusted() + exponent}"


def largest_radius(balls: Sequence[Any]) -> float:
    """Upper bound of the radii of balls."""
    return max((upper(ball.rad()) for ball in balls), default=0.0)


def upper(ball: Any) -> float:
    """A double that is not below a ball of a size that doubles have."""
    top = ball.upper()
    value = float(top)
    return value if flint.arb(value) >= top else value * (1 + 2**-51) + 5e-324


def lower(ball: Any) -> float:
    """A double that is not above a positive ball."""
    bottom = ball.lower()
    value = float(bottom)
    return value if flint.arb(value) <= bottom else value * (1 - 2**-51)


@dataclass(frozen=True)
class AngleByTangent:
    """An angle by its tangent, which is all that coefficients ask of it."""

    tangent: Any

    def tan(self) -> Any:
        """The tangent."""
        return self.tangent


def is_ball(x: Any) -> bool:
    """Whether x is a number of ball arithmetic, exact fractions and polynomials among them."""
    return isinstance(
        x, flint.fmpq | flint.arb | flint.arb_series | flint.fmpq_poly | flint.arb_poly | Bounded | AngleByTangent
    )


def exact(x: Any) -> Any:
    """A number as an exact fraction, a double as the binary number that it is; balls unchanged."""
    return flint.fmpq(*x.as_integer_ratio()) if hasattr(x, "as_integer_ratio") else x


def as_ball(x: Any) -> Any:
    """An exact fraction as a ball of the working precision; balls and series unchanged."""
    return flint.arb(x) if isinstance(x, flint.fmpq) else x


def rational(x: Any, digits: int = DIGITS) -> flint.fmpq:
    """A number as an exact fraction: floats and fractions unchanged, balls by their middle at `digits`.

    A middle that would have millions of bits, as exp(1e300) and its inverse, is a power of two far beyond doubles.
    """
    if isinstance(x, flint.fmpq):
        return x
    if isinstance(x, flint.arb):
        figures, exponent = map(int, x.mid().man_exp())
        if abs(exponent) <= _FARTHEST:
            return x.mid().fmpq()
        far = flint.fmpq(2) ** (_FARTHEST if exponent > 0 else -_FARTHEST)
        return far if figures > 0 else -far
    return flint.fmpq(*Fraction(x).as_integer_ratio())
