"""The universal chart of quartics: every polynomial of degree 4 with a4/a0 > 0, scaled to three numbers.

With s = |ω0| σ and ω0⁴ = a4/a0 it is σ⁴ + A1 σ³ + A2 σ² + A3 σ + 1, so that stability, heavy damping and
exceptional points are fixed sets of (A1, A2, A3), the same for every model.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from tmsopt.models import Model, ParameterSet, tms
from tmsopt.paper.reference import table_1
from tmsopt.records import Array

Sweep = Callable[[ArrayLike], tuple[Array, Array]]

SAME = 1e-9
"""Relative difference of scaled coefficients that counts as none: rounding and a Brent root leave about 1e-12."""


@dataclass(frozen=True)
class PathEvent:
    """A point of a path: it enters or leaves stability (``stable``, ``unstable``) or meets the EP set.

    Attributes:
        name: ``stable``, ``unstable``, ``EP4``, ``2EP2`` or ``CEP2``.
        value: of the swept parameter.
        A: A1, A2, A3, shape (3,).
        omega0: −(a4/a0)^(1/4).
    """

    name: str
    value: float
    A: Array
    omega0: float


@dataclass(frozen=True)
class UniversalPath:
    """The path of a model in the universal chart while one parameter is swept.

    Attributes:
        title: for legends.
        sweep: name of the swept parameter.
        values: of it, shape (n,).
        A: A1, A2, A3 in the columns, shape (n, 3); nan where a4/a0 ≤ 0 or a0 = 0.
        omega0: −(a4/a0)^(1/4), shape (n,), likewise.
        events: in the order of the sweep.
    """

    title: str
    sweep: str
    values: Array
    A: Array
    omega0: Array
    events: tuple[PathEvent, ...]


def normalised(coefficients: ArrayLike) -> tuple[Array, Array]:
    """A1, A2, A3 of shape (…, 3) and ω0 of shape (…) for quartics a0 … a4 of shape (…, 5); nan where a4/a0 ≤ 0."""
    c = np.asarray(coefficients, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        monic = c / c[..., :1]
        product = np.where((monic[..., 4] > 0) & (c[..., 0] != 0), monic[..., 4], np.nan)
        size = np.sqrt(np.sqrt(product))
        A = monic[..., 1:4] / size[..., None] ** np.arange(1, 4)
    return np.where(np.isfinite(A), A, np.nan), -size


def stability_margin(A: Array) -> Array:
    """A2 − A1/A3 − A3/A1 where A1, A3 > 0, else the smaller of A1 and A3, not above 0: positive exactly if stable.

    The Liénard–Chipart conditions of the scaled polynomial; shape (…, 3) in, (…) out.
    """
    A1, A2, A3 = A[..., 0], A[..., 1], A[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        hurwitz = A2 - A1 / A3 - A3 / A1
    return np.where((A1 > 0) & (A3 > 0), hurwitz, np.minimum(A1, A3))


def universal_path(
    model: Model, of: ParameterSet, parameters: Mapping[str, float], sweep: str, values: ArrayLike, title: str = ""
) -> UniversalPath:
    """The path of a degree-4 model as the parameter `sweep` of the set `of` takes ascending values, shape (n,).

    Raises:
        ValueError: for a model of another degree or an unknown parameter.
    """
    if model.degree != 4:
        raise ValueError(f"the universal chart takes models of degree 4; {model.name} has degree {model.degree}")
    if sweep not in of.names:
        raise ValueError(f"found '{sweep}'; accepted: {' '.join(of.names)}")

    def chart(value: ArrayLike) -> tuple[Array, Array]:
        a = model.coefficients({**parameters, sweep: np.asarray(value, dtype=float)}, of)
        return normalised(np.stack(np.broadcast_arrays(np.asarray(value), *a)[1:], axis=-1))

    grid = np.asarray(values, dtype=float)
    A, omega0 = chart(grid)
    return UniversalPath(title, sweep, grid, A, omega0, tuple(_events(chart, grid, A)))


def table_1_paths(Fr_max: float = 5.0) -> tuple[UniversalPath, ...]:
    """The three designs of Table 1 swept over 0 ≤ Fr ≤ Fr_max; χ_B of the law keeps them in the plane A1 = A3."""
    values = np.linspace(0.0, Fr_max, 1001)
    names = {"EP4": r"\mathrm{EP}_4", "2EP2": r"2\mathrm{EP}_2", "CEP2": r"\mathrm{CEP}_2"}
    return tuple(
        universal_path(
            tms,
            tms.sets[0],
            bicycle.parameters,
            "Fr",
            values,
            rf"${names[bicycle.name]}$ of Table 1, $\lambda_s = {bicycle.parameters['lambda_s']:.4f}$",
        )
        for bicycle in table_1()
    )


def ep_set(A1: ArrayLike) -> Array:
    """Points (A1, A2, A3) of the EP set: (σ² + (A1/2) σ + 1)², CEP2 for |A1| < 4, EP4 at 4, 2EP2 beyond."""
    a = np.asarray(A1, dtype=float)
    return np.stack([a, 2 + a * a / 4, a], axis=-1)


def heavy_section(A1: ArrayLike) -> tuple[Array, Array]:
    """Least and largest A2 of heavy damping in the plane A3 = A1; nan for A1 < 4, where there is none.

    There the polynomial is σ² (y² + A1 y + A2 − 2), y = σ + 1/σ. All σ are real and negative exactly if both y
    are real and at most −2: A2 ≤ 2 + A1²/4 and, as −A1/2 ≤ −2, A2 ≥ 2 A1 − 2.
    """
    a = np.where(np.asarray(A1, dtype=float) >= 4, np.asarray(A1, dtype=float), np.nan)
    return 2 * a - 2, 2 + a * a / 4


def spire(m: ArrayLike, t: ArrayLike) -> Array:
    """Quartics with the roots −eᵐ twice, −e^(t−m) and −e^(−t−m), as points (A1, A2, A3).

    Over all m and t ≥ 0 this is the whole boundary of heavy damping: (σ + x)² (σ² + b σ + 1/x²), x = eᵐ,
    b = 2 cosh t / x. The 2EP2 line is t = 0, the cuspidal edges EP3 are t = ±2m, and EP4 is their meeting.
    """
    x, c = np.exp(np.asarray(m, dtype=float)), np.cosh(np.asarray(t, dtype=float))
    b = 2 * c / x
    return np.stack(np.broadcast_arrays(2 * x + b, x**2 + 2 * x * b + 1 / x**2, x**2 * b + 2 / x), axis=-1)


def spire_faces(limit: float, points: int = 41) -> tuple[Array, Array, Array]:
    """The three faces of the boundary of heavy damping up to max(A1, A3) = limit > 4, shape (points, points, 3).

    The double root is the largest, the smallest, or between the two others. Along the first axis a face goes from
    EP4 to the limit; along the second from one edge to the next: 2EP2 to EP3, 2EP2 to EP3, EP3 to EP3.
    """
    u, v = np.meshgrid(np.linspace(0, 1, points), np.linspace(0, 1, points))

    def face(m: Callable[[Array], Array], t: Callable[[Array], Array]) -> Array:
        """Points (v m(u), v t(u)): a ray per u, along which A1 and A3 grow from 4, cut at the limit."""
        low, high = np.zeros(points), np.full(points, 2 * np.log(limit))
        for _ in range(60):
            middle = (low + high) / 2
            A = spire(middle * m(u[0]), middle * t(u[0]))
            inside = np.maximum(A[:, 0], A[:, 2]) < limit
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        return spire(v * low * m(u), v * low * t(u))

    return (
        face(np.ones_like, lambda a: 2 * a),
        face(lambda a: -np.ones_like(a), lambda a: 2 * a),
        face(lambda a: 2 * a - 1, lambda a: 2 * np.ones_like(a)),
    )


def _events(chart: Sweep, grid: Array, A: Array) -> list[PathEvent]:
    """Changes of stability, and points of the EP set, each at a change of sign between two grid values."""
    found: list[tuple[float, str]] = []
    margin = stability_margin(A)
    for k in _changes(np.where(np.isnan(margin), np.nan, np.where(margin > 0, 1.0, -1.0))):
        value = _root(partial(_value, stability_margin, chart), grid[k], grid[k + 1])
        found.append((value, "stable" if margin[k + 1] > 0 else "unstable"))

    for function in (_below_ep_set, _skew):
        for k in _changes(function(A)):
            value = _root(partial(_value, function, chart), grid[k], grid[k + 1])
            at = chart(value)[0]
            near = max(abs(float(_below_ep_set(at))), abs(float(_skew(at)))) <= SAME * float(np.abs(at).max())
            if near and not any(abs(value - v) <= SAME * abs(value) for v, name in found if "EP" in name):
                found.append((value, _ep_name(float(at[0]))))
    return [PathEvent(name, value, *_single(chart, value)) for value, name in sorted(found)]


def _value(function: Callable[[Array], Array], chart: Sweep, value: float) -> float:
    return float(function(chart(value)[0]))


def _below_ep_set(A: Array) -> Array:
    return np.asarray(A[..., 1] - 2 - (A[..., 0] + A[..., 2]) ** 2 / 16)


def _skew(A: Array) -> Array:
    skew = A[..., 0] - A[..., 2]
    rounding = 1e-14 * (np.abs(A[..., 0]) + np.abs(A[..., 2]))  # all along a path within the plane A1 = A3
    return np.where(np.abs(skew) <= rounding, 0.0, skew)


def _ep_name(A1: float) -> str:
    if abs(abs(A1) - 4) <= 4 * SAME:
        return "EP4"
    return "CEP2" if abs(A1) < 4 else "2EP2"


def _single(chart: Sweep, value: float) -> tuple[Array, float]:
    A, omega0 = chart(value)
    return A, float(omega0)


def _changes(sign: Array) -> NDArray[np.intp]:
    """Grid intervals over which a function changes sign or touches 0; none beside a gap, none where it stays 0."""
    left, right = sign[:-1], sign[1:]
    with np.errstate(invalid="ignore"):
        return np.flatnonzero((left * right < 0) | ((left == 0) != (right == 0)) & ~np.isnan(left * right))


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(function, low, high, xtol=1e-14 * max(abs(low), abs(high)), rtol=1e-15))
