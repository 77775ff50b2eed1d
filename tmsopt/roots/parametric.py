"""Polynomials in a parameter y, exact: found from values, evaluated, and where they vanish."""

from collections.abc import Callable, Sequence
from itertools import count
from typing import Any

import flint

from tmsopt.arithmetic.elementary import rational
from tmsopt.roots.lasting import Polynomial

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
        row = [[rational(x) for x in values(flint.fmpq(k + 1))]]
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
    points: list[Any] = []
    for k in count(1):
        y = flint.fmpq(k)
        if value_at(a, y)[0] != 0:
            points.append(y)
        if len(points) > degree:
            break
    table = [function(value_at(a, y)) for y in points]
    newton = []
    for j in range(len(points)):
        newton.append(table[0])
        table = [(table[i + 1] - table[i]) / (points[i + j + 1] - points[i]) for i in range(len(table) - 1)]
    return trimmed(_expanded(newton, points))


def value_at(a: Sequence[Polynomial], y: Any) -> list[Any]:
    """Coefficients for a y."""
    values = []
    for polynomial in a:
        value = flint.fmpq(0)
        for c in reversed(polynomial):
            value = value * y + c
        values.append(value)
    return values


def real_places(polynomial: Polynomial, lower: Any, upper: Any | None) -> list[Any]:
    """Different real roots between two ends, as fractions that are right to the digits carried."""
    common = flint.fmpz(1)
    for c in polynomial:
        common = common.lcm(c.q)
    with flint.ctx.workdps(DIGITS):
        roots: Any = flint.fmpz_poly([int(c.p * (common // c.q)) for c in polynomial]).complex_roots()
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
