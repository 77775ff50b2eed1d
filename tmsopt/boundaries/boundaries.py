"""The boundaries of stability and of heavy damping in factored form, without division by a0.

The coefficients c in this module are multiplied by the sign that a0 has on the stable side, so that all are positive if
the roots are left of the imaginary axis. Every factored form stays regular where a0 vanishes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from tmsopt.records import Array, Table, Truth
from tmsopt.roots import discriminant, is_stable, product, real_roots, rebuilt, roots

EDGE_TOLERANCE = 1e-10
"""A polynomial within this relative change of its coefficients counts as on an edge."""

_MIN_LEAD = 1e-9  # relative to the largest coefficient: least leading coefficient for computing roots
_MIN_ROOT = 1e-3  # relative to the median root: least size of a root for the sizes of terms


@dataclass(frozen=True)
class Edge:
    """A piece of a boundary: all products of a divisor and a cofactor without roots in Re s > 0, given by its factors.

    A divisor with an unknown root is e s² + 1 − e, or e s + 1 − e squared; its root is at infinity for e = 0. A
    cofactor of odd degree above 2 has one linear factor f s + 1 − f. Its first quadratic factor has any size; the
    others are a s² + b s + 1 − a − b. All unknowns are ≥ 0.

    Attributes:
        name: ``weave``, ``capsize``, ``infinity``, ``EP2``; ``capsize, real`` and ``infinity, real`` if all other roots
            are real; ``real`` for heavy damping itself, approached from outside.
        degree: degree of the polynomial.
        is_real: whether the roots of the cofactor are real; else they are only not right of the axis.
        divisor: e → the divisor.
        candidates: numeric coefficients → values of e to try; None for a divisor without e.
    """

    name: str
    degree: int
    is_real: bool
    divisor: Callable[[Any], list[Any]]
    candidates: Callable[[Array], list[float]] | None = None

    @property
    def unknowns(self) -> dict[str, float]:
        """Names of the unknowns and their upper bounds."""
        degree = self._cofactor_degree
        scaled = [f"{letter}{k}" for k in range(1, degree // 2) for letter in "ab"]
        return dict.fromkeys(self._roots, 1.0) | dict.fromkeys("ABC"[: degree + 1], np.inf) | dict.fromkeys(scaled, 1.0)

    @property
    def _cofactor_degree(self) -> int:
        return self.degree + 1 - len(self.divisor(0.0))

    @property
    def _roots(self) -> str:
        """Names of the unknowns for the root of the divisor (e) and of the linear factor (f), if there are any."""
        degree = self._cofactor_degree
        return "e" * (self.candidates is not None) + "f" * (degree > 2 and degree % 2)

    def factors(self, u: Sequence[Any]) -> list[list[Any]]:
        """The divisor and each factor of the cofactor, from the unknowns."""
        root_values = dict(zip(self._roots, u, strict=False))
        count = len(root_values)
        linear = [[f, 1 - f] for name, f in root_values.items() if name == "f"]
        scaled = [[u[k], u[k + 1], 1 - u[k] - u[k + 1]] for k in range(count + 3, len(u), 2)]
        return [self.divisor(root_values.get("e", 0.0)), *linear, list(u[count : count + 3]), *scaled]

    def equations(self, c: Sequence[Any], u: Sequence[Any]) -> dict[int, Any]:
        """Index of a coefficient → an expression of coefficients and unknowns that must be 0."""
        return {k: a - b for k, (a, b) in enumerate(zip(c, product(*self.factors(u)), strict=True))}

    def nonnegative(self, u: Sequence[Any]) -> list[Any]:
        """Expressions of the unknowns that must be ≥ 0: the other roots are not right of the axis, or are real."""
        quadratics = [factor for factor in self.factors(u)[1:] if len(factor) == 3]
        return [c for _, _, c in quadratics[1:]] + (
            [b * b - 4 * a * c for a, b, c in quadratics] if self.is_real else []
        )

    def guess(self, c: Array) -> list[float]:
        """Guess the unknowns for numeric coefficients.

        The divisor is the candidate that divides c best. Each quadratic factor of the quotient has two neighbouring
        roots, and the linear factor has the rightmost real root.
        """
        size = measure_terms(c)

        def quotient(e: float) -> Array:
            return divide_nearly(c, np.array(self.divisor(e)), size)

        def mismatch(e: float) -> float:
            return float(np.abs((c - np.convolve(self.divisor(e), quotient(e))) / size).max())

        best = min(self.candidates(c) if self.candidates else [0.0], key=mismatch)
        cofactor, guess = quotient(best), [best] * (self.candidates is not None)
        if len(cofactor) <= 3:
            return [*guess, *cofactor.tolist()]
        z = roots(replace_small_lead(cofactor))
        linear: list[list[float]] = []
        if "f" in self._roots:
            rightmost = max((s for s in z if s.imag == 0), key=lambda s: s.real)
            f = 1 / (1 + max(-float(rightmost.real), 0.0))
            linear, guess = [[f, 1 - f]], [*guess, f]
            z = np.delete(z, np.flatnonzero(z == rightmost)[0])
        order = np.lexsort((z.imag, np.abs(z.imag), z.real, z.imag == 0))
        z1, z2 = z[order].reshape(-1, 2).T
        quadratics = np.maximum(np.stack([np.ones(len(z1)), -(z1 + z2).real, (z1 * z2).real], 1), 0.0)
        scaled = quadratics / quadratics.sum(axis=1, keepdims=True)
        scaled_cofactor = np.array(product(*linear, *scaled), dtype=float)
        factor = max(float(scaled_cofactor @ cofactor) / float(scaled_cofactor @ scaled_cofactor), 0.0)
        return [*guess, *(factor * scaled[0]).tolist(), *scaled[1:, :2].ravel().tolist()]


@lru_cache(maxsize=16)
def list_edges(degree: int) -> Table[Edge]:
    """All pieces of the boundaries for polynomials of a degree ≥ 2: name → edge.

    For a polynomial that is not heavily damped, the nearest heavily damped one is on at least one edge.
    """
    edges = (
        Edge("weave", degree, False, lambda e: [e, 0, 1 - e], _guess_pairs),
        Edge("capsize", degree, False, lambda e: [1, 0]),
        Edge("infinity", degree, False, lambda e: [0, 1]),
        Edge("EP2", degree, True, lambda e: [e * e, 2 * e * (1 - e), (1 - e) * (1 - e)], _guess_double_roots),
        Edge("capsize, real", degree, True, lambda e: [1, 0]),
        Edge("infinity, real", degree, True, lambda e: [0, 1]),
        Edge("real", degree, True, lambda e: [1]),
    )
    return Table({edge.name: edge for edge in edges})


def _guess_pairs(c: Array) -> list[float]:
    """The values of e of the divisor e s² + 1 − e, as if each pair were on the axis."""
    z = roots(replace_small_lead(c))
    return [float(1 / (1 + abs(x) ** 2)) for x in z[z.imag > 0]] + [0.0, 1.0]


def _guess_double_roots(c: Array) -> list[float]:
    """The values of e of the divisor (e s + 1 − e)², as if two neighbouring roots were equal."""
    z = roots(replace_small_lead(c))
    x = np.sort(z[z.imag == 0].real)
    double_roots = [*((x[1:] + x[:-1]) / 2), *z[z.imag > 0].real]
    return [float(1 / (1 - root)) for root in double_roots if root < 0] or [1 / (1 + float(np.abs(z).mean()))]


def is_heavily_damped(c: Array) -> Truth:
    """Whether all roots are real, negative and distinct, for coefficients of shape (…, n + 1), up to rounding.

    A quartic has four distinct real roots if Δ > 0, 8 c0 c2 < 3 c1² and 64 c0³ c4 − 16 c0² c2² + 16 c0 c1² c2 −
    16 c0² c1 c3 − 3 c1⁴ < 0. A cubic or a quadratic has only real roots if Δ > 0. For higher degrees the real roots are
    counted.
    """
    columns, is_damped = [*np.moveaxis(c, -1, 0)], np.asarray(is_stable(c, exact=False))
    if len(columns) > 5:
        return _has_only_real_roots(c, is_damped)
    if len(columns) > 2:
        is_damped = is_damped & (discriminant(columns) > 0)
    if len(columns) == 5:
        a, b, p, q, r = columns
        condition = 64 * a**3 * r - 16 * a * a * p * p + 16 * a * b * b * p - 16 * a * a * b * q - 3 * b**4
        is_damped = is_damped & (8 * a * p < 3 * b * b) & (condition < 0)
    return np.asarray(is_damped)


def _has_only_real_roots(c: Array, is_candidate: Truth) -> Truth:
    """Which candidates have only real roots.

    Newton's necessary condition c_k² > (1 + 1/k)(1 + 1/(n − k)) c_{k−1} c_{k+1} is tested first.
    """
    n = c.shape[-1] - 1
    k = np.arange(1, n)
    meets_newton = c[..., 1:-1] ** 2 > (1 - 1e-9) * (1 + 1 / k) * (1 + 1 / (n - k)) * c[..., :-2] * c[..., 2:]
    has_real_roots = np.asarray(is_candidate & np.all(meets_newton, axis=-1))
    has_real_roots[has_real_roots] = real_roots(c[has_real_roots], exact=False)[0] == n
    return has_real_roots


def find_crossed_edges(c: Array, is_damping: bool) -> tuple[str, ...]:
    """The edges of stability, or of heavy damping, that a polynomial just outside has crossed.

    The coefficients c are multiplied by the sign of a0 on the inner side.
    """
    crossed_names = [n for n, k in (("capsize", -1), ("infinity", 0)) if c[k] <= 0]
    if is_damping:
        return tuple(f"{n}, real" for n in crossed_names) or ("EP2",)
    return tuple(crossed_names) or ("weave",)


def replace_small_lead(c: Array) -> Array:
    """The coefficients, with the leading one made large enough for computing roots."""
    size = float(np.abs(c).max()) or 1.0
    return np.concatenate([[c[0] if abs(c[0]) > _MIN_LEAD * size else _MIN_LEAD * size], c[1:]])


def measure_terms(c: Array) -> Array:
    """Size of the terms whose sum is each coefficient; a root at 0 counts as a thousandth of the median root."""
    lead = replace_small_lead(c)
    radius = np.abs(roots(lead))
    min_size = _MIN_ROOT * (float(np.median(radius)) or 1.0)  # 1 if all are 0
    return np.asarray(abs(lead[0]) * rebuilt(-np.maximum(radius, min_size).astype(complex)))


def divide_nearly(c: Array, factor: Array, size: Array) -> Array:
    """The quotient that best fits c, in units of the size of each coefficient."""
    columns = np.stack([np.convolve(factor, unit) for unit in np.eye(len(c) - len(factor) + 1)], axis=1)
    return np.asarray(np.linalg.lstsq(columns / size[:, None], c / size, rcond=None)[0])
