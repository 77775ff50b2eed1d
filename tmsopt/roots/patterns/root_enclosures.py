"""Encloses the roots of a polynomial, and of the nearest polynomial with a structure.

Coefficients and roots are balls: intervals with a midpoint and a radius. `flint.ctx` sets the precision.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_HALF_EVEN, Context, Decimal
from itertools import combinations
from typing import Any

import flint

from tmsopt.algebra.balls import as_ball, rational
from tmsopt.algebra.krawczyk import jacobian
from tmsopt.roots.exact import isolated_roots
from tmsopt.roots.patterns.naming import find_shape
from tmsopt.roots.patterns.shape import Shape
from tmsopt.roots.polynomial import Root, evaluate, product, rightmost_first

_MAX_STEPS = 80  # Gauss–Newton steps
_MAX_SIZE_RATIO = 1000  # a root smaller than the median root divided by this counts as that size in sizes of terms
_LOST_BITS = 7.5  # bits that the normal equations lose, for each root
_TRUSTED_DIVISOR = 2  # half of the bits of a converged fit are trusted


@dataclass(frozen=True)
class EnclosedRoot:
    """Balls around a root, with its multiplicity. The imaginary part of a real root is exactly 0."""

    re: Any
    im: Any
    multiplicity: int = 1

    @property
    def is_real(self) -> bool:
        """Whether the root is proved to be real."""
        return bool(self.im == 0)

    @property
    def modulus(self) -> Any:
        """Ball of |s|."""
        return abs(self.re) if self.im == 0 else (self.re * self.re + self.im * self.im).sqrt()


def enclosed_roots(coefficients: Sequence[Any]) -> tuple[EnclosedRoot, ...] | None:
    """Enclose every root of a real polynomial, rightmost first; None if the balls are too wide to decide.

    First the roots z of the polynomial of the midpoints are isolated. The disc of radius n |p(z)/p′(z)| around z then
    contains a root of every p in the balls (Laguerre), exactly one if the discs are disjoint, and a real one if z is
    real. Multiple roots are found only at 0 and for exact coefficients.

    Args:
        coefficients: descending, as balls or exact fractions.
    """
    terms = [flint.arb(as_ball(c)) for c in coefficients]
    if not all(t.is_finite() for t in terms):
        return None
    zero_count = 0
    while terms and terms[-1] == 0:
        terms.pop()
        zero_count += 1
    while terms and terms[0] == 0:
        terms.pop(0)
    roots = [EnclosedRoot(flint.arb(0), flint.arb(0), zero_count)] if zero_count else []
    degree = len(terms) - 1
    if degree > 0:
        slope = [(degree - k) * c for k, c in enumerate(terms[:-1])]
        for z, multiplicity in isolated_roots(terms):
            if multiplicity > 1:
                if not all(t.is_exact() for t in terms):
                    return None
                roots.append(EnclosedRoot(z.real, z.imag, multiplicity))
                continue
            middle = z.real.mid() if z.imag == 0 else flint.acb(z.real.mid(), z.imag.mid())
            radius = (degree * abs(evaluate(terms, middle) / evaluate(slope, middle))).upper()
            ball = flint.arb(0, radius)
            roots.append(EnclosedRoot(z.real.mid() + ball, flint.arb(0) if z.imag == 0 else z.imag.mid() + ball))
    balls = [flint.acb(root.re, root.im) for root in roots]
    if not all(a.is_finite() for a in balls) or any(a.overlaps(b) for a, b in combinations(balls, 2)):
        return None
    return rightmost_first(roots)


def factor_roots(factor: Sequence[Any]) -> Sequence[EnclosedRoot] | None:
    """Enclose the roots of a factor; None if the balls are too wide. Imaginary pairs have the real part 0 exactly."""
    if len(factor) != 3:
        return enclosed_roots(factor)
    b, c = map(flint.arb, factor[1:])
    zero, discriminant = flint.arb(0), b * b - 4 * c
    if discriminant > 0:
        width = discriminant.sqrt()
        larger_root = (-b - width) / 2 if b > 0 else (width - b) / 2
        return [
            EnclosedRoot(larger_root, zero),
            EnclosedRoot(-b - larger_root if larger_root.contains(0) else c / larger_root, zero),
        ]
    height = (-discriminant).sqrt() / 2
    return [EnclosedRoot(-b / 2, height), EnclosedRoot(-b / 2, -height)] if discriminant < 0 else None


def nearest_roots(coefficients: Sequence[Any], roots: Sequence[Root]) -> tuple[EnclosedRoot, ...] | None:
    """Roots of the polynomial with a structure that is nearest to a given one; None if the fit does not converge.

    The nearest polynomial minimises the sum over k = 1 … n of (Δₖ/wₖ)². Here Δₖ is the change of the k-th coefficient
    of the monic polynomial, and wₖ is the k-th coefficient of ∏ (s + |zᵢ|) with the roots zᵢ of the nearest polynomial;
    |zᵢ| is at least a thousandth of the median (of the largest, if the median is 0). The unknowns u of the
    factored form solve Σₖ Δₖ(u)/wₖ(u)² · ∂Δₖ/∂uⱼ = 0 for each j, without the derivatives of wₖ, so that they depend on
    the coefficients only.

    Gauss–Newton steps start from `roots` and end when they change nothing; half of the digits count as certain.

    Args:
        coefficients: descending, as balls or exact fractions.
        roots: roots of a fit in double precision. Their multiplicities, and equal real parts of the rightmost roots,
            are the structure.
    """
    terms = [flint.arb(as_ball(c)) for c in coefficients]
    monic = [c / terms[0] for c in terms]
    if not all(c.is_finite() for c in monic):
        return None
    unit = flint.arb(2) ** round(math.log2(max(1e-300, *(abs(complex(r.re, r.im)) for r in roots))))
    shape, unknowns = find_shape([Root(float(r.re / unit), float(r.im / unit), r.multiplicity) for r in roots])
    guess = [flint.arb(x) for x in unknowns]
    target = [(c / unit**k).mid() for k, c in enumerate(monic)]
    nearest = _fit_shape(shape, guess, target)
    return None if nearest is None else tuple(EnclosedRoot(z.re * unit, z.im * unit, z.multiplicity) for z in nearest)


def _fit_shape(shape: Shape, u: list[Any], target: Sequence[Any]) -> tuple[EnclosedRoot, ...] | None:
    """Roots of the nearest polynomial of a shape, from a first guess u; None if the fit does not converge."""
    convergence_limit = flint.arb(2) ** (_LOST_BITS * (len(target) - 1) - flint.ctx.prec)
    relative_radius = flint.arb(2) ** (-flint.ctx.prec // _TRUSTED_DIVISOR)
    for _ in range(_MAX_STEPS):
        step = _step(shape, u, target)
        if step is None:
            return None
        u = [(x + d).mid() for x, d in zip(u, step, strict=True)]
        size = max(abs(x) for x in u)
        if all(abs(d) <= convergence_limit * size for d in step):
            roots = _shape_roots(shape, [x + flint.arb(0, (size * relative_radius).upper()) for x in u])
            return None if roots is None else rightmost_first(roots)
    return None


def nearest_double(ball: Any) -> float | None:
    """The double that a ball rounds to; None if its ends round differently, nan if it is not finite."""
    return _round_ball(ball, _round_to_double)


def nearest_decimal(ball: Any, digits: int) -> float | None:
    """Like `nearest_double`, but the ends are first rounded to so many significant decimal digits."""
    context = Context(prec=digits, rounding=ROUND_HALF_EVEN)
    return _round_ball(ball, lambda end: context.divide(Decimal(int(end.p)), Decimal(int(end.q))))


def _round_ball(ball: Any, round_end: Callable[[flint.fmpq], float | Decimal]) -> float | None:
    """The number to which both ends of a ball round; None if they round differently, nan if the ball is not finite."""
    if isinstance(ball, flint.fmpq):
        ends = [ball]
    elif isinstance(ball, flint.arb) and ball.is_finite():
        middle, radius = rational(ball.mid()), rational(ball.rad())
        ends = [middle - radius, middle + radius]
    else:
        return float("nan")
    numbers = {round_end(end) for end in ends}
    return float(numbers.pop()) + 0.0 if len(numbers) == 1 else None


def _round_to_double(x: flint.fmpq) -> float:
    try:
        return int(x.p) / int(x.q)  # correctly rounded for integers of any length
    except OverflowError:
        return float("inf") if x > 0 else float("-inf")


def _shape_roots(shape: Shape, u: Sequence[Any]) -> list[EnclosedRoot] | None:
    """Roots of all groups and of the factor with free coefficients; None if the balls are too wide to decide."""
    roots: list[EnclosedRoot] = []
    factors = [*shape.group_factors(u), shape.rest_factor(u)]
    for factor, count in zip(factors, [*(g.multiplicity for g in shape.groups), 1], strict=True):
        enclosed = factor_roots(factor)
        if enclosed is None:
            return None
        roots += [replace(z, multiplicity=count * z.multiplicity) for z in enclosed]
    return roots


def _step(shape: Shape, u: Sequence[Any], target: Sequence[Any]) -> list[Any] | None:
    """Gauss–Newton step of the weighted least squares, with the weights at u; None if the equations are singular."""
    roots = _shape_roots(shape, u)
    if roots is None:
        return None
    weights = _weights(roots)
    residual = flint.arb_mat([[(b - a) / w] for a, b, w in zip(shape.monic(u), target, weights, strict=True)])
    unknowns = dict(zip(shape.unknowns, u, strict=True))
    slopes = jacobian(lambda values: shape.monic([*values.values()]), unknowns, shape.unknowns)
    rows = flint.arb_mat([[slope / w for slope in row] for row, w in zip(slopes.tolist(), weights, strict=True)])
    try:
        return list((rows.transpose() * rows).solve(rows.transpose() * residual))
    except ZeroDivisionError:
        return None


def _weights(roots: Sequence[EnclosedRoot]) -> list[Any]:
    """Coefficients of ∏ (s + |zᵢ|), the sizes of the terms of each coefficient."""
    sizes = sorted((r.modulus.mid() for r in roots for _ in range(r.multiplicity)), key=float)
    n = len(sizes)
    median = (sizes[(n - 1) // 2] + sizes[n // 2]) / 2
    floor = (sizes[-1] if median == 0 else median) / _MAX_SIZE_RATIO
    return [as_ball(c) for c in product(*[[flint.arb(1), size.max(floor).mid()] for size in sizes])]
