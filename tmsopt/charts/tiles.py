"""A grid computed a few rows at a time, by threads, and the memory that takes what they compute."""

import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from threading import local
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.charts.summary import Tally, tally
from tmsopt.charts.survey import Grid, Survey

TILE = 2**18
"""Designs of a tile: some 40 MB while it is computed."""

Tile = tuple[range, dict[str, NDArray[Any]], Tally]
"""Rows, layers and counts."""


def computed(work: Survey, tiles: Sequence[range], workers: int = 1) -> Iterator[Tile]:
    """Tiles in order, a few of them computed ahead by threads."""
    most = max(map(len, tiles), default=0)
    own = local()

    def compute(rows: range) -> Tile:
        began = time.perf_counter()
        if not hasattr(own, "room"):
            own.room = work.room(most)
        layers, fallbacks = work.tile(rows, own.room)
        first = rows.start * work.grid.shape[-1]
        return rows, layers, tally(layers, first, fallbacks, time.perf_counter() - began)

    ahead: deque[Future[Tile]] = deque()
    pool = ThreadPoolExecutor(workers, thread_name_prefix="tmsopt-chart")
    try:
        for rows in tiles:
            ahead.append(pool.submit(compute, rows))
            if len(ahead) > workers + 1:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()
    finally:  # what is computed, or compiled, by now is not waited for: Ctrl-C may have ended it
        pool.shutdown(wait=False, cancel_futures=True)


class Memory:
    """Arrays of a grid that take tiles, as a folder does.

    Attributes:
        layers: name → array of the grid's shape.
        done: first row → counts of the tiles that are there.
    """

    def __init__(self, grid: Grid, dtypes: Mapping[str, np.dtype[Any]]) -> None:
        self.layers = {n: np.empty(grid.shape, dtype) for n, dtype in dtypes.items()}
        self.done: dict[int, Tally] = {}

    def write(self, rows: range, layers: Mapping[str, NDArray[Any]], counts: Tally) -> None:
        """Put the layers of a tile into their places."""
        for name, layer in layers.items():
            whole = self.layers[name]
            whole.reshape(-1, whole.shape[-1])[rows.start : rows.stop] = layer
        self.done[rows.start] = counts
