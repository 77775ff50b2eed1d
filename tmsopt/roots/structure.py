"""The multiplicity structure of a quartic within a stated tolerance, decided on coefficients."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.roots.numeric import rebuilt
from tmsopt.roots.numeric import roots as numeric_roots
from tmsopt.roots.patterns import PATTERNS, Pattern, Roots, _quadratic, _two

ROUNDING = 8 * np.finfo(float).eps
"""Relative error that coefficients computed in double precision carry anyway."""


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
        distance: largest relative change of a coefficient that takes the polynomial there.
    """

    name: str
    roots: tuple[Root, ...]
    distance: float

    @property
    def abscissa(self) -> float:
        """Real part of the rightmost root of the structured polynomial."""
        return max(root.re for root in self.roots)


def structure(coefficients: ArrayLike, tolerance: float = 1e-12) -> Structure:
    """Structure of the rightmost roots of a real quartic, coefficients descending, shape (5,).

    A structure holds when a polynomial that has it exactly lies within `tolerance`, the largest relative
    change of a coefficient. The most degenerate one that holds is named. ``undecided`` says that the distance
    differs from the tolerance by less than rounding does, as it must for tolerance 0 at an exceptional point.
    """
    c = np.asarray(coefficients, dtype=float)
    if c.shape != (5,):
        raise ValueError(f"structure takes the five coefficients of a quartic, not an array of shape {c.shape}")
    found = numeric_roots(c)
    undecided: Structure | None = None
    for candidate, on_the_line in _CANDIDATES:
        nearest = _nearest(candidate, on_the_line, c, found)
        if nearest is None or nearest.distance > tolerance + ROUNDING:
            continue
        if nearest.distance < tolerance - ROUNDING or (nearest.distance == 0 and tolerance > 0):
            return nearest
        undecided = undecided or Structure("undecided", _simple(found), nearest.distance)
    if undecided:
        return undecided
    rightmost = found[np.argmax(found.real)]
    return Structure("pair" if rightmost.imag else "real", _simple(found), 0.0)


def _simple(found: Roots) -> tuple[Root, ...]:
    return tuple(Root(float(z.real), float(z.imag)) for z in sorted(found, key=lambda z: (-z.real, -z.imag)))


def _nearest(
    pattern: Pattern, on_the_line: Callable[[Roots, float], bool], c: NDArray[np.float64], found: Roots
) -> Structure | None:
    """The polynomial of a pattern nearest to c in the largest relative change of a coefficient."""
    best: Structure | None = None
    size = rebuilt((-np.abs(found)).astype(complex))
    target = c / c[0]
    for guess in pattern.guesses(found):
        unknowns = _fit(pattern, guess, target, size)
        if unknowns is None or any(value < 0 for value in pattern.nonnegative(unknowns)):
            continue
        monic = np.array(pattern.monic(unknowns), dtype=float)
        error = np.abs(monic - target)
        distance = float(np.max(np.where(error == 0, 0.0, error / np.where(size > 0, size, 1e-300))))
        if best is not None and best.distance <= distance:
            continue
        roots = _merged(pattern, unknowns)
        line = max(r.re for r in roots)
        width = 1e-6 * (np.abs(found).max() + 1e-300)
        right = np.array([complex(r.re, r.im) for r in roots for _ in range(r.multiplicity) if r.re >= line - width])
        if on_the_line(right, width):
            best = Structure(pattern.name, roots, distance)
    return best


def _fit(
    pattern: Pattern, guess: list[float], target: NDArray[np.float64], size: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Gauss–Newton on the relative coefficient residuals, with a complex-step Jacobian."""
    u = np.array(guess, dtype=float)
    weight = 1 / np.where(size[1:] > 0, size[1:], 1e-300)

    def residual(v: NDArray[np.complex128]) -> NDArray[np.complex128]:
        return np.asarray((np.array(pattern.monic(v)[1:], dtype=complex) - target[1:]) * weight)

    for _ in range(20):
        jacobian = np.stack([residual(u + 1e-100j * e).imag / 1e-100 for e in np.eye(len(u))], axis=1)
        if not np.all(np.isfinite(jacobian)):
            return None
        step = np.linalg.lstsq(jacobian, -residual(u.astype(complex)).real, rcond=None)[0]
        u = u + step
        if np.all(np.abs(step) <= 1e-15 * np.abs(u)):
            break
    return u


def _merged(pattern: Pattern, unknowns: NDArray[np.float64]) -> tuple[Root, ...]:
    """Roots of the factors, equal factors counted as multiplicity."""
    counted: dict[tuple[float, ...], int] = {}
    for factor in pattern.factors(unknowns):
        key = tuple(float(x) for x in factor)
        counted[key] = counted.get(key, 0) + 1
    merged = [
        Root(float(z.real), float(z.imag), count)
        for factor, count in counted.items()
        for z in numeric_roots(np.array(factor))
    ]
    return tuple(sorted(merged, key=lambda r: (-r.re, -r.im)))


def _line(name: str, unknowns: tuple[str, ...], factors: Callable[..., list[list[float]]],
          guesses: Callable[[Roots], list[list[float]]]) -> Pattern:  # fmt: skip
    return Pattern(name, "roots sharing the rightmost line", unknowns, factors, guesses)


_LINES = (
    # a pair and a real root at real part g
    _line(
        "pair+real", ("g", "W", "t"),
        lambda u: [[1, -2 * u[0], u[0] * u[0] + u[1]], [1, -u[0]], [1, -u[2]]],
        lambda z: [
            [float(a.mean().real), float((np.abs(a.imag).max()) ** 2), float(t.real)]
            for a, b in _two(z) if a.imag.any() for t in b if not b.imag.any()
        ],
    ),
    # two pairs at real part g
    _line(
        "two pairs", ("g", "W", "X"),
        lambda u: [[1, -2 * u[0], u[0] * u[0] + u[1]], [1, -2 * u[0], u[0] * u[0] + u[2]]],
        lambda z: [
            [float(z.mean().real), float(a.imag[0] ** 2), float(b.imag[0] ** 2)]
            for a, b in _two(z) if a.imag.all() and b.imag.all()
        ],
    ),
    # a double real root and a pair at real part g
    _line(
        "EP2+pair", ("g", "W"),
        lambda u: [[1, -2 * u[0], u[0] * u[0] + u[1]], [1, -u[0]], [1, -u[0]]],
        lambda z: [[float(z.mean().real), float(np.abs(z.imag).max() ** 2)]],
    ),
)  # fmt: skip


def _always(right: Roots, width: float) -> bool:
    return True


def _rightmost_multiple(multiplicity: int) -> Callable[[Roots, float], bool]:
    def on_the_line(right: Roots, width: float) -> bool:
        return sum(abs(z.imag) <= width for z in right) >= multiplicity

    return on_the_line


def _rightmost_line(count: int) -> Callable[[Roots, float], bool]:
    def on_the_line(right: Roots, width: float) -> bool:
        return len(right) >= count

    return on_the_line


# Most degenerate first.
_CANDIDATES: tuple[tuple[Pattern, Callable[[Roots, float], bool]], ...] = (
    (PATTERNS["EP4"], _always),
    (PATTERNS["2EP2"], _always),
    (PATTERNS["CEP2"], _always),
    (PATTERNS["EP3"], _rightmost_multiple(3)),
    (_LINES[2], _rightmost_line(4)),
    (PATTERNS["EP2"], _rightmost_multiple(2)),
    (_LINES[0], _rightmost_line(3)),
    (_LINES[1], _rightmost_line(4)),
)


def pattern_distance(pattern: Pattern, coefficients: ArrayLike) -> float:
    """Largest relative change of a coefficient that takes a quartic to the pattern; inf if none was found."""
    c = np.asarray(coefficients, dtype=float)
    if not np.all(np.isfinite(c)) or c[0] == 0:
        return float("inf")
    nearest = _nearest(pattern, _always, c, numeric_roots(c))
    return nearest.distance if nearest else float("inf")
