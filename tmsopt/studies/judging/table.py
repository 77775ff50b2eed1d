"""The columns of rows of which most are in blocks, each made when it is asked for."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.records import Truth
from tmsopt.studies.judging.block import METHODS, STATUS, STRUCTURES, RowBlock, seeds
from tmsopt.studies.judging.rows import RowsInBlocks

TABLES = {"varied": "varied", "parameters": "parameters", "reports": "report", "laws": "law", "violations": "violation"}
"""Table of a row → what its columns begin with in a block."""

_Part = tuple[NDArray[Any], Truth]
_FIELDS: Mapping[str, Callable[[RowBlock], Any]] = {
    "number": lambda b: b.numbers, "seed": lambda b: seeds(b.shared.seed, b.numbers),
    "status": lambda b: STATUS[b.infeasible.astype(int)],
    "cause": lambda b: np.array(b.causes(), dtype=object),
    "abscissa_realised": lambda b: b.columns["abscissa"], "stable": lambda b: b.columns["abscissa"] < 0,
    "structure": lambda b: STRUCTURES[b.columns["oscillates"].astype(int)], "proven": lambda b: False,
    "method": lambda b: METHODS[b.methods], "starts": lambda b: 0, "warm": lambda b: False,
    "seconds": lambda b: b.seconds, "host": lambda b: np.array([b.host], dtype=object),
}  # fmt: skip
"""Of a row → its values in a block; the others are columns there."""


def field(rows: RowsInBlocks, name: str, single: _Part) -> _Part:
    """Values of one field of all rows, and which rows have one.

    Args:
        single: those of the rows in no block.
    """
    made = _FIELDS.get(name)
    each = [b.columns[name] if made is None else made(b) for b in rows.blocks]
    parts = [(np.broadcast_to(x, len(b)), np.True_) for x, b in zip(each, rows.blocks, strict=True)]
    return _ordered(rows, parts, single)


def keyed(rows: RowsInBlocks, table: str, key: str, single: _Part) -> _Part:
    """Likewise the values of one name in a table of the rows."""
    return _ordered(rows, [_keyed(b, table, key) for b in rows.blocks], single)


def keys(rows: RowsInBlocks, table: str, singles: Mapping[str, Truth]) -> list[str]:
    """The names in a table of the rows, in the order in which the rows have them.

    Args:
        singles: name → which of the rows in no block have it.
    """
    known = dict.fromkeys(name for b in rows.blocks for name in _names(b, table))
    nothing = np.zeros(len(rows.singles), dtype=bool)
    first = {}
    for key in known | dict.fromkeys(singles):
        _, present = keyed(rows, table, key, (np.zeros(len(nothing)), singles.get(key, nothing)))
        if present.any():
            first[key] = int(present.argmax())
    return sorted(first, key=first.__getitem__)


def _names(block: RowBlock, table: str) -> list[str]:
    return list(block.shared.fixed) if table == "parameters" else block.named(TABLES[table])


def _keyed(block: RowBlock, table: str, key: str) -> tuple[Any, Any]:
    name = f"varied.{key}" if table == "parameters" else f"{TABLES[table]}.{key}"
    column = block.columns.get(name)
    if column is None and table == "parameters":
        column = np.full(len(block), block.shared.fixed.get(key, np.nan))
    if column is None:
        return np.full(len(block), np.nan), np.False_
    return column, ~np.isnan(column) if table in ("laws", "violations") else np.True_


def _ordered(rows: RowsInBlocks, parts: list[tuple[Any, Any]], single: _Part) -> _Part:
    values = np.concatenate([*(values for values, _ in parts), single[0]])
    present = [np.broadcast_to(there, len(values)) for values, there in parts]
    return values[rows.order], np.concatenate([*present, single[1]])[rows.order]


def causes(rows: RowsInBlocks) -> list[tuple[str, int]]:
    """Why rows are not optimal, and how many there are, the first one first: one text for all that violate the same."""
    found = [(row.number, row.cause, 1) for row in rows.singles if row.status != STATUS[0]]
    for block in rows.blocks:
        kinds = np.zeros(len(block), dtype=np.int64)
        limits = (np.isnan(block.columns[f"violation.{name}"]) for name in block.named("violation"))
        for truth in (block.columns["abscissa"] < 0, *limits):
            kinds = np.unique(2 * kinds + truth, return_inverse=True)[1]
        first, counts = np.unique(kinds, return_index=True, return_counts=True)[1:]
        places = zip(first.tolist(), counts.tolist(), strict=True)
        found += [(int(block.numbers[k]), block.cause(k), count) for k, count in places if block.infeasible[k]]
    return [(cause, count) for _, cause, count in sorted(found)]


@dataclass(frozen=True)
class Lazily(Mapping[str, Any]):
    """A table whose entries are made each time they are asked for."""

    made: Mapping[str, Callable[[], Any]]

    def __getitem__(self, name: str) -> Any:
        return self.made[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self.made)

    def __len__(self) -> int:
        return len(self.made)
