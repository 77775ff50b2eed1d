"""The universal chart of quartics: scaling reduces every polynomial of degree 4 with a4/a0 > 0 to three numbers.

With s = |ω0| σ and ω0⁴ = a4/a0, the polynomial is σ⁴ + A1 σ³ + A2 σ² + A3 σ + 1. Stability, heavy damping and
exceptional points are sets of (A1, A2, A3) that are the same for every model.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from tmsopt.models import tms
from tmsopt.paper.locus import sweep_Fr
from tmsopt.paper.reference import table_1
from tmsopt.records import Array


@dataclass(frozen=True)
class UniversalPath:
    """The path of a design of Table 1 in the universal chart while Fr is swept.

    Attributes:
        name: name of the exceptional point of the design.
        tilt: λ_s in rad.
        A: columns A1, A2, A3, shape (n, 3); A1 = A3, because χ_B obeys the law.
        stability_onset: the point at which the design becomes stable, shape (3,).
        exceptional_point: the exceptional point, shape (3,).
    """

    name: str
    tilt: float
    A: Array
    stability_onset: Array
    exceptional_point: Array


def table_1_paths() -> list[UniversalPath]:
    """The three designs of Table 1 swept over 0 < Fr ≤ 5."""
    paths = []
    for bicycle in table_1():
        data = sweep_Fr(bicycle)
        onset_Fr = next(event.at for event in data.events if event.changes)
        Fr = np.array([onset_Fr, data.design, *data.values])
        a = tms.coefficients({**bicycle.parameters, "Fr": Fr}, tms.sets[0])
        onset, ep, *A = normalise_quartics(np.stack(np.broadcast_arrays(*a), axis=-1))
        paths.append(UniversalPath(bicycle.name, bicycle.parameters["lambda_s"], np.array(A), onset, ep))
    return paths


def normalise_quartics(coefficients: Array) -> Array:
    """A1, A2, A3 of shape (n, 3) for quartics a0 … a4 of shape (n, 5) with a4/a0 > 0."""
    monic = coefficients / coefficients[:, :1]
    return np.asarray(monic[:, 1:4] / monic[:, 4:] ** (np.arange(1, 4) / 4))


def ep_set(A1: ArrayLike) -> Array:
    """Points (A1, A2, A3) of the EP set, (σ² + (A1/2) σ + 1)²: CEP2 for |A1| < 4, EP4 for 4, 2EP2 for larger |A1|."""
    a = np.asarray(A1, dtype=float)
    return np.stack([a, 2 + a * a / 4, a], axis=-1)


def heavy_section(A1: ArrayLike) -> tuple[Array, Array]:
    """Smallest and largest A2 of heavy damping in the plane A3 = A1; nan for A1 < 4, where damping is never heavy.

    In this plane the polynomial is σ² (y² + A1 y + A2 − 2), y = σ + 1/σ. All σ are real and negative exactly if both y
    are real and at most −2: A2 ≤ 2 + A1²/4 and, as −A1/2 ≤ −2, A2 ≥ 2 A1 − 2.
    """
    a = np.where(np.greater_equal(A1, 4), A1, np.nan)
    return 2 * a - 2, 2 + a * a / 4


def spire(m: ArrayLike, t: ArrayLike) -> Array:
    """Quartics with the double root −eᵐ and the roots −e^(t−m) and −e^(−t−m), as points (A1, A2, A3).

    All m and t ≥ 0 give the whole boundary of heavy damping: (σ + x)² (σ² + b σ + 1/x²), x = eᵐ, b = 2 cosh t / x. The
    2EP2 line has t = 0, the cuspidal edges EP3 have t = ±2m, and these curves meet at EP4.
    """
    x, c = np.exp(np.asarray(m, dtype=float)), np.cosh(np.asarray(t, dtype=float))
    b = 2 * c / x
    return np.stack(np.broadcast_arrays(2 * x + b, x**2 + 2 * x * b + 1 / x**2, x**2 * b + 2 / x), axis=-1)


def spire_faces(limit: float, points: int = 41) -> tuple[Array, Array, Array]:
    """The three faces of the boundary of heavy damping up to max(A1, A3) = limit > 4, shape (points, points, 3) each.

    On the first face the double root has the largest modulus of all roots, on the second face the smallest, and on the
    third face a modulus between those of the other roots. The first axis of a face runs from EP4 to the limit. The
    second axis runs from one edge to another: from 2EP2 to EP3 on the first two faces, from EP3 to EP3 on the third.
    """
    u = np.linspace(0, 1, points)

    def face(m: Array, t: Array) -> Array:
        """Points (v m, v t): each column is a ray along which A1 and A3 grow from 4 to the limit."""

        def excess(v: float, m: float, t: float) -> float:
            return float(spire(v * m, v * t)[[0, 2]].max()) - limit

        ends = [brentq(excess, 0, 2 * np.log(limit), args=slopes) for slopes in zip(m, t, strict=True)]
        v = np.outer(u, ends)
        return spire(v * m, v * t)

    ones = np.ones(points)
    return face(ones, 2 * u), face(-ones, 2 * u), face(2 * u - 1, 2 * ones)
