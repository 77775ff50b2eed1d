"""Patterns of polynomials with fractions for coefficients, decided by factorisation without rounding."""

from collections.abc import Sequence
from typing import Any

import flint

from tmsopt.design.proof.factors import Factored, roots_of

_MULTIPLE = {"EP4": (4, 1), "EP3": (3, 1), "2EP2": (2, 2), "CEP2": (2, 2), "EP2": (2, 1)}
"""Pattern → multiplicity of its roots and how many of them there are."""


def factored(coefficients: Sequence[Any]) -> Factored:
    """Square-free factors of a polynomial with fractions (descending), with exact multiplicities."""
    polynomial = flint.fmpq_poly(list(reversed(coefficients)))
    parts: list[tuple[Any, int]] = polynomial.factor()[1]  # irreducible, so that those of degree 1 are exact
    factors = []
    for part, multiplicity in parts:
        monic = part / part.leading_coefficient()
        factors.append(([flint.arb(c) for c in reversed(monic.coeffs())], int(multiplicity)))
    return Factored(tuple(factors))


def has(pattern: str, coefficients: Sequence[Any]) -> bool:
    """Whether a quartic with fractions has a pattern exactly.

    The multiple roots of 2EP2, CEP2 and the others are told apart by isolating them; for weave and resonance the even
    and the odd part of the polynomial have a root s² < 0 in common.
    """
    if coefficients[0] == 0:
        return False
    if pattern == "capsize":
        return bool(coefficients[4] == 0)
    if pattern in ("weave", "resonance"):
        return _on_axis(coefficients, twice=pattern == "resonance")
    if pattern not in _MULTIPLE:
        return False
    multiplicity, count = _MULTIPLE[pattern]
    roots = [z for f, m in factored(coefficients).factors if m == multiplicity for z in roots_of(f) or ()]
    real = pattern != "CEP2"
    return len(roots) == count and all(z.real == real for z in roots)


def _on_axis(coefficients: Sequence[Any], twice: bool) -> bool:
    a0, a1, a2, a3, a4 = coefficients
    even, odd = flint.fmpq_poly([a4, a2, a0]), flint.fmpq_poly([a3, a1])
    common = even if odd.is_zero() else even.gcd(odd)
    parts = [(part, m) for part, m in common.factor()[1] if not twice or (m == 2 and odd.is_zero())]
    monic = [[flint.arb(c) for c in reversed((p / p.leading_coefficient()).coeffs())] for p, _ in parts]
    return any(z.real and z.re < 0 for f in monic if len(f) > 1 for z in roots_of(f) or ())
