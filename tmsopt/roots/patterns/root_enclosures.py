"""Roots as balls: of a polynomial whose coefficients are balls, and of the nearest polynomial with a structure.

Everything here works at the precision of `flint.ctx`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_HALF_EVEN, Context, Decimal
from itertools import combinations
from typing import Any

import flint

from tmsopt.algebra.balls import as_ball, rational
from tmsopt.algebra.krawczyk import jacobian
from tmsopt.roots.exact import isolated_roots
from tmsopt.roots.patterns.naming import shown
from tmsopt.roots.patterns.shape import Shape
from tmsopt.roots.polynomial import Root, evaluate, product, rightmost_first

_STEPS = 80
_FLOOR = 1000  # a root smaller than the median root by more than this counts as this much smaller
_LOST = 7.5  # bits for each degree that the normal equations may lose
_HALF = 2  # of the digits that are carried, the share that a converged fit is trusted to


@dataclass(frozen=True)
class EnclosedRoot:
    """A root within balls, with its multiplicity; the imaginary part of a real root is exactly 0."""

    re: Any
    im: Any
    multiplicity: int = 1

    @property
    def real(self) -> bool:
        """Whether it is certainly real."""
        return bool(self.im == 0)

    @property
    def modulus(self) -> Any:
        """Ball of |s|."""
        return abs(self.re) if self.im == 0 else (self.re * self.re + self.im * self.im).sqrt()


def enclosed_roots(coefficients: Sequence[Any]) -> tuple[EnclosedRoot, ...] | None:
    """Every root of a real polynomial, coefficients descending as balls or exact fractions; None where not decided.

    The roots z of the polynomial p₀ in the middle are isolated first; a disc of radius n |p(z)/p′(z)| about z then
    holds a root of every p in the balls (Laguerre), exactly one if the discs are disjoint, and a real one if z is.
    Multiple roots are accepted at 0 and of coefficients that are exact. Rightmost first.
    """
    terms = [flint.arb(as_ball(c)) for c in coefficients]
    if not all(t.is_finite() for t in terms):
        return None
    zeros = 0
    while terms and terms[-1] == 0:
        terms.pop()
        zeros += 1
    while terms and terms[0] == 0:
        terms.pop(0)
    found = [EnclosedRoot(flint.arb(0), flint.arb(0), zeros)] if zeros else []
    degree = len(terms) - 1
    if degree > 0:
        slope = [(degree - k) * c for k, c in enumerate(terms[:-1])]
        for z, multiplicity in isolated_roots(terms):
            if multiplicity > 1:
                if not all(t.is_exact() for t in terms):
                    return None
                found.append(EnclosedRoot(z.real, z.imag, multiplicity))
                continue
            middle = z.real.mid() if z.imag == 0 else flint.acb(z.real.mid(), z.imag.mid())
            distance = (degree * abs(evaluate(terms, middle) / evaluate(slope, middle))).upper()
            ball = flint.arb(0, distance)
            found.append(EnclosedRoot(z.real.mid() + ball, flint.arb(0) if z.imag == 0 else z.imag.mid() + ball))
    balls = [flint.acb(root.re, root.im) for root in found]
    if not all(a.is_finite() for a in balls) or any(a.overlaps(b) for a, b in combinations(balls, 2)):
        return None
    return rightmost_first(found)


def factor_roots(factor: Sequence[Any]) -> Sequence[EnclosedRoot] | None:
    """Roots of a factor; None where the balls cannot tell. A pair on the imaginary axis has the real part 0 exactly."""
    if len(factor) != 3:
        return enclosed_roots(factor)
    b, c = map(flint.arb, factor[1:])
    nothing, discriminant = flint.arb(0), b * b - 4 * c
    if discriminant > 0:
        width = discriminant.sqrt()
        far = (-b - width) / 2 if b > 0 else (width - b) / 2
        return [EnclosedRoot(far, nothing), EnclosedRoot(-b - far if far.contains(0) else c / far, nothing)]
    height = (-discriminant).sqrt() / 2
    return [EnclosedRoot(-b / 2, height), EnclosedRoot(-b / 2, -height)] if discriminant < 0 else None


def nearest_roots(coefficients: Sequence[Any], roots: Sequence[Root]) -> tuple[EnclosedRoot, ...] | None:
    """Roots of the polynomial nearest to a given one among those of a structure; None where the fit does not converge.

    Nearest is: least in the sum over k = 1 … n of (Δₖ/wₖ)², where Δₖ is the change of the k-th coefficient of the
    monic polynomial and wₖ the k-th coefficient of ∏ (s + |zᵢ|), zᵢ the roots of the nearest polynomial itself; one
    below a thousandth of the median |z| (of the largest, if that is 0) counts as that. So the unknowns u of the
    factored form solve
    Σₖ Δₖ(u)/wₖ(u)² · ∂Δₖ/∂uⱼ = 0 for each j: a property of the coefficients alone. The slopes of wₖ are left out.

    Gauss–Newton steps, from the roots of a fit in double precision, until they change nothing; half of the digits
    carried count as certain.
    """
    terms = [flint.arb(as_ball(c)) for c in coefficients]
    monic = [c / terms[0] for c in terms]
    if not all(c.is_finite() for c in monic):
        return None
    unit = flint.arb(2) ** round(math.log2(max(1e-300, *(abs(complex(r.re, r.im)) for r in roots))))
    shape, places = shown([Root(float(r.re / unit), float(r.im / unit), r.multiplicity) for r in roots])
    start = [flint.arb(x) for x in places]
    target = [(c / unit**k).mid() for k, c in enumerate(monic)]
    found = _converged(shape, start, target)
    return None if found is None else tuple(EnclosedRoot(z.re * unit, z.im * unit, z.multiplicity) for z in found)


def _converged(shape: Shape, u: list[Any], target: Sequence[Any]) -> tuple[EnclosedRoot, ...] | None:
    """Roots of the nearest polynomial of a shape, from a start."""
    small = flint.arb(2) ** (_LOST * (len(target) - 1) - flint.ctx.prec)
    sure = flint.arb(2) ** (-flint.ctx.prec // _HALF)
    for _ in range(_STEPS):
        step = _step(shape, u, target)
        if step is None:
            return None
        u = [(x + d).mid() for x, d in zip(u, step, strict=True)]
        size = max(abs(x) for x in u)
        if all(abs(d) <= small * size for d in step):
            found = _roots_of(shape, [x + flint.arb(0, (size * sure).upper()) for x in u])
            return None if found is None else rightmost_first(found)
    return None


def nearest_double(ball: Any) -> float | None:
    """The double that a ball rounds to; None where its ends round differently, nan where it is not finite."""
    if not _finite(ball):
        return float("nan")
    ends = {_double(end) for end in _ends(ball)}
    return ends.pop() + 0.0 if len(ends) == 1 else None


def nearest_decimal(ball: Any, digits: int) -> float | None:
    """The double nearest to a ball rounded to so many significant decimal digits; as `nearest_double`."""
    if not _finite(ball):
        return float("nan")
    context = Context(prec=digits, rounding=ROUND_HALF_EVEN)
    ends = {context.divide(Decimal(int(e.p)), Decimal(int(e.q))) for e in _ends(ball)}
    return float(ends.pop()) + 0.0 if len(ends) == 1 else None


def _finite(ball: Any) -> bool:
    return ball.is_finite() if isinstance(ball, flint.arb) else isinstance(ball, flint.fmpq)


def _ends(ball: Any) -> tuple[flint.fmpq, ...]:
    """Both ends without rounding, at any working precision."""
    if isinstance(ball, flint.fmpq):
        return (ball,)
    middle, radius = rational(ball.mid()), rational(ball.rad())
    return middle - radius, middle + radius


def _double(x: flint.fmpq) -> float:
    try:
        return int(x.p) / int(x.q)  # rounded correctly, whatever the length of the two
    except OverflowError:
        return float("inf") if x > 0 else float("-inf")


def _roots_of(shape: Shape, u: Sequence[Any]) -> list[EnclosedRoot] | None:
    """Roots of each group, and those of the rest; None where these are not decided."""
    found: list[EnclosedRoot] = []
    rest = shape.rest_factor(u)
    for factor, count in [*zip(shape.group_factors(u), (g.multiplicity for g in shape.groups), strict=True), (rest, 1)]:
        own = factor_roots(factor)
        if own is None:
            return None
        found += [replace(z, multiplicity=count * z.multiplicity) for z in own]
    return found


def _step(shape: Shape, u: Sequence[Any], target: Sequence[Any]) -> list[Any] | None:
    """Gauss–Newton step of the weighted least squares, with the weights of where it starts."""
    found = _roots_of(shape, u)
    if found is None:
        return None
    weights = _weights(found)
    offs = flint.arb_mat([[(b - a) / w] for a, b, w in zip(shape.monic(u), target, weights, strict=True)])
    moved = jacobian(lambda at: shape.monic([*at.values()]), dict(zip(shape.unknowns, u, strict=True)), shape.unknowns)
    rows = flint.arb_mat([[slope / w for slope in row] for row, w in zip(moved.tolist(), weights, strict=True)])
    try:
        return list((rows.transpose() * rows).solve(rows.transpose() * offs))
    except ZeroDivisionError:
        return None


def _weights(roots: Sequence[EnclosedRoot]) -> list[Any]:
    """Coefficients of ∏ (s + |zᵢ|), sizes of the terms that each coefficient is summed from."""
    sizes = sorted((r.modulus.mid() for r in roots for _ in range(r.multiplicity)), key=float)
    n = len(sizes)
    median = (sizes[(n - 1) // 2] + sizes[n // 2]) / 2
    floor = (sizes[-1] if median == 0 else median) / _FLOOR
    return [as_ball(c) for c in product(*[[flint.arb(1), size.max(floor).mid()] for size in sizes])]
