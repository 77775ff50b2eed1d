"""Checks in exact arithmetic that a point that a solver found is on a boundary.

A solver can satisfy the equations of a boundary at points around which stability does not change: where coefficients
are differences of large numbers, or where all coefficients vanish.
"""

from collections.abc import Iterator

import flint
import numpy as np

from tmsopt.boundaries.boundaries import EDGE_TOLERANCE, is_heavily_damped
from tmsopt.boundaries.rays import list_directions
from tmsopt.boundaries.weighted_design import WeightedDesign
from tmsopt.problem.problem import Posed
from tmsopt.records import Array, Numbers
from tmsopt.roots import exact_roots, is_stable, multiple_real_roots, routh, shift

BITS = 400
"""Precision in bits of the intervals that decide signs; an undecided sign counts as 0."""

_REACHES = (1e-6, 1e-4, 1e-2)  # radii around a point at which stability is tested, relative to its distance
_MIN_RADIUS = 1e-9  # smallest change that doubles resolve, in weights
_MAX_TESTS = 4  # designs for each radius that exact arithmetic tests
_SHIFTS, _NEAR = (1e-4, 1e-3, 1e-2), 0.05  # shifts of the roots; largest displacement, relative to the distance
_ROUNDS, _STEP = 4, 1e-6  # Gauss–Newton steps; step of their finite differences
_NONE = 1e-10  # a coefficient below this part of its terms counts as 0


def is_boundary(base: WeightedDesign, u: Array, heavy: bool) -> bool:
    """Whether a displacement leads to a change of stability, or to the edge of heavy damping.

    Exact arithmetic must find a design next to the point whose stability differs from that of the design itself. The
    edge of heavy damping may be the tip of a cusp for a design outside it; then it suffices that all roots at the point
    are real and negative.
    """
    c = base.coefficients(u)
    if not u.any():
        return True  # the design itself is on the edge
    if not np.all(np.isfinite(c)) or np.all(np.abs(c) <= _NONE * base.sizes):
        return False
    own_verdict = base.heavily_damped if heavy else base.stable
    if heavy and not own_verdict and np.all(np.abs(c) > _NONE * base.sizes):
        roots = multiple_real_roots(c, EDGE_TOLERANCE)
        if roots is not None and all(r.re < 0 for r in roots):
            return True
    test = _has_negative_real_roots if heavy else is_exactly_stable
    return any(
        test(base.problem, base.design(v)) != own_verdict for v in _find_changes_nearby(base, u, heavy, own_verdict)
    )


def _find_changes_nearby(base: WeightedDesign, u: Array, heavy: bool, own_verdict: bool) -> Iterator[Array]:
    """Displacements near u at which the test in doubles differs from the verdict for the design itself."""
    size = float(np.linalg.norm(u))
    rays = np.concatenate([[u / size, -u / size], list_directions(base)])
    for reach in _REACHES:
        points = np.clip(u + max(reach * size, _MIN_RADIUS) * rays, base.lower, base.upper)
        c = base.coefficients(points)
        verdict = is_heavily_damped(np.sign(c[:, :1]) * c) if heavy else is_stable(c, exact=False)
        yield from points[np.flatnonzero(verdict != own_verdict)[:_MAX_TESTS]]
    if not heavy and not own_verdict:  # towards a corner with a multiple root, stable designs are few
        yield from (
            v for left in _SHIFTS if np.linalg.norm((v := _shift_roots_left(base, u, left)) - u) <= _NEAR * size
        )


def _shift_roots_left(base: WeightedDesign, u: Array, step: float) -> Array:
    """A displacement that moves all roots left by a step, roots at infinity too; found by Gauss–Newton steps."""
    target = shift(shift(base.coefficients(u).tolist(), step)[::-1], step)[::-1]
    v = u
    for _ in range(_ROUNDS):
        steps = _STEP * np.eye(len(u))
        slope = (base.coefficients(v + steps) - base.coefficients(v - steps)) / (2 * _STEP)
        v = v + np.linalg.lstsq(slope.T, np.array(target) - base.coefficients(v), rcond=None)[0]
        v = np.clip(v, base.lower, base.upper)
    return v


def is_exactly_stable(problem: Posed, parameters: Numbers) -> bool:
    """Whether all roots of the design as stored are proved to be left of the imaginary axis, by intervals."""
    with flint.ctx.workprec(BITS):
        c = _balls(problem, parameters)
        return all(x * c[0] > 0 for x in routh(c))


def _has_negative_real_roots(problem: Posed, parameters: Numbers) -> bool:
    with flint.ctx.workprec(BITS):
        c = _balls(problem, parameters)
        if c[0].contains(0):
            return False
    return all(root.im == 0 and root.re < 0 for root in exact_roots(c))


def _balls(problem: Posed, parameters: Numbers) -> list[flint.arb]:
    balls = {n: flint.arb(float(x)) for n, x in parameters.items()}
    return [flint.arb(c) for c in problem.model.coefficients(balls, problem.parameter_set)]
