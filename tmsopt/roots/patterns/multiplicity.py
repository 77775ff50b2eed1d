"""Which roots of a polynomial are multiple, and which stand on its rightmost vertical line, within a tolerance.

A k-fold root is a simple, so well determined, root of the (k−1)-th derivative. So the numeric roots, which scatter
there by the k-th root of the rounding unit, are not looked at: multiplicities are tried from the highest down at the
roots of derivatives, each accepted if a polynomial that has it and those found before lies within the tolerance, and
its factor is taken out before the next is sought.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tmsopt.records import Array
from tmsopt.roots.numeric import roots as numeric_roots
from tmsopt.roots.patterns.fitting import gauss_newton, relative_distance, sizes
from tmsopt.roots.patterns.shape import Group, Shape

_NEAR = 0.05  # relative distance of a guess that can still lead to a polynomial within any sensible tolerance
_NEARLY_REAL = 1e-2  # |Im z|/|z| up to which a root of a derivative may stand for a real one
_WORTH = 1e-6  # relative change that makes a place a multiple root, up to which a fit is worth its time
_TIMES = 1e3  # likewise, times the tolerance: a place found on a derivative need not be the best one
_TRIED = 4  # places for each multiplicity
_PATIENCE = 2  # steps of a fit that may bring nothing: a place is near what it stands for
_LINE = 1e-3  # of the largest root: distance of real parts that may be a tie


@dataclass(frozen=True)
class Fit:
    """The nearest polynomial of a shape.

    Attributes:
        distance: relative change of the coefficients (root sum of squares) that takes the polynomial there.
    """

    shape: Shape
    unknowns: Array
    distance: float

    @property
    def places(self) -> list[complex]:
        """One root of each group, that of a pair in the upper half-plane."""
        factors = self.shape.group_factors(list(self.unknowns))
        return [_upper(factor) for factor in factors]

    @property
    def rest(self) -> Array:
        """Coefficients of the factor with simple roots."""
        return np.array(self.shape.rest_factor(list(self.unknowns)), dtype=float)


def decided(monic: Array, size: Array, limit: float, rounding: float) -> Fit:
    """The shape with most conditions within a relative distance, of several the nearest.

    Args:
        monic: coefficients in a unit near the size of the roots.
        size: of the terms that each coefficient is summed from.
        rounding: distance that rounding alone explains.
    """
    best = _with_ties(monic, size, _grouped(monic, size, limit), limit)
    if not best.shape.groups or best.distance <= rounding:
        return best
    # Roots that are near each other may pass for one of higher multiplicity; those that are exact come first.
    for tighter in (rounding, np.sqrt(rounding * limit)):
        if tighter < limit:
            other = _with_ties(monic, size, _grouped(monic, size, tighter), limit)
            best = max((best, other), key=lambda fit: (fit.shape.conditions, -fit.distance))
    return best


def _grouped(monic: Array, size: Array, limit: float) -> Fit:
    """Multiple roots, those of the highest multiplicity first."""
    fit = Fit(Shape((), len(monic) - 1), monic[1:], 0.0)
    k = len(monic) - 1
    while (k := min(k, fit.shape.rest)) >= 2:
        found = _one_more(monic, size, fit, k, limit)
        fit, k = (fit, k - 1) if found is None else (found, k)
    return fit


def _one_more(monic: Array, size: Array, fit: Fit, k: int, limit: float) -> Fit | None:
    """The nearest polynomial with one more k-fold root; None if there is none within the limit."""
    needs = [(_change(monic, size, z, Group(k, z.imag == 0)), z) for z in _places(fit.rest, k)]
    worth = sorted((n for n in needs if n[0] <= max(_WORTH, _TIMES * limit)), key=lambda n: n[0])
    best = None
    own = sizes(numeric_roots(fit.rest)) if worth else size
    for _, z in worth[:_TRIED]:
        group = Group(k, z.imag == 0)
        shape = Shape((*fit.shape.groups, group), fit.shape.rest - group.degree)
        rest = _quotient(fit.rest, _power(z, group), own)
        trial = _fitted(shape, [*fit.places, z], rest, monic, size)
        if trial and trial.distance < (best.distance if best else limit):
            best = trial
    return best


def _places(rest: Array, k: int) -> Iterator[complex]:
    """Where a polynomial may have a k-fold root: on the real line, or in the upper half-plane if there is room."""
    degree = len(rest) - 1
    for z in numeric_roots(np.polyder(rest, k - 1)):
        if z.imag >= 0 and z.imag <= _NEARLY_REAL * abs(z):
            yield complex(z.real, 0.0)
        if z.imag > 0 and 2 * k <= degree:
            yield complex(z)


def _change(monic: Array, size: Array, z: complex, group: Group) -> float:
    """The least relative change of the coefficients that makes z a multiple root (and its conjugate, if complex)."""
    factor = _power(z, group)
    return float(np.linalg.norm((np.convolve(factor, _quotient(monic, factor, size)) - monic) / size))


def _power(z: complex, group: Group) -> Array:
    """Coefficients of the factor of a group with its root at z."""
    factor = np.array([1.0])
    for _ in range(group.multiplicity):
        factor = np.convolve(factor, [1.0, -z.real] if group.real else [1.0, -2 * z.real, abs(z) ** 2])
    return factor


def _quotient(monic: Array, factor: Array, size: Array) -> Array:
    """Quotient of two monic polynomials that leaves the least remainder, each coefficient in its own size."""
    left = len(monic) - len(factor)
    matrix = np.array([np.convolve(factor, unit) for unit in np.eye(left + 1)]).T / size[:, None]
    length = np.linalg.norm(matrix[:, 1:], axis=0)
    length[length == 0] = 1.0
    tail = np.linalg.lstsq(matrix[:, 1:] / length, monic / size - matrix[:, 0], rcond=None)[0] / length
    return np.concatenate([[1.0], tail])


def _fitted(shape: Shape, places: Sequence[complex], rest: Array, monic: Array, size: Array) -> Fit | None:
    """The nearest polynomial of a shape, from a start; None where a pair is not complex or the fit fails."""
    u = gauss_newton(shape, np.array(shape.start(places, list(rest)), dtype=float), monic, size, _PATIENCE)
    distance = relative_distance(shape, u, monic, size)
    if not np.isfinite(distance) or any(not gap > 0 for gap in shape.gaps(list(u))):
        return None
    return Fit(shape, u, distance)


def _with_ties(monic: Array, size: Array, fit: Fit, limit: float) -> Fit:
    """The same with as many roots on the rightmost vertical line as the limit allows."""
    simple = [z for z in numeric_roots(fit.rest) if z.imag >= 0] if fit.shape.rest else []
    items = [*zip(fit.places, fit.shape.groups, strict=True), *((z, Group(1, z.imag == 0)) for z in simple)]
    items.sort(key=lambda item: -item[0].real)
    near = _LINE * max(abs(z) for z, _ in items)
    on_line = sum(z.real >= items[0][0].real - near for z, _ in items)
    for count in range(on_line, 1, -1):
        if sum(g.real for _, g in items[:count]) <= 1:
            tied = [(z, replace(g, tied=True)) for z, g in items[:count]]
            others = [(z, g) for z, g in items[count:] if g.multiplicity > 1]
            free = [z for z, g in items[count:] if g.multiplicity == 1]
            places, groups = zip(*tied, *others, strict=True)
            every = [w for z in free for w in ((z, z.conjugate()) if z.imag else (z,))]
            rest = np.atleast_1d(np.poly(np.array(every))).real
            trial = _fitted(Shape(tuple(groups), len(rest) - 1), places, rest, monic, size)
            if trial and trial.distance < limit:
                return trial
    return fit


def _upper(factor: Sequence[float]) -> complex:
    if len(factor) == 2:
        return complex(-factor[1], 0.0)
    half = -factor[1] / 2
    return complex(half, np.sqrt(max(factor[2] - half * half, 0.0)))
