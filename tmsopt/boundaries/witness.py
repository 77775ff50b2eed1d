"""Whether a boundary point is one in exact arithmetic.

Where coefficients are differences of large numbers, or all vanish together, an optimiser meets its equations at points
around which nothing changes.
"""

from collections.abc import Iterator

import flint
import numpy as np

from tmsopt.boundaries.boundaries import MATCHED, heavily_damped
from tmsopt.boundaries.rays import directions
from tmsopt.boundaries.surroundings import WeightedDesign
from tmsopt.problem.problem import Posed
from tmsopt.records import Array, Numbers
from tmsopt.roots import exact_roots, is_stable, multiple_real_roots, routh, shift

BITS = 400
"""Of the balls in which a sign is decided; one that they leave open is 0."""

_BESIDE = (1e-6, 1e-4, 1e-2)  # of the distance: how far from a point a change of stability is looked for
_LEAST = 1e-9  # of the weights: changes that doubles tell apart
_FEW = 4  # designs there that exact arithmetic is asked about
_LEFT, _NEAR = (1e-4, 1e-3, 1e-2), 0.05  # of the roots' size, to move them; of the distance, that this may take
_ROUNDS, _STEP = 4, 1e-6
_NONE = 1e-10  # of the terms of the design's own coefficients: below it there is no polynomial


def is_boundary(place: WeightedDesign, u: Array, heavy: bool) -> bool:
    """Whether a displacement leads to where stability changes, or to the edge of heavy damping.

    Designs right beside the point must differ from the design itself, in balls at their doubles. From outside, that
    edge may be the tip of a cusp: real and negative roots at the point do as well.
    """
    c = place.coefficients(u)
    if not u.any():
        return True  # the design itself is met by the equations of the edge
    if not np.all(np.isfinite(c)) or np.all(np.abs(c) <= _NONE * place.sizes):
        return False
    within = place.heavily_damped if heavy else place.stable
    if heavy and not within and np.all(np.abs(c) > _NONE * place.sizes):
        roots = multiple_real_roots(c, MATCHED)
        if roots is not None and all(r.re < 0 for r in roots):
            return True
    test = _all_real if heavy else exactly_stable
    return any(test(place.problem, place.design(v)) != within for v in _beside(place, u, heavy, within))


def _beside(place: WeightedDesign, u: Array, heavy: bool, within: bool) -> Iterator[Array]:
    """Displacements near one at which doubles find the other verdict."""
    size = float(np.linalg.norm(u))
    around = np.concatenate([[u / size, -u / size], directions(place)])
    for reach in _BESIDE:
        points = np.clip(u + max(reach * size, _LEAST) * around, place.lower, place.upper)
        at = place.coefficients(points)
        verdict = heavily_damped(np.sign(at[:, :1]) * at) if heavy else is_stable(at, exact=False)
        yield from points[np.flatnonzero(verdict != within)[:_FEW]]
    if not heavy and not within:  # towards a corner with a multiple root, stable designs are few
        yield from (v for left in _LEFT if np.linalg.norm((v := _moved_left(place, u, left)) - u) <= _NEAR * size)


def _moved_left(place: WeightedDesign, u: Array, left: float) -> Array:
    """A displacement at which all roots lie further to the left than at u, those at infinity too, by Gauss-Newton."""
    target = shift(shift(place.coefficients(u).tolist(), left)[::-1], left)[::-1]
    v = u
    for _ in range(_ROUNDS):
        steps = _STEP * np.eye(len(u))
        slope = (place.coefficients(v + steps) - place.coefficients(v - steps)) / (2 * _STEP)
        v = v + np.linalg.lstsq(slope.T, np.array(target) - place.coefficients(v), rcond=None)[0]
        v = np.clip(v, place.lower, place.upper)
    return v


def exactly_stable(problem: Posed, parameters: Numbers) -> bool:
    """Whether all roots of the design as stored lie left of the imaginary axis, in ball arithmetic."""
    with flint.ctx.workprec(BITS):
        c = _balls(problem, parameters)
        return all(x * c[0] > 0 for x in routh(c))


def _all_real(problem: Posed, parameters: Numbers) -> bool:
    with flint.ctx.workprec(BITS):
        c = _balls(problem, parameters)
        if c[0].contains(0):
            return False
    return all(root.im == 0 and root.re < 0 for root in exact_roots(c))


def _balls(problem: Posed, parameters: Numbers) -> list[flint.arb]:
    at = {n: flint.arb(float(x)) for n, x in parameters.items()}
    return [flint.arb(c) for c in problem.model.coefficients(at, problem.parameter_set)]
