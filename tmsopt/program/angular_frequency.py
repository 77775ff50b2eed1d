"""The angular frequency as a variable with factors: the half-width of a strip around the real axis."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from tmsopt.models import Values
from tmsopt.program.lifts import LiftedQuantity, ProgramBuilder, factors_of, lift_factors
from tmsopt.program.nlp import AddedVariable, Contact
from tmsopt.records import Array
from tmsopt.roots.patterns.pattern import Roots


def lift_angular_frequency(build: ProgramBuilder) -> LiftedQuantity:
    """Ω with p = a0 ∏ (s² + pᵢ s + qᵢ), pᵢ² + 4 Ω² ≥ 4 qᵢ, Ω ≥ 0, in every case: at or above every |Im s|.

    pᵢ² + 4 Ω² = 4 qᵢ puts a pair on the edge of the strip; real roots alone allow Ω = 0. An odd degree adds one factor
    s + d. If the NLP reaches a0 = 0, the first factor is m s² + p s + q with m = ±a0 and p² + 4 m² Ω² ≥ 4 m q; for an
    odd degree the linear factor is m s + d instead.
    """
    first = build.size[0]
    omega = build.variable("angular_frequency", 0.0)

    def quadratic(k: int, case: int, lead: Any) -> tuple[list[Any], list[Contact]]:
        at = build.size[0]
        p, q, m = build.variable(f"p{k}.{case}"), build.variable(f"q{k}.{case}"), 1 if lead is None else lead
        build.row("angular_frequency", p * p + 4 * m * m * omega * omega - 4 * m * q, 0.0, np.inf)
        return [m, p, q], [Contact(partial(_strip_distance, at), row=build.size[1] - 1)]

    contacts, products = lift_factors(build, "angular_frequency", quadratic, linear=("d", -np.inf))
    scale = abs(build.lead) / build.leading_unit
    guess, close = (partial(_guess, build.covered_cases, near, scale) for near in (False, True))
    lift = AddedVariable("angular_frequency", build.size[0] - first, guess, close)
    all_real = Contact(lambda x: 0.0, variable=first)
    return LiftedQuantity(build.unit * omega, lift, (all_real, *contacts), products)


def _strip_distance(at: int, x: Array) -> float:
    """Minus the imaginary part of a pair, the largest of which is on the edge; positive for two real roots."""
    off = x[at] ** 2 / 4 - x[at + 1]
    return float(np.copysign(np.sqrt(abs(off)), off))


def _guess(
    cases: Sequence[int], near: bool, lead_scale: float, values: Sequence[Values], z: Sequence[Roots]
) -> list[list[float]]:
    """Ω slightly above its value, and the factors: exactly feasible."""
    every = np.concatenate([z[case] for case in cases])
    omega = float(np.abs(every.imag).max()) + (1e-6 if near else 0.05 * float(np.abs(every).mean()) + 1e-3)
    leads = [lead_scale * abs(float(values[case].coefficients[0])) if lead_scale else 1.0 for case in cases]
    return [[omega, *(c for case, a0 in zip(cases, leads, strict=True) for c in factors_of(z[case], 0.0, a0))]]
