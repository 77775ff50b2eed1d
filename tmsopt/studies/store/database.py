"""The file of a store: its tables, how it is made as a whole, recognised, opened and moved aside."""

import json
import sqlite3
import time
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from tmsopt import disk
from tmsopt.errors import Fault, InputError
from tmsopt.studies.store.definition import Definition, pack, unpack
from tmsopt.studies.store.provenance import host, now

APPLICATION = 0x746D736F
"""In the header of every store, where `file` and SQLite look for it: "tmso"."""

SCHEMA = 1

PATIENCE = 60.0
"""Seconds to wait for somebody who reads or writes just now."""

_TABLES = """
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE columns (name TEXT PRIMARY KEY, count INTEGER NOT NULL, checksum INTEGER NOT NULL, doubles BLOB NOT NULL);
CREATE TABLE sessions (id INTEGER PRIMARY KEY, started TEXT NOT NULL, ended TEXT, pid INTEGER NOT NULL,
    host TEXT NOT NULL, versions TEXT NOT NULL, rows INTEGER NOT NULL DEFAULT 0);
CREATE TABLE rows (number INTEGER PRIMARY KEY, status TEXT NOT NULL, checksum INTEGER NOT NULL, data TEXT NOT NULL);
CREATE INDEX by_status ON rows (status);
"""  # The index is a hundredth of the rows, and all that `done` and `counts` read.

_PAUSE = 0.001  # seconds between two questions to a store that is locked

_COMPANIONS = ("-journal", "-wal", "-shm")
"""What SQLite keeps beside a store, the last two for one of an earlier version."""

_MEANINGS = {
    sqlite3.SQLITE_FULL: "the disk is full; make room and run the same command again, the rows in the store are safe",
    sqlite3.SQLITE_IOERR: "reading or writing fails, or the disk is full; the rows in the store are safe",
    sqlite3.SQLITE_READONLY: "cannot be written; give a place that can",
    sqlite3.SQLITE_PERM: "cannot be written; give a place that can",
    sqlite3.SQLITE_CANTOPEN: "cannot be opened or written here; give a file in a folder that can be written",
    sqlite3.SQLITE_CORRUPT: "is damaged; --fresh moves it aside and starts a new store, or give another --store",
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
        raise refuse(path, f"{meaning} ({error})") from error


def code(error: sqlite3.Error) -> int:
    """SQLite's number of an error; that of a damaged file where text is no text or a table is gone; 0 for others."""
    found = getattr(error, "sqlite_errorcode", None)
    if isinstance(error, sqlite3.OperationalError) and (found is None or "no such" in str(error)):
        return sqlite3.SQLITE_CORRUPT  # Python gives no number to what it cannot decode
    return (found or 0) & 0xFF


def check(path: Path) -> None:
    """That a file is a store of this version of tmsopt or an earlier one; the file is only read.

    Raises:
        InputError: when it is not.
    """
    if not path.is_file():
        raise refuse(path, "is no regular file; give the name of a store, such as study.sqlite")
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
    with disk.whole(path, locked=True) as place, closing(sqlite3.connect(place, isolation_level=None)) as connection:
        connection.execute("PRAGMA journal_mode=MEMORY")  # what is not finished is not kept
        connection.execute(f"PRAGMA application_id={APPLICATION}")
        connection.execute(f"PRAGMA user_version={SCHEMA}")
        connection.executescript(f"BEGIN; {_TABLES}")
        connection.executemany("INSERT INTO about VALUES (?, ?)", about.items())
        for name, values in definition.columns.items():
            packed = pack(values)
            row = (name, len(values), zlib.crc32(packed), packed)
            connection.execute("INSERT INTO columns VALUES (?, ?, ?, ?)", row)
        connection.execute("COMMIT")


def definition(connection: sqlite3.Connection, path: Path) -> Definition:
    """Of the study that a store was made for.

    Raises:
        InputError: when it is damaged.
    """
    try:
        (plain,) = ask(connection, "SELECT value FROM about WHERE name = 'definition'")[0]
        columns = {}
        for name, count, checksum, packed in ask(connection, "SELECT * FROM columns ORDER BY rowid"):
            values = unpack(packed)
            if zlib.crc32(packed) != checksum or len(values) != count:
                raise ValueError(name)
            columns[name] = values
        return Definition(json.loads(plain), columns)
    except (IndexError, TypeError, ValueError, zlib.error) as error:
        message = "the definition of its study is damaged; --fresh moves it aside and starts a new store"
        raise refuse(path, f"{message} ({error})") from error


def connect_to_write(path: Path) -> sqlite3.Connection:
    """A connection whose commits survive ``kill -9`` of this process at any moment, and power cuts.

    A rollback journal, forced to disk at every commit: it works on every file system, and what is committed is in one
    file. A commit takes some waits for the disk, so they should be few.
    """
    connection = sqlite3.connect(path, isolation_level=None, timeout=PATIENCE, check_same_thread=False)
    try:
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
            ask(connection, "SELECT count(*) FROM sessions")
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


def aside(path: Path) -> Path:
    """Move a store to ``name.1.sqlite``, or the first number that is free; the lock must be held.

    Raises:
        OSError: when it cannot be moved, e.g. while somebody reads it on Windows.
    """
    if path.exists():
        with suppress(sqlite3.Error), closing(connect_to_write(path)) as connection:  # a damaged one is moved as it is
            ask(connection, "SELECT * FROM sessions")
            # A commit clears the journal that a killed writer left; an UPDATE that changes nothing would not be one.
            ((schema,),) = ask(connection, "PRAGMA user_version")
            connection.execute(f"PRAGMA user_version={schema}")
    return disk.aside(path, _COMPANIONS)


def leftovers(path: Path) -> bool:
    """Whether journals lie beside a store that is gone: SQLite would play them into a new one of that name."""
    return any(Path(f"{path}{ending}").exists() for ending in _COMPANIONS)
