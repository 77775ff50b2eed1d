"""Root loci: all roots of a quartic over one parameter, joined only where it is certain which root goes where."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise, permutations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from tmsopt.models import Model, ParameterSet, tms as bicycle_model
from tmsopt.paper.reference import TILT_OFFSETS, on_ep_set
from tmsopt.paper.universal import universal_path
from tmsopt.records import Array, Complex
from tmsopt.roots import discriminant, roots

_ORDERS = np.array(list(permutations(range(4))))
_CERTAIN = 0.25  # of the distance to the nearest other root: a step shorter than this can have only one reading
_ROUNDS = 36  # halvings: from a grid of 1e-2 to the rounding of Fr
_ROUNDING = 1e-13  # of the terms of a discriminant: what it may be off by, with a few hundred operations
_MOST = 4000  # steps halved in one round, a guard that no figure reaches


@dataclass(frozen=True)
class Track:
    """One root over a stretch of the parameter: `values` ascending and the root `s`, both of shape (n,)."""

    values: Array
    s: Complex


@dataclass(frozen=True)
class DoubleRoots:
    """A multiple root: ``EP4``, ``2EP2``, ``CEP2``, or ``EP2`` for one real double root; `s` lists it, once each."""

    name: str
    value: float
    s: Complex


@dataclass(frozen=True)
class Locus:
    """Roots of one design over one parameter.

    Attributes:
        title: for legends.
        values: of the parameter, ascending and crowded where roots move fast, shape (n,).
        roots: shape (n, 4); columns are not modes, for modes cannot be told apart at an exceptional point.
        tracks: the same roots, joined where the continuation is certain; tracks end at multiple roots.
        marks: the multiple roots.
        crossings: (value, |Im s|) where the design becomes stable or unstable.
    """

    title: str
    values: Array
    roots: Complex
    tracks: tuple[Track, ...]
    marks: tuple[DoubleRoots, ...]
    crossings: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class LocusRow:
    """Loci of one steer axis tilt: at χ_B of the law (first), below and above it; ω0 is the radius of the circle."""

    name: str
    tilt: float
    omega0: float
    chi_B: float
    offset: float
    loci: tuple[Locus, Locus, Locus]


def locus(
    model: Model,
    of: ParameterSet,
    parameters: Mapping[str, float],
    sweep: str,
    ends: tuple[float, float],
    resolution: float = 0.02,
    title: str = "",
) -> Locus:
    """Roots of a degree-4 model over `sweep` between two ends; no root moves further than `resolution` in a step.

    Raises:
        ValueError: where a0 = 0, a root at infinity.
    """

    def coefficients(value: ArrayLike) -> Array:
        a = model.coefficients({**parameters, sweep: np.asarray(value, dtype=float)}, of)
        return np.stack(np.broadcast_arrays(np.asarray(value), *a)[1:], axis=-1).astype(float)

    values = np.linspace(*ends, 201)
    found = roots(coefficients(values))
    fine = _fine(found[:-1], found[1:], resolution)
    for _ in range(_ROUNDS):
        coarse = np.flatnonzero(~fine & (np.diff(values) > 1e-13 * np.abs(ends).max()))[:_MOST]
        if not coarse.size:
            break
        middle = (values[coarse] + values[coarse + 1]) / 2
        between = roots(coefficients(middle))
        halves = [_fine(found[coarse], between, resolution), _fine(between, found[coarse + 1], resolution)]
        fine[coarse] = halves[0]
        fine = np.insert(fine, coarse + 1, halves[1])
        found = np.insert(found, coarse + 1, between, axis=0)
        values = np.insert(values, coarse + 1, middle)
    path = universal_path(model, of, parameters, sweep, values)
    pairs = [DoubleRoots(e.name, e.value, _double_roots(e.name, e.A, e.omega0)) for e in path.events if "EP" in e.name]
    marks = [*pairs, *_real_double_roots(coefficients, values, [m.value for m in pairs])]
    crossings = [
        (e.value, abs(e.omega0) * float(np.sqrt(e.A[2] / e.A[0])))
        for e in path.events
        if "EP" not in e.name and e.A[0] * e.A[2] > 0  # a pair on the axis: σ² = −A3/A1
    ]
    return Locus(
        title,
        values,
        found,
        tuple(_tracks(values, found)),
        tuple(sorted(marks, key=lambda m: m.value)),
        tuple(crossings),
    )


def table_1_loci(Fr_max: float = 5.0) -> tuple[LocusRow, LocusRow, LocusRow]:
    """The three rows of the paper's figure: tilts of Table 1, χ_B = √2 and beside it, 0 ≤ Fr ≤ Fr_max."""
    ep4, double, pair = (_row(name, Fr_max) for name in TILT_OFFSETS)
    return ep4, double, pair


def _row(name: str, Fr_max: float) -> LocusRow:
    bicycle = on_ep_set(name, TILT_OFFSETS[name])
    offset = 0.1 if name == "CEP2" else 0.01
    chi_B = bicycle.parameters["chi_B"]
    shifts = {r"\sqrt{2}": 0.0, rf"\sqrt{{2}} - {offset:g}": -offset, rf"\sqrt{{2}} + {offset:g}": offset}
    law, below, above = (
        locus(
            bicycle_model,
            bicycle_model.sets[0],
            {**bicycle.parameters, "chi_B": chi_B + shift},
            "Fr",
            (0.0, Fr_max),
            title=text,
        )
        for text, shift in shifts.items()
    )
    return LocusRow(name, bicycle.parameters["lambda_s"], bicycle.omega0, chi_B, offset, (law, below, above))


def _fine(before: Complex, after: Complex, resolution: float) -> NDArray[np.bool_]:
    certain, step, _ = _matching(before, after)
    return certain & (step <= resolution)


def _matching(before: Complex, after: Complex) -> tuple[NDArray[np.bool_], Array, NDArray[np.intp]]:
    """For each step: whether its reading is certain, the longest move, and the order that the next roots take.

    Of all 24 readings the one with the shortest longest move is taken. It is certain if that move is short
    against the distance between any two roots at either end.
    """
    moves = np.abs(before[:, None, :] - after[:, _ORDERS]).max(axis=-1)
    best = np.argmin(moves, axis=-1)
    step = moves[np.arange(len(best)), best]
    return step <= _CERTAIN * np.minimum(_nearest(before), _nearest(after)), step, _ORDERS[best]


def _nearest(found: Complex) -> Array:
    """The least distance between two of the roots, in each row."""
    first, second = np.triu_indices(4, 1)
    return np.asarray(np.abs(found[:, first] - found[:, second]).min(axis=1))


def _tracks(values: Array, found: Complex) -> list[Track]:
    """Roots joined along each run of certain steps."""
    certain, _, orders = _matching(found[:-1], found[1:])
    breaks = [-1, *np.flatnonzero(~certain), len(values) - 1]
    tracks = []
    for before, last in pairwise(breaks):
        first = before + 1
        if last <= first:
            continue
        order = np.arange(4)
        rows = [found[first]]
        for k in range(first, last):
            order = orders[k][order]
            rows.append(found[k + 1][order])
        joined = np.array(rows)
        tracks += [Track(values[first : last + 1], joined[:, column]) for column in range(4)]
    return tracks


def _double_roots(name: str, A: Array, omega0: float) -> Complex:
    """Roots of (σ² + (A1/2) σ + 1), scaled back; once each."""
    if name == "EP4":
        return np.array([omega0 + 0j])
    return roots(np.array([1.0, float(A[0]) / 2, 1.0])) * abs(omega0)


def _real_double_roots(
    coefficients: Callable[[ArrayLike], Array], values: Array, known: list[float]
) -> list[DoubleRoots]:
    """Where the discriminant changes sign: two real roots meet. It keeps its sign at 2EP2 and CEP2."""

    def quartic(at: ArrayLike) -> list[Array]:
        return list(np.moveaxis(coefficients(at), -1, 0))

    def value(at: float) -> float:
        return float(discriminant(quartic(at)))

    a = quartic(values)
    found = np.asarray(discriminant(a))
    i, j = _invariants([np.abs(c) for c in a])
    clear = np.flatnonzero(np.abs(found) > _ROUNDING * (4 * i**3 + j**2) / 27)
    marks = []
    for low, high in pairwise(clear):
        if found[low] * found[high] > 0 or any(values[low] <= v <= values[high] for v in known):
            continue
        at = float(brentq(value, values[low], values[high], xtol=1e-15, rtol=1e-15))
        marks.append(DoubleRoots("EP2", at, np.array([_closest_pair(roots(coefficients(at)))])))
    return marks


def _invariants(size: list[Array]) -> tuple[Array, Array]:
    """The terms of the discriminant's I and J, added without cancellation."""
    a, b, c, d, e = size
    return 12 * a * e + 3 * b * d + c * c, 72 * a * c * e + 9 * b * c * d + 27 * (a * d * d + e * b * b) + 2 * c**3


def _closest_pair(found: Complex) -> complex:
    """Mean of the two closest roots, which is accurate where each of them is not."""
    i, j = np.triu_indices(4, 1)
    k = int(np.argmin(np.abs(found[i] - found[j])))
    return complex((found[i[k]] + found[j[k]]).real / 2)
