"""Exact fractions and balls, and their storage as decimals with a radius.

A ball is an exact fraction (`flint.fmpq`), an interval with a midpoint and a radius (`flint.arb`), a power series of
these (`flint.arb_series`), a polynomial, or an array of numbers with error bounds (`rounding.Bounded`). The ball nan
stands for a value that does not exist, or whose existence cannot be decided because the balls are too wide.
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
"""Decimal digits of the working precision in most computations."""

_MAX_EXPONENT = 2**20  # largest power of 2 in a fraction that is made from the midpoint of a ball

GUARD_DIGITS = 5
"""Decimal digits written in addition to the requested ones."""


@dataclass(frozen=True)
class Number:
    """A real number that lies within a radius of a decimal.

    Attributes:
        value: the decimal.
        radius: upper bound of the error, ``0`` where the decimal is exact.
    """

    value: str
    radius: str

    def __float__(self) -> float:
        return float(self.value)

    def contains(self, x: Any) -> bool:
        """Whether an exact number (decimal text or a Fraction) lies within the radius."""
        return abs(Fraction(x) - Fraction(self.value)) <= Fraction(self.radius)


@dataclass(frozen=True)
class ProvedRoot:
    """A root with its exact multiplicity; a complex pair is two of these. The imaginary part of a real root is 0."""

    re: Number
    im: Number
    multiplicity: int


def number(ball: Any, digits: int) -> Number:
    """A ball as a decimal of `digits` + `GUARD_DIGITS` digits, or of fewer if the radius of the ball is large."""
    if not ball.is_finite():
        return Number("nan", "inf")
    if ball == 0:
        return Number("0", "0")
    middle, radius, exponent = (int(x) for x in ball.mid_rad_10exp(digits + 2 * GUARD_DIGITS))
    dropped_digits = max(len(str(abs(middle))) - digits - GUARD_DIGITS, len(str(radius)) - 2, 0)
    unit = 10**dropped_digits
    shortened = (middle + unit // 2) // unit
    radius += abs(middle - shortened * unit)
    return Number(_format_decimal(shortened, exponent + dropped_digits), _format_radius(radius, exponent))


def complex_ball(x: Any) -> Any:
    """A ball as a complex ball, a power series as a complex one."""
    return flint.acb_series(x) if isinstance(x, flint.arb_series | flint.acb_series) else flint.acb(x)


def fraction(value: Fraction, digits: int) -> Number:
    """An exact fraction as a decimal, with radius 0 if the decimal terminates."""
    denominator = value.denominator
    if pow(10, denominator.bit_length(), denominator) == 0:
        decimals = next(n for n in count() if 10**n % denominator == 0)
        return Number(_format_decimal(int(value * 10**decimals), -decimals), "0")
    return number(flint.arb(rational(value)), digits)


def _format_decimal(middle: int, exponent: int) -> str:
    """middle · 10^exponent in plain digits, or with an exponent if there would be many digits."""
    decimal, digits = Decimal(f"{middle}e{exponent}"), str(abs(middle))
    leading = decimal.adjusted()
    if leading >= -6 and (exponent <= 0 or leading < 20):
        return f"{decimal:f}"
    return f"{'-' * (middle < 0)}{digits[0]}.{digits[1:] or '0'}e{leading}"


def _format_radius(radius: int, exponent: int) -> str:
    """radius · 10^exponent, rounded up to two digits."""
    if radius == 0:
        return "0"
    rounded_up = Context(prec=2, rounding=ROUND_UP).create_decimal(radius)
    return f"{'.'.join(map(str, rounded_up.as_tuple().digits))}e{rounded_up.adjusted() + exponent}"


def largest_radius(balls: Sequence[Any]) -> float:
    """Upper bound of the radii of balls."""
    return max((upper_bound(ball.rad()) for ball in balls), default=0.0)


def upper_bound(ball: Any) -> float:
    """A double that is at least every number of a ball; the ball must be within the range of doubles."""
    top = ball.upper()
    value = float(top)
    return value if flint.arb(value) >= top else value * (1 + 2**-51) + 5e-324


def lower_bound(ball: Any) -> float:
    """A double that is at most every number of a positive ball."""
    bottom = ball.lower()
    value = float(bottom)
    return value if flint.arb(value) <= bottom else value * (1 - 2**-51)


@dataclass(frozen=True)
class Tilt:
    """An angle given by its tangent. The coefficients use no other function of the angle."""

    tangent: Any

    def tan(self) -> Any:
        """The tangent."""
        return self.tangent


def is_ball(x: Any) -> bool:
    """Whether x is a number of ball arithmetic; exact fractions and polynomials are such numbers too."""
    return isinstance(x, flint.fmpq | flint.arb | flint.arb_series | flint.fmpq_poly | flint.arb_poly | Bounded | Tilt)


def exact(x: Any) -> Any:
    """A number as an exact fraction (a double by its binary value); balls unchanged."""
    return flint.fmpq(*x.as_integer_ratio()) if hasattr(x, "as_integer_ratio") else x


def as_ball(x: Any) -> Any:
    """An exact fraction as a ball of the working precision; balls and series unchanged."""
    return flint.arb(x) if isinstance(x, flint.fmpq) else x


def rational(x: Any) -> flint.fmpq:
    """A number as an exact fraction: floats and fractions by their value, balls by their midpoint.

    A midpoint that would need millions of bits, such as exp(1e300) or its inverse, becomes a power of two far outside
    the range of doubles.
    """
    if isinstance(x, flint.fmpq):
        return x
    if isinstance(x, flint.arb):
        mantissa, exponent = map(int, x.mid().man_exp())
        if abs(exponent) <= _MAX_EXPONENT:
            return x.mid().fmpq()
        size = flint.fmpq(2) ** (_MAX_EXPONENT if exponent > 0 else -_MAX_EXPONENT)
        return size if mantissa > 0 else -size
    return flint.fmpq(*Fraction(x).as_integer_ratio())
