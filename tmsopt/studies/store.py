"""Where the rows of a study are kept: one SQLite file with one writer and any number of readers.

A row is a line of the table ``rows``: its fields, and the numbers of its tables as little-endian doubles, named in
turn by the table ``numbers``. Rows that have been added survive ``kill -9`` of the writer. A store of an earlier
version is copied to this form when it is written, and in memory when it is read.
"""

import json
import os
import platform
import sqlite3
from array import array
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from tmsopt import files
from tmsopt.errors import Fault, InputError, input_error
from tmsopt.files import from_json, list_differences
from tmsopt.studies.old_stores import about_of, columns_of, parts_of
from tmsopt.studies.rows import BLOCK, SAVED, STATUSES, Part, column_of
from tmsopt.studies.study import Study, definition
from tmsopt.versions import installed_versions, ipopt_version

APPLICATION = 0x746D736F
"""In the header of every store, where `file` and SQLite look for it: "tmso"."""

SCHEMA = 3
"""Of the stores that are written; 1 and 2 are those of `old_stores`."""

LARGEST = 2**27
"""Bytes of one value: more than a column of the study with the most rows takes."""

_INTEGER = "INTEGER NOT NULL DEFAULT 0"
_SQL = {int: _INTEGER, bool: _INTEGER, float: "REAL DEFAULT 0", str: "TEXT NOT NULL DEFAULT ''"}
_TABLES = f"""
PRAGMA application_id={APPLICATION};
PRAGMA user_version={SCHEMA};
CREATE TABLE study (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE columns (name TEXT PRIMARY KEY, doubles BLOB NOT NULL);
CREATE TABLE numbers (header TEXT PRIMARY KEY);
CREATE TABLE sessions (id INTEGER PRIMARY KEY, started TEXT NOT NULL, ended TEXT, pid INTEGER NOT NULL,
    host TEXT NOT NULL, versions TEXT NOT NULL, rows INTEGER NOT NULL DEFAULT 0);
CREATE TABLE rows ({", ".join(f"{name} {_SQL[kind]}" for name, kind in SAVED.items())}, numbers BLOB NOT NULL,
    PRIMARY KEY (number));
"""
_SESSION = ("started", "ended", "pid", "host", "versions", "rows")
_ABSENT = b"\xff"  # eight of them are a nan
_COMPANIONS = ("-journal", "-wal", "-shm")
_PATIENCE = 60.0  # s to wait for somebody who writes just now
_MOST = 20  # differences shown
_PACKAGES = ("tmsopt", "casadi", "numpy", "scipy", "python-flint")  # that the numbers of a row depend on

DAMAGED = "is damaged; --fresh moves it aside and starts a new store, or give another --store"
_FULL = "reading or writing fails, or the disk is full; make room and run the same command again, the rows are safe"
_PLACE = "cannot be opened or written here; give a file in a folder that can be written"
_BUSY = f"another program kept it locked for {_PATIENCE:g} s; end that and run the same command again"
_MEANINGS = {
    sqlite3.SQLITE_FULL: _FULL,
    sqlite3.SQLITE_IOERR: _FULL,
    sqlite3.SQLITE_READONLY: _PLACE,
    sqlite3.SQLITE_PERM: _PLACE,
    sqlite3.SQLITE_CANTOPEN: _PLACE,
    sqlite3.SQLITE_NOTADB: "is no store of tmsopt; give another file",
    sqlite3.SQLITE_BUSY: _BUSY,
    sqlite3.SQLITE_LOCKED: _BUSY,
    sqlite3.SQLITE_PROTOCOL: "locks do not work on this file system; give a --store on another disk",
}


def refuse(path: Path, *lines: str) -> InputError:
    """The error that says these lines about a store."""
    return InputError([Fault(lines[0], file=str(path)), *(Fault(f"  {line}") for line in lines[1:])])


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn what SQLite and readers of data complain of into words of a store.

    Raises:
        InputError: for any error of the file or the place where it is.
    """
    try:
        yield
    except InputError:
        raise
    except sqlite3.DatabaseError as error:
        meaning = _MEANINGS.get(getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF, DAMAGED)
        raise refuse(path, f"{meaning} ({error!s:.200})") from error  # it may quote the file at length
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise refuse(path, f"{DAMAGED} ({error!s:.200})") from error
    except OSError as error:
        raise refuse(path, f"cannot be written: {error.strerror or error}") from error


class Store:
    """Rows of one study, open for writing (`open_store`) or reading (`view_store`); a context manager.

    Attributes:
        path: of the file.
        warnings: what the user should know, one line each: other versions of the libraries, and where ``fresh`` put the
            store that was there before.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection, ending: ExitStack, session: int = 0) -> None:
        self.path, self.warnings = path, tuple[str, ...]()
        self._connection, self._ending, self._session = connection, ending, session

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file, and give up the right to write it; a second time does nothing."""
        self._ending.close()

    def add(self, part: Part) -> None:
        """Keep rows; when it returns they are safe from ``kill -9``. A row that is there stays as it is.

        Raises:
            InputError: on a full disk.
        """
        with self._change():
            heads = dict.fromkeys(_numbers(self._connection))
            new = [h for h, x in part.items() if h not in SAVED and h not in heads and not np.isnan(x).all()]
            self._connection.executemany("INSERT INTO numbers VALUES (?)", [(head,) for head in new])
            absent = np.full(len(part["number"]), np.nan)
            table = np.column_stack([part.get(head, absent) for head in (*heads, *new)] or [absent])
            table[np.isnan(table)] = np.frombuffer(8 * _ABSENT)[0]
            doubles, size = table.astype("<f8").tobytes(), 8 * table.shape[1]
            blobs = [doubles[k : k + size].rstrip(_ABSENT) for k in range(0, len(doubles), size)]
            told = ["number", *(name for name in list(SAVED)[1:] if part[name].any())]  # the others are as by default
            lines = zip(*(part[name].tolist() for name in told), blobs, strict=True)
            query = f"INSERT OR IGNORE INTO rows ({', '.join(told)}, numbers) VALUES ({'?, ' * len(told)}?)"
            added = self._connection.executemany(query, lines).rowcount
            self._connection.execute("UPDATE sessions SET rows = rows + ? WHERE id = ?", (max(added, 0), self._session))

    @contextmanager
    def _change(self) -> Iterator[None]:
        """A transaction: all or nothing of what is done within."""
        with explained(self.path):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._connection.execute("COMMIT")
            finally:
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")

    def parts(self) -> list[Part]:
        """All rows as columns, for a `RowTable`.

        Raises:
            InputError: for a damaged store.
        """
        parts, known = list[Part](), dict[Any, Any]()  # a text that many rows have is held once
        query = f"SELECT {', '.join(SAVED)}, numbers FROM rows ORDER BY number"
        with explained(self.path), closing(self._connection.execute(query)) as found:
            while lines := found.fetchmany(BLOCK):
                *saved, blobs = zip(*lines, strict=True)
                part = {
                    name: column_of([known.setdefault(v, v) for v in values] if kind is str else values, kind)
                    for (name, kind), values in zip(SAVED.items(), saved, strict=True)
                }
                if not set(part["status"]) <= set(STATUSES):
                    raise ValueError("a row has no known status")
                heads = _numbers(self._connection)
                doubles = b"".join(blob.ljust(8 * len(heads), _ABSENT) for blob in blobs)
                table = np.frombuffer(doubles, "<f8").reshape(len(lines), len(heads)).T
                part |= {head: values.copy() for head, values in zip(heads, table, strict=True)}
                parts.append(part)
        return parts

    def done(self) -> NDArray[np.int64]:
        """The numbers of all rows, ascending."""
        with explained(self.path):
            found = self._connection.execute("SELECT number FROM rows ORDER BY number").fetchall()
        return np.array([number for (number,) in found], dtype=np.int64)

    def about(self) -> dict[str, Any]:
        """Schema, definition without its columns, seed, when, where and with which versions the store was made."""
        with explained(self.path):
            found = _pairs(self._connection, "study")
            return {"schema": SCHEMA} | found | {n: from_json(found[n]) for n in ("definition", "seed", "versions")}

    def sessions(self) -> list[dict[str, Any]]:
        """Every process that wrote, in order: started, ended (None where killed), pid, host, versions, rows added."""
        with explained(self.path):
            found = self._connection.execute(f"SELECT {', '.join(_SESSION)} FROM sessions ORDER BY id").fetchall()
            made = [dict(zip(_SESSION, line, strict=True)) for line in found]
            return [session | {"versions": dict(from_json(session["versions"]))} for session in made]

    def forget(self, numbers: Iterable[int]) -> None:
        """Remove rows, so that they are solved again."""
        with self._change():
            self._connection.executemany("DELETE FROM rows WHERE number = ?", [(int(number),) for number in numbers])


def open_store(path: Path | str, study: Study, *, fresh: bool = False) -> Store:
    """Open the store of a study for writing; made if absent.

    Args:
        fresh: move a store that is there aside, to ``name.1.sqlite`` or the next number, and start a new one.

    Raises:
        InputError: when the store holds another study (with the differences), another process writes it, the file is
            no store, is damaged or of a newer tmsopt, or the place cannot be written.
    """
    path, schema = _examined(path)
    with explained(path), ExitStack() as undo:
        lock, moved = FileLock(f"{path}.lock", timeout=0), list[str]()
        try:
            lock.acquire()
        except Timeout:
            raise refuse(path, _holder(path) if os.path.lexists(lock.lock_file) else _PLACE) from None
        undo.callback(_release, lock)
        if fresh and schema:
            with suppress(sqlite3.Error), closing(_connect(path, "rw")) as old:  # a damaged one is moved as it is
                old.execute("PRAGMA journal_mode=DELETE")
        if (fresh and schema) or (not schema and any(Path(f"{path}{ending}").exists() for ending in _COMPANIONS)):
            moved, schema = [f"moved the old store to {files.move_aside(path, _COMPANIONS)}"], 0
        if not schema:
            with _written(path) as new:
                _create(new, *_described(study))
        check_same(path, study)  # what is refused is not changed
        if 0 < schema < SCHEMA:
            with closing(_connect(path, "rw")) as old, _written(path) as new:
                old.execute("PRAGMA journal_mode=DELETE")
                _copy(old, new)
        connection = undo.enter_context(closing(_connect(path, "rw")))
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("PRAGMA synchronous=NORMAL")  # safe from kill -9
        today = _versions()
        line = (_now(), os.getpid(), platform.node(), json.dumps(today))
        query = "INSERT INTO sessions (started, pid, host, versions) VALUES (?, ?, ?, ?)"
        session = connection.execute(query, line).lastrowid or 0
        undo.callback(_end, connection, session)
        store = Store(path, connection, undo, session)
        earlier = [then["versions"] for then in store.sessions() if then["rows"] > 0]
        changed = [line for then in earlier for line in list_differences(then, today, ("in the store", "now"))]
        store.warnings, store._ending = tuple(dict.fromkeys(changed + moved)), undo.pop_all()
        return store


def view_store(path: Path | str) -> Store:
    """Open a store for reading, also while another process writes it.

    Raises:
        InputError: when there is no such file, or it is no store of tmsopt.
    """
    path, schema = _examined(path)
    if not schema:
        raise refuse(path, "no such file")
    with explained(path), ExitStack() as undo:
        connection = undo.enter_context(closing(_connect(path, "ro")))
        _check_content(connection, path)
        if schema < SCHEMA:
            old, connection = connection, undo.enter_context(closing(sqlite3.connect(":memory:", isolation_level=None)))
            _copy(old, connection)
        return Store(path, connection, undo.pop_all())


def check_same(path: Path | str, study: Study) -> None:
    """Check that a store, if there is one, is of this study.

    Raises:
        InputError: with the differences where it is not; where it is no store, or damaged.
    """
    path, schema = _examined(path)
    if not schema:
        return
    with view_store(path) as store, explained(path):
        there = _pairs(store._connection, "study"), _pairs(store._connection, "columns")
        known, asked = (
            from_json(about["definition"]) | {"columns": {name: array("d", x) for name, x in columns.items()}}
            for about, columns in (there, _described(study))
        )
        found = list(list_differences(known, asked, ("in the store", "in the file")))
    if found:
        more = [f"and {len(found) - _MOST} more"] if len(found) > _MOST else []
        advice = "to keep it and start a new store, add --fresh, which moves this one aside; or give another --store"
        raise refuse(path, f"holds the rows of another study; {advice}. What differs:", *found[:_MOST], *more)


def _described(study: Study) -> tuple[dict[str, str], dict[str, bytes]]:
    """What a new store says of itself and its study, and the columns of that as little-endian doubles."""
    plain = definition(study, lambda values: np.asarray(values, dtype="<f8").tobytes())
    kept = plain.pop("columns", {})
    about = {
        "definition": json.dumps(plain),
        "seed": json.dumps(plain["seed"]),
        "created": _now(),
        "host": platform.node(),
        "platform": platform.platform(),
        "versions": json.dumps(_versions()),
    }
    if len(about["definition"]) > files.LARGEST_JSON:
        message = f"takes more than {files.LARGEST_JSON} characters to define; give the values in a CSV file"
        raise input_error(message, "study")
    return about, kept


def _create(connection: sqlite3.Connection, about: Mapping[str, str], kept: Mapping[str, bytes]) -> None:
    """Make an empty store."""
    connection.executescript(_TABLES)
    for table, pairs in (("study", about), ("columns", kept)):
        connection.executemany(f"INSERT INTO {table} VALUES (?, ?)", pairs.items())


def _copy(old: sqlite3.Connection, new: sqlite3.Connection) -> None:
    """Copy a store of an earlier version to an empty database."""
    _create(new, about_of(old), columns_of(old))
    store = Store(Path("copy"), new, ExitStack())
    with closing(parts_of(old)) as parts:
        for part in parts:
            store.add(part)
    sessions = old.execute(f"SELECT {', '.join(_SESSION)} FROM sessions ORDER BY id").fetchall()
    new.executemany(f"INSERT INTO sessions ({', '.join(_SESSION)}) VALUES (?, ?, ?, ?, ?, ?)", sessions)


@contextmanager
def _written(path: Path) -> Iterator[sqlite3.Connection]:
    """An empty database that takes the place of a path if all went well; the lock must be held."""
    with files.write_atomic(path, locked=True) as place, closing(_connect(place, "rwc")) as connection:
        yield connection


def _end(connection: sqlite3.Connection, session: int) -> None:
    with suppress(sqlite3.Error):  # on a full disk there is a better error than this one
        connection.execute("UPDATE sessions SET ended = ? WHERE id = ?", (_now(), session))
        connection.execute("PRAGMA journal_mode=DELETE")  # one plain file, unless somebody reads it


def _release(lock: FileLock) -> None:
    with suppress(OSError):
        Path(lock.lock_file).unlink()  # while it is held; Windows keeps an open file
    lock.release()


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    connection = sqlite3.connect(f"{path.as_uri()}?mode={mode}", uri=True, timeout=_PATIENCE, isolation_level=None)
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST)
    connection.execute("PRAGMA trusted_schema=OFF")
    return connection


def _examined(given: Path | str) -> tuple[Path, int]:
    """The path of a store, and its schema; 0 where there is none.

    Raises:
        InputError: for a place where none can be, another file, and the store of a newer tmsopt.
    """
    path = Path(os.path.realpath(given))  # a link's lock is that of the store
    if not path.parent.is_dir():
        raise refuse(path, f"the folder {path.parent} does not exist; make it, or give another --store")
    if not os.path.lexists(path):
        return path, 0
    if not path.is_file():
        raise refuse(path, "is no regular file; give the name of a store, such as study.sqlite")
    with explained(path), closing(_connect(path, "ro")) as connection:
        connection.execute("PRAGMA writable_schema=ON")  # or a file that was cut off is no store at all
        ((application,),) = connection.execute("PRAGMA application_id")
        ((schema,),) = connection.execute("PRAGMA user_version")
    if application != APPLICATION or schema < 1:
        raise refuse(path, _MEANINGS[sqlite3.SQLITE_NOTADB])
    if schema > SCHEMA:
        message = f"is a store of a newer tmsopt: its schema is {schema}, this version reads up to {SCHEMA}"
        raise refuse(path, f"{message}; update tmsopt or give another --store")
    return path, schema


def _check_content(connection: sqlite3.Connection, path: Path) -> None:
    """Check that a store has tables alone, which run nothing, and that its pages are whole."""
    query = "SELECT type, name FROM sqlite_schema WHERE type NOT IN ('table', 'index') OR sql LIKE '%VIRTUAL%' LIMIT 1"
    for kind, name in connection.execute(query):
        raise refuse(path, f"{DAMAGED} (its {kind} '{name!s:.60}' is not that of a store)")
    ((whole,),) = connection.execute("PRAGMA quick_check(1)")
    if whole != "ok":
        raise refuse(path, f"{DAMAGED} ({whole!s:.200})")


def _holder(path: Path) -> str:
    """Who writes a store just now, as the store tells it."""
    who = "another process, which has only just begun,"
    with suppress(InputError, IndexError), view_store(path) as store:  # it may be moved aside just now
        last = store.sessions()[-1]
        if last["ended"] is None:
            who = f"process {last['pid']} on {last['host']}, since {last['started']},"
    return f"{who} writes this store; wait for it or end it, or give another --store"


def _pairs(connection: sqlite3.Connection, table: str) -> dict[str, Any]:
    return dict(connection.execute(f"SELECT * FROM {table} ORDER BY rowid").fetchall())


def _numbers(connection: sqlite3.Connection) -> list[str]:
    """Headers of the numbers of a row, in their order."""
    return [header for (header,) in connection.execute("SELECT header FROM numbers ORDER BY rowid")]


def _now() -> str:
    """The time in UTC, ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def _versions() -> dict[str, str]:
    """Of tmsopt, Python, the libraries that solve, and IPOPT where its file tells; nothing is imported for it."""
    found = {"python": platform.python_version(), **installed_versions(_PACKAGES), "ipopt": ipopt_version()}
    return {name: version or "unknown" for name, version in found.items()}
