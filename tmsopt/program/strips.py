"""The angular frequency as a variable with factors: half the width of a strip about the real axis."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from tmsopt.models import Values
from tmsopt.program.lifts import TWO_FACTORS, Lifted, Rows, factors_of
from tmsopt.program.nlp import AddedVariable, Contact, Factor
from tmsopt.records import Array
from tmsopt.roots import product
from tmsopt.roots.patterns.pattern import Roots


def lift_angular_frequency(build: Rows) -> Lifted:
    """Ω with p = a0 ∏ (s² + pᵢ s + qᵢ), pᵢ² + 4 Ω² ≥ 4 qᵢ, Ω ≥ 0, in every case: at or above every |Im s|.

    pᵢ² + 4 Ω² = 4 qᵢ puts a pair on the edge of the strip; with real roots alone, Ω = 0. An odd degree has one factor
    s + d more. Where the NLP goes as far as a0 = 0, the first factor is m s² + p s + q, m = ±a0, and
    p² + 4 m² Ω² ≥ 4 m q; of an odd degree the linear one is m s + d instead.
    """
    covered, first, lead = build.covered, build.size[0], build.lead
    omega = build.variable("angular_frequency", 0.0)
    touches = [Contact(lambda x: 0.0, variable=first)]
    products: list[tuple[Factor, ...]] = []
    for case in covered:
        a, factors = build.polynomial(case), list[Factor]()
        monic: list[list[Any]] = []
        odd = len(a) % 2 == 0
        if lead:
            build.row("a0", lead * a[0], 0.0, np.inf)
        for k in range(1, (len(a) - 1) // 2 + 1):
            at, led = build.size[0], lead and k == 1 and not odd
            p, q, m = build.variable(f"p{k}.{case}"), build.variable(f"q{k}.{case}"), lead * a[0] if led else 1
            monic.append([m, p, q])
            build.row("angular_frequency", p * p + 4 * m * m * omega * omega - 4 * m * q, 0.0, np.inf)
            if not led:
                factors.append(Factor(at))
            if not led or len(a) <= TWO_FACTORS:
                touches.append(Contact(partial(_strip_distance, at), row=build.size[1] - 1))
        if odd:
            if not lead:
                factors.append(Factor(build.size[0], linear=True))
            monic.append([lead * a[0] if lead else 1, build.variable(f"d.{case}")])
        build.equal("angular_frequency", a, [(lead or a[0]) * c for c in product(*monic)])
        products.append(tuple(factors))
    guess, close = (partial(_guess, covered, near, abs(lead) / build.leading_unit) for near in (False, True))
    lift = AddedVariable("angular_frequency", build.size[0] - first, guess, close)
    return Lifted(build.unit * omega, lift, tuple(touches), tuple(products))


def _strip_distance(at: int, x: Array) -> float:
    """Minus the imaginary part of a pair, the greatest of which is on the edge; positive for two real roots."""
    off = x[at] ** 2 / 4 - x[at + 1]
    return float(np.copysign(np.sqrt(abs(off)), off))


def _guess(
    covered: Sequence[int], near: bool, led: float, values: Sequence[Values], z: Sequence[Roots]
) -> list[list[float]]:
    """Ω a little more than it is, and the factors: feasible exactly."""
    every = np.concatenate([z[case] for case in covered])
    omega = float(np.abs(every.imag).max()) + (1e-6 if near else 0.05 * float(np.abs(every).mean()) + 1e-3)
    leads = [led * abs(float(values[case].coefficients[0])) if led else 1.0 for case in covered]
    return [[omega, *(c for case, a0 in zip(covered, leads, strict=True) for c in factors_of(z[case], 0.0, a0))]]
