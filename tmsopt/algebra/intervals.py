"""Bounds expressions over a box, by interval arithmetic with outward rounding (balls of Arb)."""

import math
from collections.abc import Sequence
from typing import Any

import flint

from tmsopt.algebra.formula import Formula, fold
from tmsopt.algebra.kinds import INTERVALS

Interval = tuple[float, float]

REAL_LINE = (-math.inf, math.inf)
_PRECISION = 64  # bits of the balls, 11 more than a double has


def ball(ends: Interval) -> Any:
    """A ball that encloses an interval; unbounded if an end is infinite, nan if an end is nan."""
    if not all(map(math.isfinite, ends)):
        return flint.arb("nan") if math.isnan(ends[0] + ends[1]) else flint.arb(0, math.inf)
    return flint.arb(ends[0]).union(flint.arb(ends[1]))


def interval(x: Any) -> Interval:
    """Doubles that enclose a ball."""
    if not x.is_finite():
        return REAL_LINE
    return math.nextafter(float(x.lower()), -math.inf), math.nextafter(float(x.upper()), math.inf)


def round_outwards(lower: float, upper: float) -> Interval:
    """Doubles that enclose an interval whose ends are decimals; equal ends are returned unchanged."""
    return (lower, upper) if lower == upper else (math.nextafter(lower, -math.inf), math.nextafter(upper, math.inf))


def ranges(formula: Formula, box: Sequence[Interval]) -> list[Interval]:
    """Ranges of the outputs of a formula over a box; unbounded if an output may not exist.

    Raises:
        UnsupportedOperation: if intervals do not have an operation of the formula.
    """
    balls = {name: ball(ends) for name, ends in zip(formula.names, box, strict=True)}
    return [interval(x) for x in fold(formula, balls, INTERVALS)]


def bound_roots(coefficients: Sequence[Interval]) -> float:
    """Upper bound of |s| over the roots of all polynomials with coefficients in these intervals, descending.

    Fujiwara's bound is 2 max |a_k/a0|^(1/k), where the last term has half of |aₙ/a0|. It is inf if a0 may be 0.
    """
    with flint.ctx.workprec(_PRECISION):
        a = [ball(ends) for ends in coefficients]
        min_lead = abs(a[0]).lower()
        if not (a[0].is_finite() and min_lead > 0):
            return math.inf
        n = len(a) - 1
        terms = [(abs(c).upper() / min_lead / (2 if k == n else 1)).root(k) for k, c in enumerate(a[1:], start=1)]
        return max(interval(2 * t)[1] for t in terms)
