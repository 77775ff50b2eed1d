"""Roots of polynomials with rational coefficients to any number of digits, with exact multiplicities."""

import math
from collections.abc import Sequence
from typing import Any

import flint

from tmsopt.algebra.balls import DIGITS, rational
from tmsopt.roots.polynomial import Root, rightmost_first


def exact_roots(coefficients: Sequence[Any], digits: int = DIGITS) -> tuple[Root, ...]:
    """Roots of a polynomial with rational coefficients (descending), rightmost first.

    The square-free factorisation gives the multiplicities. Ball arithmetic (intervals with a midpoint and a radius)
    isolates the roots to `digits`. The results are rounded to double precision.

    Example:
        >>> [(s.re, s.im, s.multiplicity) for s in tmsopt.roots.exact_roots([1, 2, 2, 2, 1])]  # (s + 1)² (s² + 1)
        [(0.0, 1.0, 1), (0.0, -1.0, 1), (-1.0, 0.0, 2)]

    More: docs/explanation/factors.md
    """
    with flint.ctx.workdps(digits):
        return rightmost_first(Root(float(z.real), float(z.imag), m) for z, m in isolated_roots(coefficients))


def isolated_roots(coefficients: Sequence[Any]) -> list[tuple[Any, int]]:
    """The distinct roots as balls (complex intervals) of the working precision, each with its multiplicity."""
    terms = [rational(c) for c in coefficients]
    common = math.lcm(*(int(term.q) for term in terms))
    polynomial: Any = flint.fmpz_poly([int(t * common) for t in reversed(terms)])
    return [(z, int(m)) for z, m in polynomial.complex_roots()]


def exact_abscissa(coefficients: Sequence[Any]) -> float:
    """Largest real part of the roots, correct to double precision even near an exceptional point.

    Example:
        >>> tmsopt.roots.exact_abscissa([1, 12, 66, 220, 495, 792, 924, 792, 495, 220, 66, 12, 1])  # (s + 1)¹²
        -1.0

    More: docs/explanation/factors.md
    """
    return exact_roots(coefficients)[0].re
