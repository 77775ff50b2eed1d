"""The boundaries of stability and of heavy damping as factored forms, without division by a0.

Coefficients c here are those of the polynomial times the sign of a0 on the stable side, so that all of them are
positive where the roots are left of the imaginary axis. Every form stays regular where a0 vanishes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from tmsopt.records import Array, Truth
from tmsopt.roots import discriminant, hurwitz_minors, is_stable, product, real_roots, rebuilt, roots

MATCHED = 1e-10
"""Relative change of a coefficient up to which a polynomial counts as on an edge."""

_BY_SIGNS = 3
"""Up to this degree Hurwitz's inequalities give all limits of stable polynomials; above, they admit others too."""

_LEAD = 1e-9  # of the largest coefficient: a smaller leading one is replaced before roots are guessed from
_SMALL = 1e-3


@dataclass(frozen=True)
class Edge:
    """A piece of a boundary: the polynomials for which the equations have unknowns that are ≥ 0.

    A factor with unknown roots is e s² + 1 − e, or e s + 1 − e, which reaches infinity at e = 0, times a `Rest`.

    Attributes:
        name: ``weave``, ``capsize``, ``infinity``, ``EP2``, and ``capsize, real`` and ``infinity, real``, where
            all other roots are real; ``real`` for heavy damping itself, as it is seen from outside.
        unknowns, upper: names of factor coefficients, and what they are at most.
        equations: number of a coefficient → an expression of the coefficients and the unknowns that is 0.
        nonnegative: expressions of these that are ≥ 0: the other roots are not right of the axis, or are real.
        guess: unknowns to start from, for numeric coefficients.
    """

    name: str
    unknowns: tuple[str, ...]
    upper: tuple[float, ...]
    equations: Callable[[Sequence[Any], Sequence[Any]], dict[int, Any]]
    nonnegative: Callable[[Sequence[Any], Sequence[Any]], list[Any]]
    guess: Callable[[Array], list[float]]


@lru_cache(maxsize=16)
def edges(degree: int) -> Mapping[str, Edge]:
    """Every piece of a boundary among the polynomials of a degree ≥ 2, by name.

    Heavy damping is seen from outside too: there the nearest polynomial with real roots is on an edge, or on several.
    """
    every = (
        _multiples("weave", degree, False, lambda e: [e, 0, 1 - e], _pairs),
        _multiples("capsize", degree, False, lambda e: [1, 0]),
        _multiples("infinity", degree, False, lambda e: [0, 1]),
        _multiples("EP2", degree, True, lambda e: [e * e, 2 * e * (1 - e), (1 - e) * (1 - e)], _doubles),
        _multiples("capsize, real", degree, True, lambda e: [1, 0]),
        _multiples("infinity, real", degree, True, lambda e: [0, 1]),
        _multiples("real", degree, True, lambda e: [1]),
    )
    return MappingProxyType({edge.name: edge for edge in every})


def _multiples(
    name: str,
    degree: int,
    real: bool,
    divisor: Callable[[Any], list[Any]],
    candidates: Callable[[Array], list[float]] | None = None,
) -> Edge:
    """The multiples of a divisor; `candidates` gives values of its unknown e, if it has one, that may be near."""
    left_over, own = degree + 1 - len(divisor(0.0)), 0 if candidates is None else 1
    if left_over == degree - 1 <= _BY_SIGNS and not (own or real):
        end = degree * divisor(0.0)[0]  # the coefficient that is 0
        return Edge(name, (), (), lambda c, u: {end: c[end]}, lambda c, u: _limits_of_stable(c, end), lambda c: [])
    others = rest(left_over, real)

    def equations(c: Sequence[Any], u: Sequence[Any]) -> dict[int, Any]:
        whole = product(divisor(u[0] if own else 0.0), *others.factors(u[own:]))
        return {k: a - b for k, (a, b) in enumerate(zip(c, whole, strict=True))}

    def guess(c: Array) -> list[float]:
        """The e with which the divisor divides c most nearly, and the unknowns of the quotient."""
        if candidates is None:
            first = divisor(0.0).index(1)
            return others.guess(c[first : first + left_over + 1])
        size = terms(c)

        def left(e: float) -> Array:
            return quotient(c, np.array(divisor(e)), size)

        best = min(candidates(c), key=lambda e: float(np.abs((c - np.convolve(divisor(e), left(e))) / size).max()))
        return [best, *others.guess(left(best))]

    unknowns, upper = ("e",) * own + others.unknowns, (1.0,) * own + others.upper
    return Edge(name, unknowns, upper, equations, lambda c, u: others.nonnegative(u[own:]), guess)


def _limits_of_stable(c: Sequence[Any], end: int) -> list[Any]:
    """≥ 0 exactly for the limits of stable polynomials without an end: coefficients, of a cubic c1 c2 − c0 c3 too."""
    rest = [x for k, x in enumerate(c) if k != end]
    return [*rest, *([hurwitz_minors(rest)[1]] if len(rest) - 1 == _BY_SIGNS else [])]


def _pairs(c: Array) -> list[float]:
    """Every pair as if it were on the axis."""
    z = roots(regular(c))
    return [float(1 / (1 + abs(x) ** 2)) for x in z[z.imag > 0]] + [0.0, 1.0]


def _doubles(c: Array) -> list[float]:
    """Every two neighbours as if they were one."""
    z = roots(regular(c))
    real = np.sort(z[z.imag == 0].real)
    doubles = [*((real[1:] + real[:-1]) / 2), *z[z.imag > 0].real]
    return [float(1 / (1 - x)) for x in doubles if x < 0] or [1 / (1 + float(np.abs(z).mean()))]


KINDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "weave": ("weave",),
        "capsize": ("capsize",),
        "infinity": ("infinity",),
        "heavy damping": ("EP2", "capsize, real", "infinity, real", "real"),
    }
)
"""Boundary → the pieces it is made of."""


def heavily_damped(c: Array) -> Truth:
    """Whether all roots are real, negative and different, for coefficients of shape (…, n + 1), up to rounding.

    A quartic has four different real roots where Δ > 0, 8 c0 c2 < 3 c1² and 64 c0³ c4 − 16 c0² c2² + 16 c0 c1² c2 −
    16 c0² c1 c3 − 3 c1⁴ < 0, a cubic or a quadratic as many as it can where Δ > 0; others are counted.
    """
    n = c.shape[-1] - 1
    stable = is_stable(c, exact=False)
    if n == 1:
        return np.asarray(stable)
    if n > 4:
        return _counted(c, stable)
    real = stable & (discriminant([c[..., k] for k in range(n + 1)]) > 0)
    if n < 4:
        return np.asarray(real)
    a, b, p, q, r = (c[..., k] for k in range(5))
    second = 64 * a**3 * r - 16 * a * a * p * p + 16 * a * b * b * p - 16 * a * a * b * q - 3 * b**4
    return np.asarray(real & (8 * a * p < 3 * b * b) & (second < 0))


def _counted(c: Array, stable: Truth) -> Truth:
    """As many real roots as the degree; Newton's inequalities c_k² > (1 + 1/k)(1 + 1/(n − k)) c_{k−1} c_{k+1} first."""
    n = c.shape[-1] - 1
    k = np.arange(1, n)
    newton = c[..., 1:-1] ** 2 > (1 - 1e-9) * (1 + 1 / k) * (1 + 1 / (n - k)) * c[..., :-2] * c[..., 2:]
    damped = np.asarray(stable & np.all(newton, axis=-1))
    damped[damped] = real_roots(c[damped], exact=False)[0] == n
    return damped


def losses(c: Array, heavy: bool) -> tuple[str, ...]:
    """The edges that a polynomial just beyond them has crossed, c signed as on the other side."""
    passed = [n for n, k in (("capsize", -1), ("infinity", 0)) if c[k] <= 0]
    if heavy:
        return tuple(f"{n}, real" for n in passed) or ("EP2",)
    return tuple(passed) or ("weave",)


@dataclass(frozen=True)
class Rest:
    """Polynomials of one degree by their factors.

    Attributes:
        unknowns, upper: names of the factor coefficients, each ≥ 0, and what they are at most.
        factors: of the unknowns.
        nonnegative: expressions of the unknowns that are ≥ 0.
        guess: unknowns near given numeric coefficients.
    """

    unknowns: tuple[str, ...]
    upper: tuple[float, ...]
    factors: Callable[[Sequence[Any]], list[list[Any]]]
    nonnegative: Callable[[Sequence[Any]], list[Any]]
    guess: Callable[[Array], list[float]]


@lru_cache(maxsize=64)
def rest(degree: int, real: bool) -> Rest:
    """All polynomials of a degree with no root in Re s > 0; where `real`, those with real roots alone."""
    if degree < 2:
        few = ("A", "B")[: degree + 1]
        return Rest(few, (np.inf,) * len(few), lambda u: [list(u)], lambda u: [], lambda c: c.tolist())
    odd, more = degree % 2, degree // 2 - 1

    def quadratics(u: Sequence[Any]) -> list[list[Any]]:
        scaled = [[u[k], u[k + 1], 1 - u[k] - u[k + 1]] for k in range(odd + 3, len(u), 2)]
        return [list(u[odd : odd + 3]), *scaled]

    def factors(u: Sequence[Any]) -> list[list[Any]]:
        return [*([[u[0], 1 - u[0]]] if odd else []), *quadratics(u)]

    def nonnegative(u: Sequence[Any]) -> list[Any]:
        every = quadratics(u)
        return [c for _, _, c in every[1:]] + ([b * b - 4 * a * c for a, b, c in every] if real else [])

    names = [f"{letter}{k}" for k in range(1, more + 1) for letter in "ab"]
    return Rest(
        (*("f" * odd), "A", "B", "C", *names),
        (*(1.0,) * odd, *(np.inf,) * 3, *(1.0,) * (2 * more)),
        factors,
        nonnegative,
        lambda c: c.tolist() if degree == 2 else _guess(c, odd),
    )


def regular(c: Array) -> Array:
    """The same with a leading coefficient that is not too small for roots."""
    size = float(np.abs(c).max()) or 1.0
    return np.concatenate([[c[0] if abs(c[0]) > _LEAD * size else _LEAD * size], c[1:]])


def terms(c: Array) -> Array:
    """Size of the terms that each coefficient is summed from; a root at 0 counts as a thousandth of the median."""
    lead = regular(c)
    radius = np.abs(roots(lead))
    return np.asarray(abs(lead[0]) * rebuilt(-np.maximum(radius, _SMALL * float(np.median(radius))).astype(complex)))


def quotient(c: Array, factor: Array, size: Array) -> Array:
    """What a polynomial divided by a factor is most nearly, in units of the size of each coefficient."""
    columns = np.stack([np.convolve(factor, unit) for unit in np.eye(len(c) - len(factor) + 1)], axis=1)
    return np.asarray(np.linalg.lstsq(columns / size[:, None], c / size, rcond=None)[0])


def _guess(c: Array, odd: int) -> list[float]:
    """Quadratics of neighbouring roots; the linear factor has the rightmost real one."""
    found = roots(regular(c))
    linear: list[float] = []
    if odd:
        rightmost = max((z for z in found if z.imag == 0), key=lambda z: z.real)
        linear = [1 / (1 + max(-float(rightmost.real), 0.0))]
        found = np.delete(found, np.flatnonzero(found == rightmost)[0])
    order = np.lexsort((found.imag, np.abs(found.imag), found.real, found.imag == 0))
    z, w = found[order].reshape(-1, 2).T
    bounded = np.maximum(np.stack([np.ones(len(z)), -(z + w).real, (z * w).real], axis=1), 0.0)
    scaled = bounded / bounded.sum(axis=1, keepdims=True)
    whole = np.array(product(*([x, 1 - x] for x in linear), *scaled), dtype=float)
    size = max(float(whole @ c) / float(whole @ whole), 0.0)
    return [*linear, *(size * scaled[0]).tolist(), *scaled[1:, :2].ravel().tolist()]
