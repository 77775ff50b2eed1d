"""A polynomial as a product of factors in balls: its roots, whether it is stable, heavily damped, or has a pattern."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any

import flint

from tmsopt.roots import Pattern, composition, evaluate, lienard_chipart
from tmsopt.roots.patterns.root_enclosures import EnclosedRoot, factor_roots
from tmsopt.roots.polynomial import rightmost_first

Factor = Sequence[Any]
"""Monic coefficients, descending."""


@dataclass(frozen=True)
class Factored:
    """Different factors, each with how often it occurs."""

    factors: tuple[tuple[Factor, int], ...]

    @cached_property
    def roots(self) -> tuple[EnclosedRoot, ...] | None:
        """All roots, rightmost first, with exact multiplicities; None where the balls cannot tell two apart."""
        found: list[EnclosedRoot] = []
        for factor, multiplicity in self.factors:
            own = factor_roots(factor)
            if own is None:
                return None
            found += [replace(z, multiplicity=multiplicity * z.multiplicity) for z in own]
        if any(a.re.overlaps(b.re) and a.im.overlaps(b.im) for k, a in enumerate(found) for b in found[k + 1 :]):
            return None
        return rightmost_first(found)

    @cached_property
    def abscissa(self) -> Any:
        """The largest real part; None where no factor tells."""
        return _extreme(flint.arb.max, [_rightmost(factor) for factor, _ in self.factors])

    @cached_property
    def damping_ratio(self) -> Any:
        """The least −Re s/|s|; None where the balls cannot tell."""
        return _extreme(flint.arb.min, [_ratio(z) for z in self.roots or ()])

    @cached_property
    def angular_frequency(self) -> Any:
        """The greatest imaginary part; None where the balls cannot tell the roots apart."""
        return _extreme(flint.arb.max, [z.im for z in self.roots or ()])

    @cached_property
    def stable(self) -> bool | None:
        """Whether all roots are left of the imaginary axis: Liénard–Chipart signs of each factor."""
        signs = (q for factor, _ in self.factors for q in lienard_chipart([flint.arb(c) for c in factor]))
        return _every([True if q > 0 else False if q <= 0 else None for q in signs])

    @cached_property
    def heavily_damped(self) -> bool | None:
        """Whether all roots are real and negative, multiple ones included."""
        if self.stable is False:
            return False
        each = (factor_roots(factor) for factor, _ in self.factors)
        return _every([self.stable, *(None if own is None else all(z.real for z in own) for own in each)])


def of_pattern(pattern: Pattern, unknowns: Sequence[Any]) -> Factored:
    """The factors of a pattern, equal ones counted."""
    return Factored(tuple(pattern.distinct_factors(unknowns)))


def abscissa_formula(pattern: Pattern, unknowns: Sequence[Any]) -> Any:
    """Largest real part as a formula of one factor, the one whose root is rightmost in the middles; nan for none."""
    formulas = [_formula(factor) for factor, _ in of_pattern(pattern, unknowns).factors]
    told = all(f is not None for f in formulas)
    return max(formulas, key=lambda f: float(_constant(f))) if told else flint.arb("nan")


def _formula(factor: Factor) -> Any:
    """The largest real part of the roots of a factor, balls or series; None where they cannot be told apart."""
    constants = [_constant(c) for c in factor]
    own = factor_roots(constants)
    if own is None:
        return None
    z = max(own, key=lambda z: (float(z.re), -abs(float(z.im))))
    if not any(isinstance(c, flint.arb_series) for c in factor):
        return z.re
    # The root moves by −Σ δc_k s^(n−k)/p′(s), with s anywhere in its ball.
    s, n = flint.acb(z.re, z.im), len(factor) - 1
    slope = evaluate([(n - k) * c for k, c in enumerate(constants[:-1])], s)
    change = evaluate([c[1] if isinstance(c, flint.arb_series) else 0 for c in factor], s)
    return flint.arb_series([z.re, -(change / slope).real], prec=2)


def _rightmost(factor: Factor) -> Any:
    """Largest real part of the roots of a factor; of a quadratic one whatever the sign of its discriminant."""
    if len(factor) == 3:
        b, c = flint.arb(factor[1]), flint.arb(factor[2])
        discriminant = b * b - 4 * c
        if not (discriminant > 0 or discriminant < 0):
            return (discriminant.nonnegative_part().sqrt() - b) / 2
    return _extreme(flint.arb.max, [z.re for z in factor_roots(factor) or ()])


def _extreme(which: Callable[[Any, Any], Any], balls: Sequence[Any]) -> Any:
    """The greatest or the least ball; None for none, or where one is not known."""
    return reduce(which, balls) if balls and None not in balls else None


def _ratio(root: EnclosedRoot) -> Any:
    if root.real:
        return flint.arb(1) if root.re < 0 else flint.arb(-1) if root.re > 0 else None
    return -root.re / (root.re * root.re + root.im * root.im).sqrt()


def _every(signs: Sequence[bool | None]) -> bool | None:
    if any(sign is False for sign in signs):
        return False
    return None if any(sign is None for sign in signs) else True


def _constant(value: Any) -> Any:
    return value[0] if isinstance(value, flint.arb_series) else flint.arb(value)


def factored(coefficients: Sequence[Any]) -> Factored:
    """Square-free factors of a polynomial with fractions (descending), with exact multiplicities."""
    polynomial = flint.fmpq_poly(list(reversed(coefficients)))
    parts: list[tuple[Any, int]] = polynomial.factor()[1]  # irreducible, so that those of degree 1 are exact
    return Factored(tuple((_monic(part), int(multiplicity)) for part, multiplicity in parts))


def _monic(part: Any) -> Factor:
    return [flint.arb(c) for c in reversed((part / part.leading_coefficient()).coeffs())]


def has_pattern(pattern: str, coefficients: Sequence[Any]) -> bool:
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
    held = {
        "capsize": coefficients[-1] == 0,
        "weave": _on_axis(coefficients, 1),
        "resonance": _on_axis(coefficients, 2),
    }
    if "CEP" in kinds and kinds & {"weave", "resonance"} and held["resonance"]:
        return False  # one double pair on the axis might count for both
    return all(held.get(kind, found[kind, order] == count) for kind, order, count in wanted)


def multiple_roots(coefficients: Sequence[Any]) -> str:
    """Name of the pattern of all multiple roots of a polynomial with fractions, such as ``EP3+CEP2``; or empty."""
    if coefficients[0] == 0:
        return ""
    found = sorted(_multiple(coefficients).items(), key=lambda item: (item[0][0] != "EP", -item[0][1]))
    return "+".join(f"{count if count > 1 else ''}{kind}{order}" for (kind, order), count in found)


def _multiple(coefficients: Sequence[Any]) -> Counter[tuple[str, int]]:
    """How many multiple real roots and complex pairs there are of each multiplicity."""
    found: Counter[tuple[str, int]] = Counter()
    for factor, multiplicity in factored(coefficients).factors:
        for z in (factor_roots(factor) or ()) if multiplicity > 1 else ():
            if z.real or z.im > 0:
                found["EP" if z.real else "CEP", multiplicity] += 1
    return found


def _on_axis(coefficients: Sequence[Any], order: int) -> bool:
    """Whether there is a pair on the imaginary axis, so often or more."""
    even, odd = (flint.fmpq_poly([(-1) ** k * c for k, c in enumerate(coefficients[::-1][i::2])]) for i in (0, 1))
    common = even if odd.is_zero() else even.gcd(odd)
    parts = [part for part, m in common.factor()[1] if m >= order]
    return any(z.real and z.re > 0 for part in parts for z in factor_roots(_monic(part)) or ())
