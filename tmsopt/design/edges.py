"""The boundaries of stability and of heavy damping as factored forms, without division by a0.

Coefficients c here are those of the polynomial times the sign of a0 on the stable side, so that all of them are
positive where the roots are left of the imaginary axis. Every form stays regular where a0 vanishes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.roots import PATTERNS, discriminant, is_stable, pattern_distance, product, roots

Array = NDArray[np.float64]
Truth = NDArray[np.bool_]

MATCHED = 1e-10
"""Relative change of a coefficient up to which a quartic counts as on an edge."""

_LEAD = 1e-9  # of the largest coefficient: a smaller a0 is replaced before roots are guessed from


@dataclass(frozen=True)
class Edge:
    """A piece of a boundary: the quartics for which the equations have nonnegative unknowns.

    Attributes:
        name: ``weave``, ``capsize``, ``infinity``, ``EP2``, and ``capsize, real`` and ``infinity, real``, where
            all other roots are real.
        unknowns: names of factor coefficients, each ≥ 0.
        equations: expressions of the coefficients and the unknowns that are 0.
        nonnegative: expressions that are ≥ 0: the other roots are not right of the axis, or are real.
        guess: unknowns to start from, for numeric coefficients.
    """

    name: str
    unknowns: tuple[str, ...]
    equations: Callable[[Sequence[Any], Sequence[Any]], list[Any]]
    nonnegative: Callable[[Sequence[Any], Sequence[Any]], list[Any]]
    guess: Callable[[Array], list[float]]


def _difference(c: Sequence[Any], *factors: Sequence[Any]) -> list[Any]:
    """Coefficients less those of a product that has the same leading one."""
    return [a - b for a, b in zip(c, product(*factors), strict=True)][1:]


def _real(lead: Any, u: Sequence[Any]) -> Any:
    """≥ 0 where lead s² + B s + C has real roots; B and C are the last unknowns."""
    return u[-2] * u[-2] - 4 * lead * u[-1]


def _weave_guess(c: Array) -> list[float]:
    """The pair whose W = c3/c1, as on the boundary."""
    W = max(float(c[3] / c[1]), 0.0) if c[1] else 0.0
    return [W, float(c[1]), float(c[2] - c[0] * W)]


def _regular(c: Array) -> Array:
    size = float(np.abs(c).max())
    return np.concatenate([[c[0] if abs(c[0]) > _LEAD * size else _LEAD * size], c[1:]])


def _double_guess(c: Array) -> list[float]:
    """The two roots that are nearest to a double one; the others as they are."""
    lead = _regular(c)
    found = roots(lead)
    pattern = PATTERNS["EP2"]
    guesses = [g for g in pattern.guesses(found) if g[0] < 0] or [[float(found.mean().real), 1.0, 0.25]]
    size = np.abs(lead / lead[0]) + 1e-300
    r, b, d = min(guesses, key=lambda g: float(np.abs((np.array(pattern.monic(g)) - lead / lead[0]) / size).max()))
    return [-r, float(lead[0] * b), float(lead[0] * d)]


def _split_guess(c: Array) -> list[float]:
    """The cubic c as (s + d)(c0 s² + B s + C), d from its rightmost root."""
    lead = _regular(c)
    d = max(float(-roots(lead).real.max()), 0.0)
    B = float(lead[1] - lead[0] * d)
    return [d, B, float(lead[2] - B * d)]


EDGES: Mapping[str, Edge] = MappingProxyType(
    {
        e.name: e
        for e in (
            Edge(
                "weave",
                ("W", "B", "C"),
                lambda c, u: _difference(c, [1, 0, u[0]], [c[0], u[1], u[2]]),
                lambda c, u: [c[0]],
                _weave_guess,
            ),
            # A cubic is in the closure of the stable ones where its coefficients and c1 c2 − c0 c3 are ≥ 0.
            Edge(
                "capsize",
                (),
                lambda c, u: [c[4]],
                lambda c, u: [c[0], c[1], c[2], c[3], c[1] * c[2] - c[0] * c[3]],
                lambda c: [],
            ),
            Edge(
                "infinity",
                (),
                lambda c, u: [c[0]],
                lambda c, u: [c[1], c[2], c[3], c[4], c[2] * c[3] - c[1] * c[4]],
                lambda c: [],
            ),
            Edge(
                "EP2",
                ("x", "B", "C"),
                lambda c, u: _difference(c, [1, u[0]], [1, u[0]], [c[0], u[1], u[2]]),
                lambda c, u: [c[0], _real(c[0], u)],
                _double_guess,
            ),
            Edge(
                "capsize, real",
                ("x", "B", "C"),
                lambda c, u: [c[4], *_difference(c[:4], [1, u[0]], [c[0], u[1], u[2]])],
                lambda c, u: [c[0], _real(c[0], u)],
                lambda c: _split_guess(c[:4]),
            ),
            Edge(
                "infinity, real",
                ("x", "B", "C"),
                lambda c, u: [c[0], *_difference(c[1:], [1, u[0]], [c[1], u[1], u[2]])],
                lambda c, u: [c[1], _real(c[1], u)],
                lambda c: _split_guess(c[1:]),
            ),
        )
    }
)
"""Every piece of a boundary, by name."""

KINDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "weave": ("weave",),
        "capsize": ("capsize",),
        "infinity": ("infinity",),
        "heavy damping": ("EP2", "capsize, real", "infinity, real"),
    }
)
"""Boundary → the pieces it is made of."""


def heavily_damped(c: Array) -> Truth:
    """Whether all roots are real, negative and different, for coefficients of shape (…, 5): by signs, no root.

    A quartic has four different real roots where Δ > 0, 8 c0 c2 < 3 c1² and 64 c0³ c4 − 16 c0² c2² + 16 c0 c1² c2 −
    16 c0² c1 c3 − 3 c1⁴ < 0.
    """
    a, b, p, q, r = (c[..., k] for k in range(5))
    second = 64 * a**3 * r - 16 * a * a * p * p + 16 * a * b * b * p - 16 * a * a * b * q - 3 * b**4
    return np.asarray(is_stable(c) & (discriminant([a, b, p, q, r]) > 0) & (8 * a * p < 3 * b * b) & (second < 0))


def lies_on(c: Array, edge: Edge) -> bool:
    """Whether a quartic, signed as on the inner side, is on an edge within 1e-10 of its coefficients."""
    size = float(np.abs(c).max())
    if edge.name.startswith("capsize"):
        rest, on = c[:4], abs(c[4])
    elif edge.name.startswith("infinity"):
        rest, on = c[1:], abs(c[0])
    else:
        return pattern_distance(PATTERNS[edge.name], c) <= MATCHED
    return bool(on <= MATCHED * size and np.all(rest >= -MATCHED * size))


def loss(c: Array, heavy: bool) -> str:
    """The edge that a quartic just beyond it has crossed, c signed as on the other side."""
    if c[4] <= 0:
        return "capsize, real" if heavy else "capsize"
    if c[0] <= 0:
        return "infinity, real" if heavy else "infinity"
    return "EP2" if heavy else "weave"
