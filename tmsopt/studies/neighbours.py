"""Rows in an order in which neighbours are near each other, for optima that start the next ones."""

import math

import numpy as np

from tmsopt.studies.study import Study

BLOCK = 32
"""Rows of a block: the first of each starts cold, so that blocks can be solved apart."""


def blocks(study: Study, size: int = BLOCK) -> list[tuple[int, ...]]:
    """Every row once, in blocks of `size` in each of which consecutive rows are near.

    A grid is walked to and fro, so that consecutive rows differ in one axis by one step. The box of other rows is
    walked so in strips: each column but the last is cut into parts by rank, so that a logarithmic one counts as much
    as an even one.
    """
    count = len(study)
    ranks = [np.unique(np.asarray(column), return_inverse=True)[1] for column in study.columns.values()]
    moving = [rank for rank in ranks if rank.max() > 0]
    if study.grid_shape is None:
        moving = moving[: max(1, int(math.log2(count)))]
        parts = round(count ** (1 / max(1, len(moving))))
        moving[:-1] = [rank * min(parts, rank.max() + 1) // (rank.max() + 1) for rank in moving[:-1]]
    walk = np.zeros(count, dtype=np.int64)
    for rank in moving:
        most = rank.max()
        walk = walk * (most + 1) + np.where(walk % 2 == 1, most - rank, rank)
    order = np.argsort(walk, kind="stable").tolist()
    return [tuple(order[k : k + size]) for k in range(0, count, size)]
