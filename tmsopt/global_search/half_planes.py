"""Conditions on the roots for branch and bound: abscissa by interlacing, damping ratio by bounded factors.

An abscissa keeps all roots in a half-plane, a damping ratio keeps them in a sector.
"""

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
from tmsopt.global_search.interlacing import add_interlacing, squared_frequencies
from tmsopt.models import Model, Values
from tmsopt.program.formulate import Builder
from tmsopt.program.lifts import LiftedQuantity, pair_roots
from tmsopt.program.nlp import AddedVariable
from tmsopt.roots import Pattern, product, shift
from tmsopt.roots.patterns.pattern import Roots

_UNSCALED_DEGREE = 4  # up to here the powers of the unit stay near 1


@dataclass(frozen=True)
class Frame:
    """How the coefficients of all cases are scaled and signed.

    Attributes:
        signs: case → sign of its leading coefficient; cases without a sign are left out.
        unit: typical size of the roots, a power of two.
        needs_contact: whether a root must lie on the vertical line; this is so if a larger abscissa can be better.
        compact: whether squared frequencies are written as X/(1 − X).
        least_lead: lower bound on the size of the model's leading coefficient in the first case.
    """

    model: Model
    signs: Mapping[int, int]
    unit: float
    needs_contact: bool = False
    compact: bool = False
    least_lead: float = 0.0

    def coefficients(self, values: Sequence[Values], case: int) -> list[Any]:
        """Coefficients of a case, for roots measured in `unit`; the leading one is positive."""
        a = compact_coefficients(self.model, values[case])
        return [self.signs[case] * c * self.common_factor / self.unit**k for k, c in enumerate(a)]

    @property
    def common_factor(self) -> float:
        """Factor on all coefficients, so that neither the first nor the last ones become tiny."""
        return float(self.unit ** (self.model.degree // 2)) if self.model.degree > _UNSCALED_DEGREE else 1.0

    def shifted_coefficients(self, values: Sequence[Values], case: int, line: Any) -> list[Any]:
        """The coefficients of p(t + line)."""
        return shift(self.coefficients(values, case), line / self.unit)

    def bound_roots(self, ranges: Sequence[Interval], is_first_case: bool) -> float:
        """Bound on the sizes of the roots for coefficients in these ranges."""
        (lower, upper), *other_ranges = ranges
        least_lead = self.least_lead * self.common_factor if is_first_case else -math.inf
        return bound_roots([(max(lower, least_lead), max(upper, least_lead)), *other_ranges])


def compact_coefficients(model: Model, values: Values) -> list[Any]:
    """Coefficients up to a common positive factor, in the shortest form that the model has."""
    with suppress(ZeroDivisionError):  # the short form divides by a parameter that is fixed at 0
        if model.compact is not None:
            return model.compact(**model.algebraic({name: values[name] for name in model.sets[0].names}))
    return list(values.coefficients)


def add_half_planes(frame: Frame, build: Builder, line: float | None = None) -> LiftedQuantity:
    """Require that all roots of all cases lie on or left of the line Re s = `line`; None makes the line a variable."""
    first_index, covered_cases, values = len(build.x), build.covered_cases, build.values
    cases = [case for case in covered_cases if case in frame.signs]
    line_position: Any = line
    if line is None:  # the line is not right of the largest root, unless a case without a sign has that root
        largest_root = frame.unit * max(
            frame.bound_roots(build.enclose(frame.coefficients(values, case)), case == cases[0]) for case in cases
        )
        line_position = build.add_variable(
            "abscissa", -largest_root, largest_root if len(values) == 1 or not frame.needs_contact else math.inf
        )
    for case in cases:
        c = frame.shifted_coefficients(values, case, line_position)
        contacts = add_interlacing(
            build, case, c, frame.bound_roots(build.enclose(c), case == covered_cases[0]), frame.compact
        )
        if line is None and frame.needs_contact and len(covered_cases) == 1:
            build.add_row("abscissa", math.prod(contacts), 0.0, 0.0)
    guess = partial(_guess_half_planes, frame, cases, line)
    return LiftedQuantity(constant(line_position), AddedVariable("abscissa", len(build.x) - first_index, guess), (), ())


def add_sectors(frame: Frame, build: Builder, ratio: float | None = None) -> LiftedQuantity:
    """Require a damping ratio ζ for all roots of all cases: p = a0 ∏ (s² + pᵢ s + wᵢ²), wᵢ ≥ 0, pᵢ ≥ 2 ζ wᵢ.

    A root s > 0 has ζ = −1 and, together with a root s < 0, no such factor. If ζ may be −1, the factors are
    s² + pᵢ s + qᵢ, and qᵢ = wᵢ² is required for other ζ only: (1 + ζ)(wᵢ² − qᵢ) = 0. A fixed ζ = −1 requires nothing.
    An odd degree adds a factor s + d, with d ≥ 0 for other ζ only: (1 + ζ)(e − d) = 0, e ≥ 0, e ≥ d.
    """
    first_index, covered_cases, values = len(build.x), build.covered_cases, build.values
    zeta = build.add_variable("damping_ratio", -1.0, 1.0) if ratio is None else ratio
    cases = [case for case in covered_cases if case in frame.signs and (ratio is None or ratio > -1)]

    def require_at_least(greater: Any, least: Any) -> None:
        build.add_row("damping_ratio", greater - least, 0.0, np.inf)

    def require_equal_unless_real(a: Any, b: Any) -> None:
        """a ≥ b, and a = b for ζ > −1."""
        build.add_row("damping_ratio", (1 + zeta) * (a - b), 0.0, 0.0)
        require_at_least(a, b)

    for case in cases:
        a = frame.coefficients(values, case)
        root_bound = frame.bound_roots(build.enclose(a), case == covered_cases[0])
        pairs, factors = [], []
        for k in range(1, (len(a) - 1) // 2 + 1):
            p = build.add_variable(f"p{k}.{case}", -2 * root_bound, 2 * root_bound)
            w = build.add_variable(f"w{k}.{case}", 0.0, root_bound)
            q = (
                build.add_variable(f"q{k}.{case}", -root_bound * root_bound, root_bound * root_bound)
                if ratio is None
                else w * w
            )
            pairs.append(p)
            factors.append([1, p, q])
            require_at_least(p, 2 * zeta * w)
            if ratio is None:
                require_equal_unless_real(w * w, q)
        if len(a) % 2 == 0:
            d = build.add_variable(f"d.{case}", 0.0 if ratio is not None else -root_bound, root_bound)
            factors.append([1, d])
            if ratio is None:
                require_equal_unless_real(build.add_variable(f"e.{case}", 0.0, root_bound), d)
        for smaller, larger in pairwise(pairs):  # fixes the order of the factors
            require_at_least(larger, smaller)
        build.add_equations("damping_ratio", a, [a[0] * c for c in product(*factors)])
    require_at_least(1, zeta)  # real roots would satisfy any larger ratio too
    guess = partial(_guess_sectors, frame, cases, ratio, build.scale.unit)
    return LiftedQuantity(constant(zeta), AddedVariable("damping_ratio", len(build.x) - first_index, guess), (), ())


def bound_unknowns(frame: Frame, build: Builder, pattern: Pattern) -> None:
    """Bound the unknowns of a pattern, which are the last variables: C(m, k) R^k for coefficient k of a degree m."""
    count = len(pattern.unknowns)
    root_bound = bound_roots(build.enclose(compact_coefficients(frame.model, build.values[0]))) / build.scale.unit
    symbols = build.x[-count:]
    for factor in pattern.factors(symbols):
        for k, c in enumerate(factor[1:], start=1):
            for j, symbol in enumerate(symbols):
                if any(formula([c]) == formula([e]) for e in (symbol, -symbol)):
                    bound = math.comb(len(factor) - 1, k) * root_bound**k
                    lower, upper = build.bounds[j - count]
                    build.bounds[j - count] = (max(lower, -bound), min(upper, bound))


def _guess_half_planes(
    frame: Frame, cases: Sequence[int], line: float | None, values: Sequence[Values], z: Sequence[Roots]
) -> list[list[float]]:
    """Return start values: the leftmost line, unless it is fixed, and the squared frequencies."""
    line_position = max(float(values[case]["abscissa"]) for case in cases) if line is None else line
    squares = [
        x
        for case in cases
        for x in squared_frequencies([float(c) for c in frame.shifted_coefficients(values, case, line_position)])
    ]
    return [[*([line_position] if line is None else []), *(x / (1 + x) if frame.compact else x for x in squares)]]


def _guess_sectors(
    frame: Frame, cases: Sequence[int], ratio: float | None, unit: float, values: Sequence[Values], z: Sequence[Roots]
) -> list[list[float]]:
    """Return start values: the damping ratio, unless it is fixed, and the factors; `z` is in the unit of the NLP."""
    factors = []
    for case in cases:
        root_groups = pair_roots(z[case] * unit / frame.unit)
        for p, q in sorted((float(-r.sum().real), float(r.prod().real)) for r in root_groups if len(r) == 2):
            is_unstable = q < 0 or (p < 0 and p * p >= 4 * q)  # a root s > 0
            factors += [p, abs(p) / 2 if is_unstable else math.sqrt(q), *([q] if ratio is None else [])]
        for d in (-float(r[0].real) for r in root_groups if len(r) == 1):
            factors += [d, abs(d)] if ratio is None else [d]
    if ratio is not None:
        return [factors]
    return [[min(float(values[case]["damping_ratio"]) for case in cases), *factors]]
