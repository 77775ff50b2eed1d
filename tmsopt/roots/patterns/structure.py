"""The multiplicity structure of a polynomial within a stated tolerance, decided on coefficients."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tmsopt.records import Array
from tmsopt.roots.numeric import roots as numeric_roots
from tmsopt.roots.patterns.fitting import gauss_newton, relative_distance, sizes
from tmsopt.roots.patterns.multiplicity import Fit, decided
from tmsopt.roots.patterns.pattern import Pattern, Roots
from tmsopt.roots.patterns.shape import Group, with_simple
from tmsopt.roots.polynomial import Root, rightmost_first

ROUNDING = 8 * np.finfo(float).eps
"""Relative error that coefficients of a quartic computed in double precision carry anyway."""

HIGHEST = 12
"""Degree of a polynomial whose structure can be decided."""

_CLOSED = 1e-10  # of the squared root size: a pattern contains its own boundary, as CEP2 and 2EP2 contain EP4
_GREATEST = 1023  # power of 2 that is a double
_NOTHING = np.finfo(float).eps ** 2  # of the largest root: what fitting in doubles leaves of a real part that is 0


@dataclass(frozen=True)
class Structure:
    """Which roots stand on the rightmost vertical line.

    Attributes:
        name: ``EPk`` for a k-fold real root, ``CEPk`` for a k-fold complex pair, ``real``, ``pair``, ``two pairs`` …
            for simple ones, joined by ``+`` as in ``EP2+pair``, or ``undecided`` where double precision cannot tell.
            Of a quartic with two real double roots ``2EP2``.
        roots: all roots with multiplicities, of the nearest polynomial that has the structure.
        distance: relative change of the coefficients (root sum of squares) that takes the polynomial there.

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
        """Real part of the rightmost root of the structured polynomial."""
        return max((root.re for root in self.roots), default=float("nan"))


@np.errstate(all="ignore")  # roots 300 orders apart
def structure(coefficients: ArrayLike, tolerance: float = 1e-12, off: ArrayLike | None = None) -> Structure:
    """Structure of the roots of a real polynomial of degree 1 to 12, coefficients descending, shape (n + 1,).

    A structure holds when a polynomial that has it exactly lies within `tolerance`: the root sum of squares of
    the changes of the coefficients, each relative to the terms that make it up. The most degenerate structure that
    holds is named. ``undecided`` says that the distance differs from the tolerance by less than rounding does, as
    it must for tolerance 0 at an exceptional point.

    Args:
        off: how far rounding may put each coefficient off, if that is known, shape (n + 1,): those that are small
            differences of large numbers cannot be right to their own size, and others are judged by the roots' own.

    Raises:
        ValueError: for another shape, coefficients that are not finite, or a leading 0.

    Example:
        >>> tmsopt.roots.structure([1, 4, 8, 8, 4]).name  # (s² + 2 s + 2)²
        'CEP2'

    More: docs/explanation/exceptional_points.md
    """
    c = _checked(coefficients)
    found = numeric_roots(c)
    nonzero = np.abs(found[(found != 0) & np.isfinite(found)])
    power = min(round(np.mean(np.log2(nonzero))), _GREATEST) if nonzero.size else 0
    unit = 2.0**power
    monic, size = _in_unit(c, found, power, off, tolerance)
    rounding = ROUNDING * (len(c) - 1) / 4
    fit = decided(monic, size, tolerance + rounding, rounding)
    if fit.distance < tolerance - rounding or not fit.shape.groups:
        return _named(fit, found, unit)
    definite = _named(decided(monic, size, tolerance - rounding, rounding), found, unit)
    if definite.name not in ("pair", "real"):
        return definite
    return Structure("undecided", _simple(found), fit.distance)


def multiple_real_roots(coefficients: ArrayLike, tolerance: float) -> tuple[Root, ...] | None:
    """The roots of the `structure`, rightmost first, if all are real and two of them are equal; else None.

    Example:
        >>> found = tmsopt.roots.multiple_real_roots([1, 5, 9, 7, 2 + 1e-13], 1e-9)  # near (s + 1)³ (s + 2)
        >>> [(round(root.re, 6), root.multiplicity) for root in found]
        [(-1.0, 3), (-2.0, 1)]

    More: docs/explanation/exceptional_points.md
    """
    found = structure(coefficients, tolerance).roots
    multiple = all(root.im == 0 for root in found) and any(root.multiplicity > 1 for root in found)
    return found if multiple else None


def _in_unit(c: Array, found: Roots, power: int, off: ArrayLike | None, tolerance: float) -> tuple[Array, Array]:
    """Monic coefficients and their sizes where 2 to a power is the unit of roots; a double may not hold unit⁴."""
    monic, unit = _scaled(c / c[0], power), 2.0**power
    if off is None:
        return monic, sizes(found / unit)
    known = np.abs(_scaled(np.asarray(off, dtype=float) / c[0], power))
    return monic, sizes(found / unit, monic, np.where(np.isfinite(known), known, 0.0), tolerance)


def _scaled(monic: Array, power: int) -> Array:
    return np.asarray(np.ldexp(monic, -power * np.arange(len(monic))))


def pattern_distance(
    pattern: Pattern, coefficients: ArrayLike, off: ArrayLike | None = None, tolerance: float = 0.0
) -> float:
    """Relative change of the coefficients (root sum of squares) to reach a pattern of their degree; inf if none.

    Args:
        off, tolerance: see `structure`.

    Example:
        >>> double = tmsopt.roots.pattern("EP2", 2)
        >>> f"{tmsopt.roots.pattern_distance(double, [1, 2, 1.001]):.6f}"  # c² = 4 k is 0.001/√5 away
        '0.000447'

    More: docs/explanation/factors.md
    """
    try:
        fits, found = _fits(pattern, coefficients, off, tolerance)
    except ValueError:
        return float("inf")
    least = -_CLOSED * np.abs(found).max() ** 2
    inside = (distance for distance, u in fits if all(value >= least for value in pattern.nonnegative(u)))
    return next(inside, float("inf"))


def fit_unknowns(pattern: Pattern, coefficients: ArrayLike) -> list[list[float]]:
    """Unknowns of the polynomials of a pattern nearest to a given one, one for each guess, the nearest first."""
    return [u for _, u in _fits(pattern, coefficients, None, 0.0)[0]]


def _fits(
    pattern: Pattern, coefficients: ArrayLike, off: ArrayLike | None, tolerance: float
) -> tuple[list[tuple[float, list[float]]], Roots]:
    """The distance and the unknowns that each guess leads to, the nearest first, and the roots.

    Raises:
        ValueError: for coefficients of another degree than the pattern's.
    """
    c = _checked(coefficients)
    if len(c) - 1 != pattern.degree:
        raise ValueError(f"found coefficients of degree {len(c) - 1}; accepted: those of degree {pattern.degree}")
    found = numeric_roots(c)
    monic, size = _in_unit(c, found, 0, off, tolerance)
    fits = [gauss_newton(pattern, np.array(guess, dtype=float), monic, size) for guess in pattern.guesses(found)]
    each = ((relative_distance(pattern, u, monic, size), u.tolist()) for u in fits)
    return sorted(each, key=lambda fit: fit[0]), found


def guess_distance(pattern: Pattern, coefficients: Array, found: Roots) -> float:
    """Relative distance of a polynomial with known roots from its best guess of a pattern, cheaply; inf without one."""
    size, monic = sizes(found), coefficients / coefficients[0]
    return min((relative_distance(pattern, g, monic, size) for g in pattern.guesses(found)), default=float("inf"))


def _checked(coefficients: ArrayLike) -> Array:
    c = np.asarray(coefficients, dtype=float)
    if c.ndim != 1 or not 2 <= c.size <= HIGHEST + 1:
        raise ValueError(f"found coefficients of shape {c.shape}; accepted: 2 to {HIGHEST + 1} of them, descending")
    if not np.all(np.isfinite(c)) or c[0] == 0:
        raise ValueError(
            "found a coefficient that is not finite, or a leading 0; accepted: finite ones, the leading one not 0"
        )
    return c


def _named(fit: Fit, found: Roots, unit: float) -> Structure:
    """The structure of a fit, in the unit of the polynomial."""
    if not fit.shape.groups:
        return Structure("pair" if found[np.argmax(found.real)].imag else "real", _simple(found), 0.0)
    each = [(z * unit, group.multiplicity) for z, group in zip(fit.places, fit.shape.groups, strict=True)]
    each += [(z * unit, 1) for z in (numeric_roots(fit.rest) if fit.shape.rest else ()) if z.imag >= 0]
    right = max(z.real for z, _ in each)
    line = [Group(multiplicity, z.imag == 0) for z, multiplicity in each if z.real == right]
    least = _NOTHING * max(abs(z) for z, _ in each)
    pairs = ((w, m) for z, m in each for w in ((z, z.conjugate()) if z.imag else (z,)))
    roots = [Root(float(w.real) if abs(w.real) > least else 0.0, float(w.imag), m) for w, m in pairs]
    name = "2EP2" if [(root.im, root.multiplicity) for root in roots] == _TWO_DOUBLE else _line_name(line)
    return Structure(name, rightmost_first(roots), fit.distance)


_TWO_DOUBLE = [(0.0, 2), (0.0, 2)]  # all roots of a quartic, which have a name of their own


def _line_name(line: Sequence[Group]) -> str:
    """Name of the roots and pairs on a vertical line."""
    multiple = sorted((g.multiplicity, g.real) for g in line if g.multiplicity > 1)
    return with_simple((f"EP{m}" if real else f"CEP{m}" for m, real in reversed(multiple)), line)


def _simple(found: Roots) -> tuple[Root, ...]:
    return rightmost_first(Root(float(z.real), float(z.imag)) for z in found)
