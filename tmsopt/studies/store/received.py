"""That a file is what `database` makes and nothing else, before a query is run in it: it may come from anybody."""

import os
import sqlite3
import stat
from collections.abc import Iterable
from contextlib import closing, suppress
from functools import cache
from pathlib import Path
from typing import Any

from tmsopt.studies.store.asking import ask

COMPANIONS = ("-journal", "-wal", "-shm")
"""What SQLite keeps beside a store, the last two for one of an earlier version."""

TABLES = """
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE columns (name TEXT PRIMARY KEY, count INTEGER NOT NULL, checksum INTEGER NOT NULL, doubles BLOB NOT NULL);
CREATE TABLE sessions (id INTEGER PRIMARY KEY, started TEXT NOT NULL, ended TEXT, pid INTEGER NOT NULL,
    host TEXT NOT NULL, versions TEXT NOT NULL, rows INTEGER NOT NULL DEFAULT 0);
CREATE TABLE rows (number INTEGER PRIMARY KEY, status TEXT NOT NULL, checksum INTEGER NOT NULL, data TEXT NOT NULL);
CREATE INDEX by_status ON rows (status);
"""  # The index is a hundredth of the rows, and all that `done` and `counts` read.

BLOCKS = (
    "CREATE TABLE blocks (first INTEGER PRIMARY KEY, last INTEGER NOT NULL, optimal INTEGER NOT NULL, "
    "infeasible INTEGER NOT NULL, checksum INTEGER NOT NULL, data BLOB NOT NULL)"
)
"""Made with the first block of rows, when the schema becomes this one; other stores are those of earlier versions."""
SCHEMA_OF_BLOCKS = 2

_LARGEST = 2**27  # bytes of one value: more than the column of a study with the most rows takes
_LONGEST = 10_000  # bytes of SQL: a schema is SQL too
_SUPER = bytes.fromhex("d9d505f920a163d7")  # ends a journal that names another one, which SQLite would remove
_STEPS = 100_000  # of SQLite's machine between two looks at how many there were
_SCHEMA = "SELECT type, name, tbl_name, substr(sql, 1, 1000) FROM sqlite_schema LIMIT 20"


def companion_fault(path: Path) -> str:
    """What is wrong with the files beside a store, which SQLite would write, play or remove; empty where nothing is."""
    for ending in (*COMPANIONS, ".lock"):
        beside = Path(f"{path}{ending}")
        with suppress(FileNotFoundError):
            if not stat.S_ISREG(beside.lstat().st_mode):
                return f"'{beside}' is no file but a link or the like, and tmsopt writes through none; remove it"
    journal = Path(f"{path}{COMPANIONS[0]}")
    with suppress(FileNotFoundError), journal.open("rb") as stream:  # its writer may remove it just now
        stream.seek(-min(len(_SUPER), stream.seek(0, os.SEEK_END)), os.SEEK_END)
        if stream.read(len(_SUPER)) == _SUPER:
            return f"'{journal}' names another file, as none of tmsopt does; remove it"
    return ""


def careful(connection: sqlite3.Connection) -> None:
    """Let SQLite run nothing of what a schema says beside its tables, trust no page, and hold no enormous value."""
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LARGEST)
    connection.setlimit(sqlite3.SQLITE_LIMIT_SQL_LENGTH, _LONGEST)
    connection.execute("PRAGMA trusted_schema=OFF")
    connection.execute("PRAGMA cell_size_check=ON")


def content_fault(connection: sqlite3.Connection, size: int) -> str:
    """What is wrong with a database that is to be a store; empty where nothing is.

    Views, triggers, virtual tables and what else is no table of a store would be run by a query; pages that are used
    twice would make one endless.

    Args:
        size: of the file in bytes, which bounds the work.
    """
    left = 1000 + 20 * size // _STEPS

    def spent() -> bool:
        nonlocal left
        left -= 1
        return left < 0

    connection.set_progress_handler(spent, _STEPS)
    try:
        found = set(_listed(ask(connection, _SCHEMA)))
        expected = _expected("blocks" in {name for _, name, *_ in found})
        if other := sorted(found - expected) or sorted(expected - found):
            kind, name = other[0][:2]
            return f"its {kind} '{name[:60]}' is not that of a store"
        ((whole,),) = ask(connection, "PRAGMA quick_check(1)")
        return "" if whole == "ok" else str(whole).replace("\n", " ")
    finally:
        connection.set_progress_handler(None, 0)


@cache
def _expected(blocks: bool) -> frozenset[tuple[str, ...]]:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(TABLES + (BLOCKS if blocks else ""))
        return frozenset(_listed(ask(connection, _SCHEMA)))


def _listed(found: Iterable[tuple[Any, ...]]) -> list[tuple[str, ...]]:
    return [tuple(" ".join(str(part).split()) for part in line) for line in found]
