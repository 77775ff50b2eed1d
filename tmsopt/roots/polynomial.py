"""Polynomials as lists of coefficients in descending powers, for numbers of any kind.

Only ``+ - *`` are used, so that one formula serves CasADi expressions, NumPy arrays, exact fractions and balls.
"""

import math
import operator
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache, reduce
from itertools import zip_longest
from typing import Any

import numpy as np

Coefficients = Sequence[Any]


def product(*factors: Coefficients) -> list[Any]:
    """Coefficients of the product of polynomials.

    Example:
        >>> tmsopt.roots.product([1, 1], [1, 2], [1, 3])  # (s + 1)(s + 2)(s + 3)
        [1, 6, 11, 6]

    More: docs/reference/python.md
    """
    result: list[Any] = list(factors[0]) if factors else [1]
    with np.errstate(over="ignore", invalid="ignore"):
        for factor in factors[1:]:
            terms: list[Any] = [0] * (len(result) + len(factor) - 1)
            for i, a in enumerate(result):
                for j, b in enumerate(factor):
                    terms[i + j] = terms[i + j] + a * b
            result = terms
    return result


def shift(coefficients: Coefficients, gamma: Any) -> list[Any]:
    """Coefficients of p(t + gamma) as a polynomial in t (Taylor shift by repeated Horner division).

    Example:
        >>> tmsopt.roots.shift([1, 4, 6, 4, 1], -1)  # (s + 1)⁴ in t = s + 1
        [1, 0, 0, 0, 0]

    More: docs/reference/python.md
    """
    c = list(coefficients)
    for end in range(len(c), 1, -1):
        for k in range(1, end):
            c[k] = c[k] + gamma * c[k - 1]
    return c


def evaluate(coefficients: Coefficients, s: Any) -> Any:
    """Value of the polynomial at s, by Horner's rule.

    Example:
        >>> tmsopt.roots.evaluate([1, 4, 6, 4, 1], -3)  # (s + 1)⁴
        16

    More: docs/reference/python.md
    """
    value: Any = 0
    for c in coefficients:
        value = value * s + c
    return value


def quadratic_pencil(M: Sequence[Coefficients], D: Sequence[Coefficients], K: Sequence[Coefficients]) -> list[Any]:
    """Coefficients of det(M s² + D s + K) for square matrices given as nested sequences.

    Example:
        >>> tmsopt.roots.quadratic_pencil([[1, 0], [0, 1]], [[0, 0], [0, 0]], [[2, -1], [-1, 2]])  # (s² + 1)(s² + 3)
        [1, 0, 4, 0, 3]

    More: docs/tutorials/own_system.md
    """
    size = range(len(M))
    return determinant([[[M[i][j], D[i][j], K[i][j]] for j in size] for i in size])


def determinant(matrix: Sequence[Sequence[Coefficients]]) -> list[Any]:
    """Coefficients of the determinant of a square matrix whose entries are polynomials.

    The method is Laplace expansion, which computes every minor once: n 2ⁿ products and no division.

    Example:
        >>> tmsopt.roots.determinant([[[1, 0], [-1]], [[1], [1, 2]]])  # s (s + 2) + 1
        [1, 2, 1]

    More: docs/tutorials/own_system.md
    """

    @cache
    def minor(columns: tuple[int, ...]) -> list[Any]:
        if not columns:
            return [1]
        row = matrix[len(matrix) - len(columns)]
        total: list[Any] = [0]
        for k, j in enumerate(columns):
            if all(isinstance(x, int) and x == 0 for x in row[j]):
                continue
            term = product(row[j], minor(columns[:k] + columns[k + 1 :]))
            signed = term if k % 2 == 0 else [-t for t in term]
            total = [x + y for x, y in zip_longest(reversed(total), reversed(signed), fillvalue=0)][::-1]
        return total

    return minor(tuple(range(len(matrix))))


def characteristic_polynomial(A: Sequence[Sequence[Any]]) -> list[Any]:
    """Coefficients of det(s I − A), descending from 1, by the algorithm of Samuelson and Berkowitz in n⁴/4 products."""
    monic: list[Any] = [1]
    for n in range(len(A)):
        row, column = A[n][:n], [A[i][n] for i in range(n)]
        toeplitz_column: list[Any] = [1, -A[n][n]]
        for _ in range(n):
            toeplitz_column.append(-_dot(row, column))
            column = [_dot(A[i][:n], column) for i in range(n)]
        monic = [_dot(toeplitz_column[k::-1], monic[: k + 1]) for k in range(n + 2)]
    return monic


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """Sum of products, up to the end of the shorter sequence."""
    return reduce(operator.add, map(operator.mul, a, b), 0)


@dataclass(frozen=True)
class Root:
    """A root with its multiplicity. A complex pair is two `Root` objects.

    Example:
        >>> tmsopt.roots.exact_roots([1, 4, 6, 4, 1])  # (s + 1)⁴
        (Root(re=-1.0, im=0.0, multiplicity=4),)

    More: docs/explanation/exceptional_points.md
    """

    re: float
    im: float
    multiplicity: int = 1

    @property
    def size(self) -> float:
        """|s|."""
        return math.hypot(self.re, self.im)


def rightmost_first(roots: Iterable[Any]) -> tuple[Any, ...]:
    """Sort roots, rightmost first, and the upper root of a pair first. Their `re` and `im` may be doubles or balls."""
    return tuple(sorted(roots, key=lambda r: (-float(r.re), -float(r.im))))
