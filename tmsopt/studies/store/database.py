"""The file of a store: its tables, how it is made as a whole, recognised, opened and moved aside."""

import json
import os
import sqlite3
import zlib
from collections.abc import Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from tmsopt import disk
from tmsopt.errors import Fault, InputError
from tmsopt.studies.store.asking import DAMAGED, PATIENCE, ask, code, explained, refuse
from tmsopt.studies.store.definition import Definition, pack, unpack
from tmsopt.studies.store.provenance import host, now
from tmsopt.studies.store.received import (
    COMPANIONS,
    SCHEMA_OF_BLOCKS,
    TABLES,
    careful,
    companion_fault,
    content_fault,
)  # fmt: skip

APPLICATION = 0x746D736F
"""In the header of every store, where `file` and SQLite look for it: "tmso"."""

SCHEMA = SCHEMA_OF_BLOCKS
"""The newest that is read."""

_FIRST = 1  # of a store as it is made: with its first block of rows it becomes the newest

_NUMBERS = 25_000_000  # read of a store, 200 MB, unless the study that is asked for has more


def check(path: Path) -> None:
    """That a file is a store of this version of tmsopt or an earlier one; the file is only read.

    Raises:
        InputError: when it is not.
    """
    if not path.is_file():
        raise refuse(path, "is no regular file; give the name of a store, such as study.sqlite")
    if fault := companion_fault(path):
        raise refuse(path, fault)
    with explained(path):
        application, schema = _header(path)
    if application != APPLICATION:
        raise refuse(path, "is no store of tmsopt; give another file")
    if schema > SCHEMA:
        raise refuse(
            path,
            f"is a store of a newer tmsopt: its schema is {schema}, this version reads up to {SCHEMA}; "
            "update tmsopt or give another --store",
        )


def _header(path: Path) -> tuple[int, int]:
    """Application and schema, which never change in a store.

    Opened as what nobody changes: no lock, no journal, not a byte of another program's file touched. Where somebody
    does change it just now, or was killed at it, the file may be shorter than its first page says, which counts as
    damage but with `writable_schema`; a system that forbids that is asked again with a lock. Not opened by Python: if
    this process has the store open already, the system would drop all its locks when any other descriptor of the file
    is closed, and SQLite knows how to prevent that.
    """
    for way in ("mode=ro&immutable=1", "mode=ro"):
        with closing(sqlite3.connect(f"{path.as_uri()}?{way}", uri=True, timeout=0)) as connection:
            try:
                connection.execute("PRAGMA writable_schema=ON")
                ((application,),) = ask(connection, "PRAGMA application_id")
                ((schema,),) = ask(connection, "PRAGMA user_version")
                return application, schema
            except sqlite3.DatabaseError as error:
                if code(error) != sqlite3.SQLITE_CORRUPT or way == "mode=ro":
                    raise
    raise AssertionError("unreachable")


def create(path: Path, definition: Definition, versions: Mapping[str, str], platform: str) -> None:
    """Write a new store without rows. It gets its name when complete, so what has the name is a store."""
    about = {
        "definition": json.dumps(definition.plain), "seed": json.dumps(definition.plain.get("seed")), "created": now(),
        "host": host(), "platform": platform, "versions": json.dumps(versions),
    }  # fmt: skip
    if len(about["definition"]) > disk.LARGEST_JSON:
        message = f"takes more than {disk.LARGEST_JSON} characters to define; give the values in a CSV file"
        raise InputError([Fault(message, ("study",))])
    with disk.whole(path, locked=True) as place, closing(sqlite3.connect(place, isolation_level=None)) as connection:
        connection.execute("PRAGMA journal_mode=MEMORY")  # what is not finished is not kept
        connection.execute(f"PRAGMA application_id={APPLICATION}")
        connection.execute(f"PRAGMA user_version={_FIRST}")
        connection.executescript(f"BEGIN; {TABLES}")
        connection.executemany("INSERT INTO about VALUES (?, ?)", about.items())
        for name, values in definition.columns.items():
            packed = pack(values)
            row = (name, len(values), zlib.crc32(packed), packed)
            connection.execute("INSERT INTO columns VALUES (?, ?, ?, ?)", row)
        connection.execute("COMMIT")


def about(connection: sqlite3.Connection) -> dict[str, str]:
    """Name → text of what a store says of itself; what is no such text is left out."""
    found = ask(
        connection, f"SELECT name, substr(value, 1, {disk.LARGEST_JSON + 1}) FROM about ORDER BY rowid LIMIT 20"
    )
    return {name: value for name, value in found if isinstance(name, str) and isinstance(value, str)}


_SESSION = {"started": str, "ended": str | None, "pid": int, "host": str, "versions": str, "rows": int}


def sessions(connection: sqlite3.Connection) -> list[dict[str, Any]]:
    """Every process that wrote, in order; of very many the last ones.

    Raises:
        ValueError: for a line that none wrote.
    """
    names = ", ".join(f"substr({name}, 1, 4000)" if kind is str else name for name, kind in _SESSION.items())
    made = []
    for line in ask(connection, f"SELECT {names} FROM sessions ORDER BY id DESC LIMIT 10000"):
        for value, (name, kind) in zip(line, _SESSION.items(), strict=True):
            if not isinstance(value, kind):
                raise ValueError(f"{name} is {value!r:.60}")
        versions = disk.from_json(line[4])
        if not isinstance(versions, dict) or not all(isinstance(v, str) for v in versions.values()):
            raise ValueError(f"versions are {line[4]:.60}")
        made.append(dict(zip(_SESSION, line, strict=True)) | {"versions": versions})
    return made[::-1]


def definition(connection: sqlite3.Connection, path: Path, most: int = 0) -> Definition:
    """Of the study that a store was made for.

    Args:
        most: numbers in all columns that are read, or some millions where that is more.

    Raises:
        InputError: when it is damaged.
    """
    try:
        plain = disk.from_json(about(connection)["definition"])
        left, columns = max(_NUMBERS, most), {}
        for place, name, count in ask(connection, "SELECT rowid, substr(name, 1, 1000), count FROM columns LIMIT 1000"):
            if not isinstance(name, str) or not isinstance(count, int) or not 0 <= count <= left:
                raise ValueError(f"{count!r:.20} numbers of {name!r:.60}")
            ((packed, checksum),) = ask(connection, "SELECT doubles, checksum FROM columns WHERE rowid = ?", (place,))
            if zlib.crc32(packed) != checksum:
                raise ValueError(f"the checksum of {name}")
            columns[name], left = unpack(packed, count), left - count
        if not isinstance(plain, dict):
            raise ValueError("no table")
        return Definition(plain, columns)
    except (KeyError, TypeError, ValueError, zlib.error) as error:
        message = "the definition of its study is damaged; --fresh moves it aside and starts a new store"
        raise refuse(path, f"{message} ({error})") from error


def connect_to_write(path: Path) -> sqlite3.Connection:
    """A connection whose commits survive ``kill -9`` of this process at any moment, and power cuts.

    A rollback journal, forced to disk at every commit: it works on every file system, and what is committed is in one
    file. A commit takes some waits for the disk, so they should be few.
    """
    connection = sqlite3.connect(path, isolation_level=None, timeout=PATIENCE, check_same_thread=False)
    try:
        careful(connection)
        with suppress(sqlite3.OperationalError):  # somebody reads a store of an earlier version by its write-ahead log
            connection.execute("PRAGMA journal_mode=DELETE").fetchone()
        connection.execute("PRAGMA synchronous=FULL")
    except BaseException:
        connection.close()
        raise
    return connection


def connect_to_read(path: Path) -> sqlite3.Connection:
    """A connection that changes no row, while another process writes or none does.

    Where the folder can be written SQLite may have to finish what a killed writer began. Where it cannot, a store that
    was closed is one file that can be read as it is.
    """
    for number, way in enumerate(("mode=rw", "mode=ro", "mode=ro&immutable=1")):
        connection = sqlite3.connect(
            f"{path.as_uri()}?{way}", uri=True, isolation_level=None, timeout=0, check_same_thread=False
        )
        try:
            connection.execute("PRAGMA query_only=ON")
            check_content(connection, path)
            return connection
        except sqlite3.OperationalError as error:
            connection.close()
            denied = code(error) in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY)
            if number == 2 or not denied or (number == 1 and Path(f"{path}-wal").exists()):
                raise
        except BaseException:
            connection.close()
            raise
    raise AssertionError("unreachable")


def check_content(connection: sqlite3.Connection, path: Path) -> None:
    """That a database has the tables of a store, whole, and nothing that a query would run.

    Raises:
        InputError: when it has not.
    """
    careful(connection)
    if fault := content_fault(connection, path.stat().st_size):
        raise refuse(path, f"{DAMAGED} ({fault})")


def aside(path: Path) -> Path:
    """Move a store to ``name.1.sqlite``, or the first number that is free; the lock must be held.

    Raises:
        OSError: when it cannot be moved, e.g. while somebody reads it on Windows.
    """
    if path.exists():
        # A damaged one is moved as it is.
        with suppress(sqlite3.Error, InputError), closing(connect_to_write(path)) as connection:
            check_content(connection, path)
            # A commit clears the journal that a killed writer left; an UPDATE that changes nothing would not be one.
            ((schema,),) = ask(connection, "PRAGMA user_version")
            connection.execute(f"PRAGMA user_version={schema}")
    if not os.path.lexists(f"{path}-wal"):
        Path(f"{path}-shm").unlink(missing_ok=True)  # an index of that log alone
    return disk.aside(path, COMPANIONS)


def leftovers(path: Path) -> bool:
    """Whether journals lie beside a store that is gone: SQLite would play them into a new one of that name."""
    return any(Path(f"{path}{ending}").exists() for ending in COMPANIONS)
