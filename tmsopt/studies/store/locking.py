"""One writer at a time: a lock that ends with the process that holds it, however that ends."""

import os
import sqlite3
import sys
from contextlib import closing, suppress
from pathlib import Path

NETWORK = (
    "9p",
    "afs",
    "beegfs",
    "ceph",
    "cifs",
    "fuse.sshfs",
    "gpfs",
    "lustre",
    "ncpfs",
    "nfs",
    "nfs4",
    "smb3",
    "smbfs",
)
"""File systems that several machines share. A write-ahead log needs memory that all its users share, which there it may
have on the machine that tries, and not with the next one."""


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


def journal(folder: Path) -> str:
    """``wal``, a write-ahead log, where it works in the folder; else ``delete``, a rollback journal."""
    return "wal" if _type(folder) not in NETWORK and _works(folder) else "delete"


def _works(folder: Path) -> bool:
    probe = folder / f".tmsopt-probe-{os.getpid()}.sqlite"
    try:
        with (
            closing(sqlite3.connect(probe, isolation_level=None, timeout=0)) as one,
            closing(sqlite3.connect(probe, isolation_level=None, timeout=0)) as two,
        ):
            one.execute("PRAGMA synchronous=OFF")
            if one.execute("PRAGMA journal_mode=WAL").fetchone() != ("wal",):
                return False
            one.execute("CREATE TABLE probe (x)")
            one.execute("INSERT INTO probe VALUES (1)")
            seen = two.execute("SELECT x FROM probe").fetchall()
            two.execute("INSERT INTO probe VALUES (2)")
            return seen == [(1,)] and one.execute("SELECT x FROM probe").fetchall() == [(1,), (2,)]
    except sqlite3.Error:
        return False
    finally:
        for ending in ("", "-wal", "-shm", "-journal"):
            with suppress(OSError):
                probe.with_name(probe.name + ending).unlink()


def _type(folder: Path, mounts: Path = Path("/proc/self/mounts")) -> str:
    """Of the file system that holds a folder, where the system tells it as Linux does; else empty."""
    if sys.platform != "linux":
        return ""
    try:
        lines = [line.split() for line in mounts.read_text(encoding="utf-8", errors="replace").splitlines()]
    except OSError:
        return ""
    # Octal escapes stand for blanks in names; of two mounts on one folder the later hides the earlier.
    places = [(Path(place.replace("\\040", " ")), kind) for _, place, kind, *_ in lines]
    within = [
        (len(place.parts), index, kind) for index, (place, kind) in enumerate(places) if folder.is_relative_to(place)
    ]
    return max(within)[2] if within else ""
