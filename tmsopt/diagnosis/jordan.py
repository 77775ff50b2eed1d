"""Geometric and partial multiplicities of an eigenvalue of a matrix polynomial, by singular values."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from typing import Any

import flint
import numpy as np

from tmsopt.diagnosis.meeting import middle
from tmsopt.records import Array, Complex

Matrix = Sequence[Sequence[Any]]

_ELSEWHERE = ((0.31, 0.17), (-0.43, 0.71), (1.13, -0.59))
_ROUNDING = 1e-16
_SWEEPS = 8  # of equilibration: each halves the spread of the logarithms


@dataclass(frozen=True)
class Jordan:
    """The Jordan structure of one eigenvalue.

    Attributes:
        geometric: number of independent eigenvectors.
        partial: lengths of the Jordan chains, longest first; none where the ranks contradict the multiplicity.
        zero: largest singular value of the equilibrated matrix at the eigenvalue that counts as 0, relative.
        nonzero: the smallest that does not; inf without one.
        threshold: what may count as 0; the widest gap below it decides.
    """

    geometric: int
    partial: tuple[int, ...]
    zero: float
    nonzero: float
    threshold: float


def is_regular(matrices: Sequence[Matrix], s: Any, threshold: float) -> bool:
    """Whether det L(s) is not 0 for all s, judged at places about s that are no roots but by accident."""
    unit = abs(s) if abs(s) > 0 else flint.arb(1)
    return any(jordan(matrices, s + unit * flint.acb(a, b), 1, threshold).zero > threshold for a, b in _ELSEWHERE)


def jordan(matrices: Sequence[Matrix], s: Any, multiplicity: int, threshold: float) -> Jordan:
    """Jordan structure at an eigenvalue s of L(s) = Σ Pₖ s^(d−k), of known algebraic multiplicity.

    The nullity of L(s) is the geometric multiplicity, and the nullities of the block Toeplitz matrices of L(s), L′(s),
    L″(s)/2 … count the chains that are at least so long. Rows and columns are scaled to the size of the terms of L(s),
    so that units do not matter. At least one singular value counts as 0, at most those up to `threshold`, and between
    these the widest gap decides.

    Args:
        matrices: Pₖ in descending powers, balls; s is a ball too, so that no digit is lost where terms cancel.
    """
    d, n = len(matrices) - 1, len(matrices[0])
    modulus = float(abs(s).mid())
    unit = modulus if modulus > 0 else 1.0
    size = sum(np.abs(_numbers(P)) * (unit ** (d - k)) for k, P in enumerate(matrices))
    rows, columns = _equilibrated(np.asarray(size, dtype=float))
    scale = np.outer(rows, columns)
    blocks = [scale * unit**i * _numbers(_derivative(matrices, s, i)) for i in range(min(d, multiplicity - 1) + 1)]
    values = np.linalg.svd(blocks[0], compute_uv=False)[::-1] / np.linalg.norm(size * scale, 2)
    geometric = _nullity(values, 1, multiplicity, threshold)
    partial = _partial(blocks, n, multiplicity, geometric, threshold)
    nonzero = float(values[geometric]) if geometric < n else float("inf")
    return Jordan(geometric, partial, float(values[geometric - 1]), nonzero, threshold)


def _nullity(values: Array, least: int, most: int, threshold: float) -> int:
    """How many singular values, in ascending order, count as 0."""
    most = min(most, len(values), max(least, int(np.sum(values <= threshold))))
    above = np.log(np.maximum(np.append(values, 1.0), _ROUNDING))
    return least + int(np.argmax(above[least : most + 1] - above[least - 1 : most]))


def _partial(
    blocks: Sequence[Complex], n: int, multiplicity: int, geometric: int, threshold: float,
) -> tuple[int, ...]:  # fmt: skip
    """Lengths of the chains, from how many are at least 1, 2 … long."""
    if geometric == 1:
        return (multiplicity,)
    largest = max(float(np.linalg.norm(block, 2)) for block in blocks)
    longer = [geometric]
    nullity = geometric
    while nullity < multiplicity and longer[-1]:
        size = len(longer) + 1
        toeplitz = np.zeros((size * n, size * n), dtype=complex)
        for i in range(size):
            for j in range(max(0, i - len(blocks) + 1), i + 1):
                toeplitz[i * n : (i + 1) * n, j * n : (j + 1) * n] = blocks[i - j]
        values = np.linalg.svd(toeplitz, compute_uv=False)
        found = _nullity(values[::-1] / largest, nullity, nullity + longer[-1], threshold)
        longer.append(found - nullity)
        nullity = found
    lengths = tuple(sum(count > k for count in longer) for k in range(geometric))
    return lengths if sum(lengths) == multiplicity else ()


def _derivative(matrices: Sequence[Matrix], s: Any, order: int) -> list[list[Any]]:
    """The derivative of L at s, divided by the factorial of its order."""
    d = len(matrices) - 1
    terms = [(P, comb(d - k, order) * s ** (d - k - order)) for k, P in enumerate(matrices) if d - k >= order]
    size = range(len(matrices[0]))
    return [[sum((factor * P[i][j] for P, factor in terms), flint.acb(0)) for j in size] for i in size]


def _equilibrated(size: Array) -> tuple[Array, Array]:
    """Powers of two for rows and columns that bring the largest entry of each near 1."""
    rows, columns = np.ones((2, len(size)))
    for _ in range(_SWEEPS):
        scaled = np.outer(rows, columns) * size
        high, wide = scaled.max(axis=1), scaled.max(axis=0)
        rows = rows / np.sqrt(np.where(high > 0, high, 1.0))
        columns = columns / np.sqrt(np.where(wide > 0, wide, 1.0))
    return np.exp2(np.round(np.log2(rows))), np.exp2(np.round(np.log2(columns)))


def _numbers(matrix: Matrix) -> Complex:
    """Middles of balls as complex doubles."""
    return np.array([[middle(flint.acb(x)) for x in row] for row in matrix])
