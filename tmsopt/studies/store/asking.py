"""Questions to SQLite while others write, and what it complains of in words of a store."""

import sqlite3
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tmsopt.errors import Fault, InputError

PATIENCE = 60.0
"""Seconds to wait for somebody who reads or writes just now."""

_PAUSE = 0.001  # seconds between two questions to a store that is locked

DAMAGED = "is damaged; --fresh moves it aside and starts a new store, or give another --store"

_MEANINGS = {
    sqlite3.SQLITE_FULL: "the disk is full; make room and run the same command again, the rows in the store are safe",
    sqlite3.SQLITE_IOERR: "reading or writing fails, or the disk is full; the rows in the store are safe",
    sqlite3.SQLITE_READONLY: "cannot be written; give a place that can",
    sqlite3.SQLITE_PERM: "cannot be written; give a place that can",
    sqlite3.SQLITE_CANTOPEN: "cannot be opened or written here; give a file in a folder that can be written",
    sqlite3.SQLITE_CORRUPT: DAMAGED,
    sqlite3.SQLITE_INTERRUPT: DAMAGED,  # it holds an endless question, see `received`
    sqlite3.SQLITE_TOOBIG: DAMAGED,
    sqlite3.SQLITE_NOTADB: "is no store of tmsopt; give another file",
    sqlite3.SQLITE_BUSY: f"another program kept it locked for {PATIENCE:g} s; end that and run the same command again",
    sqlite3.SQLITE_PROTOCOL: "locks do not work on this file system; give a --store on another disk",
    sqlite3.SQLITE_LOCKED: "another program keeps it locked; end that and run the same command again",
}


def refuse(path: Path, *lines: str) -> InputError:
    """The error that says these lines about a store."""
    return InputError([Fault(lines[0], file=str(path)), *(Fault(f"  {line}") for line in lines[1:])])


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """What SQLite complains of, in words of a store.

    Raises:
        InputError: for any error of the file or the place where it is; a fault of the program stays one.
    """
    try:
        yield
    except sqlite3.DatabaseError as error:
        meaning = _MEANINGS.get(code(error))
        if meaning is None:
            raise
        raise refuse(path, f"{meaning} ({error!s:.200})") from error  # it may quote the file at length


def code(error: sqlite3.Error) -> int:
    """SQLite's number of an error; that of a damaged file where text is no text or a table is gone; 0 for others."""
    found = getattr(error, "sqlite_errorcode", None)
    if isinstance(error, sqlite3.OperationalError) and (found is None or "no such" in str(error)):
        return sqlite3.SQLITE_CORRUPT  # Python gives no number to what it cannot decode
    if "unsupported file format" in str(error):  # SQLite has no number for it
        return sqlite3.SQLITE_NOTADB
    return (found or 0) & 0xFF


def ask(connection: sqlite3.Connection, query: str, values: Sequence[Any] | Mapping[str, Any] = ()) -> list[Any]:
    """All that a query finds. It asks often while the store is locked.

    SQLite asks ten times a second, and a writer with a rollback journal, who locks the store for most of the time while
    he waits for the disk, would let a reader in once a minute.
    """
    end = time.monotonic() + PATIENCE
    while True:
        try:
            return connection.execute(query, values).fetchall()
        except sqlite3.OperationalError as error:
            if code(error) != sqlite3.SQLITE_BUSY or time.monotonic() > end:
                raise
            time.sleep(_PAUSE)


@contextmanager
def undamaged(path: Path, what: str) -> Iterator[None]:
    """What is read there can be read.

    Raises:
        InputError: when it cannot.
    """
    try:
        yield
    except (KeyError, ValueError) as error:
        raise error if isinstance(error, InputError) else refuse(path, f"{DAMAGED} ({what}: {error})") from error
