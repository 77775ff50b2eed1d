"""Geometric and partial multiplicities of an eigenvalue of a matrix polynomial, by singular values."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from typing import Any

import flint
import numpy as np

from tmsopt.records import Array, Complex

Matrix = Sequence[Sequence[Any]]

_OFFSETS = ((0.31, 0.17), (-0.43, 0.71), (1.13, -0.59))  # distances of arbitrary test points from s, divided by |s|
_ROUNDING = 1e-16  # a smaller relative singular value counts as this value
_SWEEPS = 8  # sweeps of `equilibrate`; each halves the spread of the logarithms of the sizes


@dataclass(frozen=True)
class Jordan:
    """The Jordan structure of one eigenvalue.

    Attributes:
        geometric: number of independent eigenvectors.
        partial: lengths of the Jordan chains, longest first; empty if the ranks contradict the multiplicity.
        zero: the largest relative singular value of the equilibrated matrix that counts as 0.
        nonzero: the smallest of these singular values that does not count as 0; inf if there is none.
        threshold: upper limit of the singular values that may count as 0.
    """

    geometric: int
    partial: tuple[int, ...]
    zero: float
    nonzero: float
    threshold: float


def is_regular(matrices: Sequence[Matrix], s: Any, threshold: float) -> bool:
    """Whether det L(s), with L as in `jordan`, is nonzero for some s; it is tested at three arbitrary points.

    Example:
        >>> import flint
        >>> half = [[flint.arb(1), flint.arb(0)], [flint.arb(0), flint.arb(0)]]  # the second equation is 0 = 0
        >>> tmsopt.roots.is_regular((half, half), flint.acb(-1), 1e-10)
        False

    More: docs/explanation/exceptional_points.md
    """
    leading, *others = (float(np.linalg.norm(_as_complex(P))) for P in matrices)
    sizes = [(size / leading) ** (1 / k) for k, size in enumerate(others, start=1) if leading > 0]
    unit = max([float(abs(s).mid()), *sizes]) or 1.0  # s may be a rounded 0
    return any(jordan(matrices, s + unit * flint.acb(a, b), 1, threshold).zero > threshold for a, b in _OFFSETS)


def jordan(matrices: Sequence[Matrix], s: Any, multiplicity: int, threshold: float, least: float = 0.0) -> Jordan:
    """Jordan structure at an eigenvalue s of L(s) = Σ Pₖ s^(d−k), of known algebraic multiplicity.

    The nullity of L(s) is the geometric multiplicity. The nullities of the block Toeplitz matrices of L(s), L′(s),
    L″(s)/2 … give the number of chains of each length. Rows and columns are scaled to the size of the terms of L(s), so
    that units do not matter. At least one singular value counts as 0, and none above `threshold` does. Within these
    limits, the widest gap between the singular values decides.

    Args:
        matrices: Pₖ in descending powers, as balls; s is a ball too, so that no digit is lost where terms cancel.
        least: lower limit of the unit of eigenvalues. It matters if |s| is small compared with the other eigenvalues.

    Example:
        >>> import flint
        >>> one, zero = flint.arb(1), flint.arb(0)
        >>> block = [[one, zero], [zero, one]], [[one, one], [zero, one]]  # s + 1 twice, with a 1 above the diagonal
        >>> tmsopt.roots.jordan(block, flint.acb(-1), 2, 1e-10).partial
        (2,)

    More: docs/explanation/exceptional_points.md
    """
    d, n = len(matrices) - 1, len(matrices[0])
    unit = max(float(abs(s).mid()), least) or 1.0
    size, scale = equilibrate([_as_complex(P) for P in matrices], unit)
    blocks = [scale * unit**i * _as_complex(_derivative(matrices, s, i)) for i in range(min(d, multiplicity - 1) + 1)]
    values = np.linalg.svd(blocks[0], compute_uv=False)[::-1] / np.linalg.norm(size * scale, 2)
    geometric = _nullity(values, 1, multiplicity, threshold)
    partial = _chain_lengths(blocks, multiplicity, geometric, threshold)
    nonzero = float(values[geometric]) if geometric < n else float("inf")
    return Jordan(geometric, partial, float(values[geometric - 1]), nonzero, threshold)


def _nullity(values: Array, min_count: int, max_count: int, threshold: float) -> int:
    """Number of singular values that count as 0; the values are in ascending order."""
    max_count = min(max_count, len(values), max(min_count, int(np.sum(values <= threshold))))
    logarithms = np.log(np.maximum(np.append(values, 1.0), _ROUNDING))
    return min_count + int(np.argmax(logarithms[min_count : max_count + 1] - logarithms[min_count - 1 : max_count]))


def _chain_lengths(blocks: Sequence[Complex], multiplicity: int, geometric: int, threshold: float) -> tuple[int, ...]:
    """Lengths of the Jordan chains, longest first; empty if they do not add up to the multiplicity."""
    if geometric == 1:
        return (multiplicity,)
    largest = max(float(np.linalg.norm(block, 2)) for block in blocks)
    counts = [geometric]  # numbers of chains of length at least 1, 2 …
    nullity = geometric
    while nullity < multiplicity and counts[-1]:
        size = len(counts) + 1
        padded = [*blocks, *[np.zeros_like(blocks[0])] * size]  # derivatives beyond the degree are 0
        toeplitz = np.block([[padded[i - j] if i >= j else padded[-1] for j in range(size)] for i in range(size)])
        values = np.linalg.svd(toeplitz, compute_uv=False)
        next_nullity = _nullity(values[::-1] / largest, nullity, nullity + counts[-1], threshold)
        counts.append(next_nullity - nullity)
        nullity = next_nullity
    lengths = tuple(sum(count > k for count in counts) for k in range(geometric))
    return lengths if sum(lengths) == multiplicity else ()


def _derivative(matrices: Sequence[Matrix], s: Any, order: int) -> list[list[Any]]:
    """The derivative of L at s, divided by the factorial of its order."""
    d = len(matrices) - 1
    terms = [(P, comb(d - k, order) * s ** (d - k - order)) for k, P in enumerate(matrices) if d - k >= order]
    size = range(len(matrices[0]))
    return [[sum([factor * P[i][j] for P, factor in terms], flint.acb(0)) for j in size] for i in size]


def has_one_eigenvector(matrices: Sequence[Matrix], s: Any) -> bool:
    """Whether the n × n matrix L(s) is proved to have the rank n − 1 or n, by a minor whose ball does not contain 0.

    Example:
        >>> import flint
        >>> one, zero = flint.arb(1), flint.arb(0)
        >>> block = [[one, zero], [zero, one]], [[one, one], [zero, one]]
        >>> tmsopt.roots.has_one_eigenvector(block, flint.acb(-1))
        True

    More: docs/explanation/exceptional_points.md
    """
    value = _derivative(matrices, s, 0)
    size = range(len(value))
    minors = (
        flint.acb_mat([[value[a][b] for b in size if b != j] for a in size if a != i]) for i in size for j in size
    )
    return len(value) == 1 or any(not minor.det().contains(0) for minor in minors)


def exact_nullity(matrices: Sequence[Matrix], factor: Any) -> int:
    """Number of independent eigenvectors at each root of an irreducible factor of det L, in exact fractions.

    Args:
        matrices: their entries are of the type ``fmpq``.
        factor: the irreducible factor, of the type ``fmpq_poly``.

    Example:
        >>> from flint import fmpq, fmpq_poly
        >>> unit = [[fmpq(1), fmpq(0)], [fmpq(0), fmpq(1)]]
        >>> tmsopt.roots.exact_nullity((unit, unit), fmpq_poly([1, 1]))  # s + 1 twice, with two eigenvectors
        2

    More: docs/explanation/exceptional_points.md
    """
    return _nullity_modulo(_polynomials(matrices), factor)


def exact_longest(matrices: Sequence[Matrix], factor: Any, multiplicity: int) -> int:
    """Length of the longest Jordan chain at each root of an irreducible factor of det L, in exact fractions.

    Args:
        matrices: their entries are of the type ``fmpq``.
        factor: the irreducible factor, of the type ``fmpq_poly``.
        multiplicity: how often the factor occurs in det L.

    Example:
        >>> from flint import fmpq, fmpq_poly
        >>> unit, block = [[fmpq(1), fmpq(0)], [fmpq(0), fmpq(1)]], [[fmpq(1), fmpq(1)], [fmpq(0), fmpq(1)]]
        >>> tmsopt.roots.exact_longest((unit, block), fmpq_poly([1, 1]), 2)  # s + 1 twice, with a 1 above the diagonal
        2

    More: docs/explanation/exceptional_points.md
    """
    blocks = [_polynomials(matrices)]
    size, zero = range(len(blocks[0])), flint.fmpq_poly()
    nullity = _nullity_modulo(blocks[0], factor)
    if nullity == 1:
        return multiplicity
    for length in range(1, multiplicity):
        blocks.append([[x.derivative() / length for x in row] for row in blocks[-1]])
        steps = range(length + 1)
        toeplitz = [[blocks[a - b][i][j] if a >= b else zero for b in steps for j in size] for a in steps for i in size]
        next_nullity = _nullity_modulo(toeplitz, factor)
        if next_nullity == nullity:
            return length
        nullity = next_nullity
    return multiplicity


def _polynomials(matrices: Sequence[Matrix]) -> list[list[Any]]:
    """L(s) as a matrix of polynomials."""
    size = range(len(matrices[0]))
    return [[flint.fmpq_poly([P[i][j] for P in reversed(matrices)]) for j in size] for i in size]


def _nullity_modulo(rows: Sequence[Sequence[Any]], factor: Any) -> int:
    """Nullity of a square matrix of polynomials at each root of an irreducible factor."""
    remaining_rows = [[x % factor for x in row] for row in rows]
    for j in range(len(rows)):
        pivot = next((row for row in remaining_rows if row[j] != 0), None)
        if pivot is None:
            continue
        inverse = pivot[j].xgcd(factor)[1]
        other_rows = (row for row in remaining_rows if row is not pivot)
        remaining_rows = [
            [(x - row[j] * inverse * y) % factor for x, y in zip(row, pivot, strict=True)] for row in other_rows
        ]
    return len(remaining_rows)


def equilibrate(matrices: Sequence[Any], unit: float) -> tuple[Array, Array]:
    """Sizes of the entries of L(s) for |s| = `unit`, and powers of two; the products have rows and columns near 1."""
    d = len(matrices) - 1
    size = np.asarray(sum(np.abs(P) * (unit ** (d - k)) for k, P in enumerate(matrices)), dtype=float)
    rows, columns = np.ones((2, len(size)))
    for _ in range(_SWEEPS):
        scaled = np.outer(rows, columns) * size
        row_max, column_max = scaled.max(axis=1), scaled.max(axis=0)
        rows = rows / np.sqrt(np.where(row_max > 0, row_max, 1.0))
        columns = columns / np.sqrt(np.where(column_max > 0, column_max, 1.0))
    return size, np.outer(*(np.exp2(np.round(np.log2(factors))) for factors in (rows, columns)))


def _as_complex(matrix: Matrix) -> Complex:
    """Midpoints of balls as complex doubles."""
    return np.array([[complex(flint.acb(x)) for x in row] for row in matrix])
