"""The boundaries of stability and of heavy damping as factored forms, without division by a0.

Coefficients c here are those of the polynomial times the sign of a0 on the stable side, so that all of them are
positive where the roots are left of the imaginary axis. Every form stays regular where a0 vanishes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from tmsopt.records import Array, Table, Truth
from tmsopt.roots import discriminant, is_stable, product, real_roots, rebuilt, roots

MATCHED = 1e-10
"""Relative change of a coefficient up to which a polynomial counts as on an edge."""

_LEAD = 1e-9  # of the largest coefficient: a smaller leading one is replaced before roots are guessed from
_SMALL = 1e-3


@dataclass(frozen=True)
class Rest:
    """All polynomials of a degree with no root in Re s > 0 by their factors; where `real`, those with real roots alone.

    Above degree 2 a linear factor, if any, is f s + 1 − f; the first quadratic has any size, the others are
    a s² + b s + 1 − a − b.
    """

    degree: int
    real: bool

    @property
    def unknowns(self) -> dict[str, float]:
        """Names of the factor coefficients, each ≥ 0, and what they are at most."""
        more = {f"{letter}{k}": 1.0 for k in range(1, self.degree // 2) for letter in "ab"}
        return dict.fromkeys("f" * self._odd, 1.0) | dict.fromkeys("ABC"[: self.degree + 1], np.inf) | more

    @property
    def _odd(self) -> int:
        """How many factors are linear beside the first."""
        return self.degree % 2 if self.degree > 2 else 0

    def factors(self, u: Sequence[Any]) -> list[list[Any]]:
        """Coefficients of each factor, from the unknowns."""
        more = self._odd + 3
        linear, scaled = u[: self._odd], ([u[k], u[k + 1], 1 - u[k] - u[k + 1]] for k in range(more, len(u), 2))
        return [*([f, 1 - f] for f in linear), list(u[self._odd : more]), *scaled]

    def nonnegative(self, u: Sequence[Any]) -> list[Any]:
        """Expressions of the unknowns that are ≥ 0."""
        quadratics = [factor for factor in self.factors(u) if len(factor) == 3]
        return [c for _, _, c in quadratics[1:]] + ([b * b - 4 * a * c for a, b, c in quadratics] if self.real else [])

    def guess(self, c: Array) -> list[float]:
        """Unknowns near numeric coefficients: quadratics of neighbouring roots; the rightmost real one is linear."""
        if self.degree <= 2:
            return list(c.tolist())
        found = roots(regular(c))
        linear: list[float] = []
        if self._odd:
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


@dataclass(frozen=True)
class Edge:
    """A piece of a boundary: the multiples of a divisor by a `Rest`, with unknowns that are ≥ 0.

    A divisor with unknown roots is e s² + 1 − e, or e s + 1 − e squared, which reaches infinity at e = 0.

    Attributes:
        name: ``weave``, ``capsize``, ``infinity``, ``EP2``, and ``capsize, real`` and ``infinity, real``, where
            all other roots are real; ``real`` for heavy damping itself, as it is seen from outside.
        real: whether the other roots are real, or else not right of the axis.
        divisor: of e.
        candidates: values of e that may be near, for numeric coefficients; None for a divisor without e.
    """

    name: str
    degree: int
    real: bool
    divisor: Callable[[Any], list[Any]]
    candidates: Callable[[Array], list[float]] | None = None

    @property
    def unknowns(self) -> dict[str, float]:
        """Names of factor coefficients, and what they are at most."""
        return dict.fromkeys("e" * self._own, 1.0) | self._rest.unknowns

    @property
    def _rest(self) -> Rest:
        return Rest(self.degree + 1 - len(self.divisor(0.0)), self.real)

    @property
    def _own(self) -> int:
        return int(self.candidates is not None)

    def equations(self, c: Sequence[Any], u: Sequence[Any]) -> dict[int, Any]:
        """Number of a coefficient → an expression of the coefficients and the unknowns that is 0."""
        whole = product(self.divisor(u[0] if self._own else 0.0), *self._rest.factors(u[self._own :]))
        return {k: a - b for k, (a, b) in enumerate(zip(c, whole, strict=True))}

    def nonnegative(self, u: Sequence[Any]) -> list[Any]:
        """Expressions of the unknowns that are ≥ 0: the other roots are not right of the axis, or are real."""
        return self._rest.nonnegative(u[self._own :])

    def guess(self, c: Array) -> list[float]:
        """The e with which the divisor divides c most nearly, and the unknowns of the quotient."""
        size = terms(c)

        def left(e: float) -> Array:
            return quotient(c, np.array(self.divisor(e)), size)

        def off(e: float) -> float:
            return float(np.abs((c - np.convolve(self.divisor(e), left(e))) / size).max())

        best = min(self.candidates(c) if self.candidates else [0.0], key=off)
        return [best] * self._own + self._rest.guess(left(best))


@lru_cache(maxsize=16)
def edges(degree: int) -> Table[Edge]:
    """Every piece of a boundary among the polynomials of a degree ≥ 2, by name.

    Heavy damping is seen from outside too: there the nearest polynomial with real roots is on an edge, or on several.
    """
    every = (
        Edge("weave", degree, False, lambda e: [e, 0, 1 - e], _pairs),
        Edge("capsize", degree, False, lambda e: [1, 0]),
        Edge("infinity", degree, False, lambda e: [0, 1]),
        Edge("EP2", degree, True, lambda e: [e * e, 2 * e * (1 - e), (1 - e) * (1 - e)], _doubles),
        Edge("capsize, real", degree, True, lambda e: [1, 0]),
        Edge("infinity, real", degree, True, lambda e: [0, 1]),
        Edge("real", degree, True, lambda e: [1]),
    )
    return Table({edge.name: edge for edge in every})


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


def heavily_damped(c: Array) -> Truth:
    """Whether all roots are real, negative and different, for coefficients of shape (…, n + 1), up to rounding.

    A quartic has four different real roots where Δ > 0, 8 c0 c2 < 3 c1² and 64 c0³ c4 − 16 c0² c2² + 16 c0 c1² c2 −
    16 c0² c1 c3 − 3 c1⁴ < 0, a cubic or a quadratic as many as it can where Δ > 0; others are counted.
    """
    columns, damped = [*np.moveaxis(c, -1, 0)], np.asarray(is_stable(c, exact=False))
    if len(columns) > 5:
        return _counted(c, damped)
    if len(columns) > 2:
        damped = damped & (discriminant(columns) > 0)
    if len(columns) == 5:
        a, b, p, q, r = columns
        second = 64 * a**3 * r - 16 * a * a * p * p + 16 * a * b * b * p - 16 * a * a * b * q - 3 * b**4
        damped = damped & (8 * a * p < 3 * b * b) & (second < 0)
    return np.asarray(damped)


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


def regular(c: Array) -> Array:
    """The same with a leading coefficient that is not too small for roots."""
    size = float(np.abs(c).max()) or 1.0
    return np.concatenate([[c[0] if abs(c[0]) > _LEAD * size else _LEAD * size], c[1:]])


def terms(c: Array) -> Array:
    """Size of the terms that each coefficient is summed from; a root at 0 counts as a thousandth of the median."""
    lead = regular(c)
    radius = np.abs(roots(lead))
    least = _SMALL * (float(np.median(radius)) or 1.0)  # where all are at 0
    return np.asarray(abs(lead[0]) * rebuilt(-np.maximum(radius, least).astype(complex)))


def quotient(c: Array, factor: Array, size: Array) -> Array:
    """What a polynomial divided by a factor is most nearly, in units of the size of each coefficient."""
    columns = np.stack([np.convolve(factor, unit) for unit in np.eye(len(c) - len(factor) + 1)], axis=1)
    return np.asarray(np.linalg.lstsq(columns / size[:, None], c / size, rcond=None)[0])
