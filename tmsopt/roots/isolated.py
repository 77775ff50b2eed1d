"""Abscissa and damping ratio of many polynomials at once, to twice the digits of a double and with error bounds.

Numeric roots have a backward error of 1e-13, so each true root lies in a disc that this and its distance from the
others give (Smith, J. ACM 17, 137, 1970). Where discs are apart, p(z)/(a0 ∏ (z − z*ⱼ)) over the other true roots z*ⱼ is
the error of z itself: one step by it, with p(z) in twice the digits, leaves the relative error of the product.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tmsopt.arithmetic.twofold import Twofold
from tmsopt.records import Array, Complex, Truth
from tmsopt.roots.numeric import roots
from tmsopt.roots.quartics.quartic import quartic_factors

_BACKWARD = 2e-13  # of numeric roots, twice what they promise
_COVERED = 18.0  # roundings that count as none when structures are decided, and an eighth
_FLOOR = 1e-3  # of the median root: the size that a smaller one counts as there
_LARGEST = 1e40  # relative to the leading coefficient: beyond it a root may be no double
_STEPS = 4  # in which an error of one part in 1000 of the distances becomes one of 1e-24
_ENOUGH = 1e-24
_EXACT = 1e-14  # roundings of a product of a dozen complex factors and of its quotient


@dataclass(frozen=True)
class Motions:
    """Of each polynomial.

    Attributes:
        abscissa, damping_ratio: of the roots.
        frequency: greatest |Im s|, in doubles.
        oscillates: whether a pair is rightmost.
        scatter: how far numeric roots may be off.
        simple: whether all this is certain, and no polynomial within the tolerance has a multiple root, or other roots
            beside the rightmost one or pair.
    """

    abscissa: Twofold
    damping_ratio: Twofold
    frequency: Array
    oscillates: Truth
    scatter: Array
    simple: Truth


def motions(coefficients: Sequence[Twofold], roundings: Sequence[Array], tolerance: float) -> Motions:
    """Abscissa and damping ratio of polynomials, coefficients descending, each of shape (m,).

    Args:
        roundings: how far rounding of a design puts each coefficient off.
        tolerance: relative change of a coefficient within which roots count as multiple.
    """
    high = np.stack([c.high for c in coefficients])
    n = len(high) - 1
    off = np.stack(list(roundings))
    fit = np.isfinite(high).all(axis=0) & np.isfinite(off).all(axis=0)
    fit &= (np.abs(high[0]) > 2 * off[0]) & (np.abs(high[0]) * _LARGEST > np.abs(high).max(axis=0))
    z = _numeric(np.where(fit, high, (np.arange(n + 1) % n == 0)[:, None] * 1.0))
    size = np.abs(z)
    reach = np.maximum(size, _FLOOR * np.median(size, axis=0))
    product = np.ones_like(size)
    for i in range(n):
        for j in range(i + 1, n):
            apart = np.abs(z[i] - z[j])
            product[i] *= apart
            product[j] *= apart
    moved = np.stack([np.prod(size[i] + reach, axis=0) for i in range(n)])
    exact = n * _BACKWARD * moved / product
    own = np.zeros_like(size)
    for rounding in off:
        own = own * size + rounding / np.abs(high[0])
    near = n * (1.1 * tolerance * moved + _COVERED * own) / product + exact
    top = z.real.argmax(axis=0)
    rows = np.arange(z.shape[1])
    simple = fit & (near < size).all(axis=0)
    right, reach_right = z[top, rows], near[top, rows]
    for i in range(n):
        for j in range(i + 1, n):
            simple &= np.abs(z[i] - z[j]) > near[i] + near[j]
        beside = (right.real - z[i].real <= near[i] + reach_right) & (z[i].real != right.real)
        simple &= ~beside & ((z[i].real != right.real) | (np.abs(z[i].imag) == np.abs(right.imag)))
    place, damped, certain = _least_damped(z, exact, size)
    simple &= certain
    found = _refined(coefficients, z, exact, top, simple)
    ratio = -found[0] / (found[0] * found[0] + found[1] * found[1]).sqrt()
    other = np.flatnonzero(simple & (damped == 0) & (place != top) & (z[place, rows] != right.conj()))
    if other.size:
        x, y = _refined([c[other] for c in coefficients], z[:, other], exact[:, other], place[other], simple[other])
        part = -x / (x * x + y * y).sqrt()
        for whole, some in ((ratio.high, part.high), (ratio.low, part.low), (ratio.off, part.off)):
            whole[other] = some
    ratio = ratio.where(damped == 0, Twofold(damped))
    return Motions(found[0], ratio, z.imag.max(axis=0), right.imag != 0, exact.max(axis=0), simple)


def _numeric(a: Array) -> Complex:
    """Roots in doubles, shape (n, m)."""
    found = quartic_factors(*a).roots if len(a) == 5 else roots(a.T)
    return np.ascontiguousarray(found.T)


def _least_damped(z: Complex, exact: Array, size: Array) -> tuple[Array, Array, Truth]:
    """Root with the least damping ratio; the ratio where that is of a real root, 1 or −1, else 0; whether certain."""
    real = z.imag == 0
    ratio = np.where(real, np.inf, -z.real / np.where(size > 0, size, 1.0))
    error = 2 * exact / np.where(size > 0, size, 1.0)
    place = ratio.argmin(axis=0)
    rows = np.arange(z.shape[1])
    least, reach = ratio[place, rows], error[place, rows]
    growing = (real & (z.real > 0)).any(axis=0)
    alone = np.ones(z.shape[1], dtype=bool)
    for k in range(len(z)):
        same = real[k] | (z[k] == z[place, rows]) | (z[k] == z[place, rows].conj())
        alone &= same | (ratio[k] - error[k] > least + reach)
    damped = np.where(growing, -1.0, np.where(real.all(axis=0), 1.0, 0.0))
    return place, damped, alone | (damped != 0)


def _refined(
    coefficients: Sequence[Twofold], z: Complex, exact: Array, place: Array, wanted: Truth
) -> tuple[Twofold, Twofold]:
    """Real and imaginary part of one root of each polynomial; not a number where it is not wanted."""
    m = z.shape[1]
    parts = [[np.full(m, np.nan), np.zeros(m), np.full(m, np.inf)] for _ in range(2)]
    point = z[place, np.arange(m)]
    rows = np.flatnonzero(wanted)
    for _ in range(_STEPS):
        a = [c[rows] for c in coefficients] if len(rows) < m else list(coefficients)
        at, others, apart = point[rows], a[0].high.astype(complex), np.full(len(rows), _EXACT)
        apart += a[0].off / np.abs(a[0].high)
        for k in range(len(z)):
            mine = place[rows] == k
            factor = np.where(mine, 1.0, at - z[k, rows])
            others = others * factor
            lost = np.where(mine, 0.0, exact[k, rows])
            apart += 2 * lost / np.maximum(np.abs(factor) - lost, 1e-300)
        x, y = Twofold(at.real), Twofold(at.imag)
        p, q = a[0], Twofold(np.zeros(len(rows)))
        for c in a[1:]:
            p, q = p * x - q * y + c, p * y + q * x
        step = (p.high + 1j * q.high) / others
        off = np.where(apart < 0.1, 1.2 * apart * np.abs(step) + 1.2 * (p.off + q.off) / np.abs(others), np.inf)
        real = at.imag == 0
        for part, start, move in zip(parts, (at.real, at.imag), (step.real, step.imag), strict=True):
            result = Twofold(start) - move
            for whole, some in zip(part, (result.high, result.low, result.off + off), strict=True):
                whole[rows] = some
        parts[1][0][rows[real]], parts[1][1][rows[real]], parts[1][2][rows[real]] = 0.0, 0.0, 0.0
        point[rows] = parts[0][0][rows] + 1j * parts[1][0][rows]
        rows = rows[off > _ENOUGH * np.abs(at)]
        if not rows.size:
            break
    return Twofold(*parts[0]), Twofold(*parts[1])
