"""Roots of polynomials with rational coefficients, to any number of digits, multiplicities exact."""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import flint

from tmsopt.roots.patterns.structure import Root

DIGITS = 60


def rational(x: Any, digits: int = DIGITS) -> flint.fmpq:
    """A number as an exact fraction: floats and fractions unchanged, balls by their middle at `digits`."""
    if isinstance(x, flint.fmpq):
        return x
    if isinstance(x, flint.arb):
        mantissa, exponent = x.mid().man_exp()
        return flint.fmpq(mantissa) * flint.fmpq(2) ** int(exponent)
    ratio = Fraction(x)
    return flint.fmpq(ratio.numerator, ratio.denominator)


def exact_roots(coefficients: Sequence[Any], digits: int = DIGITS) -> tuple[Root, ...]:
    """Isolated roots of a polynomial with rational coefficients (descending), rightmost first.

    The square-free factorisation decides multiplicities, ball arithmetic isolates the roots to `digits`; the
    values returned are those rounded to double precision.
    """
    terms = [rational(c) for c in coefficients]
    common = flint.fmpz(1)
    for term in terms:
        common = common.lcm(term.q)
    with flint.ctx.workdps(digits):
        polynomial = flint.fmpz_poly([int(t.p * (common // t.q)) for t in reversed(terms)])
        isolated: Any = polynomial.complex_roots()  # pairs (ball, multiplicity)
        found = [Root(float(z.real.mid()), float(z.imag.mid()), int(m)) for z, m in isolated]
    return tuple(sorted(found, key=lambda r: (-r.re, -r.im)))


def exact_abscissa(coefficients: Sequence[Any]) -> float:
    """Largest real part of the roots, correct to double precision even beside an exceptional point."""
    return exact_roots(coefficients)[0].re
