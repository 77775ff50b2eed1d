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
    """A piece of a boundary: the quartics for which the equations have unknowns e in [0, 1] and A, B, C ≥ 0.

    A factor with unknown roots is e s² + 1 − e, or e s + 1 − e, which reaches infinity at e = 0, times A s² + B s + C.

    Attributes:
        name: ``weave``, ``capsize``, ``infinity``, ``EP2``, and ``capsize, real`` and ``infinity, real``, where
            all other roots are real.
        unknowns: names of factor coefficients.
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
    """Coefficients less those of a product."""
    return [a - b for a, b in zip(c, product(*factors), strict=True)]


def _linear(u: Sequence[Any]) -> list[Any]:
    """e s + 1 − e, with 0 ≤ e ≤ 1: every root ≤ 0, infinity included."""
    return [u[0], 1 - u[0]]


def _real(u: Sequence[Any]) -> Any:
    """≥ 0 where A s² + B s + C has real roots."""
    return u[2] * u[2] - 4 * u[1] * u[3]


def _unknowns(x: float, c: Array, divisor: Callable[[float], list[float]]) -> list[float]:
    """e for a root −x, or for W = x, and the quotient of c by the factor with that e."""
    e = 1 / (1 + max(x, 0.0))
    factor = np.array(divisor(e))
    columns = np.stack([np.convolve(factor, unit) for unit in np.eye(len(c) - len(factor) + 1)], axis=1)
    return [e, *np.linalg.lstsq(columns, c, rcond=None)[0].tolist()]


def _weave_guess(c: Array) -> list[float]:
    """The pair whose W = c3/c1, as on the boundary."""
    return _unknowns(float(c[3] / c[1]) if c[1] else 0.0, c, lambda e: [e, 0.0, 1 - e])


def _regular(c: Array) -> Array:
    size = float(np.abs(c).max()) or 1.0
    return np.concatenate([[c[0] if abs(c[0]) > _LEAD * size else _LEAD * size], c[1:]])


def _double_guess(c: Array) -> list[float]:
    """The two roots that are nearest to a double one; the others as they are."""
    lead = _regular(c)
    found = roots(lead)
    pattern = PATTERNS["EP2"]
    guesses = [g for g in pattern.guesses(found) if g[0] < 0] or [[float(found.mean().real), 1.0, 0.25]]
    size = np.abs(lead / lead[0]) + 1e-300
    r = min(guesses, key=lambda g: float(np.abs((np.array(pattern.monic(g)) - lead / lead[0]) / size).max()))[0]
    return _unknowns(-r, c, lambda e: [e * e, 2 * e * (1 - e), (1 - e) ** 2])


def _split_guess(c: Array) -> list[float]:
    """A cubic with its rightmost root split off."""
    return _unknowns(float(-roots(_regular(c)).real.max()), c, lambda e: [e, 1 - e])


EDGES: Mapping[str, Edge] = MappingProxyType(
    {
        e.name: e
        for e in (
            Edge(
                "weave",
                ("e", "A", "B", "C"),
                lambda c, u: _difference(c, [u[0], 0, 1 - u[0]], u[1:]),
                lambda c, u: [],
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
                ("e", "A", "B", "C"),
                lambda c, u: _difference(c, _linear(u), _linear(u), u[1:]),
                lambda c, u: [_real(u)],
                _double_guess,
            ),
            Edge(
                "capsize, real",
                ("e", "A", "B", "C"),
                lambda c, u: [c[4], *_difference(c[:4], _linear(u), u[1:])],
                lambda c, u: [_real(u)],
                lambda c: _split_guess(c[:4]),
            ),
            Edge(
                "infinity, real",
                ("e", "A", "B", "C"),
                lambda c, u: [c[0], *_difference(c[1:], _linear(u), u[1:])],
                lambda c, u: [_real(u)],
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
    size = float(np.abs(c).max()) or 1.0
    if edge.name.startswith("capsize"):
        rest, on = c[:4], abs(c[4])
    elif edge.name.startswith("infinity"):
        rest, on = c[1:], abs(c[0])
    else:
        # Inverted roots keep both patterns, and keep clear of infinity.
        return pattern_distance(PATTERNS[edge.name], c if abs(c[0]) >= abs(c[4]) else c[::-1]) <= MATCHED
    return bool(on <= MATCHED * size and np.all(rest >= -MATCHED * size))


def losses(c: Array, heavy: bool) -> tuple[str, ...]:
    """The edges that a quartic just beyond them has crossed, c signed as on the other side."""
    passed = [n for n, k in (("capsize", 4), ("infinity", 0)) if c[k] <= 0]
    if heavy:
        return tuple(f"{n}, real" for n in passed) or ("EP2",)
    return tuple(passed) or ("weave",)
