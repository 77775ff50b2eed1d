"""Checks in exact arithmetic whether a point that a solver found is on a boundary.

A solver can satisfy the equations of a boundary at points near which stability does not change: where coefficients are
differences of large numbers, or where all coefficients vanish.
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

_TEST_RADII = (1e-6, 1e-4, 1e-2)  # radii around a point at which stability is tested, relative to its distance
_MIN_RADIUS = 1e-9  # smallest change that doubles resolve, in weights
_MAX_TESTS = 4  # designs for each radius that exact arithmetic tests
_SHIFTS = (1e-4, 1e-3, 1e-2)  # distances by which all roots are moved left
_MAX_DISPLACEMENT = 0.05  # largest distance that such a move may shift the point, relative to its own distance
_STEP_COUNT = 4  # Gauss–Newton steps of such a move
_STEP = 1e-6  # step of their finite differences
_NEGLIGIBLE = 1e-10  # a coefficient below this part of its terms counts as 0


def is_boundary(base: WeightedDesign, u: Array, is_damping: bool) -> bool:
    """Whether stability, or heavy damping if `is_damping`, changes at a displacement from the design.

    Exact arithmetic must find a point nearby at which the verdict differs from the verdict on the design itself. For a
    design that is not heavily damped, the point may be the tip of a cusp; then it is enough that all roots at the point
    are real and negative.
    """
    c = base.coefficients(u)
    if not u.any():
        return True  # the design itself is on the edge
    if not np.all(np.isfinite(c)) or np.all(np.abs(c) <= _NEGLIGIBLE * base.sizes):
        return False
    own_verdict = base.is_heavily_damped if is_damping else base.is_stable
    if is_damping and not own_verdict and np.all(np.abs(c) > _NEGLIGIBLE * base.sizes):
        roots = multiple_real_roots(c, EDGE_TOLERANCE)
        if roots is not None and all(r.re < 0 for r in roots):
            return True
    test = _has_negative_real_roots if is_damping else is_exactly_stable
    return any(
        test(base.problem, base.design(v)) != own_verdict
        for v in _find_changes_nearby(base, u, is_damping, own_verdict)
    )


def _find_changes_nearby(base: WeightedDesign, u: Array, is_damping: bool, own_verdict: bool) -> Iterator[Array]:
    """Yield displacements near u for which the test in doubles differs from the verdict on the design itself."""
    size = float(np.linalg.norm(u))
    rays = np.concatenate([[u / size, -u / size], list_directions(base)])
    for radius in _TEST_RADII:
        points = np.clip(u + max(radius * size, _MIN_RADIUS) * rays, base.lower, base.upper)
        c = base.coefficients(points)
        verdict = is_heavily_damped(np.sign(c[:, :1]) * c) if is_damping else is_stable(c, exact=False)
        yield from points[np.flatnonzero(verdict != own_verdict)[:_MAX_TESTS]]
    if not is_damping and not own_verdict:  # near a multiple root, few designs are stable
        yield from (
            v
            for step in _SHIFTS
            if np.linalg.norm((v := _shift_roots_left(base, u, step)) - u) <= _MAX_DISPLACEMENT * size
        )


def _shift_roots_left(base: WeightedDesign, u: Array, step: float) -> Array:
    """A displacement that moves all roots left by a step, roots at infinity too; found by Gauss–Newton steps."""
    target = shift(shift(base.coefficients(u).tolist(), step)[::-1], step)[::-1]
    v = u
    for _ in range(_STEP_COUNT):
        steps = _STEP * np.eye(len(u))
        slope = (base.coefficients(v + steps) - base.coefficients(v - steps)) / (2 * _STEP)
        v = v + np.linalg.lstsq(slope.T, np.array(target) - base.coefficients(v), rcond=None)[0]
        v = np.clip(v, base.lower, base.upper)
    return v


def is_exactly_stable(problem: Posed, parameters: Numbers) -> bool:
    """Whether all roots of the design as stored are proved to be left of the imaginary axis, by intervals."""
    with flint.ctx.workprec(BITS):
        c = _coefficient_balls(problem, parameters)
        return all(x * c[0] > 0 for x in routh(c))


def _has_negative_real_roots(problem: Posed, parameters: Numbers) -> bool:
    with flint.ctx.workprec(BITS):
        c = _coefficient_balls(problem, parameters)
        if c[0].contains(0):
            return False
    return all(root.im == 0 and root.re < 0 for root in exact_roots(c))


def _coefficient_balls(problem: Posed, parameters: Numbers) -> list[flint.arb]:
    balls = {n: flint.arb(float(x)) for n, x in parameters.items()}
    return [flint.arb(c) for c in problem.model.coefficients(balls, problem.parameter_set)]
