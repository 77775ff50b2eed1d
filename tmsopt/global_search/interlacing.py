"""Conditions for stability by the Hermite–Biehler theorem, without factors and determinants.

The coefficients c_k of p(t), with c0 > 0, form two polynomials in X = ω², which are the parts of p(iω): the first
part F(X) = c0 X^m − c2 X^(m−1) + … and the second part S(X) = c1 X^l − c3 X^(l−1) + …. All roots of p lie in Re t ≤ 0
exactly if all c_k ≥ 0 and the zeros of the two parts are real and interlace: there are x1 ≥ x2 ≥ … ≥ 0 with
S(X) = c1 (X − x1)(X − x2)… and (−1)^j F(xj) ≥ 0. From degree 5 on, some polynomials with roots in Re t > 0 satisfy
this too, if S has a multiple zero at which F vanishes; bounds stay valid. A quartic needs one unknown x, while two
quadratic factors need four. For fixed x and a fixed line its conditions are linear: c3 = x c1 and c2 x ≥ c0 x² + c4.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from tmsopt.program.lifts import ProgramBuilder
from tmsopt.roots import product

Square = tuple[Any, Any]
"""(x, y), both ≥ 0, stands for the number x/y, which is infinite for y = 0."""


def frequency_count(degree: int) -> int:
    """Number of zeros of the second part of a polynomial of this degree."""
    return (degree - 1) // 2


def interlacing_conditions(coefficients: Sequence[Any], squares: Sequence[Square]) -> tuple[list[Any], list[Any]]:
    """Return expressions that are 0 and expressions that are ≥ 0 if all roots have Re t ≤ 0.

    Up to degree 4 the converse holds too.

    Args:
        coefficients: descending; the leading one is positive.
        squares: squared frequencies x1 ≥ x2 ≥ … ≥ 0 at which the second part vanishes.
    """
    first, second = coefficients[0::2], coefficients[1::2]
    expanded_product = product(*([y, x] for x, y in squares))
    equations = [c * expanded_product[0] - second[0] * e for c, e in zip(second[1:], expanded_product[1:], strict=True)]
    signs = [(-1) ** (j + 1) * _alternating_sum(first, *square) for j, square in enumerate(squares)]
    return equations, [*coefficients, *signs, *(x * v - u * y for (x, y), (u, v) in pairwise(squares))]


def _alternating_sum(part: Sequence[Any], x: Any, y: Any) -> Any:
    """c0 x^m − c2 x^(m−1) y + …"""
    total, scale = part[0], 1
    for k, c in enumerate(part[1:], start=1):
        scale = scale * y
        total = total * x + (-1) ** k * c * scale
    return total


def add_interlacing(
    build: ProgramBuilder, case: int, coefficients: Sequence[Any], root_bound: float, compact: bool
) -> list[Any]:
    """Add variables and rows that keep all roots in Re t ≤ 0.

    Args:
        root_bound: bound on the size of the roots.
        compact: whether to write the squares as X/(1 − X), which needs no bound on the roots.

    Returns:
        Expressions ≥ 0; one of them can be 0 exactly if some root has Re t = 0.
    """
    degree = len(coefficients) - 1
    count = frequency_count(degree)
    # The last frequency is highest if all roots are −R; there the phase degree · atan(ω/R) of p is (degree − 2) π/2.
    max_ratio = max(1.0, math.tan(math.pi / 2 - math.pi / degree)) if degree > 4 else 1.0
    largest_square = 1.0 if compact else (root_bound * max_ratio) ** 2
    unknown_squares = [build.add_variable(f"x{k}.{case}", 0.0, largest_square) for k in range(1, count + 1)]
    equations, nonnegative = interlacing_conditions(
        coefficients, [(x, 1 - x if compact else 1) for x in unknown_squares]
    )
    for expression in equations:
        build.add_row("abscissa", expression, 0.0, 0.0)
    for expression in nonnegative:
        build.add_row("abscissa", expression, 0.0, np.inf)
    signs = nonnegative[len(coefficients) : len(coefficients) + count]
    return [coefficients[-1], *(signs or coefficients[1:2])]


def squared_frequencies(coefficients: Sequence[float]) -> list[float]:
    """The squared frequencies that violate the conditions least, for numeric coefficients."""

    def violation(squares: Sequence[float]) -> float:
        equations, nonnegative = interlacing_conditions(coefficients, [(x, 1.0) for x in squares])
        return float(max(*map(abs, equations), *(-e for e in nonnegative), 0.0))

    return min(_candidate_squares(coefficients), key=violation)


def _candidate_squares(coefficients: Sequence[float]) -> Iterator[list[float]]:
    """Yield the zeros of the second part; if it vanishes, values between the zeros of the first part; and 0 for all."""
    count = frequency_count(len(coefficients) - 1)
    for part in (coefficients[1::2], coefficients[0::2]):
        alternating = np.array([c if k % 2 == 0 else -c for k, c in enumerate(part)])
        zeros = np.roots(alternating) if np.any(alternating) else np.zeros(0)
        squares = sorted((max(float(x.real), 0.0) for x in zeros), reverse=True)
        if len(squares) == count:
            yield squares
        elif len(squares) == count + 1:
            yield [(a + b) / 2 for a, b in pairwise(squares)]
            yield squares[:-1]
            yield squares[1:]
    yield [0.0] * count
