"""Root quantities for branch and bound: half-planes by interlacing parts, sectors by bounded factors."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from tmsopt.algebra.formula import constant, formula
from tmsopt.algebra.intervals import Interval, bound_roots
from tmsopt.global_search.interlacing import interlace, squares_of
from tmsopt.models import Model, Values
from tmsopt.program.formulate import Builder
from tmsopt.program.lifts import LiftedQuantity, pair_roots
from tmsopt.program.nlp import AddedVariable
from tmsopt.roots import Pattern, product, shift
from tmsopt.roots.patterns.pattern import Roots

_PLAIN = 4  # degree up to which the powers of the unit are near enough to 1


@dataclass(frozen=True)
class Frame:
    """How coefficients are looked at.

    Attributes:
        signs: case → sign of the leading one; cases without are left aside.
        unit: usual size of the roots, a power of two.
        touching: whether a line must have a root on it, lest more be claimed than is so.
        compact: whether squared frequencies are taken as X/(1 − X).
        least: what the leading coefficient of the model is not below in the first case, in absolute value.
    """

    model: Model
    signs: Mapping[int, int]
    unit: float
    touching: bool = False
    compact: bool = False
    least: float = 0.0

    def coefficients(self, values: Sequence[Values], case: int) -> list[Any]:
        """Coefficients for roots in the unit, with a leading one that is positive, in the compact form of the model."""
        a = compact(self.model, values[case])
        return [self.signs[case] * c * self.lead / self.unit**k for k, c in enumerate(a)]

    @property
    def lead(self) -> float:
        """What all coefficients are multiplied by, so that none is far smaller than the others are large."""
        return float(self.unit ** (self.model.degree // 2)) if self.model.degree > _PLAIN else 1.0

    def about(self, values: Sequence[Values], case: int, line: Any) -> list[Any]:
        """The same of p(t + line)."""
        return shift(self.coefficients(values, case), line / self.unit)

    def largest(self, ranges: Sequence[Interval], first: bool) -> float:
        """Bound on the roots for coefficients in ranges, of the first case or of another."""
        (lower, upper), *others = ranges
        least = self.least * self.lead if first else -math.inf
        return bound_roots([(max(lower, least), max(upper, least)), *others])


def compact(model: Model, values: Values) -> list[Any]:
    """Coefficients but for a positive factor, in as few products as the model knows."""
    with suppress(ZeroDivisionError):  # by a parameter that is fixed at 0
        if model.compact is not None:
            return model.compact(**model.algebraic({name: values[name] for name in model.sets[0].names}))
    return list(values.coefficients)


def half_planes(frame: Frame, build: Builder, line: float | None = None) -> LiftedQuantity:
    """Every root of every case at or left of a line: a known one, or a variable."""
    first, covered, values = len(build.x), build.covered_cases, build.values
    looked = [case for case in covered if case in frame.signs]
    at: Any = line
    if line is None:  # it is no larger than the largest root, unless that is one of a case not looked at
        most = frame.unit * max(
            frame.largest(build.enclose(frame.coefficients(values, case)), case == looked[0]) for case in looked
        )
        at = build.variable("abscissa", -most, most if len(values) == 1 or not frame.touching else math.inf)
    for case in looked:
        c = frame.about(values, case, at)
        edges = interlace(build, case, c, frame.largest(build.enclose(c), case == covered[0]), frame.compact)
        if line is None and frame.touching and len(covered) == 1:
            build.row("abscissa", math.prod(edges), 0.0, 0.0)
    guess = partial(_half_plane_guess, frame, looked, line)
    return LiftedQuantity(constant(at), AddedVariable("abscissa", len(build.x) - first, guess), (), ())


def sectors(frame: Frame, build: Builder, ratio: float | None = None) -> LiftedQuantity:
    """Every root of every case with at least a damping ratio: p = a0 ∏ (s² + pᵢ s + wᵢ²), wᵢ ≥ 0, pᵢ ≥ 2 ζ wᵢ.

    A root s > 0 has ζ = −1, and with another s < 0 no such factor. Where ζ may be −1, the factors are s² + pᵢ s + qᵢ,
    with qᵢ = wᵢ² asked only of other ζ: (1 + ζ)(wᵢ² − qᵢ) = 0; where it is known to be, nothing is asked. An odd degree
    has one factor s + d more, d ≥ 0 asked only of other ζ: (1 + ζ)(e − d) = 0, e ≥ 0, e ≥ d.
    """
    first, covered, values = len(build.x), build.covered_cases, build.values
    zeta = build.variable("damping_ratio", -1.0, 1.0) if ratio is None else ratio
    looked = [case for case in covered if case in frame.signs and (ratio is None or ratio > -1)]

    def at_least(greater: Any, least: Any) -> None:
        build.row("damping_ratio", greater - least, 0.0, np.inf)

    def unless_real(a: Any, b: Any) -> None:
        """a ≥ b, and a = b for ζ > −1."""
        build.row("damping_ratio", (1 + zeta) * (a - b), 0.0, 0.0)
        at_least(a, b)

    for case in looked:
        a = frame.coefficients(values, case)
        largest = frame.largest(build.enclose(a), case == covered[0])
        pairs, monic = [], []
        for k in range(1, (len(a) - 1) // 2 + 1):
            p = build.variable(f"p{k}.{case}", -2 * largest, 2 * largest)
            w = build.variable(f"w{k}.{case}", 0.0, largest)
            q = build.variable(f"q{k}.{case}", -largest * largest, largest * largest) if ratio is None else w * w
            pairs.append(p)
            monic.append([1, p, q])
            at_least(p, 2 * zeta * w)
            if ratio is None:
                unless_real(w * w, q)
        if len(a) % 2 == 0:
            d = build.variable(f"d.{case}", 0.0 if ratio is not None else -largest, largest)
            monic.append([1, d])
            if ratio is None:
                unless_real(build.variable(f"e.{case}", 0.0, largest), d)
        for one, other in pairwise(pairs):  # their order means nothing
            at_least(other, one)
        build.equal("damping_ratio", a, [a[0] * c for c in product(*monic)])
    at_least(1, zeta)  # real roots would satisfy any larger one, too
    guess = partial(_sector_guess, frame, looked, ratio, build.unit)
    return LiftedQuantity(constant(zeta), AddedVariable("damping_ratio", len(build.x) - first, guess), (), ())


def bound_unknowns(frame: Frame, build: Builder, pattern: Pattern) -> None:
    """Ranges for the unknown factor coefficients of a pattern, the last variables so far: C(m, k) R^k for degree m."""
    count = len(pattern.unknowns)
    largest = bound_roots(build.enclose(compact(frame.model, build.values[0]))) / build.unit
    symbols = build.x[-count:]
    for factor in pattern.factors(symbols):
        for k, c in enumerate(factor[1:], start=1):
            for j, symbol in enumerate(symbols):
                if any(formula([c]) == formula([e]) for e in (symbol, -symbol)):
                    most = math.comb(len(factor) - 1, k) * largest**k
                    lower, upper = build.bounds[j - count]
                    build.bounds[j - count] = (max(lower, -most), min(upper, most))


def _half_plane_guess(
    frame: Frame, covered: Sequence[int], line: float | None, values: Sequence[Values], z: Sequence[Roots]
) -> list[list[float]]:
    """The least line, if it is not known, and squared frequencies."""
    at = max(float(values[case]["abscissa"]) for case in covered) if line is None else line
    squares = [x for case in covered for x in squares_of([float(c) for c in frame.about(values, case, at)])]
    return [[*([at] if line is None else []), *(x / (1 + x) if frame.compact else x for x in squares)]]


def _sector_guess(
    frame: Frame, covered: Sequence[int], ratio: float | None, unit: float, values: Sequence[Values], z: Sequence[Roots]
) -> list[list[float]]:
    """Damping ratio, if it is not known, and factors; the roots are given in the unit of the NLP."""
    factors = []
    for case in covered:
        split = pair_roots(z[case] * unit / frame.unit)
        for p, q in sorted((float(-r.sum().real), float(r.prod().real)) for r in split if len(r) == 2):
            unstable = q < 0 or (p < 0 and p * p >= 4 * q)  # a root s > 0
            factors += [p, abs(p) / 2 if unstable else math.sqrt(q), *([q] if ratio is None else [])]
        for d in (-float(r[0].real) for r in split if len(r) == 1):
            factors += [d, abs(d)] if ratio is None else [d]
    if ratio is not None:
        return [factors]
    return [[min(float(values[case]["damping_ratio"]) for case in covered), *factors]]
