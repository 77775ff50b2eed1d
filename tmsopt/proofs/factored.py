"""A polynomial as a product of factors in balls: its roots, and whether it is stable and heavily damped."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import flint

from tmsopt.roots import Pattern, evaluate, lienard_chipart
from tmsopt.roots.patterns.enclosed import Enclosed

Factor = Sequence[Any]
"""Monic coefficients, descending."""


@dataclass(frozen=True)
class Factored:
    """Different factors, each with how often it occurs."""

    factors: tuple[tuple[Factor, int], ...]

    @cached_property
    def roots(self) -> tuple[Enclosed, ...] | None:
        """All roots, rightmost first, with exact multiplicities; None where the balls cannot tell two apart."""
        found: list[Enclosed] = []
        for factor, multiplicity in self.factors:
            own = roots_of(factor)
            if own is None:
                return None
            found += [Enclosed(z.re, z.im, multiplicity) for z in own]
        if any(a.re.overlaps(b.re) and a.im.overlaps(b.im) for k, a in enumerate(found) for b in found[k + 1 :]):
            return None
        return tuple(sorted(found, key=lambda z: (-float(z.re), -float(z.im))))

    @cached_property
    def abscissa(self) -> Any:
        """The largest real part; None where no factor tells."""
        tops = [_rightmost(factor) for factor, _ in self.factors]
        return None if any(top is None for top in tops) else reduce(lambda a, b: a.max(b), tops)

    @cached_property
    def damping_ratio(self) -> Any:
        """The least −Re s/|s|; None where the balls cannot tell."""
        ratios = [_ratio(z) for z in self.roots or ()] or [None]
        return None if any(ratio is None for ratio in ratios) else reduce(lambda a, b: a.min(b), ratios)

    @cached_property
    def angular_frequency(self) -> Any:
        """The greatest imaginary part; None where the balls cannot tell the roots apart."""
        return reduce(lambda a, b: a.max(b), [z.im for z in self.roots]) if self.roots else None

    @cached_property
    def stable(self) -> bool | None:
        """Whether all roots are left of the imaginary axis: Liénard–Chipart signs of each factor."""
        signs = [_all_positive(lienard_chipart([flint.arb(c) for c in factor])) for factor, _ in self.factors]
        return _every(signs)

    @cached_property
    def heavily_damped(self) -> bool | None:
        """Whether all roots are real and negative, multiple ones included."""
        if self.stable is False:
            return False
        signs: list[bool | None] = []
        for factor, _ in self.factors:
            own = roots_of(factor)
            signs.append(None if own is None else all(z.real for z in own))
        return _every([self.stable, *signs])


def of_pattern(pattern: Pattern, unknowns: Sequence[Any]) -> Factored:
    """The factors of a pattern, equal ones counted."""
    return Factored(tuple(pattern.counted(unknowns)))


def abscissa_formula(pattern: Pattern, unknowns: Sequence[Any]) -> Any:
    """Largest real part as a formula of one factor, the one whose root is rightmost in the middles; nan for none."""
    formulas = [_formula(factor) for factor, _ in of_pattern(pattern, unknowns).factors]
    told = all(f is not None for f in formulas)
    return max(formulas, key=lambda f: float(_constant(f))) if told else flint.arb("nan")


def _formula(factor: Factor) -> Any:
    """The largest real part of the roots of a factor, balls or series; None where they cannot be told apart."""
    if len(factor) == 2:
        return -factor[1]
    if len(factor) == 3:
        _, b, c = factor
        discriminant = b * b - 4 * c
        return (discriminant.sqrt() - b) / 2 if _constant(discriminant) > 0 else -b / 2 + 0 * c
    constants = [_constant(c) for c in factor]
    own = roots_of(constants)
    if own is None:
        return None
    z = max(own, key=lambda z: float(z.re))
    if not any(isinstance(c, flint.arb_series) for c in factor):
        return z.re
    # The root moves by −Σ δc_k s^(n−k)/p′(s), with s anywhere in its ball.
    s, n = flint.acb(z.re, z.im), len(factor) - 1
    slope = evaluate([(n - k) * c for k, c in enumerate(constants[:-1])], s)
    change = evaluate([c[1] if isinstance(c, flint.arb_series) else 0 for c in factor], s)
    return flint.arb_series([z.re, -(change / slope).real], prec=2)


def roots_of(factor: Factor) -> list[Enclosed] | None:
    """Roots of a factor that are certainly simple; None where the balls cannot tell."""
    nothing = flint.arb(0)
    match [flint.arb(c) for c in factor]:
        case [_, c]:
            return [Enclosed(-c, nothing)]
        case [_, b, c]:
            discriminant = b * b - 4 * c
            if discriminant > 0:
                width = discriminant.sqrt()
                far = (-b - width) / 2 if b > 0 else (width - b) / 2
                return [Enclosed(far, nothing), Enclosed(-b - far if far.contains(0) else c / far, nothing)]
            if discriminant < 0:
                height = (-discriminant).sqrt() / 2
                return [Enclosed(-b / 2, height), Enclosed(-b / 2, -height)]
            return None
        case balls:
            return _isolated(balls)


def _isolated(coefficients: Sequence[Any]) -> list[Enclosed] | None:
    """Simple roots of a polynomial of any degree, isolated; None where that fails.

    A ball that touches the real axis holds a real root if its mirror image meets no other ball: the conjugate of
    its root is then in it too, and it holds one root only.
    """
    polynomial: Any = flint.acb_poly([flint.acb(c) for c in reversed(coefficients)])
    balls = _balls(polynomial, flint.arb(10) ** (-3 * flint.ctx.dps // 4)) or _balls(polynomial, None)
    if balls is None:
        return None
    found = []
    for k, z in enumerate(balls):
        if not z.imag.contains(0):
            found.append(Enclosed(z.real, z.imag))
        elif any(z.conjugate().overlaps(w) for j, w in enumerate(balls) if j != k):
            return None
        else:
            found.append(Enclosed(z.real, flint.arb(0)))
    return found if len(found) == len(coefficients) - 1 else None


def _balls(polynomial: Any, tolerance: Any) -> list[Any] | None:
    try:
        found: list[Any] = polynomial.roots(tolerance)
    except (ValueError, ZeroDivisionError):
        return None
    return found


def _rightmost(factor: Factor) -> Any:
    """Largest real part of the roots of a factor; of a quadratic one whatever the sign of its discriminant."""
    if len(factor) == 3:
        b, c = flint.arb(factor[1]), flint.arb(factor[2])
        discriminant = b * b - 4 * c
        if not (discriminant > 0 or discriminant < 0):
            return (discriminant.nonnegative_part().sqrt() - b) / 2
    own = roots_of(factor)
    if own is None:
        return None
    return reduce(lambda a, b: a.max(b), (z.re for z in own))


def _ratio(root: Enclosed) -> Any:
    if root.real:
        return flint.arb(1) if root.re < 0 else flint.arb(-1) if root.re > 0 else None
    return -root.re / (root.re * root.re + root.im * root.im).sqrt()


def _all_positive(quantities: Iterable[Any]) -> bool | None:
    return _every([True if q > 0 else False if q <= 0 else None for q in quantities])


def _every(signs: Sequence[bool | None]) -> bool | None:
    if any(sign is False for sign in signs):
        return False
    return None if any(sign is None for sign in signs) else True


def _constant(value: Any) -> Any:
    return value[0] if isinstance(value, flint.arb_series) else flint.arb(value)
