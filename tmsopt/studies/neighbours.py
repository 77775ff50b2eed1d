"""Order of rows in which neighbours are close, so that each optimum can start the next row."""

import math

import numpy as np

from tmsopt.studies.study import Study

BLOCK = 32
"""Rows of a block; the first row of each block starts cold, so that blocks are independent."""


def split_into_blocks(study: Study, size: int = BLOCK) -> list[tuple[int, ...]]:
    """Every row once, in blocks of `size` with close consecutive rows.

    A grid is traversed back and forth, so consecutive rows differ in one axis by one step. For other rows, each
    column but the last is binned by rank and traversed in the same way. Ranks treat logarithmic and linear columns
    alike.
    """
    count = len(study)
    ranks = [np.unique(np.asarray(column), return_inverse=True)[1] for column in study.columns.values()]
    moving = [rank for rank in ranks if rank.max() > 0]
    if study.grid_shape is None:
        moving = moving[: max(1, int(math.log2(count)))]
        bins = round(count ** (1 / max(1, len(moving))))
        moving[:-1] = [rank * min(bins, rank.max() + 1) // (rank.max() + 1) for rank in moving[:-1]]
    walk = np.zeros(count, dtype=np.int64)
    for rank in moving:
        most = rank.max()
        walk = walk * (most + 1) + np.where(walk % 2 == 1, most - rank, rank)
    order = np.argsort(walk, kind="stable").tolist()
    return [tuple(order[k : k + size]) for k in range(0, count, size)]
