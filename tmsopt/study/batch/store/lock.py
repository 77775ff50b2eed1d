"""One writer at a time: a lock that ends with the process that holds it, however that ends."""

import os
import sqlite3
from contextlib import suppress
from pathlib import Path

_TRIES = 20


class Lock:
    """The right to write one store; held until `release` or the end of the process."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self._path, self._connection = path, connection

    def release(self) -> None:
        """Give the right back. The file goes while it is still locked; `lock` holds for files that go meanwhile."""
        with suppress(OSError):
            self._path.unlink()  # Windows does not remove an open file; an empty one stays, and blocks nobody
        self._connection.close()


def lock(store: Path) -> Lock | None:
    """The lock of a store, or None where another process or connection holds it; never waits.

    An empty SQLite database beside the store, with a transaction that is begun and writes nothing: SQLite knows how to
    lock on every system, forked children do not inherit such a lock, and a file that stayed behind locks nothing.

    Raises:
        sqlite3.OperationalError: where no file can be written or the file system has no locks.
    """
    path = store.with_name(f"{store.name}.lock")
    for _ in range(_TRIES):
        before = _identity(path)
        connection = sqlite3.connect(path, isolation_level=None, timeout=0, check_same_thread=False)
        try:
            connection.execute("PRAGMA journal_mode=MEMORY")  # none in a file, since nothing is written
            connection.execute("BEGIN IMMEDIATE")
        except sqlite3.OperationalError as error:
            connection.close()
            if error.sqlite_errorcode & 0xFF == sqlite3.SQLITE_BUSY:
                return None
            if (now := _identity(path)) is not None and before in (None, now):
                raise
            continue  # its last holder removed the file just now, and SQLite noticed
        if before is not None and _identity(path) == before:
            return Lock(path, connection)
        connection.close()  # made just now, or removed by its last holder: what is locked may have no name any more
    return None


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        status = os.stat(path)
    except FileNotFoundError:
        return None
    return status.st_dev, status.st_ino
