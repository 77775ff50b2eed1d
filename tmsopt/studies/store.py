"""The store of a study: one SQLite file with one writer and any number of readers.

A row of the study is a line of the table ``rows``. The line has the fields with one value; all other numbers follow as
little-endian doubles, whose headers are in the table ``numbers``. Added rows survive ``kill -9`` of the writer. A
store of an earlier version is converted when it is opened for writing; when it is only read, it is converted in
memory.
"""

import json
import os
import platform
import sqlite3
import zlib
from array import array
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from sys import intern
from typing import Any

import numpy as np
from filelock import FileLock, Timeout

from tmsopt import files
from tmsopt.errors import Fault, InputError, input_error
from tmsopt.files import from_json, list_differences
from tmsopt.studies.old_stores import read_batches, read_columns
from tmsopt.studies.rows import CHUNK_ROWS, SCALAR_FIELDS, STATUSES, Batch, column_of
from tmsopt.studies.study import Study, definition
from tmsopt.versions import installed_versions, ipopt_version

APPLICATION = 0x746D736F
"""Application id in the SQLite header of every store: "tmso"."""

SCHEMA = 3
"""Schema of new stores; `old_stores` reads the schemas 1 and 2."""

MAX_VALUE_BYTES = 2**27
"""Largest number of bytes of one value in SQLite; a column of the largest possible study has fewer bytes."""

_INTEGER = "INTEGER NOT NULL DEFAULT 0"
_SQL_TYPES = {int: _INTEGER, bool: _INTEGER, float: "REAL DEFAULT 0", str: "TEXT NOT NULL DEFAULT ''"}
_TABLES = f"""
PRAGMA application_id={APPLICATION};
PRAGMA user_version={SCHEMA};
CREATE TABLE study (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE columns (name TEXT PRIMARY KEY, doubles BLOB NOT NULL);
CREATE TABLE numbers (header TEXT PRIMARY KEY);
CREATE TABLE sessions (id INTEGER PRIMARY KEY, started TEXT NOT NULL, ended TEXT, pid INTEGER NOT NULL,
    host TEXT NOT NULL, versions TEXT NOT NULL, rows INTEGER NOT NULL DEFAULT 0);
CREATE TABLE rows ({", ".join(f"{name} {_SQL_TYPES[kind]}" for name, kind in SCALAR_FIELDS.items())},
    numbers BLOB NOT NULL, PRIMARY KEY (number));
"""
# Names of the columns of the tables `sessions` and `rows`.
_SESSION_COLUMNS = "started, ended, pid, host, versions, rows"
_ROW_COLUMNS = ", ".join((*SCALAR_FIELDS, "numbers"))
_STUDY_TABLES = ("study", "columns")  # tables that describe the study
_MAKE_ONE_FILE = "PRAGMA journal_mode=DELETE"  # no second file, unless another process reads the store
_NAN_BYTE = b"\xff"  # eight of these bytes are a nan
_COMPANION_ENDINGS = ("-journal", "-wal", "-shm")  # endings of files that SQLite writes next to the store
_LOCK_SECONDS = 60.0  # longest time to wait for a lock of another process
_MAX_DIFFERENCES = 20  # largest number of differences that are listed
_PACKAGES = ("tmsopt", "casadi", "numpy", "scipy", "python-flint")  # packages that affect the numbers of a row

_DAMAGED = "is damaged; --fresh moves it aside and starts a new store, or give another --store"
_DISK_FULL = "cannot be read or written, or the disk is full; make room and run the command again; saved rows are safe"
_NOT_WRITABLE = "cannot be opened or written here; give a file in a writable folder"
_LOCKED = f"another program kept the store locked for {_LOCK_SECONDS:g} s; end that program and run the command again"
_MESSAGE_BY_CODE = {
    sqlite3.SQLITE_FULL: _DISK_FULL,
    sqlite3.SQLITE_IOERR: _DISK_FULL,
    sqlite3.SQLITE_READONLY: _NOT_WRITABLE,
    sqlite3.SQLITE_PERM: _NOT_WRITABLE,
    sqlite3.SQLITE_CANTOPEN: _NOT_WRITABLE,
    sqlite3.SQLITE_NOTADB: "is not a store of tmsopt; give another file",
    sqlite3.SQLITE_BUSY: _LOCKED,
    sqlite3.SQLITE_LOCKED: _LOCKED,
    sqlite3.SQLITE_PROTOCOL: "locks do not work on this file system; give a --store on another disk",
}
"""Error code of SQLite → message."""


def store_error(path: Path, *lines: str) -> InputError:
    """An error about a store, with these lines as its message."""
    return InputError([Fault(lines[0], file=str(path)), *(Fault(f"  {line}") for line in lines[1:])])


@contextmanager
def translate_errors(path: Path) -> Iterator[None]:
    """Translate errors of SQLite, data and files into an `InputError` about a store.

    Raises:
        InputError: for any error of the file or its folder.
    """
    try:
        yield
    except InputError:
        raise
    except sqlite3.DatabaseError as error:
        message = _MESSAGE_BY_CODE.get(getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF, _DAMAGED)
        raise store_error(path, f"{message} ({error!s:.200})") from error  # short, because the error may quote the file
    except (AttributeError, KeyError, TypeError, ValueError, zlib.error) as error:
        raise store_error(path, f"{_DAMAGED} ({error!s:.200})") from error
    except OSError as error:
        raise store_error(path, f"cannot be written: {error.strerror or error}") from error


@dataclass(frozen=True)
class Store:
    """Rows of one study, open for writing (`open_store`) or reading (`view_store`).

    Attributes:
        path: path of the file.
        warnings: lines about changed versions of libraries, and about the file to which ``fresh`` moved the old store.
    """

    path: Path
    _connection: sqlite3.Connection
    _session: int = 0
    warnings: tuple[str, ...] = ()

    def add(self, batch: Batch) -> None:
        """Add rows; they survive ``kill -9`` after the call. An existing row stays unchanged.

        Raises:
            InputError: on a full disk.
        """
        with self._transaction() as connection:
            heads = dict.fromkeys(_read_headers(connection))
            new_heads = [h for h, x in batch.items() if h not in {*SCALAR_FIELDS, *heads} and not np.isnan(x).all()]
            connection.executemany("INSERT INTO numbers VALUES (?)", [(head,) for head in new_heads])
            blanks = np.full(len(batch["number"]), np.nan)
            table = np.column_stack([batch.get(head, blanks) for head in (*heads, *new_heads)] or [blanks])
            table[np.isnan(table)] = np.frombuffer(8 * _NAN_BYTE)[0]
            doubles, size = table.astype("<f8").tobytes(), 8 * table.shape[1]
            blobs = [doubles[k : k + size].rstrip(_NAN_BYTE) for k in range(0, len(doubles), size)]
            lines = zip(*(batch[name].tolist() for name in SCALAR_FIELDS), blobs, strict=True)
            query = f"INSERT OR IGNORE INTO rows ({_ROW_COLUMNS}) VALUES ({'?, ' * len(SCALAR_FIELDS)}?)"
            added = connection.executemany(query, lines).rowcount
            connection.execute("UPDATE sessions SET rows = rows + ? WHERE id = ?", (max(added, 0), self._session))

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        """A transaction, which any error rolls back."""
        with translate_errors(self.path), self._connection as connection:
            connection.execute("BEGIN IMMEDIATE")
            yield connection

    def read_batches(self) -> list[Batch]:
        """Read all rows as columns, for a `RowTable`.

        Raises:
            InputError: for a damaged store.
        """
        batches = list[Batch]()
        query = f"SELECT {_ROW_COLUMNS} FROM rows ORDER BY number"
        with translate_errors(self.path), closing(self._connection.execute(query)) as cursor:
            while lines := cursor.fetchmany(CHUNK_ROWS):
                *saved, blobs = zip(*lines, strict=True)
                batch = {
                    name: column_of([*map(intern, values)] if kind is str else values, kind)  # equal texts share memory
                    for (name, kind), values in zip(SCALAR_FIELDS.items(), saved, strict=True)
                }
                if not set(batch["status"]) <= set(STATUSES):
                    raise ValueError("a row has an unknown status")
                heads = _read_headers(self._connection)
                doubles = b"".join(blob.ljust(8 * len(heads), _NAN_BYTE) for blob in blobs)
                table = np.frombuffer(doubles, "<f8").reshape(len(lines), len(heads)).T
                batches.append(batch | {head: values.copy() for head, values in zip(heads, table, strict=True)})
        return batches

    def about(self) -> dict[str, Any]:
        """Schema, seed and definition of the study without columns; time, machine and versions of its first writer."""
        with translate_errors(self.path):
            pairs = _read_pairs(self._connection, "study")
            return {"schema": SCHEMA} | pairs | {n: from_json(pairs[n]) for n in ("definition", "seed", "versions")}

    def sessions(self) -> list[dict[str, Any]]:
        """Each process that wrote rows, in order: started, ended (None if killed), pid, host, versions, added rows."""
        with translate_errors(self.path):
            lines = self._connection.execute(f"SELECT {_SESSION_COLUMNS} FROM sessions ORDER BY id").fetchall()
            sessions = [dict(zip(_SESSION_COLUMNS.split(", "), line, strict=True)) for line in lines]
            return [session | {"versions": dict(from_json(session["versions"]))} for session in sessions]

    def forget(self, numbers: Iterable[int]) -> None:
        """Remove rows, so that they are solved again."""
        with self._transaction() as connection:
            connection.executemany("DELETE FROM rows WHERE number = ?", [(int(number),) for number in numbers])


@contextmanager
def open_store(path: Path | str, study: Study, *, fresh: bool = False) -> Iterator[Store]:
    """Open the store of a study for writing; create it if it does not exist. It is locked until the context ends.

    Args:
        fresh: move an existing store to ``name.1.sqlite``, or the next free number, and start a new one.

    Raises:
        InputError: if the store belongs to another study (with the differences), if another process writes it, if the
            file is not a store, is damaged or comes from a newer tmsopt, or if the folder is not writable.
    """
    path, schema = _inspect_path(path)
    with ExitStack() as stack:
        with translate_errors(path):
            warnings = []
            stack.enter_context(_lock(path))
            if fresh and schema:
                with suppress(sqlite3.Error), closing(_connect(path, "rw")) as old:  # a damaged store is moved as it is
                    old.execute(_MAKE_ONE_FILE)
                schema = 0
            if not schema:
                if any(os.path.lexists(f"{path}{suffix}") for suffix in ("", *_COMPANION_ENDINGS)):
                    warnings.append(f"moved the old store to {files.move_aside(path, _COMPANION_ENDINGS)}")
                with _replace_database(path) as new:
                    _create_tables(new, *_describe_study(study))
            check_same_study(path, study)  # before the store is changed
            if 0 < schema < SCHEMA:
                with closing(_connect(path, "rw")) as old, _replace_database(path) as new:
                    old.execute(_MAKE_ONE_FILE)
                    _copy_store(old, new)
            connection = stack.enter_context(closing(_connect(path, "rw")))
            connection.execute("PRAGMA journal_mode=WAL")
            connection.execute("PRAGMA synchronous=NORMAL")  # safe from kill -9
            versions = _versions()
            sides, sessions = ("in the store", "now"), Store(path, connection).sessions()
            changes = [line for s in sessions if s["rows"] for line in list_differences(s["versions"], versions, sides)]
            line = (_format_now(), os.getpid(), platform.node(), json.dumps(versions))
            query = "INSERT INTO sessions (started, pid, host, versions) VALUES (?, ?, ?, ?)"
            session = connection.execute(query, line).lastrowid or 0
            stack.callback(_end_session, connection, session)
        yield Store(path, connection, session, tuple(dict.fromkeys(changes + warnings)))


@contextmanager
def view_store(path: Path | str) -> Iterator[Store]:
    """Open a store for reading; another process may write it at the same time.

    Raises:
        InputError: if there is no such file, or it is not a store of tmsopt.
    """
    path, schema = _inspect_path(path)
    if not schema:
        raise store_error(path, "no such file")
    with ExitStack() as stack:
        with translate_errors(path):
            connection = stack.enter_context(closing(_connect(path, "ro")))
            _check_content(connection, path)
            if schema < SCHEMA:
                old, connection = connection, stack.enter_context(closing(_connect(path, "memory")))
                _copy_store(old, connection)
        yield Store(path, connection)


def check_same_study(path: Path | str, study: Study) -> None:
    """Check that an existing store belongs to this study.

    Raises:
        InputError: with the differences, if it does not; also if the file is not a store or is damaged.
    """
    with view_store(path) as store, translate_errors(store.path):
        old, new = (
            from_json(about["definition"]) | {"columns": {name: array("d", x) for name, x in columns.items()}}
            for about, columns in ([_read_pairs(store._connection, n) for n in _STUDY_TABLES], _describe_study(study))
        )
        differences = list(list_differences(old, new, ("in the store", "in the file")))
        if differences:
            unlisted = len(differences) - _MAX_DIFFERENCES
            remainder = [f"and {unlisted} more"] if unlisted > 0 else []
            advice = "add --fresh to move it aside and start a new store, or give another --store"
            message = f"holds the rows of another study; {advice}. Differences:"
            raise store_error(store.path, message, *differences[:_MAX_DIFFERENCES], *remainder)


def _describe_study(study: Study) -> tuple[dict[str, str], dict[str, bytes]]:
    """The metadata of a new store, and the columns of the study as little-endian doubles."""
    plain = definition(study, lambda values: np.asarray(values, dtype="<f8").tobytes())
    columns = plain.pop("columns", {})
    about = {
        "definition": json.dumps(plain),
        "seed": json.dumps(plain["seed"]),
        "created": _format_now(),
        "host": platform.node(),
        "platform": platform.platform(),
        "versions": json.dumps(_versions()),
    }
    if len(about["definition"]) > files.MAX_JSON_CHARACTERS:
        message = f"its definition has more than {files.MAX_JSON_CHARACTERS} characters; give the values in a CSV file"
        raise input_error(message, "study")
    return about, columns


def _create_tables(connection: sqlite3.Connection, about: Mapping[str, str], columns: Mapping[str, bytes]) -> None:
    """Create the tables of an empty store."""
    connection.executescript(_TABLES)
    for table, pairs in zip(_STUDY_TABLES, (about, columns), strict=True):
        connection.executemany(f"INSERT INTO {table} VALUES (?, ?)", pairs.items())


def _copy_store(old: sqlite3.Connection, new: sqlite3.Connection) -> None:
    """Copy a store of an earlier version to an empty database."""
    _create_tables(new, _read_pairs(old, "about"), read_columns(old))
    store = Store(Path("copy"), new)
    with closing(read_batches(old)) as batches:  # an open cursor would keep the file locked
        for batch in batches:
            store.add(batch)
    sessions = old.execute(f"SELECT {_SESSION_COLUMNS} FROM sessions ORDER BY id").fetchall()
    new.executemany(f"INSERT INTO sessions ({_SESSION_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?)", sessions)


@contextmanager
def _replace_database(path: Path) -> Iterator[sqlite3.Connection]:
    """An empty database that replaces the file at a path on success; the caller must hold the lock."""
    with files.write_atomic(path, is_locked=True) as temporary, closing(_connect(temporary, "rwc")) as connection:
        yield connection


def _end_session(connection: sqlite3.Connection, session: int) -> None:
    with suppress(sqlite3.Error):  # a full disk has already raised a better error
        connection.execute("UPDATE sessions SET ended = ? WHERE id = ?", (_format_now(), session))
        connection.execute(_MAKE_ONE_FILE)


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Lock the store, so that there is only one writer."""
    lock = FileLock(f"{path}.lock", timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise store_error(path, _describe_writer(path) if os.path.lexists(lock.lock_file) else _NOT_WRITABLE) from None
    try:
        yield
    finally:
        with suppress(OSError):
            # The file is removed before the lock is released. On Windows this fails, because the file is open.
            Path(lock.lock_file).unlink()
        lock.release()


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    connection = sqlite3.connect(f"{path.as_uri()}?mode={mode}", uri=True, timeout=_LOCK_SECONDS, isolation_level=None)
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_VALUE_BYTES)
    connection.execute("PRAGMA trusted_schema=OFF")
    return connection


def _inspect_path(location: Path | str) -> tuple[Path, int]:
    """The path of a store, and its schema; the schema is 0 if there is no store.

    Raises:
        InputError: for a missing folder, a file that is not a store, or a store of a newer tmsopt.
    """
    path = Path(os.path.realpath(location))  # a link and its store share one lock
    if not path.parent.is_dir():
        raise store_error(path, f"the folder {path.parent} does not exist; make it, or give another --store")
    if not os.path.lexists(path):
        return path, 0
    if not path.is_file():
        raise store_error(path, "is not a regular file; give the name of a store, such as study.sqlite")
    with translate_errors(path), closing(_connect(path, "ro")) as connection:
        connection.execute("PRAGMA writable_schema=ON")  # so that a truncated file is still recognised
        ((application,),) = connection.execute("PRAGMA application_id")
        ((schema,),) = connection.execute("PRAGMA user_version")
    if application != APPLICATION or schema < 1:
        raise store_error(path, _MESSAGE_BY_CODE[sqlite3.SQLITE_NOTADB])
    if schema > SCHEMA:
        message = f"is a store of a newer tmsopt: its schema is {schema}, this version reads up to {SCHEMA}"
        raise store_error(path, f"{message}; update tmsopt or give another --store")
    return path, schema


def _check_content(connection: sqlite3.Connection, path: Path) -> None:
    """Check that a store has only plain tables, which cannot execute code, and that its pages are intact."""
    query = "SELECT type, name FROM sqlite_schema WHERE type NOT IN ('table', 'index') OR sql LIKE '%VIRTUAL%' LIMIT 1"
    for kind, name in connection.execute(query):
        raise store_error(path, f"{_DAMAGED} (a store has no {kind} '{name!s:.60}')")
    ((result,),) = connection.execute("PRAGMA quick_check(1)")
    if result != "ok":
        raise store_error(path, f"{_DAMAGED} ({result!s:.200})")


def _describe_writer(path: Path) -> str:
    """The message that names the process which writes a store, and says what to do."""
    writer = "another process, which has just started,"
    with suppress(InputError, IndexError), view_store(path) as store:  # the store may be moved at this moment
        session = store.sessions()[-1]
        if session["ended"] is None:
            writer = f"process {session['pid']} on {session['host']}, since {session['started']},"
    return f"{writer} writes this store; wait until it ends, or end it, or give another --store"


def _read_pairs(connection: sqlite3.Connection, table: str) -> dict[str, Any]:
    return dict(connection.execute(f"SELECT * FROM {table} ORDER BY rowid").fetchall())


def _read_headers(connection: sqlite3.Connection) -> list[str]:
    """Headers of the numbers of a row, in their order."""
    return [header for (header,) in connection.execute("SELECT header FROM numbers ORDER BY rowid")]


def _format_now() -> str:
    """The current time in UTC, in the format ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def _versions() -> dict[str, str]:
    """Versions of tmsopt, Python, the numerical libraries, and IPOPT if its file shows it. Nothing is imported."""
    versions = {"python": platform.python_version(), **installed_versions(_PACKAGES), "ipopt": ipopt_version()}
    return {name: version or "unknown" for name, version in versions.items()}
