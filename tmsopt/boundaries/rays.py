"""Where rays from a design first cross the boundaries: upper bounds of the distances, and starts for an optimiser."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tmsopt.boundaries.boundaries import heavily_damped, losses
from tmsopt.boundaries.surroundings import WeightedDesign
from tmsopt.records import Array, Truth
from tmsopt.roots import is_stable, roots

_DIRECTIONS = 1000
_RADII = np.concatenate([[0.0], np.geomspace(1e-4, 4.0, 36)])
_COARSE, _FINE = (16, 2), (256, 6)  # parts and times: all crossings, and those that are kept to all digits
_KEPT = 5
_ALIKE = 0.9  # cosine between directions that lead to one start
_ELSEWHERE = 4  # starts; as many as led 11 of 196 random systems of degrees 6 to 8 to nearer points, and 6 to no more
_POINTS = 400  # looked at on the straight way to a nearest point
_AROUND = np.array([0.1, 0.3, 1.0])
_STEP = 1e-6  # of differences, which only choose directions
_stable = partial(is_stable, exact=False)  # up to rounding: a bracket closes in on where that decides


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


def ray_crossings(place: WeightedDesign, damped: bool = True) -> list[RayCrossing]:
    """The nearest few crossings of each edge in different directions, nearest first.

    Args:
        damped: whether the edges of heavy damping are looked for too.
    """
    return along(place, directions(place), _RADII, damped)


def between(place: WeightedDesign, u: Array, damped: bool) -> list[RayCrossing]:
    """Crossings on the straight way to u, short of its end."""
    return along(place, u[None, :], np.linspace(0.0, 1.0, _POINTS)[:-1], damped)


def along(place: WeightedDesign, rays: Array, t: Array, damped: bool) -> list[RayCrossing]:
    """Crossings between displacements t · ray, t ascending."""
    c = place.coefficients(place.along(rays[:, None, :], t))
    found: list[RayCrossing] = []
    for heavy, test in ((False, _stable), (True, heavily_damped))[: 1 + damped]:
        inside = test(c)
        ray, step = np.nonzero(inside[:, 1:] != inside[:, :-1])
        all_of = _Bracket(place, test, rays[ray], t[step], t[step + 1], inside[ray, step]).narrowed(*_COARSE)
        names = [losses(c, heavy) for c in all_of.sides()[0]]
        distance = np.linalg.norm(place.along(all_of.rays, all_of.high), axis=1)
        for name in sorted({n for each in names for n in each}):
            rows = [k for k in np.argsort(distance, kind="stable") if name in names[k]]
            found += all_of.rows(_different(all_of.rays, rows)).narrowed(*_FINE).crossings(heavy)
    return sorted(found, key=lambda x: x.distance)


def directions(place: WeightedDesign) -> Array:
    """Unit vectors: the axes, the gradients of the boundaries both ways, and random ones."""
    axes = np.eye(len(place.lower))
    random = np.random.default_rng(0).standard_normal((_DIRECTIONS if len(axes) > 1 else 0, len(axes)))
    near = place.coefficients(_STEP * np.concatenate([axes, -axes]))
    slopes = (_tests(near[: len(axes)]) - _tests(near[len(axes) :])).T
    slopes = slopes[np.all(np.isfinite(slopes), axis=1) & np.any(slopes != 0, axis=1)]
    largest = np.abs(slopes).max(axis=1, keepdims=True, initial=0.0)
    slopes = np.ldexp(slopes, -np.frexp(largest)[1])  # squares are doubles
    every = np.concatenate([axes, -axes, slopes, -slopes, random])
    return np.asarray(every / np.linalg.norm(every, axis=1, keepdims=True))


def most_damped(place: WeightedDesign, sign: float) -> list[Array]:
    """The design and points around it that are nearest to having real roots only, for a given sign of a0."""
    rays = directions(place)
    u = place.along(rays[:, None, :], _AROUND).reshape(-1, rays.shape[1])
    c = sign * place.coefficients(u)
    kept = np.any(u != 0, axis=1) & np.all(np.isfinite(c), axis=1) & (c[:, 0] > 0) & _stable(c)
    u, c = u[kept], c[kept]
    ratio = np.min(-(z := roots(c)).real / np.abs(z), axis=1) if len(c) else np.zeros(0)
    rows = np.argsort(-ratio, kind="stable").tolist()
    return [np.zeros(rays.shape[1]), *u[_different(u, rows)]]


def elsewhere(place: WeightedDesign, distance: float, seed: int) -> list[Array]:
    """A few points at a distance in random directions, be they stable or not."""
    rays = np.random.default_rng(seed).standard_normal((_ELSEWHERE, len(place.lower)))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return [*place.along(rays, np.full(_ELSEWHERE, distance))]


def _tests(c: Array) -> Array:
    """What vanishes on the edges: a0, aₙ, ∏ −(zᵢ + zⱼ) and ∏ (zᵢ − zⱼ)² over pairs of roots, shape (…, 4).

    The last two are Δₙ₋₁ (Orlando) and the discriminant without powers of a0.
    """
    proper = np.all(np.isfinite(c), axis=-1) & (c[..., 0] != 0)
    z = roots(np.where(proper[..., None], c, np.eye(c.shape[-1])[0]))
    first, second = np.triu_indices(z.shape[-1], 1)
    sums, differences = z[..., first] + z[..., second], z[..., first] - z[..., second]
    pair, double = np.prod(-sums, axis=-1).real, np.prod(differences * differences, axis=-1).real
    return np.stack([c[..., 0], c[..., -1], *(np.where(proper, x, np.nan) for x in (pair, double))], axis=-1)


def _different(rays: Array, rows: list[int]) -> NDArray[np.int_]:
    """The first few of the rows whose directions differ."""
    unit = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    kept: list[int] = []
    for k in rows:
        if len(kept) < _KEPT and all(float(unit[k] @ unit[other]) < _ALIKE for other in kept):
            kept.append(k)
    return np.array(kept, dtype=int)


@dataclass(frozen=True)
class _Bracket:
    """Points t · ray on either side of a change of a test: `low` has its value `inside`, `high` has not."""

    place: WeightedDesign
    test: Callable[[Array], Truth]
    rays: Array
    low: Array
    high: Array
    inside: Truth

    def rows(self, k: NDArray[np.int_]) -> "_Bracket":
        """Some of them."""
        return replace(self, rays=self.rays[k], low=self.low[k], high=self.high[k], inside=self.inside[k])

    def at(self, t: Array) -> Array:
        """Coefficients at t of shape (rays,) or (rays, points)."""
        rays = self.rays if t.ndim == 1 else self.rays[:, None, :]
        return self.place.coefficients(self.place.along(rays, t))

    def narrowed(self, parts: int, times: int) -> "_Bracket":
        """The first change within each, looked for at a few points at once: calls cost more than points."""
        low, high = self.low, self.high
        every = np.arange(len(low))
        for _ in range(times):
            t = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, parts + 1)
            other = self.test(self.at(t[:, 1:-1])) != self.inside[:, None]
            first = np.where(other.any(axis=1), other.argmax(axis=1) + 1, parts)
            low, high = t[every, first - 1], t[every, first]
        return replace(self, low=low, high=high)

    def sides(self) -> tuple[Array, Array]:
        """Coefficients beyond the edge, signed as on the side where the test holds; that sign."""
        within, beyond = (self.at(np.where(self.inside == side, self.low, self.high)) for side in (True, False))
        sign = np.sign(within[:, 0])
        return sign[:, None] * beyond, sign

    def crossings(self, heavy: bool) -> list[RayCrossing]:
        """As data."""
        beyond, sign = self.sides()
        u = self.place.along(self.rays, self.high)
        return [
            RayCrossing(name, float(sign[k]), u[k], float(np.linalg.norm(u[k])))
            for k, c in enumerate(beyond)
            for name in losses(c, heavy)
        ]
