"""Polynomials in a parameter y, exact: found from values, evaluated, and where they vanish."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count, islice
from math import prod
from typing import Any

import flint

from tmsopt.arithmetic.elementary import rational

Polynomial = Sequence[Any]
"""Coefficients in y, exact fractions, ascending."""
Bivariate = list[list[Any]]
"""A polynomial in s, descending, each coefficient a polynomial in y."""

DIGITS = 120
"""Of y: a k-fold root then scatters by 1e-120/k."""

_FURTHER = 4  # divided differences that must vanish for a function to be taken as a polynomial


def interpolated(values: Callable[[Any], Sequence[Any]], most: int = 40) -> list[list[Any]] | None:
    """Functions of an exact fraction, all given at once, as polynomials; None if they are none of degree `most`.

    Newton's divided differences at 1, 2, 3, …: of a polynomial those beyond its degree vanish exactly.
    """
    edges: list[list[Any]] = []
    newton: list[list[Any]] = []
    idle = 0
    for k in range(most + _FURTHER + 1):
        found = values(flint.fmpq(k + 1))
        if not all(x.is_finite() for x in found if isinstance(x, flint.arb)):  # no value there: no polynomial
            return None
        row = [[rational(x) for x in found]]
        for j, before in enumerate(edges, start=1):
            row.append([(a - b) / j for a, b in zip(row[-1], before, strict=True)])
        edges = row
        newton.append(row[-1])
        idle = idle + 1 if all(x == 0 for x in row[-1]) else 0
        if idle >= _FURTHER:
            return [_expanded([d[c] for d in newton[:-idle]] or [flint.fmpq(0)]) for c in range(len(row[0]))]
    return None


def of_values(a: Sequence[Polynomial], function: Callable[[Sequence[Any]], Any]) -> Polynomial:
    """A polynomial function of the coefficients as a polynomial in y, from its values where a0 is not 0."""
    degree = max(len(c) - 1 for c in a) * 2 * len(a)
    points = list(islice((y for y in map(flint.fmpq, count(1)) if value_at(a[:1], y)[0] != 0), degree + 1))
    table = [function(value_at(a, y)) for y in points]
    newton = []
    for j in range(len(points)):
        newton.append(table[0])
        table = [(table[i + 1] - table[i]) / (points[i + j + 1] - points[i]) for i in range(len(table) - 1)]
    return trimmed(_expanded(newton, points))


def value_at(a: Sequence[Polynomial], y: Any) -> list[Any]:
    """Coefficients for a y."""
    return [flint.fmpq_poly(list(polynomial))(y) for polynomial in a]


def real_places(polynomial: Polynomial, lower: Any, upper: Any | None) -> list[Any]:
    """Different real roots between two ends, as fractions that are right to the digits carried."""
    with flint.ctx.workdps(DIGITS):
        roots: Any = flint.fmpq_poly(list(polynomial)).numer().complex_roots()
        real = [rational(z.real) for z, _ in roots if z.imag == 0]
    return sorted(y for y in real if y > lower and (upper is None or y < upper))


def trimmed(polynomial: Polynomial) -> list[Any]:
    """Without leading zeros; empty for 0."""
    kept = [rational(c) for c in polynomial]
    while kept and kept[-1] == 0:
        kept.pop()
    return kept


def _expanded(newton: Sequence[Any], points: Sequence[Any] | None = None) -> list[Any]:
    """Newton's form as coefficients, ascending; at 1, 2, 3, … where no points are given."""
    result = flint.fmpq_poly([0])
    for k in reversed(range(len(newton))):
        point = flint.fmpq(k + 1) if points is None else points[k]
        result = result * flint.fmpq_poly([-point, 1]) + flint.fmpq_poly([newton[k]])
    return list(result.coeffs())


@dataclass(frozen=True)
class Lasting:
    """A polynomial p(s, y) = s^zeros · (factors), every factor but s once.

    Attributes:
        zeros: multiplicity of the root 0 that is there for every y.
        mirrored: product of the different factors that are even in s: their roots are s and −s.
        rest: product of the other factors; it shares no root with its mirror image for every y.
        once: s (if it divides p), mirrored and rest: p without its repetitions.
        repeated: whether a factor other than s is there more than once.
        repeats_mirrored: whether one of those that are even is.
    """

    zeros: int
    mirrored: Bivariate
    rest: Bivariate
    once: Bivariate
    repeated: bool
    repeats_mirrored: bool


def lasting(coefficients: Sequence[Polynomial]) -> Lasting:
    """Split a polynomial that is not 0; coefficients descending in s."""
    context = flint.fmpq_mpoly_ctx.get(["s", "y"], "lex")
    s, y = context.gens()
    degree = len(coefficients) - 1
    every = ((degree - k, j, value) for k, polynomial in enumerate(coefficients) for j, value in enumerate(polynomial))
    terms = {(i, j): value for i, j, value in every if value != 0}
    zeros = min(power for power, _ in terms)
    p = context.from_dict({(i - zeros, j): value for (i, j), value in terms.items()})
    factors = [(f, times) for f, times in p.factor_squarefree()[1] if f.degrees()[0] > 0]
    once = prod((f for f, _ in factors), start=context.from_dict({(0, 0): 1}))
    mirrored = once.gcd(once.compose(-s, y))
    repeated = any(times > 1 for _, times in factors)
    repeats_mirrored = p.gcd(p.compose(-s, y)).degrees()[0] > mirrored.degrees()[0]
    rest, single = _rows(once / mirrored), _rows(once * s if zeros else once)
    return Lasting(zeros, _rows(mirrored), rest, single, repeated, repeats_mirrored)


def _rows(p: Any) -> Bivariate:
    """Coefficients of a polynomial in s and y, descending in s."""
    degree, width = p.degrees()
    rows = [[flint.fmpq(0)] * (width + 1) for _ in range(degree + 1)]
    for (i, j), value in p.to_dict().items():
        rows[degree - i][j] = value
    return rows
