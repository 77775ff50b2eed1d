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

_HORNER = 4 * np.finfo(float).eps  # times degree and size of the terms: rounding error of a complex Horner scheme
_IGNORED_ROUNDINGS = 18.0  # so many rounding errors count as none when a structure is decided
_FLOOR = 1e-3  # smallest size of a root when a structure is decided, relative to the median root
_LARGEST = 1e40  # if a coefficient is larger, relative to the leading one, a root may exceed doubles


@dataclass(frozen=True)
class Motions:
    """Motion of each polynomial.

    Attributes:
        abscissa, damping_ratio: abscissa and smallest damping ratio of the roots.
        frequency: greatest |Im s|.
        oscillates: whether a pair is rightmost.
        scatter: largest error of a numeric root.
        simple: whether these values are certain, and every polynomial within the tolerance has only simple roots and
            exactly one rightmost root or pair.
    """

    abscissa: Bounded
    damping_ratio: Bounded
    frequency: Array
    oscillates: Truth
    scatter: Array
    simple: Truth


class Discs:
    """Discs around the numeric roots of polynomials; disjoint discs contain one true root each.

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
        self.radius = n * (np.abs(value) + n * _HORNER * terms + self.change) / self.product

    def are_disjoint(self, radius: Array) -> Truth:
        """Whether the discs of each polynomial would be disjoint with these radii."""
        disjoint = [distance > radius[i] + radius[j] for (i, j), distance in self.distances.items()]
        return np.asarray(np.all([np.ones(radius.shape[1], dtype=bool), *disjoint], axis=0))


@np.errstate(all="ignore")
def enclose_motions(coefficients: Sequence[Bounded], tolerance: float) -> Motions:
    """Abscissa and damping ratio of polynomials; each of the descending coefficients has shape (m,).

    Args:
        tolerance: relative change of a coefficient within which roots count as multiple.
    """
    a, errors = (np.stack([getattr(c, field) for c in coefficients]) for field in ("value", "error"))
    n = len(a) - 1
    is_usable = np.isfinite(a).all(axis=0) & np.isfinite(errors).all(axis=0)
    is_usable &= (np.abs(a[0]) > 2 * errors[0]) & (np.abs(a[0]) * _LARGEST > np.abs(a).max(axis=0))
    polynomials = np.where(is_usable, a, (np.arange(n + 1) % n == 0)[:, None] * 1.0)
    z = np.ascontiguousarray((quartic_factors(*polynomials).roots if n == 4 else roots(polynomials.T)).T)
    size = np.abs(z)
    min_size = np.maximum(size, _FLOOR * np.median(size, axis=0))
    terms = np.stack([np.prod(size[i] + min_size, axis=0) for i in range(n)])
    discs = Discs(a / a[0], errors / np.abs(a[0]), z)
    radius = discs.radius
    reach = n * (1.1 * tolerance * terms + _IGNORED_ROUNDINGS * discs.change) / discs.product + radius
    top, rows = z.real.argmax(axis=0), np.arange(z.shape[1])
    simple = is_usable & (reach < size).all(axis=0) & discs.are_disjoint(reach)
    right, right_reach = z[top, rows], reach[top, rows]
    for i in range(n):
        is_near = (right.real - z[i].real <= reach[i] + right_reach) & (z[i].real != right.real)
        simple &= ~is_near & ((z[i].real != right.real) | (np.abs(z[i].imag) == np.abs(right.imag)))
    ratio, certain = _damping_ratio(z, radius, size)
    abscissa = Bounded(right.real + 0.0, radius[top, rows])
    return Motions(abscissa, ratio, z.imag.max(axis=0), right.imag != 0, radius.max(axis=0), simple & certain)


def _damping_ratio(z: Complex, radius: Array, size: Array) -> tuple[Bounded, Truth]:
    """The smallest −Re s/|s|, exactly ±1 if a real root has it, and whether it is certain which root has it."""
    real, size = z.imag == 0, np.where(size > 0, size, 1.0)
    ratio, errors = np.where(real, np.inf, -z.real / size), 2 * radius / size
    place, rows = ratio.argmin(axis=0), np.arange(z.shape[1])
    min_ratio, error = ratio[place, rows], errors[place, rows]
    has_growth, is_certain = (real & (z.real > 0)).any(axis=0), np.ones(z.shape[1], dtype=bool)
    for k in range(len(z)):
        is_same_root = real[k] | (z[k] == z[place, rows]) | (z[k] == z[place, rows].conj())
        is_certain &= is_same_root | (ratio[k] - errors[k] > min_ratio + error)
    damped = np.where(has_growth, -1.0, np.where(real.all(axis=0), 1.0, 0.0))
    is_between = damped == 0
    return Bounded(min_ratio, error).where(is_between, Bounded(damped, np.zeros_like(damped))), is_certain | ~is_between
