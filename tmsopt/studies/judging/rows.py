"""Blocks of rows and single rows as one sequence."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import overload

import numpy as np

from tmsopt.studies.judging.block import RowBlock
from tmsopt.studies.row import Row


class RowsInBlocks(Sequence[Row]):
    """Rows by ascending number; those of blocks are made each time they are asked for.

    Attributes:
        blocks: columns of most of them.
        singles: the others.
        order: place of each row in the chain of all blocks and the single ones.
    """

    def __init__(self, blocks: Iterable[RowBlock], singles: Iterable[Row]) -> None:
        self.blocks, self.singles = tuple(blocks), tuple(singles)
        single = np.array([row.number for row in self.singles], dtype=np.int64)
        numbers = np.concatenate([*(block.numbers for block in self.blocks), single])
        self.order = np.argsort(numbers, kind="stable")
        self._ends = np.cumsum([len(block) for block in self.blocks])

    def __len__(self) -> int:
        return len(self.order)

    @overload
    def __getitem__(self, where: int) -> Row: ...

    @overload
    def __getitem__(self, where: slice) -> tuple[Row, ...]: ...

    def __getitem__(self, where: int | slice) -> Row | tuple[Row, ...]:
        if isinstance(where, slice):
            return tuple(self._at(int(k)) for k in self.order[where])
        return self._at(int(self.order[where]))

    def __iter__(self) -> Iterator[Row]:
        return (self._at(int(k)) for k in self.order)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RowsInBlocks | tuple) and len(self) == len(other) and all(map(_same, self, other))

    def __hash__(self) -> int:
        return hash(len(self))

    def __repr__(self) -> str:
        return f"RowsInBlocks({len(self)})"

    def _at(self, place: int) -> Row:
        which = int(np.searchsorted(self._ends, place, side="right"))
        if which == len(self.blocks):
            return self.singles[place - (int(self._ends[-1]) if self.blocks else 0)]
        return self.blocks[which].row(place - (int(self._ends[which - 1]) if which else 0))


def _same(one: Row, other: object) -> bool:
    return one == other


def gathered(blocks: Sequence[RowBlock], singles: Iterable[Row]) -> Sequence[Row]:
    """Rows in the order of their numbers: a tuple where none are in blocks."""
    if any(len(block) for block in blocks):
        return RowsInBlocks([block for block in blocks if len(block)], singles)
    return tuple(sorted(chain(singles), key=lambda row: row.number))
