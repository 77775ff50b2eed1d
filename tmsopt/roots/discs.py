"""Roots of many polynomials at once in double precision, each in a disc that holds the true one.

The true roots lie in discs about numeric ones z, of radii n |p(z)|/(|a0| ∏ |z − zⱼ|) (Smith, J. ACM 17, 137, 1970).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tmsopt.algebra.rounding import Bounded
from tmsopt.records import Array, Complex, Truth
from tmsopt.roots.numeric import roots
from tmsopt.roots.quartics.quartic import quartic_factors

_HORNER = 4 * np.finfo(float).eps  # times the degree and the terms: rounding of a complex polynomial's value
_COVERED = 18.0  # roundings that count as none when structures are decided
_FLOOR = 1e-3  # of the median root: the size that a smaller one counts as there
_LARGEST = 1e40  # relative to the leading coefficient: beyond it a root may be no double


@dataclass(frozen=True)
class Motions:
    """Of each polynomial.

    Attributes:
        abscissa, damping_ratio: of the roots.
        frequency: greatest |Im s|.
        oscillates: whether a pair is rightmost.
        scatter: how far numeric roots may be off.
        simple: whether all this is certain, and no polynomial within the tolerance has a multiple root, or other roots
            beside the rightmost one or pair.
    """

    abscissa: Bounded
    damping_ratio: Bounded
    frequency: Array
    oscillates: Truth
    scatter: Array
    simple: Truth


class Discs:
    """Discs about numeric roots of polynomials, with one true root in each where they are disjoint.

    Attributes:
        product: |a0| ∏ |z − zⱼ|, with the other roots zⱼ.
        own: what the errors of the coefficients may change p(z) by.
        radius: of the discs.
    """

    def __init__(self, coefficients: Array, off: Array, z: Complex) -> None:
        """Coefficients and their errors, descending, of shape (n + 1, m), and numeric roots, of shape (n, m)."""
        n, size = len(z), np.abs(z)
        self.apart = {(i, j): np.abs(z[i] - z[j]) for i, j in combinations(range(n), 2)}
        self.product = np.abs(coefficients[0]) * np.ones_like(size)
        for (i, j), apart in self.apart.items():
            self.product[i] *= apart
            self.product[j] *= apart
        self.own, terms, value = np.zeros_like(size), np.zeros_like(size), np.zeros_like(z)
        for one, error in zip(coefficients, off, strict=True):
            self.own, terms, value = self.own * size + error, terms * size + np.abs(one), value * z + one
        self.radius = n * (np.abs(value) + n * _HORNER * terms + self.own) / self.product

    def disjoint(self, radius: Array) -> Truth:
        """Of which polynomials discs of some radii do not touch one another."""
        apart = [apart > radius[i] + radius[j] for (i, j), apart in self.apart.items()]
        return np.asarray(np.all([np.ones(radius.shape[1], dtype=bool), *apart], axis=0))


@np.errstate(all="ignore")
def enclose_motions(coefficients: Sequence[Bounded], tolerance: float) -> Motions:
    """Abscissa and damping ratio of polynomials, coefficients descending, each of shape (m,).

    Args:
        tolerance: relative change of a coefficient within which roots count as multiple.
    """
    a, off = (np.stack([getattr(c, part) for c in coefficients]) for part in ("value", "error"))
    n = len(a) - 1
    fit = np.isfinite(a).all(axis=0) & np.isfinite(off).all(axis=0)
    fit &= (np.abs(a[0]) > 2 * off[0]) & (np.abs(a[0]) * _LARGEST > np.abs(a).max(axis=0))
    told = np.where(fit, a, (np.arange(n + 1) % n == 0)[:, None] * 1.0)
    z = np.ascontiguousarray((quartic_factors(*told).roots if n == 4 else roots(told.T)).T)
    size = np.abs(z)
    reach = np.maximum(size, _FLOOR * np.median(size, axis=0))
    moved = np.stack([np.prod(size[i] + reach, axis=0) for i in range(n)])
    discs = Discs(a / a[0], off / np.abs(a[0]), z)
    error = discs.radius
    near = n * (1.1 * tolerance * moved + _COVERED * discs.own) / discs.product + error
    top, rows = z.real.argmax(axis=0), np.arange(z.shape[1])
    simple = fit & (near < size).all(axis=0) & discs.disjoint(near)
    right, reach_right = z[top, rows], near[top, rows]
    for i in range(n):
        other = (right.real - z[i].real <= near[i] + reach_right) & (z[i].real != right.real)
        simple &= ~other & ((z[i].real != right.real) | (np.abs(z[i].imag) == np.abs(right.imag)))
    ratio, certain = _damping_ratio(z, error, size)
    abscissa = Bounded(right.real + 0.0, error[top, rows])
    return Motions(abscissa, ratio, z.imag.max(axis=0), right.imag != 0, error.max(axis=0), simple & certain)


def _damping_ratio(z: Complex, error: Array, size: Array) -> tuple[Bounded, Truth]:
    """The least −Re s/|s|: 1 or −1 where it is that of a real root; and where it is certain which root has it."""
    real, size = z.imag == 0, np.where(size > 0, size, 1.0)
    ratio, off = np.where(real, np.inf, -z.real / size), 2 * error / size
    place, rows = ratio.argmin(axis=0), np.arange(z.shape[1])
    least, reach = ratio[place, rows], off[place, rows]
    growing, alone = (real & (z.real > 0)).any(axis=0), np.ones(z.shape[1], dtype=bool)
    for k in range(len(z)):
        same = real[k] | (z[k] == z[place, rows]) | (z[k] == z[place, rows].conj())
        alone &= same | (ratio[k] - off[k] > least + reach)
    damped = np.where(growing, -1.0, np.where(real.all(axis=0), 1.0, 0.0))
    return Bounded(least, reach).where(damped == 0, Bounded(damped, np.zeros_like(damped))), alone | (damped != 0)
