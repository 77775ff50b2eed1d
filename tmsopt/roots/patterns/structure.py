"""Decides the multiplicity structure of a polynomial within a given tolerance of its coefficients."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tmsopt.records import Array
from tmsopt.roots.numeric import roots as numeric_roots
from tmsopt.roots.patterns.fitting import gauss_newton, relative_distance, term_sizes
from tmsopt.roots.patterns.multiplicity import Fit, find_multiple_roots
from tmsopt.roots.patterns.pattern import Pattern, Roots
from tmsopt.roots.patterns.shape import Group, join_group_names
from tmsopt.roots.polynomial import Root, rightmost_first

ROUNDING = 8 * np.finfo(float).eps
"""Relative rounding error of the coefficients of a quartic in double precision."""

MAX_DEGREE = 12
"""Highest degree of a polynomial whose structure can be decided."""

_BOUNDARY_TOLERANCE = 1e-10
"""An expression that must be ≥ 0 may be below 0 by this share of the squared size of the roots. So a pattern contains
its boundary; for example, CEP2 contains EP4."""

_MAX_EXPONENT = 1023  # largest power of 2 of a double
_ZERO_SHARE = np.finfo(float).eps ** 2  # a smaller real part, relative to the largest root, is a rounding error


@dataclass(frozen=True)
class Structure:
    """The multiplicities of the roots on the rightmost vertical line, and the roots.

    Attributes:
        name: ``EPk`` for a k-fold real root, ``CEPk`` for a k-fold complex pair, ``real``, ``pair``, ``two pairs`` …
            for simple roots, joined by ``+`` as in ``EP2+pair``; ``2EP2`` for a quartic with two real double roots;
            ``undecided`` if double precision does not suffice.
        roots: all roots of the nearest polynomial with the structure, with multiplicities.
        distance: relative change of the coefficients (root sum of squares) to that polynomial.

    Example:
        >>> found = tmsopt.roots.structure([1, 3, 3, 1])
        >>> found.name, [(round(root.re, 9), root.multiplicity) for root in found.roots]
        ('EP3', [(-1.0, 3)])

    More: docs/explanation/exceptional_points.md
    """

    name: str
    roots: tuple[Root, ...]
    distance: float

    @property
    def abscissa(self) -> float:
        """Real part of the rightmost root of the polynomial with the structure."""
        return max((root.re for root in self.roots), default=float("nan"))


@np.errstate(all="ignore")  # roots may differ by 300 orders of magnitude
def structure(coefficients: ArrayLike, tolerance: float = 1e-12, off: ArrayLike | None = None) -> Structure:
    """Structure of the roots of a real polynomial of degree 1 to 12, coefficients descending, shape (n + 1,).

    A structure holds if a polynomial with exactly this structure lies within `tolerance`. The result is the most
    degenerate structure that holds. It is ``undecided`` if the distance differs from the tolerance by less than
    rounding errors, for example if the tolerance is 0 at an exceptional point.

    Args:
        tolerance: root sum of squares of the changes of the coefficients, each relative to the size of its terms.
        off: rounding errors of the coefficients, if known, shape (n + 1,). The change of a small difference of large
            numbers is then not relative to its own size. The change of a coefficient far above its error is relative
            to the true sizes of the roots.

    Raises:
        ValueError: for another shape, coefficients that are not finite, or a leading 0.

    Example:
        >>> tmsopt.roots.structure([1, 4, 8, 8, 4]).name  # (s² + 2 s + 2)²
        'CEP2'

    More: docs/explanation/exceptional_points.md
    """
    c = _validate(coefficients)
    z = numeric_roots(c)
    nonzero = np.abs(z[(z != 0) & np.isfinite(z)])
    power = min(round(np.mean(np.log2(nonzero))), _MAX_EXPONENT) if nonzero.size else 0
    unit = 2.0**power
    monic, size = _scale(c, z, power, off, tolerance)
    rounding = ROUNDING * (len(c) - 1) / 4
    fit = find_multiple_roots(monic, size, tolerance + rounding, rounding)
    if fit.distance < tolerance - rounding or not fit.shape.groups:
        return _make_structure(fit, z, unit)
    certain_structure = _make_structure(find_multiple_roots(monic, size, tolerance - rounding, rounding), z, unit)
    if certain_structure.name not in ("pair", "real"):
        return certain_structure
    return Structure("undecided", _simple_roots(z), fit.distance)


def multiple_real_roots(coefficients: ArrayLike, tolerance: float) -> tuple[Root, ...] | None:
    """The roots of the `structure`, rightmost first, if all are real and two of them are equal; else None.

    Example:
        >>> found = tmsopt.roots.multiple_real_roots([1, 5, 9, 7, 2 + 1e-13], 1e-9)  # near (s + 1)³ (s + 2)
        >>> [(round(root.re, 6), root.multiplicity) for root in found]
        [(-1.0, 3), (-2.0, 1)]

    More: docs/explanation/exceptional_points.md
    """
    roots = structure(coefficients, tolerance).roots
    has_multiple = all(root.im == 0 for root in roots) and any(root.multiplicity > 1 for root in roots)
    return roots if has_multiple else None


def _scale(c: Array, z: Roots, power: int, off: ArrayLike | None, tolerance: float) -> tuple[Array, Array]:
    """Monic coefficients and the sizes of their terms, with 2^power as the unit of roots; unit⁴ may exceed doubles."""
    powers, unit = -power * np.arange(len(c)), 2.0**power
    monic = np.asarray(np.ldexp(c / c[0], powers))
    if off is None:
        return monic, term_sizes(z / unit)
    errors = np.abs(np.ldexp(np.asarray(off, dtype=float) / c[0], powers))
    return monic, term_sizes(z / unit, monic, np.where(np.isfinite(errors), errors, 0.0), tolerance)


def pattern_distance(
    pattern: Pattern, coefficients: ArrayLike, off: ArrayLike | None = None, tolerance: float = 0.0
) -> float:
    """Least relative change of the coefficients (root sum of squares) to a pattern; inf if no fit has the pattern.

    Args:
        off, tolerance: see `structure`.

    Example:
        >>> double = tmsopt.roots.pattern("EP2", 2)
        >>> f"{tmsopt.roots.pattern_distance(double, [1, 2, 1.001]):.6f}"  # c² = 4 k is 0.001/√5 away
        '0.000447'

    More: docs/explanation/factors.md
    """
    try:
        fits, z = _fit_pattern(pattern, coefficients, off, tolerance)
    except ValueError:
        return float("inf")
    lower_bound = -_BOUNDARY_TOLERANCE * np.abs(z).max() ** 2
    distances = (distance for distance, u in fits if all(value >= lower_bound for value in pattern.nonnegative(u)))
    return next(distances, float("inf"))


def fit_unknowns(pattern: Pattern, coefficients: ArrayLike) -> list[list[float]]:
    """Unknowns of the nearest polynomials of a pattern, one list for each guess, the nearest first."""
    return [u for _, u in _fit_pattern(pattern, coefficients, None, 0.0)[0]]


def _fit_pattern(
    pattern: Pattern, coefficients: ArrayLike, off: ArrayLike | None, tolerance: float
) -> tuple[list[tuple[float, list[float]]], Roots]:
    """Distance and unknowns of the fit from each guess, the nearest first, and the numeric roots.

    Raises:
        ValueError: if the polynomial and the pattern have different degrees.
    """
    c = _validate(coefficients)
    if len(c) - 1 != pattern.degree:
        raise ValueError(f"found coefficients of degree {len(c) - 1}; accepted: degree {pattern.degree}")
    z = numeric_roots(c)
    monic, size = _scale(c, z, 0, off, tolerance)
    unknowns = [gauss_newton(pattern, np.array(guess, dtype=float), monic, size) for guess in pattern.guesses(z)]
    fits = ((relative_distance(pattern, u, monic, size), u.tolist()) for u in unknowns)
    return sorted(fits, key=lambda fit: fit[0]), z


def guess_distance(pattern: Pattern, coefficients: Array, z: Roots) -> float:
    """Relative distance from a polynomial with roots z to the best guess of a pattern; inf if there is no guess."""
    size, monic = term_sizes(z), coefficients / coefficients[0]
    return min((relative_distance(pattern, g, monic, size) for g in pattern.guesses(z)), default=float("inf"))


def _validate(coefficients: ArrayLike) -> Array:
    c = np.asarray(coefficients, dtype=float)
    if c.ndim != 1 or not 2 <= c.size <= MAX_DEGREE + 1:
        raise ValueError(f"found coefficients of shape {c.shape}; accepted: 2 to {MAX_DEGREE + 1} of them, descending")
    if not np.all(np.isfinite(c)) or c[0] == 0:
        raise ValueError(
            "found a coefficient that is not finite, or a leading 0; accepted: finite ones, the leading one not 0"
        )
    return c


def _make_structure(fit: Fit, numeric: Roots, unit: float) -> Structure:
    """The structure of a fit, with its roots in the unit of the polynomial."""
    if not fit.shape.groups:
        return Structure("pair" if numeric[np.argmax(numeric.real)].imag else "real", _simple_roots(numeric), 0.0)
    upper = [(z * unit, group.multiplicity) for z, group in zip(fit.group_roots, fit.shape.groups, strict=True)]
    upper += [(z * unit, 1) for z in (numeric_roots(fit.rest_factor) if fit.shape.rest_degree else ()) if z.imag >= 0]
    abscissa = max(z.real for z, _ in upper)
    line_groups = [Group(multiplicity, z.imag == 0) for z, multiplicity in upper if z.real == abscissa]
    zero_size = _ZERO_SHARE * max(abs(z) for z, _ in upper)
    all_roots = ((w, m) for z, m in upper for w in ((z, z.conjugate()) if z.imag else (z,)))
    roots = [Root(float(w.real) if abs(w.real) > zero_size else 0.0, float(w.imag), m) for w, m in all_roots]
    is_two_double = [(root.im, root.multiplicity) for root in roots] == [(0.0, 2), (0.0, 2)]
    return Structure("2EP2" if is_two_double else name_line(line_groups), rightmost_first(roots), fit.distance)


def name_line(line_groups: Sequence[Group]) -> str:
    """Name of the roots and pairs on a vertical line."""
    multiple = sorted((g.multiplicity, g.is_real) for g in line_groups if g.multiplicity > 1)
    return join_group_names((f"EP{m}" if is_real else f"CEP{m}" for m, is_real in reversed(multiple)), line_groups)


def _simple_roots(numeric: Roots) -> tuple[Root, ...]:
    return rightmost_first(Root(float(z.real), float(z.imag)) for z in numeric)
