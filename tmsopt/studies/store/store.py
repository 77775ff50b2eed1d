"""The store of a study: rows in one SQLite file, safe from ``kill -9``, with one writer and any number of readers."""

import json
import sqlite3
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from heapq import merge
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from tmsopt.disk import from_json
from tmsopt.locks import Lock
from tmsopt.studies.judging import RowBlock
from tmsopt.studies.row import STATUSES, Row
from tmsopt.studies.store import blocks, database
from tmsopt.studies.store.asking import DAMAGED, ask, explained, refuse, undamaged
from tmsopt.studies.store.packing import SELECT, packed, unpacked
from tmsopt.studies.store.provenance import now

_CHUNK = 100  # rows read at once: a reader that pauses between rows must not hold up the writer; 100 MB at most


class Store:
    """Rows of one study, open for writing (`open_store`) or reading (`read_store`); a context manager.

    Attributes:
        path: of the file.
        warnings: what the user should know, one line each, such as other versions of the libraries.
        moved: where ``fresh`` put the store that was there before.
    """

    def __init__(
        self, path: Path, connection: sqlite3.Connection, held: Lock | None = None, session: int = 0,
        warnings: Sequence[str] = (), moved: Path | None = None,
    ) -> None:  # fmt: skip
        self.path, self.warnings, self.moved = path, tuple(warnings), moved
        self._connection, self._lock, self._session = connection, held, session
        self._closed, self._turn = False, threading.Lock()

    def __enter__(self) -> "Store":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file, and give up the right to write it; a second time does nothing."""
        if self._closed:
            return
        self._closed = True
        if self._lock is None:
            self._connection.close()
            return
        try:
            with suppress(sqlite3.Error):  # on a full disk there is a better error than this one
                self._connection.execute("UPDATE sessions SET ended = ? WHERE id = ?", (now(), self._session))
        finally:
            self._connection.close()
            self._lock.release()

    def add(self, rows: Sequence[Row]) -> None:
        """Keep rows, all or none; when it returns they are safe from ``kill -9``.

        A row that is there already, bit by bit but for time and host, is passed over.

        Raises:
            InputError: when another row of that number is there; on a full disk; when open for reading only.
        """
        self._check_writable()
        rows = self._not_in_blocks(rows)
        if not rows:
            return
        kept = [packed(row) for row in rows]
        with self._change():
            new = self._connection.executemany("INSERT OR IGNORE INTO rows VALUES (?, ?, ?, ?)", kept).rowcount
            if new < len(rows):
                self._check_same(rows)
            self._connection.execute("UPDATE sessions SET rows = rows + ? WHERE id = ?", (new, self._session))

    def add_block(self, block: RowBlock) -> None:
        """Keep a block of rows likewise.

        Raises:
            InputError: as `add`.
        """
        self._check_writable()
        first, last = int(block.numbers[0]), int(block.numbers[-1])
        with explained(self.path):
            beside = ask(self._connection, "SELECT 1 FROM rows WHERE number BETWEEN ? AND ? LIMIT 1", (first, last))
            if beside or blocks.listed(self._connection, first, last):
                there = self.done()
                self.add([row for row in block if row.number in there])
                block = block.some(np.flatnonzero([int(n) not in there for n in block.numbers]))
        if len(block):
            with self._change():
                blocks.insert(self._connection, block)
                query = "UPDATE sessions SET rows = rows + ? WHERE id = ?"
                self._connection.execute(query, (len(block), self._session))

    @contextmanager
    def _change(self) -> Iterator[None]:
        """A transaction: all or nothing of what is done within."""
        with self._turn, explained(self.path):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")
                raise

    def _not_in_blocks(self, rows: Sequence[Row]) -> list[Row]:
        """Those rows that are in no block; the others are the same there."""
        with explained(self.path):
            if not rows or not blocks.listed(self._connection):
                return list(rows)
        numbers = {row.number for row in rows}
        there = {n for block in self.blocks(min(numbers), max(numbers)) for n in block.numbers.tolist()} & numbers
        self._check_same([row for row in rows if row.number in there])
        return [row for row in rows if row.number not in there]

    def _check_same(self, rows: Sequence[Row]) -> None:
        for row in rows:
            there = self.row(row.number)
            if there.identity != row.identity:
                mine, theirs = json.loads(row.identity), json.loads(there.identity)
                unlike = ", ".join(name for name in mine if mine[name] != theirs.get(name))
                message = (
                    f"row {row.number} is there already and differs from the new one in {unlike}; nothing was changed"
                )
                raise refuse(self.path, message)

    def done(self) -> set[int]:
        """The numbers of all rows in the store."""
        with explained(self.path):
            found = {number for (number,) in ask(self._connection, "SELECT number FROM rows")}
        return found.union(*(block.numbers.tolist() for block in self.blocks()))

    def counts(self) -> dict[str, int]:
        """Status → rows that have it, in the order of `STATUSES`; none that no row has."""
        with explained(self.path):
            found = dict(ask(self._connection, "SELECT status, count(*) FROM rows GROUP BY status LIMIT 100"))
            for status, count in zip(("optimal", "infeasible"), blocks.counts(self._connection), strict=True):
                if count:
                    found[status] = found.get(status, 0) + count
        if unknown := [status for status in found if status not in STATUSES]:
            raise refuse(self.path, f"{DAMAGED} (a row has the status {unknown[0]!r:.60})")
        return {status: found[status] for status in STATUSES if status in found}

    def outside(self, most: int) -> int | None:
        """The number of a row that a study of so many rows cannot have; None where there is none."""
        query = "SELECT number FROM rows WHERE number < 0 OR number >= ? LIMIT 1"
        with explained(self.path):
            found = [number for (number,) in ask(self._connection, query, (most,))]
            found += [n for ends in blocks.listed(self._connection, most) for n in ends if n >= most]
            found += [n for n, _ in blocks.listed(self._connection, -(2**62)) if n < 0]
        return found[0] if found else None

    def row(self, number: int) -> Row:
        """One row.

        Raises:
            InputError: when it is not there or damaged.
        """
        with explained(self.path):
            found = ask(self._connection, f"{SELECT} WHERE number = ?", (number,))
        if found:
            return self._unpacked(*found[0])
        for block in self.blocks(number, number):
            if (row := block.find(number)) is not None:
                return row
        raise refuse(self.path, f"row {number} is not in the store")

    def blocks(self, first: int = 0, last: int = 2**62) -> Iterator[RowBlock]:
        """The blocks that may have rows between two numbers, in order.

        Raises:
            InputError: on reaching one that is damaged.
        """
        try:
            with explained(self.path):
                yield from blocks.every(self._connection, first, last)
        except blocks.DamagedBlock as error:
            lost = f"rows {error.first} to {error.last} are damaged ({error})"
            advice = f"Store.forget([{error.first}]) removes them, and the same study judges them again"
            raise refuse(self.path, f"{lost}; {advice}") from error

    def rows(self, status: str | None = None) -> Iterator[Row]:
        """All rows, or those of one status, in order of number; rows added meanwhile may or may not be among them.

        Raises:
            InputError: on reaching a row that is damaged.
        """
        inside = (row for block in self.blocks() for row in block if status in (None, row.status))
        return merge(inside, self.singles(status), key=lambda row: row.number)

    def singles(self, status: str | None = None) -> Iterator[Row]:
        """Likewise the rows that are in no block."""
        where = "" if status is None else " AND status = :status"
        query = f"{SELECT} WHERE number > :last{where} ORDER BY number LIMIT {_CHUNK}"
        last = -1
        while True:
            with explained(self.path):
                found = ask(self._connection, query, {"last": last, "status": status})
            for line in found:
                yield self._unpacked(*line)
            if len(found) < _CHUNK:
                return
            last = found[-1][0]

    def definition(self) -> dict[str, Any]:
        """The study as it was given to `open_store`; numbers in columns as doubles."""
        with explained(self.path):
            return database.definition(self._connection, self.path).to_json()

    def about(self) -> dict[str, Any]:
        """Schema, definition without its columns, seed, when, where and with which versions the store was made."""
        with explained(self.path):
            found: dict[str, Any] = database.about(self._connection)
            ((schema,),) = ask(self._connection, "PRAGMA user_version")
        with undamaged(self.path, "what it says of itself"):
            for name in ("definition", "seed", "versions"):
                found[name] = from_json(found[name])
        return {"schema": schema} | found

    def sessions(self) -> list[dict[str, Any]]:
        """Every process that wrote, in order: started, ended (None where killed), pid, host, versions, rows added."""
        with explained(self.path), undamaged(self.path, "the list of its writers"):
            return database.sessions(self._connection)

    def forget(self, numbers: Iterable[int]) -> None:
        """Remove rows, such as damaged ones, so that they are solved again.

        Raises:
            InputError: when open for reading only.
        """
        self._check_writable()
        gone = set(numbers)
        with self._change():
            self._connection.executemany("DELETE FROM rows WHERE number = ?", [(number,) for number in gone])
            blocks.forget(self._connection, gone)

    def _check_writable(self) -> None:
        if self._lock is None:
            raise refuse(self.path, "is open for reading; open_store opens it for writing")

    def _unpacked(self, number: int, status: bytes, checksum: int, data: bytes) -> Row:
        try:
            return unpacked(number, status, checksum, data)
        except ValueError as error:
            command = f"sqlite3 '{self.path}' 'DELETE FROM rows WHERE number = {number}'"
            advice = f"{command} (or Store.forget([{number}])) removes it, and the same study solves it again"
            raise refuse(self.path, f"row {number} is damaged ({error}); {advice}") from error
