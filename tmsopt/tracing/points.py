"""Points along a traced curve: parameters, quantities, unknowns of the pattern, stability."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tmsopt.models import Values
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, NO_RADIUS
from tmsopt.records import Array, Complex, Truth
from tmsopt.roots import lienard_chipart, roots
from tmsopt.roots.patterns.pattern import mean_size
from tmsopt.roots.sign_tests import MAX_CLOSED_FORM_DEGREE, opposite_roots_test
from tmsopt.tracing.branch import name_unknowns
from tmsopt.tracing.chain_curve import ChainSetup
from tmsopt.tracing.equations import Setup, design_at

ZERO_TOLERANCE = 1e-9  # a function below this value along the whole curve counts as 0

_ROUNDING = 1e-14  # relative; a few rounding errors
_REAL_TOLERANCE = 1e-6
"""Largest |Im s| / |s| of a root that counts as real. A rounding error moves a double root by its square root."""


@dataclass(frozen=True)
class Points:
    """Points y of a traced curve, in units of its scale, and its tangents t, both of shape (n, variables)."""

    setup: Setup
    y: Array
    t: Array

    def __len__(self) -> int:
        return len(self.y)

    @cached_property
    def x(self) -> Array:
        """The points in natural units."""
        return self.y * self.setup.curve.scale

    @property
    def unknowns(self) -> list[Array]:
        """The unknowns of the pattern, shape (n,) each."""
        setup = self.setup
        return setup.unknowns(self.y) if isinstance(setup, ChainSetup) else list(self.x[:, setup.unknown_columns].T)

    @property
    def speed(self) -> Array:
        """Speed of the free parameters along the curve, in units of the scale."""
        return np.asarray(np.linalg.norm(self.t[:, : len(self.setup.problem.free)], axis=1))

    @cached_property
    def parameters(self) -> dict[str, Array]:
        """Every parameter of the problem, shape (n,) each."""
        problem = self.setup.problem
        free = {n: _clip_rounding(v, *problem.free[n]) for n, v in design_at(problem, self.x).items()}
        return {n: np.array(np.broadcast_to(v, len(self)), dtype=float) for n, v in problem.ordered(free).items()}

    @cached_property
    def values(self) -> Values:
        """Quantities of the points."""
        z, problem = self.roots, self.setup.problem
        return Values(problem.model, problem.parameter_set, self.parameters, extra=(NO_RADIUS,)).with_known(
            {
                "abscissa": z.real.max(axis=-1),
                "damping_ratio": np.min(-z.real / (np.abs(z) + 1e-300), axis=-1),
                ANGULAR_FREQUENCY: z.imag.max(axis=-1),
            }
        )

    def __getitem__(self, name: str) -> Array:
        """A parameter, a quantity of the model or of the roots, or an unknown of the pattern, shape (n,)."""
        return self.named_unknowns[name] if name in self.named_unknowns else self.column(self.values[name])

    @property
    def names(self) -> list[str]:
        """Names that `__getitem__` accepts."""
        return [*self.values, *self.named_unknowns]

    @cached_property
    def named_unknowns(self) -> dict[str, Array]:
        """The unknowns by name."""
        pattern = self.setup.pattern
        return name_unknowns(pattern.name, dict(zip(pattern.unknowns, self.unknowns, strict=True)), self.parameters)

    @cached_property
    def stable(self) -> Truth:
        """Where all other roots are left of the imaginary axis by more than rounding errors."""
        return np.asarray(np.all(self.other_roots.real < -_ROUNDING * np.abs(self.other_roots), axis=-1))

    @property
    def heavily_damped(self) -> Truth:
        """Where all roots are real, and those that the pattern leaves free are negative."""
        is_real = np.all(np.abs(self.other_roots.imag) <= _REAL_TOLERANCE * np.abs(self.other_roots), axis=-1)
        can_be_damped = "W" not in self.setup.pattern.unknowns and not self.setup.problem.model.is_complex
        return np.asarray(self.stable & is_real & can_be_damped)

    @property
    def satisfied(self) -> Truth:
        """Where every inequality constraint holds."""
        limits = [c for c in self.setup.problem.conditions.values() if not c.equality]
        conditions_hold = [self.column(True), *(c.holds(self.column(c(self.values))) for c in limits)]
        return np.asarray(np.all(conditions_hold, axis=0))

    @property
    def residual(self) -> Array:
        """Largest mismatch of a coefficient, relative to its terms; of an equation of a chain, relative to L."""
        if isinstance(self.setup, ChainSetup):
            return np.asarray(self.setup.measure(self.y)[:, 0])
        monic = self.setup.pattern.monic(self.unknowns)
        a0 = self.column(self.values.coefficients[0])
        unit = self.column(mean_size(monic))
        unit = np.maximum(unit, np.median(unit)) + 1e-300  # where all roots are near 0, use the unit of the whole curve
        pairs = enumerate(zip(self.values.coefficients, monic, strict=True))
        terms = [(a - a0 * c, np.abs(a) + np.abs(a0 * c) + np.abs(a0) * unit**k) for k, (a, c) in pairs]
        # a size is 0 if all roots are 0
        return np.asarray(
            np.max([np.abs(mismatch) / np.where(size == 0, 1.0, size) for mismatch, size in terms], axis=0)
        )

    @property
    def special_cases(self) -> list[str]:
        """Special cases of the pattern that hold along the whole curve, up to rounding."""
        return [name for name in self.setup.pattern.marks if np.median(np.abs(self.mark(name))) <= ZERO_TOLERANCE]

    def mark(self, name: str) -> Array:
        """Values of the function that vanishes at a special case of the pattern."""
        pattern = self.setup.pattern
        return self.column(pattern.marks[name](pattern.scaled_unknowns(self.unknowns)))

    def column(self, value: Any) -> Array:
        """A value at each point."""
        return np.broadcast_to(np.asarray(value, dtype=float), len(self))

    @cached_property
    def roots(self) -> Complex:
        """All roots, of which the multiple ones are exact, shape (n, roots)."""
        if isinstance(self.setup, ChainSetup):
            return self._spectrum[0]
        return roots_along(self.setup.pattern.factors(self.unknowns), len(self))

    @cached_property
    def other_roots(self) -> Complex:
        """The roots that the pattern does not place on the imaginary axis."""
        if isinstance(self.setup, ChainSetup):
            return np.asarray(self._spectrum[0][:, ~self._spectrum[1]])
        return roots_along(self.setup.pattern.remaining_factors(self.unknowns), len(self))

    @cached_property
    def _spectrum(self) -> tuple[Complex, Truth]:
        assert isinstance(self.setup, ChainSetup)
        return self.setup.spectrum(self.y)


def _clip_rounding(v: Array, low: float, high: float) -> Array:
    """The values, where those that exceed a limit only by rounding errors are set to the limit."""
    clipped = np.clip(v, low, high)
    return np.where(np.abs(v - clipped) <= _ROUNDING * (1 + np.abs(v)), clipped, v)


def roots_along(factors: list[list[Any]], count: int) -> Complex:
    """Roots of factors along a curve, shape (count, roots); nan where they overflow, near infinity."""
    columns = [np.zeros((count, 0), dtype=complex)]
    for factor in factors:
        rows = np.stack([np.broadcast_to(np.asarray(c, dtype=float), count) for c in factor], axis=-1)
        is_finite = np.isfinite(rows).all(axis=1) & (rows[:, 0] != 0)
        columns.append(np.full((count, len(factor) - 1), np.nan, dtype=complex))
        columns[-1][is_finite] = roots(rows[is_finite])
    return np.concatenate(columns, axis=-1)


def is_on_axis(z: Complex) -> Truth:
    """Whether roots are on the imaginary axis, up to rounding."""
    return np.abs(z.real) <= _ROUNDING * np.abs(z)


def axis_functions(factor: list[Any]) -> list[Any]:
    """Functions of a factor. One of them vanishes if a root is on the imaginary axis, the first one if a root is 0."""
    return (
        lienard_chipart(factor)
        if len(factor) - 1 <= MAX_CLOSED_FORM_DEGREE
        else [factor[-1], opposite_roots_test(factor)]
    )
