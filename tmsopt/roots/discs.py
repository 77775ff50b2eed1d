"""Roots of many polynomials at once in double precision, each with a disc that contains the true root.

The true roots lie in discs around numeric roots z, of radius n |p(z)|/(|a0| ∏ |z − zⱼ|) (Smith, J. ACM 17, 137, 1970).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tmsopt.algebra.rounding import Bounded
from tmsopt.records import Array, Complex, Truth
from tmsopt.roots.numeric import roots
from tmsopt.roots.quartics.quartic import quartic_factors

_HORNER_ERROR = 4 * np.finfo(float).eps
"""Rounding error of a complex Horner scheme, divided by the degree and the size of the terms."""
_IGNORED_ROUNDINGS = 18.0  # a change of the coefficients by so many rounding errors does not make roots distinct
_MIN_SIZE = 1e-3  # a smaller root, relative to the median root, counts as this size when roots may be multiple
_MAX_COEFFICIENT = 1e40  # if a coefficient is larger, relative to the leading one, a root may exceed the doubles


@dataclass(frozen=True)
class Motions:
    """Motion of each polynomial.

    Attributes:
        abscissa: largest real part of the roots.
        damping_ratio: smallest damping ratio of the roots.
        frequency: greatest |Im s|.
        oscillates: whether the rightmost roots are a complex pair.
        scatter: largest error of a numeric root.
        are_simple: whether the other fields are certain, and every polynomial within the tolerance has only simple
            roots and exactly one rightmost root or pair.
    """

    abscissa: Bounded
    damping_ratio: Bounded
    frequency: Array
    oscillates: Truth
    scatter: Array
    are_simple: Truth


class Discs:
    """Discs around the numeric roots of polynomials. If the discs are disjoint, each contains one true root.

    Attributes:
        distances: |zᵢ − zⱼ| of each pair of roots.
        product: |a0| ∏ |z − zⱼ| over the other roots zⱼ, for each root z.
        change: largest change of p(z) within the errors of the coefficients.
        radius: radius of each disc.
    """

    def __init__(self, coefficients: Array, errors: Array, z: Complex) -> None:
        """Coefficients and their errors, descending, of shape (n + 1, m), and numeric roots, of shape (n, m)."""
        n, size = len(z), np.abs(z)
        self.distances = {(i, j): np.abs(z[i] - z[j]) for i, j in combinations(range(n), 2)}
        self.product = np.abs(coefficients[0]) * np.ones_like(size)
        for (i, j), distance in self.distances.items():
            self.product[i] *= distance
            self.product[j] *= distance
        self.change, terms, value = np.zeros_like(size), np.zeros_like(size), np.zeros_like(z)
        for a, error in zip(coefficients, errors, strict=True):
            self.change, terms, value = self.change * size + error, terms * size + np.abs(a), value * z + a
        self.radius = n * (np.abs(value) + n * _HORNER_ERROR * terms + self.change) / self.product

    def are_disjoint(self, radius: Array) -> Truth:
        """Whether the discs of each polynomial would be disjoint with these radii."""
        disjoint = [distance > radius[i] + radius[j] for (i, j), distance in self.distances.items()]
        return np.asarray(np.all([np.ones(radius.shape[1], dtype=bool), *disjoint], axis=0))


@np.errstate(all="ignore")
def enclose_motions(coefficients: Sequence[Bounded], tolerance: float) -> Motions:
    """The motions of m polynomials. The coefficients are descending, and each has shape (m,).

    Args:
        tolerance: relative change of a coefficient within which roots count as multiple.
    """
    a, errors = (np.stack([getattr(c, field) for c in coefficients]) for field in ("value", "error"))
    n = len(a) - 1
    is_usable = np.isfinite(a).all(axis=0) & np.isfinite(errors).all(axis=0)
    is_usable &= (np.abs(a[0]) > 2 * errors[0]) & (np.abs(a[0]) * _MAX_COEFFICIENT > np.abs(a).max(axis=0))
    polynomials = np.where(is_usable, a, (np.arange(n + 1) % n == 0)[:, None] * 1.0)
    z = np.ascontiguousarray((quartic_factors(*polynomials).roots if n == 4 else roots(polynomials.T)).T)
    size = np.abs(z)
    min_size = np.maximum(size, _MIN_SIZE * np.median(size, axis=0))
    terms = np.stack([np.prod(size[i] + min_size, axis=0) for i in range(n)])
    discs = Discs(a / a[0], errors / np.abs(a[0]), z)
    radius = discs.radius
    tolerance_radius = n * (1.1 * tolerance * terms + _IGNORED_ROUNDINGS * discs.change) / discs.product + radius
    rightmost_index, rows = z.real.argmax(axis=0), np.arange(z.shape[1])
    are_simple = is_usable & (tolerance_radius < size).all(axis=0) & discs.are_disjoint(tolerance_radius)
    rightmost, rightmost_radius = z[rightmost_index, rows], tolerance_radius[rightmost_index, rows]
    for i in range(n):
        is_near = (rightmost.real - z[i].real <= tolerance_radius[i] + rightmost_radius) & (z[i].real != rightmost.real)
        are_simple &= ~is_near & ((z[i].real != rightmost.real) | (np.abs(z[i].imag) == np.abs(rightmost.imag)))
    ratio, is_certain = _damping_ratio(z, radius, size)
    abscissa = Bounded(rightmost.real + 0.0, radius[rightmost_index, rows])
    return Motions(
        abscissa, ratio, z.imag.max(axis=0), rightmost.imag != 0, radius.max(axis=0), are_simple & is_certain
    )


def _damping_ratio(z: Complex, radius: Array, size: Array) -> tuple[Bounded, Truth]:
    """The smallest −Re s/|s|, and whether it is certain which root has it. It is exactly ±1 if this is a real root."""
    is_real, size = z.imag == 0, np.where(size > 0, size, 1.0)
    ratio, errors = np.where(is_real, np.inf, -z.real / size), 2 * radius / size
    min_index, rows = ratio.argmin(axis=0), np.arange(z.shape[1])
    min_ratio, error = ratio[min_index, rows], errors[min_index, rows]
    has_growth, is_certain = (is_real & (z.real > 0)).any(axis=0), np.ones(z.shape[1], dtype=bool)
    for k in range(len(z)):
        is_same_root = is_real[k] | (z[k] == z[min_index, rows]) | (z[k] == z[min_index, rows].conj())
        is_certain &= is_same_root | (ratio[k] - errors[k] > min_ratio + error)
    real_ratio = np.where(has_growth, -1.0, np.where(is_real.all(axis=0), 1.0, 0.0))  # 0 if a pair has the ratio
    has_pair = real_ratio == 0
    exact_ratio = Bounded(real_ratio, np.zeros_like(real_ratio))
    return Bounded(min_ratio, error).where(has_pair, exact_ratio), is_certain | ~has_pair
