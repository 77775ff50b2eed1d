"""The multiplicity structure of a quartic within a stated tolerance, decided on coefficients."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.roots.numeric import rebuilt
from tmsopt.roots.numeric import roots as numeric_roots
from tmsopt.roots.patterns import LINES, PATTERNS, Pattern, Roots

ROUNDING = 8 * np.finfo(float).eps
"""Relative error that coefficients computed in double precision carry anyway."""

# Most degenerate first: pattern, multiplicity of its rightmost root, roots on its rightmost line.
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
_STEPS = 20
_CLOSED = 1e-10  # of the squared root size: a pattern contains its own boundary, as CEP2 and 2EP2 contain EP4
_LINE = 1e-6  # relative difference of real parts on one vertical line, for roots of an exact pattern

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Root:
    """A root with its multiplicity; a complex pair is two of these."""

    re: float
    im: float
    multiplicity: int = 1


@dataclass(frozen=True)
class Structure:
    """Which roots stand on the rightmost vertical line.

    Attributes:
        name: ``EP4``, ``EP3``, ``2EP2``, ``CEP2``, ``EP2+pair``, ``EP2``, ``pair+real``, ``two pairs``,
            ``pair``, ``real``, or ``undecided`` where double precision cannot tell.
        roots: all roots with multiplicities, of the nearest polynomial that has the structure.
        distance: relative change of the coefficients (root sum of squares) that takes the polynomial there.
    """

    name: str
    roots: tuple[Root, ...]
    distance: float

    @property
    def abscissa(self) -> float:
        """Real part of the rightmost root of the structured polynomial."""
        return max((root.re for root in self.roots), default=float("nan"))


def structure(coefficients: ArrayLike, tolerance: float = 1e-12) -> Structure:
    """Structure of the rightmost roots of a real quartic, coefficients descending, shape (5,).

    A structure holds when a polynomial that has it exactly lies within `tolerance`: the root sum of squares of
    the changes of the coefficients, each relative to the terms that make it up. The most degenerate structure that
    holds is named. ``undecided`` says that the distance differs from the tolerance by less than rounding does, as
    it must for tolerance 0 at an exceptional point.

    Raises:
        ValueError: for another shape, coefficients that are not finite, or a leading 0.
    """
    c = _quartic(coefficients)
    found = numeric_roots(c)
    undecided: Structure | None = None
    for pattern, multiplicity, on_line in _CANDIDATES:
        for candidate in _fits(pattern, c, found, _NEAR):
            line = [r for r in candidate.roots if r.re >= candidate.abscissa - _LINE * np.abs(found).max()]
            if line[0].multiplicity < multiplicity or sum(r.multiplicity for r in line) < on_line:
                continue
            if candidate.distance < tolerance - ROUNDING:
                return candidate
            if candidate.distance <= tolerance + ROUNDING and undecided is None:
                undecided = Structure("undecided", _simple(found), candidate.distance)
    if undecided:
        return undecided
    rightmost = found[np.argmax(found.real)]
    return Structure("pair" if rightmost.imag else "real", _simple(found), 0.0)


def pattern_distance(pattern: Pattern, coefficients: ArrayLike) -> float:
    """Relative change of the coefficients (root sum of squares) that takes a quartic to a pattern; inf if none."""
    try:
        c = _quartic(coefficients)
    except ValueError:
        return float("inf")
    return min((fit.distance for fit in _fits(pattern, c, numeric_roots(c), np.inf)), default=float("inf"))


def nearest_unknowns(pattern: Pattern, coefficients: ArrayLike) -> list[tuple[float, ...]]:
    """Unknowns of the polynomials of a pattern nearest to a quartic, one for each of its guesses, the nearest first."""
    c = _quartic(coefficients)
    found = numeric_roots(c)
    size = _size(found)
    fits = [_gauss_newton(pattern, np.array(guess), c / c[0], size) for guess in pattern.guesses(found)]
    fits.sort(key=lambda u: _distance(pattern, u, c, size))
    return [tuple(float(x) for x in u) for u in fits]


def guess_distance(pattern: Pattern, coefficients: Array, found: Roots) -> float:
    """Relative distance of a quartic with known roots from its best guess of a pattern, cheaply; inf without one."""
    size = _size(found)
    return min((_distance(pattern, g, coefficients, size) for g in pattern.guesses(found)), default=float("inf"))


def _distance(pattern: Pattern, unknowns: Sequence[float] | Array, c: Array, size: Array) -> float:
    return float(np.linalg.norm((np.array(pattern.monic(list(unknowns)), dtype=float) - c / c[0]) / size))


def _size(found: Roots) -> Array:
    """Size of the terms that each monic coefficient is summed from.

    A root far smaller than the others counts as a thousandth of their median, so that a coefficient that a root
    at 0 makes vanish is judged by the others' size and not by its own rounding.
    """
    radius = np.abs(found)
    floor = 1e-3 * float(np.median(radius))
    return np.maximum(rebuilt((-np.maximum(radius, floor)).astype(complex)), 1e-100)


def _quartic(coefficients: ArrayLike) -> Array:
    c = np.asarray(coefficients, dtype=float)
    if c.shape != (5,):
        raise ValueError(f"found coefficients of shape {c.shape}; accepted: the five of a quartic, descending")
    if not np.all(np.isfinite(c)) or c[0] == 0:
        raise ValueError("found a coefficient that is not finite, or a leading 0; accepted: a quartic")
    return c


def _simple(found: Roots) -> tuple[Root, ...]:
    return _sorted([Root(float(z.real), float(z.imag)) for z in found])


def _sorted(roots: list[Root]) -> tuple[Root, ...]:
    return tuple(sorted(roots, key=lambda r: (-r.re, -r.im)))


def _fits(pattern: Pattern, c: Array, found: Roots, near: float) -> Iterator[Structure]:
    """Polynomials of a pattern close to c, one per guess that starts within `near`, the nearest first."""
    fits = []
    size = _size(found)
    for guess in pattern.guesses(found):
        if _distance(pattern, guess, c, size) > near:
            continue
        unknowns = _gauss_newton(pattern, np.array(guess), c / c[0], size)
        if all(value >= -_CLOSED * np.abs(found).max() ** 2 for value in pattern.nonnegative(list(unknowns))):
            distance = _distance(pattern, unknowns, c, size)
            fits.append(Structure(pattern.name, _roots_of(pattern, unknowns), distance))
    yield from sorted(fits, key=lambda fit: fit.distance)


def _gauss_newton(pattern: Pattern, guess: Array, target: Array, size: Array) -> Array:
    """Least squares of the relative coefficient residuals, with a complex-step Jacobian."""
    u = guess

    def residual(v: NDArray[np.complex128]) -> NDArray[np.complex128]:
        return np.asarray((np.array(pattern.monic(list(v)), dtype=complex) - target.astype(complex)) / size)

    for _ in range(_STEPS):
        columns = [residual(u + 1e-100j * unit).imag / 1e-100 for unit in np.eye(len(u))]
        step = np.linalg.lstsq(np.stack(columns, axis=1), -residual(u.astype(complex)).real, rcond=None)[0]
        u = u + step
        if np.all(np.abs(step) <= 1e-15 * np.abs(u)):
            break
    return u


def _roots_of(pattern: Pattern, unknowns: Array) -> tuple[Root, ...]:
    """Roots of the factors, equal factors counted as multiplicity."""
    counted: dict[tuple[float, ...], int] = {}
    for factor in pattern.factors(list(unknowns)):
        key = tuple(float(x) for x in factor)
        counted[key] = counted.get(key, 0) + 1
    return _sorted(
        [
            Root(float(z.real), float(z.imag), count)
            for factor, count in counted.items()
            for z in numeric_roots(np.array(factor))
        ]
    )
