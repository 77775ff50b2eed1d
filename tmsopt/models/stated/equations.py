"""The polynomial and the matrix polynomial of a statement, whose entries are nodes."""

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from tmsopt.models.model import Matrix
from tmsopt.models.stated.pairs import Pair, pair
from tmsopt.roots.polynomial import characteristic_polynomial, product, quadratic_pencil

IMAGINARY = "H, imaginary part"
"""Name of the matrix of the imaginary parts of H, beside ``H`` of the real ones."""


def whole(key: str) -> str:
    """The matrix that a user wrote, of which this is a part."""
    return key.partition(",")[0]


def in_order(kind: str, places: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Places of entries as a user reads them: both parts of an entry of H one after the other."""
    return sorted(places, key=lambda at: (at[0] == "quantities", at[1])) if kind == "hamiltonian" else list(places)


def polynomial(kind: str, blocks: dict[str, Matrix], carrier: float = 0.0) -> list[Any]:
    """Coefficients of the characteristic polynomial, descending."""
    if kind == "coefficients":
        return blocks["coefficients"][0]
    if kind == "hamiltonian":
        return _doubled(blocks["H"], blocks[IMAGINARY], carrier)
    if "A" in blocks:
        return characteristic_polynomial(blocks["A"])
    M, K = blocks["M"], blocks["K"]
    return quadratic_pencil(M, blocks.get("D") or [[0] * len(M) for _ in M], K)


def _doubled(R: Matrix, J: Matrix, carrier: float) -> list[Any]:
    """|det(s + i (H + carrier))|² for real s, of which −i (ω + carrier) and the conjugates are the roots."""
    rows, S = range(len(R)), _carried(R, carrier)
    found = [pair(x) for x in characteristic_polynomial([[Pair(J[i][j], -S[i][j]) for j in rows] for i in rows])]
    re, im = [x.re for x in found], [x.im for x in found]
    return [a + b for a, b in zip(product(re, re), product(im, im), strict=True)]


def _carried(R: Matrix, carrier: float) -> Matrix:
    """The real part of H with its carrier."""
    return [[x + Fraction(carrier) if i == j else x for j, x in enumerate(row)] for i, row in enumerate(R)]


def pencil(blocks: dict[str, Matrix], carrier: float = 0.0) -> tuple[Matrix, ...]:
    """Matrices of the matrix polynomial with these roots, in descending powers; of H those of the real double."""
    if "H" in blocks:
        R, J = blocks["H"], blocks[IMAGINARY]
        S = _carried(R, carrier)
        A = [[*j, *r] for j, r in zip(J, S, strict=True)] + [[*(-x for x in r), *j] for j, r in zip(J, S, strict=True)]
    elif "A" in blocks:
        A = blocks["A"]
    else:
        M = blocks["M"]
        return M, blocks.get("D") or [[0] * len(M) for _ in M], blocks["K"]
    return [[int(i == j) for j in range(len(A))] for i in range(len(A))], [[-x for x in row] for row in A]
