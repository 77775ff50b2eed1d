"""Points along a traced curve: parameters, values, stability, and the functions of them whose zeros are events."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from tmsopt.models import Values
from tmsopt.problem.expression import Expression
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, NO_RADIUS, ROOT_QUANTITIES
from tmsopt.records import Array, Complex, Truth
from tmsopt.roots import lienard_chipart, roots
from tmsopt.roots.meetings import CLOSED, balance, nearest_two
from tmsopt.roots.patterns.pattern import mean_size
from tmsopt.tracing.equations import Traced

NOTHING = 1e-9  # a function smaller than this all along the curve is 0 on it, not an event of it

CHANGES = "stability changes"
"""Detail of the marks that count only where they change it."""

_ROUNDED = 1e-14  # a tangent, its inverse and the scale, or a real part beside the modulus: some roundings
_REAL = 1e-6  # of |s|: a factor with a double root has coefficients right to 1e-15 and roots to the root of that


@dataclass(frozen=True)
class Points:
    """Points x of a traced curve in natural units, and its tangents t, both of shape (n, variables)."""

    ready: Traced
    x: Array
    t: Array

    def __len__(self) -> int:
        return len(self.x)

    @property
    def unknowns(self) -> list[Array]:
        """Those of the pattern, shape (n,) each."""
        return list(self.x[:, self.ready.unknowns].T)

    @cached_property
    def parameters(self) -> dict[str, Array]:
        """Every parameter of the problem, shape (n,) each."""
        problem = self.ready.problem
        of = problem.parameter_set
        free = {
            n: _within(np.arctan(v) if of[n].tangent else v, *problem.free[n])
            for n, v in zip(problem.free, self.x.T, strict=False)
        }
        return {n: np.array(np.broadcast_to(v, len(self)), dtype=float) for n, v in problem.ordered(free).items()}

    @cached_property
    def values(self) -> Values:
        """Quantities; those of the roots come from the factors, where multiple roots are exact."""
        z = roots_along(self.ready.pattern.factors(self.unknowns), len(self))
        formulas = {
            "abscissa": lambda _: z.real.max(axis=-1),
            "damping_ratio": lambda _: np.min(-z.real / (np.abs(z) + 1e-300), axis=-1),
            ANGULAR_FREQUENCY: lambda _: z.imag.max(axis=-1),
        }
        extra = [*(replace(q, value=formulas[q.name]) for q in ROOT_QUANTITIES), NO_RADIUS]
        problem = self.ready.problem
        return Values(problem.model, problem.parameter_set, self.parameters, extra=extra)

    @cached_property
    def stable(self) -> Truth:
        """Where the other roots lie left of the imaginary axis by more than rounding; none count as stable."""
        return np.asarray(np.all(self._others.real < -_ROUNDED * np.abs(self._others), axis=-1))

    @property
    def heavily_damped(self) -> Truth:
        """Where the other roots are real and negative, and the pattern has none but those."""
        real = np.all(np.abs(self._others.imag) <= _REAL * np.abs(self._others), axis=-1)
        return np.asarray(self.stable & real & ("W" not in self.ready.pattern.unknowns))

    @property
    def satisfied(self) -> Truth:
        """Where every inequality constraint holds."""
        inside = np.ones(len(self), dtype=bool)
        for condition in self.ready.problem.conditions.values():
            if not condition.equality:
                inside &= condition.holds(self.excess(condition))
        return inside

    @property
    def residual(self) -> Array:
        """Largest mismatch of a coefficient, relative to the terms that it is made of."""
        monic = self.ready.pattern.monic(self.unknowns)
        a0 = self.column(self.values.coefficients[0])
        unit = self.column(mean_size(monic))
        unit = np.maximum(unit, np.median(unit)) + 1e-300  # where all roots come to 0, that of the curve
        worst = np.zeros(len(self))
        for k, (a, c) in enumerate(zip(self.values.coefficients, monic, strict=True)):
            size = np.abs(a) + np.abs(a0 * c) + np.abs(a0) * unit**k
            worst = np.maximum(worst, np.abs(a - a0 * c) / np.where(size == 0, 1.0, size))  # 0: roots that are all 0
        return worst

    def excess(self, condition: Expression) -> Array:
        """The difference of the sides of a constraint."""
        return self.column(condition(self.values))

    @property
    def special(self) -> list[str]:
        """Special cases of the pattern that are met along the whole curve, up to rounding."""
        return [name for name in self.ready.pattern.marks if np.median(np.abs(self.mark(name))) <= NOTHING]

    def mark(self, name: str) -> Array:
        """What vanishes at a special case of the pattern."""
        pattern = self.ready.pattern
        return self.column(pattern.marks[name](pattern.reduced(self.unknowns)))

    def column(self, value: Any) -> Array:
        """A value at each point."""
        return np.broadcast_to(np.asarray(value, dtype=float), len(self))

    @cached_property
    def _others(self) -> Complex:
        """The roots that the pattern does not tie."""
        return roots_along(self.ready.pattern.remaining(self.unknowns), len(self))


Monitor = Callable[[Points], Array]


@dataclass(frozen=True)
class Mark:
    """A function of points whose zeros are events."""

    name: str
    detail: str
    value: Monitor


def _within(v: Array, low: float, high: float) -> Array:
    """A limit met exactly, where a tangent and its inverse have rounded past it."""
    limited = np.clip(v, low, high)
    return np.where(np.abs(v - limited) <= _ROUNDED * (1 + np.abs(v)), limited, v)


def roots_along(factors: list[list[Any]], count: int) -> Complex:
    """Roots of factors along a curve, shape (count, roots); nan where one is beyond doubles, as beside infinity."""
    found = [np.zeros((count, 0), dtype=complex)]
    for factor in factors:
        rows = np.stack([np.broadcast_to(np.asarray(c, dtype=float), count) for c in factor], axis=-1)
        known = np.isfinite(rows).all(axis=1) & (rows[:, 0] != 0)
        found.append(np.full((count, len(factor) - 1), np.nan, dtype=complex))
        found[-1][known] = roots(rows[known])
    return np.concatenate(found, axis=-1)


def on_axis(z: Complex) -> Truth:
    """Which roots lie on the imaginary axis, up to rounding."""
    return np.asarray(np.abs(z.real) <= _ROUNDED * np.abs(z))


def marks(points: Points) -> Iterator[Mark]:
    """Everything that may be an event of a curve."""
    ready, problem = points.ready, points.ready.problem

    def margin(number: int, k: int) -> Monitor:
        return lambda p: margins(ready.pattern.remaining(p.unknowns)[number])[k]

    def turn(k: int) -> Monitor:  # by the arclength in the parameters: the unknowns may move much faster
        return lambda p: p.t[:, k] / (np.linalg.norm(p.t[:, : len(problem.free)], axis=1) + 1e-300)

    for name in ready.pattern.marks:
        yield Mark(name, "", partial(Points.mark, name=name))
    if ready.pattern.form == "EP2" and "2EP2" in points.special:
        # q(r) has a double zero where r is the double root of q
        yield Mark("EP4", "", lambda p: p.unknowns[0] - nearest_two(ready.pattern.factors(p.unknowns)[-1]))
    for number, factor in enumerate(ready.pattern.remaining(points.unknowns)):
        for k in range(len(margins(factor))):  # the first quantity is the constant term
            yield Mark("weave" if k else "capsize", CHANGES, margin(number, k))
    for k, parameter in enumerate(problem.free):
        yield Mark("fold", parameter, turn(k))
    for name, condition in problem.conditions.items():
        if not condition.equality:
            yield Mark("constraint", name, partial(Points.excess, condition=condition))


def margins(factor: list[Any]) -> list[Any]:
    """Quantities of which one vanishes wherever a root of the factor comes to the imaginary axis, the first at 0."""
    return lienard_chipart(factor) if len(factor) - 1 <= CLOSED else [factor[-1], balance(factor)]


def sign_changes(value: Array) -> Truth:
    """Where a sequence changes sign from one entry to the next; a 0 has the sign before it, or that after the first."""
    sign = np.sign(value)
    if np.any(sign):
        sign[0] = sign[0] or sign[np.flatnonzero(sign)[0]]
    for k in range(1, len(sign)):
        sign[k] = sign[k] or sign[k - 1]
    return np.asarray(sign[1:] * sign[:-1] < 0)
