"""The multiplicity structure of a polynomial within a stated tolerance, decided on coefficients."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tmsopt.records import Array
from tmsopt.roots.numeric import roots as numeric_roots
from tmsopt.roots.patterns.composed import PATTERNS
from tmsopt.roots.patterns.fitting import gauss_newton, relative_distance, sizes
from tmsopt.roots.patterns.multiplicity import Fit, decided
from tmsopt.roots.patterns.pattern import LINES, Pattern, Roots
from tmsopt.roots.polynomial import Root

ROUNDING = 8 * np.finfo(float).eps
"""Relative error that coefficients of a quartic computed in double precision carry anyway."""

HIGHEST = 12
"""Degree of a polynomial whose structure can be decided."""

# Of a quartic, most degenerate first: pattern, multiplicity of its rightmost root, roots on its rightmost line.
_CANDIDATES = (
    (PATTERNS["EP4"], 4, 4),
    (PATTERNS["2EP2"], 2, 2),
    (PATTERNS["CEP2"], 2, 4),
    (PATTERNS["EP3"], 3, 3),
    (LINES["EP2+pair"], 1, 4),
    (PATTERNS["EP2"], 2, 2),
    (LINES["pair+real"], 1, 3),
    (LINES["two pairs"], 1, 4),
)

_NEAR = 0.05  # relative distance of a guess that can still lead to a pattern within any sensible tolerance
_CLOSED = 1e-10  # of the squared root size: a pattern contains its own boundary, as CEP2 and 2EP2 contain EP4
_LINE = 1e-6  # relative difference of real parts on one vertical line, for roots of an exact pattern


@dataclass(frozen=True)
class Structure:
    """Which roots stand on the rightmost vertical line.

    Attributes:
        name: ``EPk`` for a k-fold real root, ``CEPk`` for a k-fold complex pair, ``real``, ``pair``, ``two pairs`` …
            for simple ones, joined by ``+`` as in ``EP2+pair``, or ``undecided`` where double precision cannot tell.
            Of a quartic with two real double roots ``2EP2``.
        roots: all roots with multiplicities, of the nearest polynomial that has the structure. Those of a quartic
            whose rightmost root is simple and alone are its own.
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
    size = _sizes(c, found, off, tolerance)
    return (_of_quartic if len(c) == 5 else _of_any)(c, found, size, tolerance)


def _sizes(c: Array, found: Roots, off: ArrayLike | None, tolerance: float) -> Array:
    if off is None:
        return sizes(found)
    known = np.abs(np.asarray(off, dtype=float) / c[0])
    return sizes(found, c / c[0], np.where(np.isfinite(known), known, 0.0), tolerance)


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
        c = _matching(pattern, coefficients)
    except ValueError:
        return float("inf")
    found = numeric_roots(c)
    size = _sizes(c, found, off, tolerance)
    return min((distance for distance, _ in _fits(pattern, c, found, size, np.inf)), default=float("inf"))


def nearest_unknowns(pattern: Pattern, coefficients: ArrayLike) -> list[tuple[float, ...]]:
    """Unknowns of the polynomials of a pattern nearest to a given one, one for each guess, the nearest first."""
    c = _matching(pattern, coefficients)
    found = numeric_roots(c)
    size = sizes(found)
    fits = [gauss_newton(pattern, np.array(guess), c / c[0], size) for guess in pattern.guesses(found)]
    fits.sort(key=lambda u: relative_distance(pattern, u, c / c[0], size))
    return [tuple(float(x) for x in u) for u in fits]


def guess_distance(pattern: Pattern, coefficients: Array, found: Roots) -> float:
    """Relative distance of a polynomial with known roots from its best guess of a pattern, cheaply; inf without one."""
    size, monic = sizes(found), coefficients / coefficients[0]
    return min((relative_distance(pattern, g, monic, size) for g in pattern.guesses(found)), default=float("inf"))


def _checked(coefficients: ArrayLike) -> Array:
    c = np.asarray(coefficients, dtype=float)
    if c.ndim != 1 or not 2 <= c.size <= HIGHEST + 1:
        raise ValueError(f"found coefficients of shape {c.shape}; accepted: 2 to {HIGHEST + 1} of them, descending")
    if not np.all(np.isfinite(c)) or c[0] == 0:
        raise ValueError("found a coefficient that is not finite, or a leading 0; accepted: a polynomial's")
    return c


def _matching(pattern: Pattern, coefficients: ArrayLike) -> Array:
    """The coefficients, if they are of the pattern's degree."""
    c = _checked(coefficients)
    if len(c) - 1 != pattern.degree:
        raise ValueError(f"found coefficients of degree {len(c) - 1}; accepted: those of degree {pattern.degree}")
    return c


def _of_quartic(c: Array, found: Roots, size: Array, tolerance: float) -> Structure:
    undecided: Structure | None = None
    for pattern, multiplicity, on_line in _CANDIDATES:
        for distance, unknowns in _fits(pattern, c, found, size, _NEAR):
            if not distance <= tolerance + ROUNDING:
                continue
            candidate = Structure(pattern.name, _roots_of(pattern, unknowns), distance)
            line = [r for r in candidate.roots if r.re >= candidate.abscissa - _LINE * np.abs(found).max()]
            if line[0].multiplicity < multiplicity or sum(r.multiplicity for r in line) < on_line:
                continue
            if distance < tolerance - ROUNDING:
                return candidate
            undecided = undecided or Structure("undecided", _simple(found), distance)
    return undecided or Structure(_simple_name(found), _simple(found), 0.0)


def _of_any(c: Array, found: Roots, size: Array, tolerance: float) -> Structure:
    nonzero = np.abs(found[found != 0])
    unit = 2.0 ** np.round(np.mean(np.log2(nonzero))) if nonzero.size else 1.0
    units = unit ** np.arange(len(c))
    monic = c / c[0] / units
    size = size / units
    rounding = ROUNDING * (len(c) - 1) / 4
    fit = decided(monic, size, tolerance + rounding, rounding)
    if fit.distance < tolerance - rounding or not fit.shape.groups:
        return _named(fit, found, unit)
    definite = _named(decided(monic, size, tolerance - rounding, rounding), found, unit)
    if definite.name not in ("pair", "real"):
        return definite
    return Structure("undecided", _simple(found), fit.distance)


def _named(fit: Fit, found: Roots, unit: float) -> Structure:
    """The structure of a fit, in the unit of the polynomial."""
    if not fit.shape.groups:
        return Structure(_simple_name(found), _simple(found), 0.0)
    each = [(z * unit, group.multiplicity) for z, group in zip(fit.places, fit.shape.groups, strict=True)]
    each += [(z * unit, 1) for z in (numeric_roots(fit.rest) if fit.shape.rest else ()) if z.imag >= 0]
    right = max(z.real for z, _ in each)
    line = [(multiplicity, z.imag == 0) for z, multiplicity in each if z.real == right]
    roots = [Root(w.real, w.imag, m) for z, m in each for w in ((z, z.conjugate()) if z.imag else (z,))]
    return Structure(_line_name(line), _sorted(roots), fit.distance)


def _line_name(line: Sequence[tuple[int, bool]]) -> str:
    """Name of the roots and pairs on a vertical line, given by multiplicity and whether they are real."""
    multiple = sorted(((m, real) for m, real in line if m > 1), reverse=True)
    names = [f"EP{m}" if real else f"CEP{m}" for m, real in multiple]
    pairs = sum(m == 1 and not real for m, real in line)
    names += [f"{_COUNTS[pairs]}pair" + ("s" if pairs > 1 else "")] if pairs else []
    return "+".join([*names, *("real" for m, real in line if m == 1 and real)])


_COUNTS = ("", "", "two ", "three ", "four ", "five ", "six ")


def _simple_name(found: Roots) -> str:
    return "pair" if found[np.argmax(found.real)].imag else "real"


def _simple(found: Roots) -> tuple[Root, ...]:
    return _sorted([Root(float(z.real), float(z.imag)) for z in found])


def _sorted(roots: list[Root]) -> tuple[Root, ...]:
    return tuple(sorted(roots, key=lambda r: (-r.re, -r.im)))


def _fits(pattern: Pattern, c: Array, found: Roots, size: Array, near: float) -> list[tuple[float, Array]]:
    """Distance and unknowns of polynomials of a pattern close to c, one per guess within `near`, the nearest first."""
    fits = []
    monic = c / c[0]
    for guess in pattern.guesses(found):
        if relative_distance(pattern, guess, monic, size) > near:
            continue
        unknowns = gauss_newton(pattern, np.array(guess, dtype=float), monic, size)
        if all(value >= -_CLOSED * np.abs(found).max() ** 2 for value in pattern.nonnegative(list(unknowns))):
            fits.append((relative_distance(pattern, unknowns, monic, size), unknowns))
    return sorted(fits, key=lambda fit: fit[0])


def _roots_of(pattern: Pattern, unknowns: Array) -> tuple[Root, ...]:
    """Roots of the factors, equal factors counted as multiplicity."""
    counted = Counter(tuple(float(x) for x in factor) for factor in pattern.factors(list(unknowns)))
    found = ((z, m) for factor, m in counted.items() for z in numeric_roots(np.array(factor)))
    return _sorted([Root(float(z.real), float(z.imag), m) for z, m in found])
