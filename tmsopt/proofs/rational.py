"""Patterns of polynomials with fractions for coefficients, decided by factorisation without rounding."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import flint

from tmsopt.proofs.factored import Factored, roots_of
from tmsopt.roots import composition


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
    """Whether a polynomial with fractions has a pattern exactly, beside roots of other multiplicities.

    Multiple roots are told apart by isolating them; for weave and resonance the even and the odd part of the polynomial
    have a root s² < 0 in common.
    """
    try:
        wanted = composition(pattern)
    except ValueError:  # a tie of the rightmost line
        return False
    if coefficients[0] == 0:
        return False
    found = _multiple(coefficients)
    kinds = {kind for kind, _, _ in wanted}
    if "CEP" in kinds and kinds & {"weave", "resonance"} and _on_axis(coefficients, twice=True):
        return False  # one double pair on the axis might count for both
    return all(_has(kind, order, count, coefficients, found) for kind, order, count in wanted)


def multiple(coefficients: Sequence[Any]) -> str:
    """Name of the pattern of all multiple roots of a polynomial with fractions, such as ``EP3+CEP2``; or empty."""
    if coefficients[0] == 0:
        return ""
    found = sorted(_multiple(coefficients).items(), key=lambda item: (item[0][0] != "EP", -item[0][1]))
    return "+".join(f"{count if count > 1 else ''}{kind}{order}" for (kind, order), count in found)


def _has(kind: str, order: int, count: int, coefficients: Sequence[Any], found: Mapping[tuple[str, int], int]) -> bool:
    if kind == "capsize":
        return bool(coefficients[-1] == 0)
    if kind in ("weave", "resonance"):
        return _on_axis(coefficients, twice=kind == "resonance")
    return found.get((kind, order), 0) == count


def _multiple(coefficients: Sequence[Any]) -> Counter[tuple[str, int]]:
    """How many multiple real roots and complex pairs there are of each multiplicity."""
    found: Counter[tuple[str, int]] = Counter()
    for factor, multiplicity in factored(coefficients).factors:
        for z in (roots_of(factor) or ()) if multiplicity > 1 else ():
            if z.real or z.im > 0:
                found["EP" if z.real else "CEP", multiplicity] += 1
    return found


def _on_axis(coefficients: Sequence[Any], twice: bool) -> bool:
    even, odd = (flint.fmpq_poly([(-1) ** k * c for k, c in enumerate(coefficients[::-1][i::2])]) for i in (0, 1))
    common = even if odd.is_zero() else even.gcd(odd)
    parts = [(part, m) for part, m in common.factor()[1] if not twice or m >= 2]
    monic = [[flint.arb(c) for c in reversed((p / p.leading_coefficient()).coeffs())] for p, _ in parts]
    return any(z.real and z.re > 0 for f in monic if len(f) > 1 for z in roots_of(f) or ())
