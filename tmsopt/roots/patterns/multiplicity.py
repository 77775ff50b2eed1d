"""Finds the multiple roots of a polynomial, and the roots on its rightmost vertical line, within a tolerance.

The numeric roots do not show a k-fold root, since they scatter by the k-th root of the rounding unit. But a k-fold root
is a simple root of the (k−1)-th derivative, and therefore well determined. Multiplicities are tried at the roots of the
derivatives, the highest first. A multiple root is accepted if a polynomial with this root and all roots accepted before
lies within the tolerance. Its factor is divided out before the next root is tried. A shape is a factored form; a group
is one multiple root of it, and a tied group is one on the rightmost line.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tmsopt.records import Array
from tmsopt.roots.numeric import roots as numeric_roots
from tmsopt.roots.patterns.fitting import gauss_newton, relative_distance, term_sizes
from tmsopt.roots.patterns.shape import Group, Shape

_MAX_ANGLE = 1e-2  # a root of a derivative with |Im z|/|z| up to this may stand for a real root
_MAX_CHANGE = 1e-6  # a fit is tried at z if a smaller relative change of the coefficients makes z a multiple root
_MAX_CHANGE_FACTOR = 1e3  # a fit is also tried if the change is smaller than so many tolerances
_MAX_FITS = 4  # fits that are tried for each multiplicity
_PATIENCE = 2  # a fit ends after so many steps without progress
_MAX_DIFFERENCE = 1e-3  # real parts with a smaller difference, relative to the largest root, may be equal


@dataclass(frozen=True)
class Fit:
    """The polynomial of a shape nearest to a given one.

    Attributes:
        distance: relative change of the coefficients (root sum of squares) between the two.
    """

    shape: Shape
    unknowns: Array
    distance: float

    @property
    def group_roots(self) -> list[complex]:
        """One root of each group; the upper root of a pair."""
        return [_upper_root(factor) for factor in self.shape.group_factors(list(self.unknowns))]

    @property
    def rest_factor(self) -> Array:
        """Coefficients of the factor with simple roots."""
        return np.array(self.shape.rest_factor(list(self.unknowns)), dtype=float)


def find_multiple_roots(monic: Array, size: Array, limit: float, rounding_distance: float) -> Fit:
    """The fit whose shape has the most conditions, among the fits within a relative distance; the nearest of several.

    Args:
        monic: coefficients in a unit near the size of the roots.
        size: size of the terms of each coefficient.
        limit: largest relative distance.
        rounding_distance: distance that can be due to rounding only.
    """
    best_fit = _tie_rightmost(monic, size, _find_groups(monic, size, limit), limit)
    if not best_fit.shape.groups or best_fit.distance <= rounding_distance:
        return best_fit
    # Distinct but close roots may look like one root of higher multiplicity, so smaller limits are tried, too.
    for smaller_limit in (rounding_distance, np.sqrt(rounding_distance * limit)):
        if smaller_limit < limit:
            trial = _tie_rightmost(monic, size, _find_groups(monic, size, smaller_limit), limit)
            best_fit = max((best_fit, trial), key=lambda fit: (fit.shape.conditions, -fit.distance))
    return best_fit


def _find_groups(monic: Array, size: Array, limit: float) -> Fit:
    """Multiple roots, the highest multiplicity first."""
    k = len(monic) - 1
    fit = Fit(Shape((), k), monic[1:], 0.0)
    while (k := min(k, fit.shape.rest_degree)) >= 2:
        next_fit = _add_group(monic, size, fit, k, limit)
        fit, k = (fit, k - 1) if next_fit is None else (next_fit, k)
    return fit


def _add_group(monic: Array, size: Array, fit: Fit, k: int, limit: float) -> Fit | None:
    """The nearest polynomial with one more k-fold root; None if there is none within the limit."""
    changes = [(_least_change(monic, size, z, Group(k, z.imag == 0)), z) for z in _find_candidates(fit.rest_factor, k)]
    largest_change = max(_MAX_CHANGE, _MAX_CHANGE_FACTOR * limit)
    candidates = [z for _, z in sorted((c for c in changes if c[0] <= largest_change), key=lambda c: c[0])]
    best_fit = None
    rest_size = term_sizes(numeric_roots(fit.rest_factor)) if candidates else size
    for z in candidates[:_MAX_FITS]:
        group = Group(k, z.imag == 0)
        shape = Shape((*fit.shape.groups, group), fit.shape.rest_degree - group.degree)
        rest_factor = _quotient(fit.rest_factor, _power(z, group), rest_size)
        trial = _fit_shape(shape, [*fit.group_roots, z], rest_factor, monic, size)
        if trial and trial.distance < (best_fit.distance if best_fit else limit):
            best_fit = trial
    return best_fit


def _find_candidates(rest_factor: Array, k: int) -> Iterator[complex]:
    """Numbers near which a k-fold root may lie: real ones, and complex ones if the degree allows a k-fold pair."""
    degree = len(rest_factor) - 1
    for z in numeric_roots(np.polyder(rest_factor, k - 1)):
        if z.imag >= 0 and z.imag <= _MAX_ANGLE * abs(z):
            yield complex(z.real, 0.0)
        if z.imag > 0 and 2 * k <= degree:
            yield complex(z)


def _least_change(monic: Array, size: Array, z: complex, group: Group) -> float:
    """The least relative change of the coefficients that makes z (and its conjugate, if complex) a multiple root."""
    factor = _power(z, group)
    return float(np.linalg.norm((np.convolve(factor, _quotient(monic, factor, size)) - monic) / size))


def _power(z: complex, group: Group) -> Array:
    """Coefficients of the product of the factors of a group whose root is z."""
    factor = np.array([1.0])
    for _ in range(group.multiplicity):
        factor = np.convolve(factor, [1.0, -z.real] if group.is_real else [1.0, -2 * z.real, abs(z) ** 2])
    return factor


def _quotient(monic: Array, factor: Array, size: Array) -> Array:
    """Quotient of two monic polynomials that leaves the least remainder, relative to the sizes of the coefficients."""
    degree = len(monic) - len(factor)
    matrix = np.array([np.convolve(factor, unit) for unit in np.eye(degree + 1)]).T / size[:, None]
    length = np.linalg.norm(matrix[:, 1:], axis=0)
    length[length == 0] = 1.0
    tail = np.linalg.lstsq(matrix[:, 1:] / length, monic / size - matrix[:, 0], rcond=None)[0] / length
    return np.concatenate([[1.0], tail])


def _fit_shape(
    shape: Shape, group_roots: Sequence[complex], rest_factor: Array, monic: Array, size: Array
) -> Fit | None:
    """The nearest polynomial of a shape, from a first guess; None if a pair is not complex or the fit fails."""
    u = gauss_newton(
        shape, np.array(shape.initial_unknowns(group_roots, list(rest_factor)), dtype=float), monic, size, _PATIENCE
    )
    distance = relative_distance(shape, u, monic, size)
    if not np.isfinite(distance) or any(not height > 0 for height in shape.squared_heights(list(u))):
        return None
    return Fit(shape, u, distance)


def _tie_rightmost(monic: Array, size: Array, fit: Fit, limit: float) -> Fit:
    """The fit with the most roots tied to the rightmost line within the limit; the given fit if none can be tied."""
    upper_roots = [z for z in numeric_roots(fit.rest_factor) if z.imag >= 0] if fit.shape.rest_degree else []
    items = [*zip(fit.group_roots, fit.shape.groups, strict=True), *((z, Group(1, z.imag == 0)) for z in upper_roots)]
    items.sort(key=lambda item: -item[0].real)
    max_difference = _MAX_DIFFERENCE * max(abs(z) for z, _ in items)
    near_count = sum(z.real >= items[0][0].real - max_difference for z, _ in items)
    for count in range(near_count, 1, -1):
        if sum(g.is_real for _, g in items[:count]) <= 1:
            tied_roots = [(z, replace(g, is_tied=True)) for z, g in items[:count]]
            multiple_roots = [(z, g) for z, g in items[count:] if g.multiplicity > 1]
            simple_roots = [z for z, g in items[count:] if g.multiplicity == 1]
            group_roots, groups = zip(*tied_roots, *multiple_roots, strict=True)
            free_roots = [w for z in simple_roots for w in ((z, z.conjugate()) if z.imag else (z,))]
            rest_factor = np.atleast_1d(np.poly(np.array(free_roots))).real
            trial = _fit_shape(Shape(tuple(groups), len(rest_factor) - 1), group_roots, rest_factor, monic, size)
            if trial and trial.distance < limit:
                return trial
    return fit


def _upper_root(factor: Sequence[float]) -> complex:
    if len(factor) == 2:
        return complex(-factor[1], 0.0)
    half = -factor[1] / 2
    return complex(half, np.sqrt(max(factor[2] - half * half, 0.0)))
