"""Which journal SQLite can keep in a folder, found by trying."""

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
