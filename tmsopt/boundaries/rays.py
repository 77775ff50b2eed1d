"""Where rays from a design first cross the boundaries: upper bounds of the distances, and starts for an optimiser."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tmsopt.boundaries.boundaries import find_crossed_edges, is_heavily_damped
from tmsopt.boundaries.weighted_design import WeightedDesign
from tmsopt.records import Array, Truth
from tmsopt.roots import is_stable, roots

_DIRECTIONS = 1000
_RADII = np.concatenate([[0.0], np.geomspace(1e-4, 4.0, 36)])
_COARSE, _FINE = (16, 2), (256, 6)  # (parts, rounds) for all crossings, and for those kept, to all digits
_KEPT = 5
_SAME_DIRECTION = 0.9  # cosine above which two directions count as one
_DRAWN = 4  # random starts; 4 led 11 of 196 random systems of degrees 6 to 8 to nearer points, 6 found no more
_POINTS = 400  # tested on the straight way to a nearest point
_RADII_AROUND = np.array([0.1, 0.3, 1.0])
_STEP = 1e-6  # of finite differences, which only choose directions
_stable = partial(is_stable, exact=False)  # up to rounding


@dataclass(frozen=True)
class RayCrossing:
    """A point just beyond an edge.

    Attributes:
        edge: name of the edge.
        sign: sign of a0 on the stable, or heavily damped, side.
    """

    edge: str
    sign: float
    u: Array
    distance: float


def find_ray_crossings(base: WeightedDesign, with_damping: bool = True) -> list[RayCrossing]:
    """The nearest few crossings of each edge in different directions, nearest first.

    Args:
        with_damping: include the edges of heavy damping.
    """
    return find_crossings(base, list_directions(base), _RADII, with_damping)


def find_crossings_before(base: WeightedDesign, u: Array, with_damping: bool) -> list[RayCrossing]:
    """Crossings on the straight way to u, before its end."""
    return find_crossings(base, u[None, :], np.linspace(0.0, 1.0, _POINTS)[:-1], with_damping)


def find_crossings(base: WeightedDesign, rays: Array, t: Array, with_damping: bool) -> list[RayCrossing]:
    """Crossings along the displacements t · ray, t ascending."""
    c = base.coefficients(base.clip_rays(rays[:, None, :], t))
    found: list[RayCrossing] = []
    for heavy, test in ((False, _stable), (True, is_heavily_damped))[: 1 + with_damping]:
        inside = test(c)
        ray, step = np.nonzero(inside[:, 1:] != inside[:, :-1])
        brackets = _Bracket(base, test, rays[ray], t[step], t[step + 1], inside[ray, step]).narrow(*_COARSE)
        names = [find_crossed_edges(c, heavy) for c in brackets.sides()[0]]
        distance = np.linalg.norm(base.clip_rays(brackets.rays, brackets.high), axis=1)
        for name in sorted({n for each in names for n in each}):
            rows = [k for k in np.argsort(distance, kind="stable") if name in names[k]]
            found += brackets.rows(_select_different(brackets.rays, rows)).narrow(*_FINE).crossings(heavy)
    return sorted(found, key=lambda x: x.distance)


def list_directions(base: WeightedDesign) -> Array:
    """Unit vectors: the axes, the gradients of the boundaries both ways, and random ones."""
    axes = np.eye(len(base.lower))
    random = np.random.default_rng(0).standard_normal((_DIRECTIONS if len(axes) > 1 else 0, len(axes)))
    near = base.coefficients(_STEP * np.concatenate([axes, -axes]))
    slopes = (_edge_functions(near[: len(axes)]) - _edge_functions(near[len(axes) :])).T
    slopes = slopes[np.all(np.isfinite(slopes), axis=1) & np.any(slopes != 0, axis=1)]
    largest = np.abs(slopes).max(axis=1, keepdims=True, initial=0.0)
    slopes = np.ldexp(slopes, -np.frexp(largest)[1])  # so that squares do not overflow
    every = np.concatenate([axes, -axes, slopes, -slopes, random])
    return np.asarray(every / np.linalg.norm(every, axis=1, keepdims=True))


def find_most_damped(base: WeightedDesign, sign: float) -> list[Array]:
    """The design, and points around it whose smallest damping ratio is largest, for a given sign of a0."""
    rays = list_directions(base)
    u = base.clip_rays(rays[:, None, :], _RADII_AROUND).reshape(-1, rays.shape[1])
    c = sign * base.coefficients(u)
    kept = np.any(u != 0, axis=1) & np.all(np.isfinite(c), axis=1) & (c[:, 0] > 0) & _stable(c)
    u, c = u[kept], c[kept]
    ratio = np.min(-(z := roots(c)).real / np.abs(z), axis=1) if len(c) else np.zeros(0)
    rows = np.argsort(-ratio, kind="stable").tolist()
    return [np.zeros(rays.shape[1]), *u[_select_different(u, rows)]]


def draw_points(base: WeightedDesign, distance: float, seed: int) -> list[Array]:
    """A few points at a distance in random directions, stable or not."""
    rays = np.random.default_rng(seed).standard_normal((_DRAWN, len(base.lower)))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return [*base.clip_rays(rays, np.full(_DRAWN, distance))]


def _edge_functions(c: Array) -> Array:
    """Functions that vanish on the edges: a0, aₙ, ∏ −(zᵢ + zⱼ) and ∏ (zᵢ − zⱼ)² over pairs of roots, shape (…, 4).

    The last two are Δₙ₋₁ (Orlando) and the discriminant without powers of a0.
    """
    proper = np.all(np.isfinite(c), axis=-1) & (c[..., 0] != 0)
    z = roots(np.where(proper[..., None], c, np.eye(c.shape[-1])[0]))
    first, second = np.triu_indices(z.shape[-1], 1)
    sums, differences = z[..., first] + z[..., second], z[..., first] - z[..., second]
    pair, double = np.prod(-sums, axis=-1).real, np.prod(differences * differences, axis=-1).real
    return np.stack([c[..., 0], c[..., -1], *(np.where(proper, x, np.nan) for x in (pair, double))], axis=-1)


def _select_different(rays: Array, rows: list[int]) -> NDArray[np.int_]:
    """The first few of the rows whose directions differ."""
    unit = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    kept: list[int] = []
    for k in rows:
        if len(kept) < _KEPT and all(float(unit[k] @ unit[other]) < _SAME_DIRECTION for other in kept):
            kept.append(k)
    return np.array(kept, dtype=int)


@dataclass(frozen=True)
class _Bracket:
    """Points t · ray on either side of a change of a test, which is `inside` at `low` and not at `high`."""

    base: WeightedDesign
    test: Callable[[Array], Truth]
    rays: Array
    low: Array
    high: Array
    inside: Truth

    def rows(self, k: NDArray[np.int_]) -> "_Bracket":
        """The selected rays."""
        return replace(self, rays=self.rays[k], low=self.low[k], high=self.high[k], inside=self.inside[k])

    def coefficients(self, t: Array) -> Array:
        """Coefficients at t of shape (rays,) or (rays, points)."""
        rays = self.rays if t.ndim == 1 else self.rays[:, None, :]
        return self.base.coefficients(self.base.clip_rays(rays, t))

    def narrow(self, parts: int, times: int) -> "_Bracket":
        """Narrow each bracket to its first change, testing several points per call."""
        low, high = self.low, self.high
        every = np.arange(len(low))
        for _ in range(times):
            t = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, parts + 1)
            other = self.test(self.coefficients(t[:, 1:-1])) != self.inside[:, None]
            first = np.where(other.any(axis=1), other.argmax(axis=1) + 1, parts)
            low, high = t[every, first - 1], t[every, first]
        return replace(self, low=low, high=high)

    def sides(self) -> tuple[Array, Array]:
        """Coefficients beyond the edge, times the sign of a0 on the side where the test holds; that sign."""
        within, beyond = (
            self.coefficients(np.where(self.inside == side, self.low, self.high)) for side in (True, False)
        )
        sign = np.sign(within[:, 0])
        return sign[:, None] * beyond, sign

    def crossings(self, heavy: bool) -> list[RayCrossing]:
        """The crossings, one for each ray and edge."""
        beyond, sign = self.sides()
        u = self.base.clip_rays(self.rays, self.high)
        return [
            RayCrossing(name, float(sign[k]), u[k], float(np.linalg.norm(u[k])))
            for k, c in enumerate(beyond)
            for name in find_crossed_edges(c, heavy)
        ]
