"""Roots of polynomials with rational coefficients, to any number of digits, multiplicities exact."""

from collections.abc import Sequence
from typing import Any

import flint

from tmsopt.arithmetic.elementary import DIGITS, rational
from tmsopt.roots.polynomial import Root


def exact_roots(coefficients: Sequence[Any], digits: int = DIGITS) -> tuple[Root, ...]:
    """Isolated roots of a polynomial with rational coefficients (descending), rightmost first.

    The square-free factorisation decides multiplicities, ball arithmetic isolates the roots to `digits`; the
    values returned are those rounded to double precision.
    """
    with flint.ctx.workdps(digits):
        found = [Root(float(z.real.mid()), float(z.imag.mid()), m) for z, m in isolated_roots(coefficients)]
    return tuple(sorted(found, key=lambda r: (-r.re, -r.im)))


def isolated_roots(coefficients: Sequence[Any]) -> list[tuple[Any, int]]:
    """The distinct ones as balls of the working precision, each with its multiplicity."""
    terms = [rational(c) for c in coefficients]
    common = flint.fmpz(1)
    for term in terms:
        common = common.lcm(term.q)
    polynomial: Any = flint.fmpz_poly([int(t.p * (common // t.q)) for t in reversed(terms)])
    return [(z, int(m)) for z, m in polynomial.complex_roots()]


def exact_abscissa(coefficients: Sequence[Any]) -> float:
    """Largest real part of the roots, correct to double precision even beside an exceptional point."""
    return exact_roots(coefficients)[0].re
