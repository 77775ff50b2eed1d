"""The right to write one file or folder, which one process or thread has at a time."""

import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tmsopt.errors import Fault, InputError

if TYPE_CHECKING:
    import sqlite3

_TRIES = 20


class Lock:
    """The right to write one file or folder; held until `release` or the end of the process, however that ends."""

    def __init__(self, path: Path, connection: "sqlite3.Connection") -> None:
        self._path, self._connection = path, connection

    def release(self) -> None:
        """Give the right back. The file goes while it is still locked; `lock` holds for files that go meanwhile."""
        with suppress(OSError):
            self._path.unlink()  # Windows does not remove an open file; an empty one stays, and blocks nobody
        self._connection.close()


def lock(path: Path) -> Lock | None:
    """The lock of a file or folder, or None where another process or thread holds it; never waits.

    An empty SQLite database beside it, with a transaction that is begun and writes nothing: SQLite knows how to lock on
    every system, forked children do not inherit such a lock, and a file that stayed behind locks nothing.

    Raises:
        sqlite3.OperationalError: where no file can be written or the file system has no locks.
        InputError: where something else has the name of the lock, such as a link.
    """
    import sqlite3  # not for those who read a problem

    path = path.with_name(f"{path.name}.lock")
    for _ in range(_TRIES):
        with suppress(FileNotFoundError):
            if not stat.S_ISREG((there := path.lstat()).st_mode) or there.st_size:
                raise InputError([Fault("is no lock of tmsopt, which is an empty file; remove it", file=str(path))])
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
