"""Where the roots of a polynomial in s that depends on y meet, or meet the imaginary axis: all such places, exactly.

The coefficients are polynomials with rational coefficients in that number y. A root 0, a root at infinity, a pair ± iω
and a multiple root are then roots of polynomials in y: of aₙ, of a0, of the Hurwitz minor Δₙ₋₁ and of the discriminant.
These are isolated in ball arithmetic, so that none is missed, however close to another.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

import flint

from tmsopt.roots.exact import exact_roots, rational
from tmsopt.roots.stability import lienard_chipart
from tmsopt.roots.structure import Root

_DIGITS = 120  # of y: a k-fold root then scatters by 1e-120/k, which must stay below `_SAME`
_SAME = 1e-12  # relative to the largest root: difference of two that are one
_NOTHING = flint.fmpq(1, 10**90)  # of the largest coefficient: one that is 0 but for the digits of y
_FURTHER = 4  # divided differences that must vanish for a function to be taken as a polynomial

Polynomial = Sequence[Any]
"""Coefficients in y, exact fractions, ascending."""


@dataclass(frozen=True)
class Crossing:
    """A place where roots meet, or meet the imaginary axis.

    Attributes:
        at: y.
        kind: ``capsize`` (a root 0), ``weave`` (a pair ± iω), ``infinity`` (a root there), ``EP2``, ``EP3``, … (a real
            k-fold root) or ``CEP2``, … (a k-fold pair).
        root: the root of it, with its multiplicity; the upper one of a pair. Of ``infinity`` without meaning.
        rightmost: whether no root is right of it.
        changes: whether the polynomial is stable on one side of it and not on the other.
    """

    at: float
    kind: str
    root: Root
    rightmost: bool
    changes: bool


@dataclass(frozen=True)
class Crossings:
    """Every place in a range of y.

    Attributes:
        found: in ascending order.
        stable: bands with all Re s < 0, and whether each is known to begin or end at an end of the range is plain
            from its ends being those.
        heavily_damped: bands with all s real and negative.
        always: what holds for every y: ``weave`` (roots mirrored in the axis), ``EP2`` (a multiple root), ``capsize``.
    """

    found: tuple[Crossing, ...]
    stable: tuple[tuple[float, float], ...]
    heavily_damped: tuple[tuple[float, float], ...]
    always: tuple[str, ...] = ()


def interpolated(values: Callable[[Any], Sequence[Any]], most: int = 40) -> list[list[Any]] | None:
    """Functions of an exact fraction, all given at once, as polynomials; None if they are none of degree `most`.

    Newton's divided differences at 1, 2, 3, …: of a polynomial those beyond its degree vanish exactly.
    """
    edges: list[list[Any]] = []
    newton: list[list[Any]] = []
    idle = 0
    for k in range(most + _FURTHER + 1):
        row = [[rational(x) for x in values(flint.fmpq(k + 1))]]
        for j, before in enumerate(edges, start=1):
            row.append([(a - b) / j for a, b in zip(row[-1], before, strict=True)])
        edges = row
        newton.append(row[-1])
        idle = idle + 1 if all(x == 0 for x in row[-1]) else 0
        if idle >= _FURTHER:
            return [_expanded([d[c] for d in newton[:-idle]] or [flint.fmpq(0)]) for c in range(len(row[0]))]
    return None


def crossings(coefficients: Sequence[Polynomial], lower: Any, upper: Any | None) -> Crossings:
    """All crossings with lower < y < upper, in exact numbers; without an upper end where that is None.

    Args:
        coefficients: of the polynomial in s, descending, each a polynomial in y.
    """
    lower, upper = rational(lower), None if upper is None else rational(upper)
    a = [_trimmed(c) for c in coefficients]
    kinds = {"capsize": a[-1], "infinity": a[0], "weave": _of_values(a, _mirrored), "EP2": _of_values(a, _double)}
    always = tuple(kind for kind, polynomial in kinds.items() if not polynomial)
    places = {kind: _real_roots(polynomial, lower, upper) for kind, polynomial in kinds.items() if polynomial}
    found = [(y, *rest) for kind, ys in places.items() for y in ys for rest in _named(a, kind, y)]
    found.sort(key=lambda place: place[0])
    marks = sorted({y for ys in places.values() for y in ys})
    cells = list(_cells(marks, lower, upper))
    states = [_state(_at(a, middle)) for _, _, middle in cells]
    sides = {float(y): (states[k][0], states[k + 1][0]) for k, y in enumerate(marks)}
    return Crossings(
        tuple(Crossing(float(y), kind, root, first, len({*sides[float(y)]}) > 1) for y, kind, root, first in found),
        _bands(cells, [stable for stable, _ in states]),
        _bands(cells, [damped for _, damped in states]),
        always,
    )


def _named(a: Sequence[Polynomial], kind: str, y: Any) -> Iterator[tuple[str, Root, bool]]:
    """What is at a place: kind, root, whether rightmost. A mirrored pair that is real is nothing."""
    if kind == "infinity":
        yield kind, Root(float("nan"), 0.0), False
        return
    roots = _grouped(_finite_part(_at(a, y)))
    if not roots:
        return
    size = max(abs(complex(r.re, r.im)) for r in roots)
    line = max(r.re for r in roots)

    def first(root: Root) -> bool:
        return root.re >= line - _SAME * size

    if kind == "capsize":
        zero = min(roots, key=lambda r: abs(complex(r.re, r.im)))
        yield kind, Root(0.0, 0.0, zero.multiplicity), first(zero)
    elif kind == "weave":
        for root in roots:
            if abs(root.re) <= _SAME * size and root.im > _SAME * size:
                yield kind, Root(0.0, root.im, root.multiplicity), first(root)
    else:
        for root in roots:
            if root.multiplicity > 1 and root.im >= 0:
                yield f"{'CEP' if root.im else 'EP'}{root.multiplicity}", root, first(root)


def _finite_part(coefficients: Sequence[Any]) -> Sequence[Any]:
    """Without leading coefficients that are 0 but for the digits of y: their roots are at infinity."""
    largest = max(abs(c) for c in coefficients)
    first = next((k for k, c in enumerate(coefficients) if abs(c) > _NOTHING * largest), len(coefficients) - 1)
    return coefficients[first:]


def _grouped(coefficients: Sequence[Any]) -> list[Root]:
    """Roots of a polynomial that is known to many digits, those that are one to a few of these as one."""
    left = list(exact_roots(coefficients, _DIGITS)) if len(coefficients) > 1 else []
    size = max((abs(complex(r.re, r.im)) for r in left), default=1.0) or 1.0
    groups: list[Root] = []
    while left:
        z = complex(left[0].re, left[0].im)
        near = [r for r in left if abs(complex(r.re, r.im) - z) <= _SAME * size]
        left = [r for r in left if r not in near]
        number = sum(r.multiplicity for r in near)
        middle = sum(complex(r.re, r.im) * r.multiplicity for r in near) / number
        groups.append(Root(middle.real, middle.imag if abs(middle.imag) > _SAME * size else 0.0, number))
    return groups


def _state(coefficients: Sequence[Any]) -> tuple[bool, bool]:
    """Whether a polynomial is stable, and whether it is heavily damped, in exact numbers."""
    sign = 1 if coefficients[0] > 0 else -1
    if coefficients[0] == 0 or not all(x > 0 for x in lienard_chipart([sign * c for c in coefficients])):
        return False, False
    return True, all(r.im == 0 for r in exact_roots(coefficients))


def _cells(marks: Sequence[Any], lower: Any, upper: Any | None) -> Iterator[tuple[float, float, Any]]:
    """The gaps between marks: both ends, and a number between them."""
    ends = [lower, *marks]
    for k, low in enumerate(ends):
        high = ends[k + 1] if k + 1 < len(ends) else upper
        if high is None:
            yield float(low), float("inf"), low + 1 + abs(low)
        else:
            yield float(low), float(high), (low + high) / 2


def _bands(cells: Sequence[tuple[float, float, Any]], inside: Sequence[bool]) -> tuple[tuple[float, float], ...]:
    """Neighbouring gaps in which something holds, as one. It may fail at a mark between them, in one point."""
    bands: list[tuple[float, float]] = []
    for (low, high, _), holds in zip(cells, inside, strict=True):
        if holds and bands and bands[-1][1] == low:
            bands[-1] = (bands[-1][0], high)
        elif holds:
            bands.append((low, high))
    return tuple(bands)


def _at(a: Sequence[Polynomial], y: Any) -> list[Any]:
    """Coefficients for a y."""
    values = []
    for polynomial in a:
        value = flint.fmpq(0)
        for c in reversed(polynomial):
            value = value * y + c
        values.append(value)
    return values


def _real_roots(polynomial: Polynomial, lower: Any, upper: Any | None) -> list[Any]:
    """Different real roots between two ends, as fractions that are right to the digits carried."""
    common = flint.fmpz(1)
    for c in polynomial:
        common = common.lcm(c.q)
    with flint.ctx.workdps(_DIGITS):
        roots: Any = flint.fmpz_poly([int(c.p * (common // c.q)) for c in polynomial]).complex_roots()
        real = [rational(z.real) for z, _ in roots if z.imag == 0]
    return sorted(y for y in real if y > lower and (upper is None or y < upper))


def _of_values(a: Sequence[Polynomial], function: Callable[[Sequence[Any]], Any]) -> Polynomial:
    """A polynomial function of the coefficients as a polynomial in y, from its values where a0 is not 0."""
    degree = max(len(c) - 1 for c in a) * 2 * len(a)
    points: list[Any] = []
    for k in count(1):
        y = flint.fmpq(k)
        if _at(a, y)[0] != 0:
            points.append(y)
        if len(points) > degree:
            break
    table = [function(_at(a, y)) for y in points]
    newton = []
    for j in range(len(points)):
        newton.append(table[0])
        table = [(table[i + 1] - table[i]) / (points[i + j + 1] - points[i]) for i in range(len(table) - 1)]
    return _trimmed(_expanded(newton, points))


def _expanded(newton: Sequence[Any], points: Sequence[Any] | None = None) -> list[Any]:
    """Newton's form as coefficients, ascending; at 1, 2, 3, … where no points are given."""
    result = flint.fmpq_poly([0])
    for k in reversed(range(len(newton))):
        point = flint.fmpq(k + 1) if points is None else points[k]
        result = result * flint.fmpq_poly([-point, 1]) + flint.fmpq_poly([newton[k]])
    return list(result.coeffs())


def _mirrored(a: Sequence[Any]) -> Any:
    """Δₙ₋₁, which is 0 where two roots are s and −s."""
    n = len(a) - 1
    entry = [[2 * (j + 1) - (i + 1) for j in range(n - 1)] for i in range(n - 1)]
    matrix = [[a[k] if 0 <= k <= n else flint.fmpq(0) for k in row] for row in entry]
    return flint.fmpq_mat(n - 1, n - 1, [x for row in matrix for x in row]).det()


def _double(a: Sequence[Any]) -> Any:
    """The resultant of a polynomial and its derivative, by Euclid's algorithm."""
    p = flint.fmpq_poly(list(reversed(a)))
    q, value = p.derivative(), flint.fmpq(1)
    while q.degree() > 0:
        rest = p % q
        if rest.degree() < 0:
            return flint.fmpq(0)
        lead = q[q.degree()]
        value = value * (-1) ** (p.degree() * q.degree()) * lead ** (p.degree() - rest.degree())
        p, q = q, rest
    return value * q[0] ** p.degree()


def _trimmed(polynomial: Polynomial) -> list[Any]:
    """Without leading zeros; empty for 0."""
    kept = [rational(c) for c in polynomial]
    while kept and kept[-1] == 0:
        kept.pop()
    return kept
