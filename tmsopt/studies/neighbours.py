"""Rows in an order in which neighbours are near each other, for optima that start the next ones."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmsopt.studies.study import Study

BLOCK = 32
"""Rows of a block: the first of each starts cold, so that blocks can be solved apart."""

_BITS = 62  # of the key of a curve
_FINEST = 16  # bits of one column

Integers = NDArray[np.int64]


def blocks(study: Study, size: int = BLOCK) -> list[tuple[int, ...]]:
    """Every row once, in blocks of `size` in each of which consecutive rows are near.

    A grid is walked to and fro, so that consecutive rows differ in one axis by one step. Other rows follow a Hilbert
    curve through their columns, each taken by rank, so that a logarithmic one counts as much as an even one.
    """
    order = (_to_and_fro(study) if study.grid_shape is not None else _along_curve(study)).tolist()
    return [tuple(order[k : k + size]) for k in range(0, len(order), size)]


def _to_and_fro(study: Study) -> Integers:
    """Rows of a grid, each axis in the order of its values, turning round at its ends."""
    sizes = tuple((study.grid_shape or {}).values())
    place = np.arange(len(study))
    digits, stride = [], len(study)
    for size, values in zip(sizes, study.axes.values(), strict=True):
        stride //= size
        turn, step = np.divmod(place // stride, size)
        step = np.where(turn % 2 == 1, size - 1 - step, step)
        digits.append(np.argsort(values, kind="stable")[step])
    return np.ravel_multi_index(tuple(digits), sizes).astype(np.int64)


def _along_curve(study: Study) -> Integers:
    moving = [ranks for ranks in map(_ranks, study.columns.values()) if ranks.max() > 0][:_BITS]
    if not moving:
        return np.arange(len(study), dtype=np.int64)
    bits = min(_FINEST, _BITS // len(moving))
    cells = [np.minimum((r / r.max() * 2**bits).astype(np.int64), 2**bits - 1) for r in moving]
    tie = np.lexsort(moving[::-1]) if len(moving) > 1 else np.argsort(moving[0], kind="stable")
    key = _hilbert(np.array(cells), bits)
    return tie[np.argsort(key[tie], kind="stable")].astype(np.int64)


def _ranks(column: ArrayLike) -> Integers:
    return np.unique(np.asarray(column), return_inverse=True)[1].astype(np.int64)


def _hilbert(cells: Integers, bits: int) -> Integers:
    """Place of each cell on a Hilbert curve (J. Skilling, AIP Conf. Proc. 707, 381, 2004).

    Args:
        cells: (columns, rows), whole numbers below 2**bits.
    """
    x = cells.copy()
    columns = len(x)
    high = 1 << (bits - 1)
    q = high
    while q > 1:  # undo the rotations and reflections of the smaller cubes
        low = q - 1
        for i in range(columns):
            flip = (x[i] & q) != 0
            swapped = (x[0] ^ x[i]) & low
            x[i] = np.where(flip, x[i], x[i] ^ swapped)
            x[0] = np.where(flip, x[0] ^ low, x[0] ^ swapped)
        q >>= 1
    for i in range(1, columns):  # Gray code
        x[i] ^= x[i - 1]
    turn = np.zeros_like(x[0])
    q = high
    while q > 1:
        turn = np.where(x[-1] & q, turn ^ (q - 1), turn)
        q >>= 1
    x ^= turn
    key: Integers = np.zeros(x.shape[1], dtype=np.int64)
    for bit in range(bits - 1, -1, -1):
        for i in range(columns):
            key = (key << 1) | ((x[i] >> bit) & 1)
    return key
