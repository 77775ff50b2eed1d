"""What a polynomial on an edge has beside the edge: a factor with no root right of the axis, or with real roots ≤ 0.

Coefficients are bounded, as roots may be at infinity: the linear factor is f s + 1 − f, quadratics are
a s² + b s + 1 − a − b with 0 ≤ a, b and a + b ≤ 1, but for one, A s² + B s + C, that has the size of the whole.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from tmsopt.records import Array
from tmsopt.roots import product, rebuilt, roots

_LEAD = 1e-9  # of the largest coefficient: a smaller leading one is replaced before roots are guessed from
_SMALL = 1e-3


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
        real = found[found.imag == 0]
        rightmost = real[np.argmax(real.real)]
        linear = [1 / (1 + max(-float(rightmost.real), 0.0))]
        found = np.delete(found, np.flatnonzero(found == rightmost)[0])
    order = np.lexsort((found.imag, np.abs(found.imag), found.real, found.imag == 0))
    scaled = []
    for z, w in found[order].reshape(-1, 2):
        bounded = np.maximum([1.0, -(z + w).real, (z * w).real], 0.0)
        scaled.append(bounded / bounded.sum())
    whole = np.array(product(*([[*linear, 1 - linear[0]]] if odd else []), *scaled), dtype=float)
    size = max(float(whole @ c) / float(whole @ whole), 0.0)
    return [*linear, *(size * scaled[0]).tolist(), *(x for s in scaled[1:] for x in s[:2].tolist())]
