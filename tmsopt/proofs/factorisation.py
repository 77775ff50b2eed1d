"""Factorises polynomials and decides their roots, stability, heavy damping and patterns in ball arithmetic."""

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
class Factorisation:
    """A polynomial as a product of distinct factors: (factor, multiplicity) for each."""

    factors: tuple[tuple[Factor, int], ...]

    @cached_property
    def roots(self) -> tuple[EnclosedRoot, ...] | None:
        """All roots, rightmost first, with exact multiplicities; None if the balls of two roots overlap."""
        roots: list[EnclosedRoot] = []
        for factor, multiplicity in self.factors:
            own_roots = factor_roots(factor)
            if own_roots is None:
                return None
            roots += [replace(z, multiplicity=multiplicity * z.multiplicity) for z in own_roots]
        if any(a.re.overlaps(b.re) and a.im.overlaps(b.im) for k, a in enumerate(roots) for b in roots[k + 1 :]):
            return None
        return rightmost_first(roots)

    @cached_property
    def abscissa(self) -> Any:
        """The largest real part; None if a factor leaves it undecided."""
        return _choose_extreme(flint.arb.max, [_rightmost(factor) for factor, _ in self.factors])

    @cached_property
    def damping_ratio(self) -> Any:
        """The least −Re s/|s|; None if undecided."""
        return _choose_extreme(flint.arb.min, [_damping_ratio(z) for z in self.roots or ()])

    @cached_property
    def angular_frequency(self) -> Any:
        """The greatest imaginary part; None if the balls of two roots overlap."""
        return _choose_extreme(flint.arb.max, [z.im for z in self.roots or ()])

    @cached_property
    def stable(self) -> bool | None:
        """Whether all roots lie left of the imaginary axis, by Liénard–Chipart signs of each factor."""
        signs = (q for factor, _ in self.factors for q in lienard_chipart([flint.arb(c) for c in factor]))
        return _all_hold([True if q > 0 else False if q <= 0 else None for q in signs])

    @cached_property
    def heavily_damped(self) -> bool | None:
        """Whether all roots are real and negative; multiple roots are allowed."""
        if self.stable is False:
            return False
        root_lists = (factor_roots(factor) for factor, _ in self.factors)
        return _all_hold(
            [self.stable, *(None if roots is None else all(z.is_real for z in roots) for roots in root_lists)]
        )


def factor_pattern(pattern: Pattern, unknowns: Sequence[Any]) -> Factorisation:
    """The factorisation of a pattern for given unknowns."""
    return Factorisation(tuple(pattern.distinct_factors(unknowns)))


def abscissa_formula(pattern: Pattern, unknowns: Sequence[Any]) -> Any:
    """The largest real part of the roots of a pattern, from the factor with the rightmost root; nan if undecided."""
    formulas = [_abscissa_formula(factor) for factor, _ in factor_pattern(pattern, unknowns).factors]
    if any(f is None for f in formulas):
        return flint.arb("nan")
    return max(formulas, key=lambda f: float(_centre(f)))


def _abscissa_formula(factor: Factor) -> Any:
    """The largest real part of the roots of a factor, as a ball or a series; None if the balls of two roots overlap."""
    constants = [_centre(c) for c in factor]
    roots = factor_roots(constants)
    if roots is None:
        return None
    z = max(roots, key=lambda z: (float(z.re), -abs(float(z.im))))
    if not any(isinstance(c, flint.arb_series) for c in factor):
        return z.re
    # The root moves by −Σ δc_k s^(n−k)/p′(s), with s anywhere in its ball.
    s, n = flint.acb(z.re, z.im), len(factor) - 1
    slope = evaluate([(n - k) * c for k, c in enumerate(constants[:-1])], s)
    change = evaluate([c[1] if isinstance(c, flint.arb_series) else 0 for c in factor], s)
    return flint.arb_series([z.re, -(change / slope).real], prec=2)


def _rightmost(factor: Factor) -> Any:
    """The largest real part of the roots of a factor; a quadratic factor may have a discriminant of unknown sign."""
    if len(factor) == 3:
        b, c = flint.arb(factor[1]), flint.arb(factor[2])
        discriminant = b * b - 4 * c
        if not (discriminant > 0 or discriminant < 0):
            return (discriminant.nonnegative_part().sqrt() - b) / 2
    return _choose_extreme(flint.arb.max, [z.re for z in factor_roots(factor) or ()])


def _choose_extreme(choose: Callable[[Any, Any], Any], balls: Sequence[Any]) -> Any:
    """Choose the greatest or the least ball; None if the list is empty or has a None."""
    return reduce(choose, balls) if balls and None not in balls else None


def _damping_ratio(root: EnclosedRoot) -> Any:
    if root.is_real:
        return flint.arb(1) if root.re < 0 else flint.arb(-1) if root.re > 0 else None
    return -root.re / (root.re * root.re + root.im * root.im).sqrt()


def _all_hold(signs: Sequence[bool | None]) -> bool | None:
    return False if False in signs else None if None in signs else True


def _centre(value: Any) -> Any:
    return value[0] if isinstance(value, flint.arb_series) else flint.arb(value)


def factor_polynomial(coefficients: Sequence[Any]) -> Factorisation:
    """Factorise a polynomial with fractions (descending) into irreducible factors, with exact multiplicities."""
    polynomial = flint.fmpq_poly(list(reversed(coefficients)))
    parts: list[tuple[Any, int]] = polynomial.factor()[1]
    return Factorisation(tuple((_monic(part), int(multiplicity)) for part, multiplicity in parts))


def _monic(part: Any) -> Factor:
    return [flint.arb(c) for c in reversed((part / part.leading_coefficient()).coeffs())]


def has_pattern(pattern: str, coefficients: Sequence[Any]) -> bool:
    """Whether a polynomial with fractions has a pattern exactly; other multiple roots are allowed.

    Weave and resonance need a common root s² < 0 of the even and the odd part of the polynomial.
    """
    try:
        components = composition(pattern)
    except ValueError:  # the pattern ties roots on the rightmost line
        return False
    if coefficients[0] == 0:
        return False
    counts = _count_multiple_roots(coefficients)
    kinds = {kind for kind, _, _ in components}
    axis_patterns = {
        "capsize": coefficients[-1] == 0,
        "weave": _has_imaginary_pair(coefficients, 1),
        "resonance": _has_imaginary_pair(coefficients, 2),
    }
    if "CEP" in kinds and kinds & {"weave", "resonance"} and axis_patterns["resonance"]:
        return False  # a double pair on the axis must not count for both
    return all(axis_patterns.get(kind, counts[kind, order] == count) for kind, order, count in components)


def multiple_roots(coefficients: Sequence[Any]) -> str:
    """The pattern of all multiple roots of a polynomial with fractions, e.g. ``EP3+CEP2``, or empty."""
    if coefficients[0] == 0:
        return ""
    counts = sorted(_count_multiple_roots(coefficients).items(), key=lambda item: (item[0][0] != "EP", -item[0][1]))
    return "+".join(f"{count if count > 1 else ''}{kind}{order}" for (kind, order), count in counts)


def _count_multiple_roots(coefficients: Sequence[Any]) -> Counter[tuple[str, int]]:
    """Number of multiple real roots (EP) and complex pairs (CEP) of each multiplicity."""
    counts: Counter[tuple[str, int]] = Counter()
    for factor, multiplicity in factor_polynomial(coefficients).factors:
        for z in (factor_roots(factor) or ()) if multiplicity > 1 else ():
            if z.is_real or z.im > 0:
                counts["EP" if z.is_real else "CEP", multiplicity] += 1
    return counts


def _has_imaginary_pair(coefficients: Sequence[Any], order: int) -> bool:
    """Whether a pair of at least this multiplicity lies on the imaginary axis, 0 excluded."""
    even, odd = (flint.fmpq_poly([(-1) ** k * c for k, c in enumerate(coefficients[::-1][i::2])]) for i in (0, 1))
    common_factor = even if odd.is_zero() else even.gcd(odd)
    parts = [part for part, m in common_factor.factor()[1] if m >= order]
    return any(z.is_real and z.re > 0 for part in parts for z in factor_roots(_monic(part)) or ())
