"""Characteristic polynomial and matrix polynomial of a system whose entries are nodes (parts of formulas)."""

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

import numpy as np

from tmsopt.models.model import Matrices, Matrix
from tmsopt.models.stated.pairs import Pair, pair
from tmsopt.roots.polynomial import characteristic_polynomial, product, quadratic_pencil

IMAGINARY_KEY = "H, imaginary part"
"""Key of the imaginary part of a complex H; the key ``H`` then has the real part."""


def user_key(key: str) -> str:
    """The key that the user wrote: ``H`` for both parts of H."""
    return key.partition(",")[0]


def sort_places(kind: str, places: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Sort places, each a key and a position, in the user's order: the two parts of an entry of H stay together."""
    return (
        sorted(places, key=lambda place: (place[0] == "quantities", place[1]))
        if kind == "hamiltonian"
        else list(places)
    )


def polynomial(kind: str, blocks: dict[str, Matrix], carrier: float = 0.0) -> list[Any]:
    """Coefficients of the characteristic polynomial, descending.

    Args:
        blocks: key → matrix.
        carrier: real constant that is added to the eigenfrequencies of H.
    """
    if kind == "coefficients":
        return blocks["coefficients"][0]
    if kind == "hamiltonian":
        return _real_polynomial(blocks["H"], blocks[IMAGINARY_KEY], carrier)
    if "A" in blocks:
        return characteristic_polynomial(blocks["A"])
    return quadratic_pencil(*pencil(blocks))


def _real_polynomial(R: Matrix, J: Matrix, carrier: float) -> list[Any]:
    """|det(s + i (H + carrier))|² for real s; its roots are −i (ω + carrier) and their conjugates."""
    rows, S = range(len(R)), _add_carrier(R, carrier)
    coefficients = [pair(x) for x in characteristic_polynomial([[Pair(J[i][j], -S[i][j]) for j in rows] for i in rows])]
    re, im = [x.re for x in coefficients], [x.im for x in coefficients]
    return [a + b for a, b in zip(product(re, re), product(im, im), strict=True)]


def _add_carrier(R: Matrix, carrier: float) -> Matrix:
    """The real part of H plus the carrier."""
    return [[x + Fraction(carrier) if i == j else x for j, x in enumerate(row)] for i, row in enumerate(R)]


def pencil(blocks: dict[str, Matrix]) -> Matrices:
    """Matrices of the matrix polynomial, for descending powers; for H they are I and i H, with pairs as entries."""
    if "H" in blocks:
        parts = zip(blocks["H"], blocks[IMAGINARY_KEY], strict=True)
        A: Matrix = [[Pair(y, -x) for x, y in zip(*rows, strict=True)] for rows in parts]
    elif "A" in blocks:
        A = blocks["A"]
    else:
        M = blocks["M"]
        return M, blocks.get("D") or np.zeros((len(M), len(M)), dtype=int).tolist(), blocks["K"]
    return np.eye(len(A), dtype=int).tolist(), [[-x for x in row] for row in A]
