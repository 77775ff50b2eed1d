"""Blocks of rows in a store: the table of them, made with the first one, and what is asked of it."""

import sqlite3
import zlib
from collections.abc import Collection, Iterator

import numpy as np
from numpy.typing import NDArray

from tmsopt.studies.judging import RowBlock, packed_block, unpacked_block
from tmsopt.studies.store.asking import ask
from tmsopt.studies.store.received import BLOCKS, SCHEMA_OF_BLOCKS

_OVERLAP = "first <= :last AND last >= :first"


class DamagedBlock(ValueError):
    """Bytes that are no block; `first` and `last` are the numbers of its rows."""

    def __init__(self, first: int, last: int, error: Exception) -> None:
        self.first, self.last = first, last
        super().__init__(str(error))


def holds(connection: sqlite3.Connection) -> bool:
    """Whether a store has blocks."""
    return bool(ask(connection, "SELECT 1 FROM sqlite_schema WHERE name = 'blocks'"))


def insert(connection: sqlite3.Connection, block: RowBlock) -> None:
    """Add a block, within a transaction; the table too where there is none yet."""
    if not holds(connection):
        connection.execute(BLOCKS)
        connection.execute(f"PRAGMA user_version={SCHEMA_OF_BLOCKS}")
    data, (first, last), bad = packed_block(block), _ends(block.numbers), int(block.infeasible.sum())
    line = (first, last, len(block) - bad, bad, _checksum(first, last, data), data)
    connection.execute("INSERT INTO blocks VALUES (?, ?, ?, ?, ?, ?)", line)


def listed(connection: sqlite3.Connection, first: int = 0, last: int = 2**62) -> list[tuple[int, int]]:
    """First and last number of each block that may have rows between two numbers."""
    if not holds(connection):
        return []
    query = f"SELECT first, last FROM blocks WHERE {_OVERLAP} ORDER BY first"
    return [(int(a), int(b)) for a, b in ask(connection, query, {"first": first, "last": last})]


def read(connection: sqlite3.Connection, first: int) -> RowBlock:
    """The block that begins with a row.

    Raises:
        DamagedBlock: for another one.
    """
    ((last, checksum, data),) = ask(connection, "SELECT last, checksum, data FROM blocks WHERE first = ?", (first,))
    try:
        if not isinstance(data, bytes) or _checksum(first, last, data) != checksum:
            raise ValueError("its checksum is wrong")
        block = unpacked_block(data)
        if _ends(block.numbers) != (first, last):
            raise ValueError("it has other rows")
    except (ValueError, KeyError, TypeError) as error:
        raise DamagedBlock(first, last, error) from error
    return block


def every(connection: sqlite3.Connection, first: int = 0, last: int = 2**62) -> Iterator[RowBlock]:
    """The blocks that may have rows between two numbers, one after the other."""
    return (read(connection, start) for start, _ in listed(connection, first, last))


def counts(connection: sqlite3.Connection) -> tuple[int, int]:
    """Rows in blocks that are optimal, and infeasible."""
    if not holds(connection):
        return 0, 0
    ((optimal, infeasible),) = ask(connection, "SELECT sum(optimal), sum(infeasible) FROM blocks")
    return int(optimal or 0), int(infeasible or 0)


def forget(connection: sqlite3.Connection, numbers: Collection[int]) -> None:
    """Remove rows, within a transaction; of a damaged block all."""
    wanted = np.array(sorted(numbers), dtype=np.int64)
    for first, last in listed(connection, int(wanted[0]), int(wanted[-1])) if wanted.size else ():
        if not np.any((wanted >= first) & (wanted <= last)):
            continue
        try:
            block = read(connection, first)
            kept = block.some(np.flatnonzero(~np.isin(block.numbers, wanted)))
        except DamagedBlock:
            kept = None
        connection.execute("DELETE FROM blocks WHERE first = ?", (first,))
        if kept is not None and len(kept):
            insert(connection, kept)


def _ends(numbers: NDArray[np.int64]) -> tuple[int, int]:
    return int(numbers[0]), int(numbers[-1])


def _checksum(first: int, last: int, data: bytes) -> int:
    return zlib.crc32(data, zlib.crc32(b"%d:%d:" % (first, last)))
