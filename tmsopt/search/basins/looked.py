"""Designs as points of the unit cube that were looked at: ranked, told apart, and the basins that they show."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Array

REACHES = (0.1, 0.03, 0.008, 2e-3, 4e-4)
"""Steps by which designs are refined, of the box, round after round."""

_APART = 0.15  # of the box: distance of designs that may lie in different basins
_CELL = 0.05  # of the box
_FAR_OFF = 1e-3  # of their scales, in sum: limits that refined designs violate by more exclude each other, it seems
_OUT_OF_REACH, _SIMPLEST = 2.1, 4  # times the n-th root of the last reach, by which a sample misses an n-fold root
_CELLS, _BESIDE, _FEWEST = 2, 4, 4
"""Of the grid in which basins are told apart: most cells for each design, designs beside one a parameter and two,
fewest cells along a parameter."""


@dataclass(frozen=True)
class Looked:
    """Designs as points of the unit cube, with what they are; the first ones come first where nothing else decides.

    Attributes:
        worth: larger is worse; inf where it does not exist.
        violation: sum of the excesses, each relative to its scale; 0 where all limits are met.
    """

    u: Array
    worth: Array
    violation: Array

    def __len__(self) -> int:
        return len(self.u)

    def take(self, rows: NDArray[np.int_]) -> "Looked":
        """Some of them."""
        return Looked(self.u[rows], self.worth[rows], self.violation[rows])

    def joined(self, other: "Looked") -> "Looked":
        """These and others."""
        pairs = ((self.u, other.u), (self.worth, other.worth), (self.violation, other.violation))
        return Looked(*(np.concatenate(pair) for pair in pairs))

    @cached_property
    def ranked(self) -> NDArray[np.int_]:
        """Rows by violation, then by worth."""
        return np.lexsort((self.worth, self.violation))

    @property
    def far_off(self) -> bool:
        """Whether limits seem to exclude each other: where they can be met, some refined design meets them."""
        return bool(np.all(self.violation > _FAR_OFF))

    def out_of_reach(self, degree: int) -> bool:
        """The same by so much that it is not for a root of that multiplicity alone, which no sample meets."""
        return bool(np.all(self.violation > _OUT_OF_REACH * REACHES[-1] ** (1 / max(degree, _SIMPLEST))))


def scattered(found: Looked, most: int) -> NDArray[np.int_]:
    """The first few rows in cells of their own: what `apart` gives for many, in a fraction of its time."""
    cells = np.floor(found.u / _CELL) @ np.random.default_rng(0).random(found.u.shape[1])
    return np.asarray(np.sort(np.unique(cells, return_index=True)[1])[:most])


def apart(found: Looked, most: int, distance: float = _APART) -> NDArray[np.int_]:
    """The first few rows that lie apart from each other."""
    rows: list[int] = []
    left = np.arange(len(found))
    while left.size and len(rows) < most:
        rows.append(int(left[0]))
        left = left[np.abs(found.u[left] - found.u[left[0]]).max(axis=1) >= distance]
    return np.array(rows, dtype=int)


def basins(found: Looked, coordinates: Array, slopes: Array) -> tuple[NDArray[np.int_], Array]:
    """Rows that are the best of all in the cells of a grid beside their own, the best first; and the size of a cell.

    Each of them is where a way from design to better design beside it ends, as in Törn's topographs.

    Args:
        coordinates: of the designs, from 0 to 1, about as even as they are.
        slopes: of these in the coordinates of the cube, by which the cells there are smaller.
    """
    size = found.u.shape[1]
    each = min(_CELLS, 3**size / (_BESIDE * (size + 2)))
    count = max(int((each * len(found)) ** (1 / size)), _FEWEST)
    rank = np.empty(len(found), dtype=int)
    rank[found.ranked] = np.arange(len(found))
    cells = np.minimum(coordinates * count, count - 1).astype(int)
    cell = np.ravel_multi_index(tuple(cells.T), (count,) * size)
    least = np.full(count**size, len(found))
    np.minimum.at(least, cell, rank)
    grid = least.reshape((count,) * size)
    for axis in range(size):
        before = np.moveaxis(grid, axis, 0)
        after = before.copy()
        after[1:] = np.minimum(after[1:], before[:-1])
        after[:-1] = np.minimum(after[:-1], before[1:])
        grid = np.moveaxis(after, 0, axis)
    lowest = np.flatnonzero(grid.ravel()[cell] == rank)
    lowest = lowest[np.argsort(rank[lowest])]
    return lowest, 1 / (count * slopes[lowest])
