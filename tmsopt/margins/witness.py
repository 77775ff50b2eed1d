"""Whether a boundary point is one in exact arithmetic.

Where coefficients are differences of large numbers, or all vanish together, an optimiser meets its equations at points
around which nothing changes.
"""

from collections.abc import Mapping

import flint
import numpy as np

from tmsopt.design.problem import Problem
from tmsopt.margins.axis import edges_at
from tmsopt.margins.boundaries import heavily_damped
from tmsopt.margins.rays import directions
from tmsopt.margins.surroundings import Place
from tmsopt.records import Array
from tmsopt.roots import exact_roots, is_stable, lienard_chipart, routh

BITS = 400
"""Of the balls in which a sign is decided; one that they leave open is 0."""

_BESIDE = (1e-6, 1e-4, 1e-2)  # of the distance: how far from a point a change of stability is looked for
_FEW = 4  # designs there that exact arithmetic is asked about
_NONE = 1e-10  # of the terms of the design's own coefficients: below it there is no polynomial
_SMALL = 4  # degree up to which Liénard–Chipart's conditions have few terms


def is_boundary(place: Place, u: Array, heavy: bool) -> bool:
    """Whether a displacement leads to where stability changes, or to the edge of heavy damping.

    Of a design that is not heavily damped that edge may be the tip of a cusp: the roots there must be real and
    negative. Else designs right beside the point must differ from the design itself, in balls at their doubles.
    """
    c = np.abs(place.space.coefficients(u))
    if not np.all(np.isfinite(c)) or np.all(c <= _NONE * place.sizes):
        return False
    if heavy and not place.heavily_damped:
        there = place.design(u)
        roots = place.problem.values(there)["structure"].roots
        return bool(roots) and all(r.im == 0 > r.re for r in roots) and not edges_at(place.problem, there)
    inside = heavy or place.stable
    size = float(np.linalg.norm(u))
    around = np.concatenate([[u / size, -u / size], directions(place.space, seed=0)])
    for reach in _BESIDE:
        points = np.clip(u + reach * size * around, place.space.lower, place.space.upper)
        at = place.space.coefficients(points)
        verdict = heavily_damped(np.sign(at[:, :1]) * at) if heavy else is_stable(at, exact=False)
        test = _all_real if heavy else exactly_stable
        if any(
            test(place.problem, place.design(points[k])) != inside for k in np.flatnonzero(verdict != inside)[:_FEW]
        ):
            return True
    return False


def exactly_stable(problem: Problem, parameters: Mapping[str, float]) -> bool:
    """Whether all roots of the design as stored lie left of the imaginary axis, in ball arithmetic."""
    with flint.ctx.workprec(BITS):
        c = _balls(problem, parameters)
        if not (c[0] > 0 or c[0] < 0):
            return False
        signed = [-x for x in c] if c[0] < 0 else c
        tests = lienard_chipart(signed) if len(c) <= _SMALL + 1 else routh(signed)
        return all(x > 0 for x in tests)


def _all_real(problem: Problem, parameters: Mapping[str, float]) -> bool:
    with flint.ctx.workprec(BITS):
        c = _balls(problem, parameters)
        if c[0].contains(0):
            return False
    return all(root.im == 0 and root.re < 0 for root in exact_roots(c))


def _balls(problem: Problem, parameters: Mapping[str, float]) -> list[flint.arb]:
    at = {n: flint.arb(float(x)) for n, x in parameters.items()}
    return [flint.arb(c) for c in problem.model.coefficients(at, problem.parameter_set)]
