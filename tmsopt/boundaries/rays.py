"""Finds where rays from a design first cross an edge of stability or of heavy damping.

The crossings give upper bounds of the distances to the edges, and starts for an optimiser.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tmsopt.boundaries.boundaries import find_crossed_edges, is_heavily_damped
from tmsopt.boundaries.weighted_design import WeightedDesign
from tmsopt.records import Array, Truth
from tmsopt.roots import is_stable, roots

_RAY_COUNT = 1000  # random rays
_RADII = np.concatenate([[0.0], np.geomspace(1e-4, 4.0, 36)])  # distances on a ray that are tested
_COARSE = (16, 2)  # (parts, rounds) in which the interval of every crossing is narrowed
_FINE = (256, 6)  # the same for selected crossings, to full precision
_MAX_CROSSINGS = 5  # crossings of one edge
_SAME_DIRECTION = 0.9  # cosine above which two directions count as one
_RANDOM_STARTS = 4  # with 4 instead of none, 11 of 196 random systems had nearer points; 6 starts helped no others
_SEGMENT_POINTS = 400  # points that are tested on the segment from the design to a nearest point
_RADII_AROUND_DESIGN = np.array([0.1, 0.3, 1.0])  # distances of starts for an optimiser
_STEP = 1e-6  # step of finite differences; they only select directions, so they need no accuracy
_is_stable = partial(is_stable, exact=False)  # up to rounding


@dataclass(frozen=True)
class RayCrossing:
    """A point just outside an edge of stability or of heavy damping.

    Attributes:
        edge: name of the edge.
        sign: sign of a0 on the stable, or heavily damped, side.
        u: displacement from the design in weights.
        distance: length of u.
    """

    edge: str
    sign: float
    u: Array
    distance: float


def find_ray_crossings(base: WeightedDesign, with_damping: bool = True) -> list[RayCrossing]:
    """The nearest few crossings of each edge in different directions, nearest first.

    Args:
        with_damping: whether to include the edges of heavy damping.
    """
    return find_crossings(base, list_directions(base), _RADII, with_damping)


def find_crossings_on_segment(base: WeightedDesign, u: Array, with_damping: bool) -> list[RayCrossing]:
    """Crossings on the segment from the design to u, without its end."""
    return find_crossings(base, u[None, :], np.linspace(0.0, 1.0, _SEGMENT_POINTS)[:-1], with_damping)


def find_crossings(base: WeightedDesign, rays: Array, t: Array, with_damping: bool) -> list[RayCrossing]:
    """Crossings along the displacements t · ray; t ascends."""
    c = base.coefficients(base.clip_rays(rays[:, None, :], t))
    crossings: list[RayCrossing] = []
    for is_damping, test in ((False, _is_stable), (True, is_heavily_damped))[: 1 + with_damping]:
        is_inside = test(c)
        ray, step = np.nonzero(is_inside[:, 1:] != is_inside[:, :-1])
        brackets = _Brackets(base, test, rays[ray], t[step], t[step + 1], is_inside[ray, step]).narrow(*_COARSE)
        names = [find_crossed_edges(c, is_damping) for c in brackets.outer_coefficients()[0]]
        distance = np.linalg.norm(base.clip_rays(brackets.rays, brackets.high), axis=1)
        for name in sorted({n for row_names in names for n in row_names}):
            rows = [k for k in np.argsort(distance, kind="stable") if name in names[k]]
            crossings += brackets.select(_select_different(brackets.rays, rows)).narrow(*_FINE).crossings(is_damping)
    return sorted(crossings, key=lambda x: x.distance)


def list_directions(base: WeightedDesign) -> Array:
    """Unit vectors along ± each axis, along ± the gradient of each edge function, and in random directions."""
    axes = np.eye(len(base.lower))
    random = np.random.default_rng(0).standard_normal((_RAY_COUNT if len(axes) > 1 else 0, len(axes)))
    coefficients = base.coefficients(_STEP * np.concatenate([axes, -axes]))
    slopes = (_edge_functions(coefficients[: len(axes)]) - _edge_functions(coefficients[len(axes) :])).T
    slopes = slopes[np.all(np.isfinite(slopes), axis=1) & np.any(slopes != 0, axis=1)]
    largest = np.abs(slopes).max(axis=1, keepdims=True, initial=0.0)
    slopes = np.ldexp(slopes, -np.frexp(largest)[1])  # so that squares do not overflow
    rays = np.concatenate([axes, -axes, slopes, -slopes, random])
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def find_most_damped(base: WeightedDesign, sign: float) -> list[Array]:
    """The design, and the points around it with the largest damping ratios among those where a0 has this sign."""
    rays = list_directions(base)
    u = base.clip_rays(rays[:, None, :], _RADII_AROUND_DESIGN).reshape(-1, rays.shape[1])
    c = sign * base.coefficients(u)
    is_start = np.any(u != 0, axis=1) & np.all(np.isfinite(c), axis=1) & (c[:, 0] > 0) & _is_stable(c)
    u, c = u[is_start], c[is_start]
    ratio = np.min(-(z := roots(c)).real / np.abs(z), axis=1) if len(c) else np.zeros(0)
    rows = np.argsort(-ratio, kind="stable").tolist()
    return [np.zeros(rays.shape[1]), *u[_select_different(u, rows)]]


def draw_points(base: WeightedDesign, distance: float, seed: int) -> list[Array]:
    """A few points at a distance in random directions, stable or not."""
    rays = np.random.default_rng(seed).standard_normal((_RANDOM_STARTS, len(base.lower)))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return [*base.clip_rays(rays, np.full(_RANDOM_STARTS, distance))]


def _edge_functions(c: Array) -> Array:
    """Functions that vanish on the edges: a0, aₙ, ∏ −(zᵢ + zⱼ) and ∏ (zᵢ − zⱼ)² over pairs of roots, shape (…, 4).

    The third is Δₙ₋₁ divided by a power of a0 (Orlando's formula). The fourth is the discriminant divided by another
    power of a0.
    """
    is_proper = np.all(np.isfinite(c), axis=-1) & (c[..., 0] != 0)
    z = roots(np.where(is_proper[..., None], c, np.eye(c.shape[-1])[0]))
    first, second = np.triu_indices(z.shape[-1], 1)
    sums, differences = z[..., first] + z[..., second], z[..., first] - z[..., second]
    hurwitz, discriminant = np.prod(-sums, axis=-1).real, np.prod(differences * differences, axis=-1).real
    return np.stack(
        [c[..., 0], c[..., -1], *(np.where(is_proper, x, np.nan) for x in (hurwitz, discriminant))], axis=-1
    )


def _select_different(rays: Array, rows: list[int]) -> NDArray[np.int_]:
    """The first few of these rows of `rays` that have clearly different directions."""
    unit = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    selected_rows: list[int] = []
    for k in rows:
        if len(selected_rows) < _MAX_CROSSINGS and all(
            float(unit[k] @ unit[selected]) < _SAME_DIRECTION for selected in selected_rows
        ):
            selected_rows.append(k)
    return np.array(selected_rows, dtype=int)


@dataclass(frozen=True)
class _Brackets:
    """Rays with an interval low < t < high in which the result of a test changes.

    Attributes:
        is_inside: result of the test at t = low, for each ray.
    """

    base: WeightedDesign
    test: Callable[[Array], Truth]
    rays: Array
    low: Array
    high: Array
    is_inside: Truth

    def select(self, rows: NDArray[np.int_]) -> "_Brackets":
        """Return the brackets of these rays."""
        return replace(
            self, rays=self.rays[rows], low=self.low[rows], high=self.high[rows], is_inside=self.is_inside[rows]
        )

    def coefficients(self, t: Array) -> Array:
        """Coefficients at t of shape (rays,) or (rays, points)."""
        rays = self.rays if t.ndim == 1 else self.rays[:, None, :]
        return self.base.coefficients(self.base.clip_rays(rays, t))

    def narrow(self, parts: int, rounds: int) -> "_Brackets":
        """Narrow each bracket to the first change in it: test several points in each round."""
        low, high = self.low, self.high
        rays = np.arange(len(low))
        for _ in range(rounds):
            t = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, parts + 1)
            has_changed = self.test(self.coefficients(t[:, 1:-1])) != self.is_inside[:, None]
            first = np.where(has_changed.any(axis=1), has_changed.argmax(axis=1) + 1, parts)
            low, high = t[rays, first - 1], t[rays, first]
        return replace(self, low=low, high=high)

    def outer_coefficients(self) -> tuple[Array, Array]:
        """Return the coefficients on the outer side, multiplied by the sign of a0 on the inner side, and this sign."""
        inner, outer = (
            self.coefficients(np.where(self.is_inside == side, self.low, self.high)) for side in (True, False)
        )
        sign = np.sign(inner[:, 0])
        return sign[:, None] * outer, sign

    def crossings(self, is_damping: bool) -> list[RayCrossing]:
        """The crossings, one for each ray and edge."""
        outer, sign = self.outer_coefficients()
        u = self.base.clip_rays(self.rays, self.high)
        return [
            RayCrossing(name, float(sign[k]), u[k], float(np.linalg.norm(u[k])))
            for k, c in enumerate(outer)
            for name in find_crossed_edges(c, is_damping)
        ]
