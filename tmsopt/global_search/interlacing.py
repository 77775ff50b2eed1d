"""Stability without factors and without determinants: the theorem of Hermite and Biehler.

Let F(X) = c0 X^m − c2 X^(m−1) + … and S(X) = c1 X^l − c3 X^(l−1) + … be the two parts of p(iω), in X = ω². All roots of
p, c0 > 0, lie in Re t ≤ 0 exactly if all c_k ≥ 0 and the roots of the two parts are real and interlace: there are
x1 ≥ x2 ≥ … ≥ 0 with S(X) = c1 (X − x1)(X − x2)… and (−1)^j F(xj) ≥ 0. From degree 5 a little more satisfies that, where
S has a multiple zero at which F vanishes: a bound is no less valid for it. For a quartic that is one unknown instead of
the four of two factors, and where it and the line are known, what is asked of the coefficients is linear:
c3 = x c1 and c2 x ≥ c0 x² + c4.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from tmsopt.program.lifts import ProgramBuilder
from tmsopt.roots import product

Square = tuple[Any, Any]
"""x/y of x and y ≥ 0: infinite where y = 0."""


def unknowns(degree: int) -> int:
    """How many frequencies the second part of a polynomial has."""
    return (degree - 1) // 2


def interlacing(coefficients: Sequence[Any], squares: Sequence[Square]) -> tuple[list[Any], list[Any]]:
    """Expressions that vanish, and that are not negative, if all roots have Re t ≤ 0; up to degree 4 only then.

    Args:
        coefficients: descending, with a leading one that is positive.
        squares: x1 ≥ x2 ≥ … ≥ 0, squared frequencies at which the second part vanishes.
    """
    first, second = coefficients[0::2], coefficients[1::2]
    expanded = product(*([y, x] for x, y in squares))
    equations = [c * expanded[0] - second[0] * e for c, e in zip(second[1:], expanded[1:], strict=True)]
    signs = [(-1) ** (j + 1) * _alternating(first, *square) for j, square in enumerate(squares)]
    return equations, [*coefficients, *signs, *(x * v - u * y for (x, y), (u, v) in pairwise(squares))]


def _alternating(part: Sequence[Any], x: Any, y: Any) -> Any:
    """c0 x^m − c2 x^(m−1) y + …"""
    total, scale = part[0], 1
    for k, c in enumerate(part[1:], start=1):
        scale = scale * y
        total = total * x + (-1) ** k * c * scale
    return total


def interlace(
    build: ProgramBuilder, case: int, coefficients: Sequence[Any], largest: float, compact: bool
) -> list[Any]:
    """Variables and rows that hold all roots in Re t ≤ 0, none larger than `largest`; what vanishes with a root on it.

    Of the returned expressions, none negative, one can be 0 exactly if some root has Re t = 0.

    Args:
        compact: take X/(1 − X) for the squares, so that no bound on the roots is needed.
    """
    degree = len(coefficients) - 1
    count = unknowns(degree)
    # The phase of p(iω) is least where all roots are at −R: degree · atan(ω/R), at the last frequency (degree − 2) π/2.
    reach = max(1.0, math.tan(math.pi / 2 - math.pi / degree)) if degree > 4 else 1.0
    most = 1.0 if compact else (largest * reach) ** 2
    unknown = [build.variable(f"x{k}.{case}", 0.0, most) for k in range(1, count + 1)]
    equations, nonnegative = interlacing(coefficients, [(x, 1 - x if compact else 1) for x in unknown])
    for expression in equations:
        build.row("abscissa", expression, 0.0, 0.0)
    for expression in nonnegative:
        build.row("abscissa", expression, 0.0, np.inf)
    signs = nonnegative[len(coefficients) : len(coefficients) + count]
    return [coefficients[-1], *(signs or coefficients[1:2])]


def squares_of(coefficients: Sequence[float]) -> list[float]:
    """Squared frequencies for known coefficients that interlace best."""

    def violation(squares: Sequence[float]) -> float:
        equations, nonnegative = interlacing(coefficients, [(x, 1.0) for x in squares])
        return float(max(*map(abs, equations), *(-e for e in nonnegative), 0.0))

    return min(_candidates(coefficients), key=violation)


def _candidates(coefficients: Sequence[float]) -> Iterator[list[float]]:
    """Zeros of the second part; values between those of the first, where the second vanishes; and 0."""
    count = unknowns(len(coefficients) - 1)
    for part in (coefficients[1::2], coefficients[0::2]):
        alternating = np.array([c if k % 2 == 0 else -c for k, c in enumerate(part)])
        found = np.roots(alternating) if np.any(alternating) else np.zeros(0)
        squares = sorted((max(float(x.real), 0.0) for x in found), reverse=True)
        if len(squares) == count:
            yield squares
        elif len(squares) == count + 1:
            yield [(a + b) / 2 for a, b in pairwise(squares)]
            yield squares[:-1]
            yield squares[1:]
    yield [0.0] * count
