"""Characteristic polynomial and matrix polynomial of a system whose entries are nodes (parts of formulas)."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from tmsopt.models.model import Matrices, Matrix
from tmsopt.models.stated.pairs import Pair
from tmsopt.roots.polynomial import characteristic_polynomial, quadratic_pencil

IMAGINARY = ", imaginary part"
"""Suffix of the key of the imaginary part of a complex matrix; the key without it has the real part."""


def user_key(key: str) -> str:
    """The key that the user wrote: ``H`` for both parts of H."""
    return key.partition(",")[0]


def join_parts(parts: dict[str, Matrix]) -> dict[str, Matrix]:
    """Complex matrices from their real and imaginary parts, with pairs as entries; real ones stay the same."""
    return {
        n: [list(map(Pair, *both)) for both in zip(rows, parts[n + IMAGINARY], strict=True)]
        if n + IMAGINARY in parts
        else rows
        for n, rows in parts.items()
        if not n.endswith(IMAGINARY)
    }


def sort_places(is_complex: bool, places: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Sort places, each a key and a position, in the user's order: the two parts of an entry stay together."""
    listed = list(places)
    if not is_complex:
        return listed
    keys = list(dict.fromkeys(user_key(key) for key, _ in listed))
    return sorted(listed, key=lambda place: (keys.index(user_key(place[0])), place[1]))


def polynomial(kind: str, blocks: dict[str, Matrix]) -> list[Any]:
    """Coefficients of the characteristic polynomial, descending.

    Args:
        blocks: key → matrix.
    """
    if kind == "coefficients":
        return blocks["coefficients"][0]
    if "A" in blocks:
        return characteristic_polynomial(blocks["A"])
    return quadratic_pencil(*pencil(blocks))


def pencil(blocks: dict[str, Matrix]) -> Matrices:
    """Matrices of the matrix polynomial, for descending powers; for H they are I and i H, with pairs as entries."""
    if "coefficients" in blocks:
        return tuple([[x]] for x in blocks["coefficients"][0])
    if "H" in blocks:
        A: Matrix = [[Pair(x.im, -x.re) for x in row] for row in blocks["H"]]
    elif "A" in blocks:
        A = blocks["A"]
    else:
        M = blocks["M"]
        return M, blocks.get("D") or np.zeros((len(M), len(M)), dtype=int).tolist(), blocks["K"]
    return np.eye(len(A), dtype=int).tolist(), [[-x for x in row] for row in A]
