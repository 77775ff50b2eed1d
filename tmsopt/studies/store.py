"""Where the rows of a study are kept: one SQLite file with one writer and any number of readers.

A row is a line of the table ``rows`` with a column for each of its numbers. Rows that have been added survive
``kill -9`` of the writer. A store of an earlier version is copied to this form when it is written, and in memory when
it is read.
"""

import json
import os
import platform
import sqlite3
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from datetime import UTC, datetime
from itertools import repeat
from pathlib import Path
from typing import Any, Self

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from tmsopt import files
from tmsopt.errors import Fault, InputError
from tmsopt.files import differences, from_json
from tmsopt.studies.old_stores import about_of, columns_of, parts_of
from tmsopt.studies.rows import FIELDS, PREFIXES, STATUSES, Part, PartialColumn, Row, columns, full
from tmsopt.studies.study import Study, definition
from tmsopt.versions import installed, ipopt

APPLICATION = 0x746D736F
"""In the header of every store, where `file` and SQLite look for it: "tmso"."""

SCHEMA = 3
"""Of the stores that are written; 1 and 2 are those of `old_stores`."""

LARGEST = 2**27
"""Bytes of one value: more than a column of the study with the most rows takes."""

_TABLES = """
CREATE TABLE study (key TEXT PRIMARY KEY, value NOT NULL);
CREATE TABLE sessions (id INTEGER PRIMARY KEY, started TEXT NOT NULL, ended TEXT, pid INTEGER NOT NULL,
    host TEXT NOT NULL, versions TEXT NOT NULL, rows INTEGER NOT NULL DEFAULT 0);
CREATE TABLE rows (number INTEGER PRIMARY KEY);
CREATE TABLE headers (name TEXT PRIMARY KEY, header TEXT NOT NULL);
"""
_SQL = {int: "INTEGER", bool: "INTEGER", float: "REAL", str: "TEXT"}
_COLUMN = "column "  # begins the key of a column of the study
_COMPANIONS = ("-journal", "-wal", "-shm")
_PATIENCE = 60.0  # s to wait for somebody who writes just now
_CHUNK = 10_000  # rows read at once
_MOST = 20  # differences shown
_PACKAGES = ("tmsopt", "casadi", "numpy", "scipy", "python-flint")  # that the numbers of a row depend on

DAMAGED = "is damaged; --fresh moves it aside and starts a new store, or give another --store"
_MEANINGS = {
    sqlite3.SQLITE_FULL: "the disk is full; make room and run the same command again, the rows in the store are safe",
    sqlite3.SQLITE_IOERR: "reading or writing fails, or the disk is full; the rows in the store are safe",
    sqlite3.SQLITE_READONLY: "cannot be written; give a place that can",
    sqlite3.SQLITE_PERM: "cannot be written; give a place that can",
    sqlite3.SQLITE_CANTOPEN: "cannot be opened or written here; give a file in a folder that can be written",
    sqlite3.SQLITE_CORRUPT: DAMAGED,
    sqlite3.SQLITE_TOOBIG: DAMAGED,
    sqlite3.SQLITE_NOTADB: "is no store of tmsopt; give another file",
    sqlite3.SQLITE_BUSY: f"another program kept it locked for {_PATIENCE:g} s; end that and run the same command again",
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
        code = getattr(error, "sqlite_errorcode", None)
        if code is None or "no such" in str(error):  # text that is none, a table that is gone
            code = sqlite3.SQLITE_CORRUPT
        meaning = _MEANINGS.get(code & 0xFF)
        if meaning is None:
            raise
        raise refuse(path, f"{meaning} ({error!s:.200})") from error  # it may quote the file at length
    except (KeyError, TypeError, ValueError) as error:
        raise refuse(path, f"{DAMAGED} ({error!s:.200})") from error


class Store:
    """Rows of one study, open for writing (`open_store`) or reading (`read_store`); a context manager.

    Attributes:
        path: of the file.
        warnings: what the user should know, one line each, such as other versions of the libraries.
        moved: where ``fresh`` put the store that was there before.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection, lock: FileLock | None = None) -> None:
        self.path, self.warnings = path, tuple[str, ...]()
        self.moved: Path | None = None
        self._connection, self._session, self._lock = connection, 0, lock
        self._headers = _headers(connection)  # header → name of its column

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file, and give up the right to write it; a second time does nothing."""
        if self._session:
            with suppress(sqlite3.Error):  # on a full disk there is a better error than this one
                self._connection.execute("UPDATE sessions SET ended = ? WHERE id = ?", (_now(), self._session))
                self._connection.execute("PRAGMA journal_mode=DELETE")  # one plain file, unless somebody reads it
        lock, self._session, self._lock = self._lock, 0, None
        self._connection.close()
        if lock is not None:
            _release(lock)

    def add(self, rows: Iterable[Row]) -> None:
        """Keep rows; when it returns they are safe from ``kill -9``. A row that is there stays as it is.

        Raises:
            InputError: on a full disk.
        """
        self.add_part(columns(rows))

    def add_part(self, part: Part) -> None:
        """Keep rows that are columns likewise, but for what follows from the study or the other columns."""
        ends = ("stable", PREFIXES["varied"])
        kept = {head: c for head, c in part.items() if not head.startswith(ends) and c.present.any()}
        if not kept:
            return
        with self._change():
            names = ", ".join(self._name(head) for head in kept)
            query = f"INSERT OR IGNORE INTO rows ({names}) VALUES ({', '.join(repeat('?', len(kept)))})"
            lines = zip(*(_values(*named) for named in kept.items()), strict=True)
            new = self._connection.executemany(query, lines).rowcount
            self._connection.execute("UPDATE sessions SET rows = rows + ? WHERE id = ?", (max(new, 0), self._session))

    def _name(self, head: str) -> str:
        """The column of a header, made if it is not there; SQLite does not tell small letters from capitals."""
        if head not in self._headers:
            name, used = head, {known.lower() for known in self._headers.values()}
            while name.lower() in used:
                name += "'"
            kind = _SQL[FIELDS.get(head, float)]
            self._connection.execute(f"ALTER TABLE rows ADD COLUMN {_quoted(name)} {kind}")
            self._connection.execute("INSERT INTO headers VALUES (?, ?)", (name, head))
            self._headers[head] = name
        return _quoted(self._headers[head])

    @contextmanager
    def _change(self) -> Iterator[None]:
        """A transaction: all or nothing of what is done within."""
        with explained(self.path):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")
                self._headers = _headers(self._connection)
                raise

    def parts(self) -> list[Part]:
        """All rows as columns, for a `RowTable`.

        Raises:
            InputError: for a damaged store.
        """
        with explained(self.path):
            heads = _headers(self._connection)
            used = {
                head: name
                for head, name in heads.items()
                if self._connection.execute(f"SELECT 1 FROM rows WHERE {_quoted(name)} IS NOT NULL LIMIT 1").fetchone()
            }
            names = ", ".join(map(_quoted, used.values())) or "number"
            parts = list[Part]()
            with closing(self._connection.execute(f"SELECT {names} FROM rows ORDER BY number")) as found:
                while lines := found.fetchmany(_CHUNK):
                    named = zip(used, zip(*lines, strict=True), strict=True)
                    parts.append({head: _column(head, values) for head, values in named})
        return parts

    def done(self) -> NDArray[np.int64]:
        """The numbers of all rows, ascending."""
        with explained(self.path):
            found = self._connection.execute("SELECT number FROM rows ORDER BY number").fetchall()
        return np.array([number for (number,) in found], dtype=np.int64)

    def counts(self) -> dict[str, int]:
        """Status → rows that have it, in the order of `STATUSES`; none that no row has."""
        with explained(self.path):
            if "status" not in _headers(self._connection):
                return {}
            found = dict(self._connection.execute("SELECT status, count(*) FROM rows GROUP BY status").fetchall())
        return {status: found[status] for status in STATUSES if status in found}

    def definition(self) -> dict[str, Any]:
        """The study as plain data; numbers in columns as lists."""
        with explained(self.path):
            plain, kept = _definition(self._connection)
        return plain | ({"columns": {name: values.tolist() for name, values in kept.items()}} if kept else {})

    def about(self) -> dict[str, Any]:
        """Schema, definition without its columns, seed, when, where and with which versions the store was made."""
        with explained(self.path):
            found = _about(self._connection)
            for name in ("definition", "seed", "versions"):
                found[name] = from_json(found[name])
        return {"schema": SCHEMA} | found

    def sessions(self) -> list[dict[str, Any]]:
        """Every process that wrote, in order: started, ended (None where killed), pid, host, versions, rows added."""
        names = ("started", "ended", "pid", "host", "versions", "rows")
        with explained(self.path):
            found = self._connection.execute(f"SELECT {', '.join(names)} FROM sessions ORDER BY id").fetchall()
            made = [dict(zip(names, line, strict=True)) for line in found]
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
    path = _placed(path)
    schema = _schema(path)
    lock = FileLock(f"{path}.lock", timeout=0)
    try:
        lock.acquire()
    except Timeout:
        if not os.path.lexists(lock.lock_file):
            raise refuse(
                path, "cannot be opened or written here; give a file in a folder that can be written"
            ) from None
        raise refuse(path, _holder(path)) from None
    except OSError as error:
        raise refuse(path, f"cannot be written: {error.strerror or error}") from error
    try:
        with explained(path):
            return _opened(path, study, fresh, schema, lock)
    except OSError as error:
        _release(lock)
        raise refuse(path, f"cannot be written: {error.strerror or error}") from error
    except BaseException:
        _release(lock)
        raise


def read_store(path: Path | str) -> Store:
    """Open a store for reading, also while another process writes it.

    Raises:
        InputError: when there is no such file, or it is no store of tmsopt.
    """
    path = _placed(path)
    schema = _schema(path)
    if not schema:
        raise refuse(path, "no such file")
    with explained(path), ExitStack() as failed:
        connection = failed.enter_context(closing(_connect(path, "ro")))
        _check_content(connection, path)
        if schema < SCHEMA:
            copy = sqlite3.connect(":memory:", isolation_level=None)
            _copy(connection, copy)
            return Store(path, copy)
        store = Store(path, connection)
        failed.pop_all()
        return store


def check_same(path: Path | str, study: Study) -> None:
    """Check that a store, if there is one, is of this study.

    Raises:
        InputError: with the differences where it is not; where it is no store, or damaged.
    """
    path = _placed(path)
    if not _schema(path):
        return
    with read_store(path) as store, explained(path):
        found = list(_different(_definition(store._connection), _definition_of(study)))
    if found:
        more = [f"and {len(found) - _MOST} more"] if len(found) > _MOST else []
        advice = "to keep it and start a new store, add --fresh, which moves this one aside; or give another --store"
        raise refuse(path, f"holds the rows of another study; {advice}. What differs:", *found[:_MOST], *more)


def _create(connection: sqlite3.Connection, about: Mapping[str, str], kept: Mapping[str, bytes]) -> None:
    """Make an empty store: what it says of itself, and the columns of its study as little-endian doubles."""
    connection.execute(f"PRAGMA application_id={APPLICATION}")
    connection.execute(f"PRAGMA user_version={SCHEMA}")
    connection.executescript(_TABLES)
    lines = [*about.items(), *((f"{_COLUMN}{name}", doubles) for name, doubles in kept.items())]
    connection.executemany("INSERT INTO study VALUES (?, ?)", lines)


def _copy(old: sqlite3.Connection, new: sqlite3.Connection) -> None:
    """Copy a store of an earlier version to an empty database."""
    _create(new, about_of(old), columns_of(old))
    store = Store(Path("copy"), new)
    with closing(parts_of(old)) as parts:
        for part in parts:
            store.add_part(part)
    names = "id, started, ended, pid, host, versions, rows"
    sessions = old.execute(f"SELECT {names} FROM sessions").fetchall()
    new.executemany(f"INSERT INTO sessions ({names}) VALUES (?, ?, ?, ?, ?, ?, ?)", sessions)


def _opened(path: Path, study: Study, fresh: bool, schema: int, lock: FileLock) -> Store:
    today, moved = _versions(), None
    leftovers = not schema and any(Path(f"{path}{ending}").exists() for ending in _COMPANIONS)
    if leftovers or (fresh and schema):
        moved, schema = _move_aside(path), 0
    if not schema:
        plain, kept = _definition_of(study)
        about = {
            "definition": json.dumps(plain),
            "seed": json.dumps(plain.get("seed")),
            "created": _now(),
            "host": platform.node(),
            "platform": platform.platform(),
            "versions": json.dumps(today),
        }
        if len(about["definition"]) > files.LARGEST_JSON:
            message = f"takes more than {files.LARGEST_JSON} characters to define; give the values in a CSV file"
            raise InputError([Fault(message, ("study",))])
        with files.write_atomic(path, locked=True) as place, closing(_connect(place, "rwc")) as connection:
            _create(connection, about, {name: values.tobytes() for name, values in kept.items()})
    check_same(path, study)  # what is refused is not changed
    if 0 < schema < SCHEMA:
        with files.write_atomic(path, locked=True) as place, closing(_connect(path, "rw")) as old:
            old.execute("PRAGMA journal_mode=DELETE")
            with closing(_connect(place, "rwc")) as new:
                _copy(old, new)
    connection = _connect(path, "rw")
    try:
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("PRAGMA synchronous=NORMAL")  # safe from kill -9
        store = Store(path, connection, lock)
        earlier = [session["versions"] for session in store.sessions() if session["rows"] > 0]
        store.warnings = tuple(dict.fromkeys(line for then in earlier for line in _changed(then, today)))
        store.moved = moved
        line = (_now(), os.getpid(), platform.node(), json.dumps(today))
        query = "INSERT INTO sessions (started, pid, host, versions) VALUES (?, ?, ?, ?)"
        store._session = connection.execute(query, line).lastrowid or 0
        return store
    except BaseException:
        connection.close()
        raise


def _release(lock: FileLock) -> None:
    with suppress(OSError):
        Path(lock.lock_file).unlink()  # while it is held; Windows keeps an open file
    lock.release()


def _placed(path: Path | str) -> Path:
    try:
        path = Path(path).resolve()  # a link's lock is that of the store
        if not path.parent.is_dir():
            raise refuse(path, f"the folder {path.parent} does not exist; make it, or give another --store")
    except (OSError, RuntimeError) as error:  # a name too long, or links in a circle
        raise refuse(Path(path), f"is no name for a file here ({error})") from error
    return path


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    connection = sqlite3.connect(f"{path.as_uri()}?mode={mode}", uri=True, timeout=_PATIENCE, isolation_level=None)
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST)
    connection.execute("PRAGMA trusted_schema=OFF")
    return connection


def _schema(path: Path) -> int:
    """The schema of the store at a path; 0 where there is none.

    Raises:
        InputError: for another file, and the store of a newer tmsopt.
    """
    if not os.path.lexists(path):
        return 0
    if not path.is_file():
        raise refuse(path, "is no regular file; give the name of a store, such as study.sqlite")
    with explained(path), closing(_connect(path, "ro")) as connection:
        connection.execute("PRAGMA writable_schema=ON")  # or a file that was cut off is no store at all
        ((application,),) = connection.execute("PRAGMA application_id")
        ((schema,),) = connection.execute("PRAGMA user_version")
    if application != APPLICATION or schema < 1:
        raise refuse(path, "is no store of tmsopt; give another file")
    if schema > SCHEMA:
        raise refuse(
            path,
            f"is a store of a newer tmsopt: its schema is {schema}, this version reads up to {SCHEMA}; "
            "update tmsopt or give another --store",
        )
    return int(schema)


def _check_content(connection: sqlite3.Connection, path: Path) -> None:
    """Check that a store has tables alone, which run nothing, and that its pages are whole."""
    query = "SELECT type, name FROM sqlite_schema WHERE type NOT IN ('table', 'index') OR sql LIKE '%VIRTUAL%' LIMIT 1"
    for kind, name in connection.execute(query):
        raise refuse(path, f"{DAMAGED} (its {kind} '{name!s:.60}' is not that of a store)")
    ((whole,),) = connection.execute("PRAGMA quick_check(1)")
    if whole != "ok":
        raise refuse(path, f"{DAMAGED} ({whole!s:.200})")


def _move_aside(path: Path) -> Path:
    """Move a store to ``name.1.sqlite``, or the first number that is free; the lock must be held."""
    if path.exists():
        with suppress(sqlite3.Error), closing(_connect(path, "rw")) as connection:  # a damaged one is moved as it is
            connection.execute("PRAGMA journal_mode=DELETE")
    return files.move_aside(path, _COMPANIONS)


def _holder(path: Path) -> str:
    """Who writes a store just now, as the store tells it."""
    last: list[dict[str, Any]] = []
    with suppress(InputError), read_store(path) as store:  # it may be moved aside just now
        last = store.sessions()[-1:]
    who = "another process, which has only just begun,"
    if last and last[0]["ended"] is None:
        who = f"process {last[0]['pid']} on {last[0]['host']}, since {last[0]['started']},"
    return f"{who} writes this store; wait for it or end it, or give another --store"


# The definition of a study


Definition = tuple[dict[str, Any], dict[str, "array[float]"]]
"""What defines a study: plain data, and its columns."""


def _definition_of(study: Study) -> Definition:
    plain = definition(study, lambda values: array("d", np.asarray(values, dtype="<f8").tobytes()))
    kept = plain.pop("columns", {})
    return json.loads(json.dumps(plain)), kept


def _definition(connection: sqlite3.Connection) -> Definition:
    """Of the study of a store.

    Raises:
        ValueError, TypeError, KeyError: for a damaged one.
    """
    plain = from_json(_about(connection)["definition"])
    query = "SELECT substr(key, ?), value FROM study WHERE substr(key, 1, ?) = ?"
    found = connection.execute(query, (len(_COLUMN) + 1, len(_COLUMN), _COLUMN)).fetchall()
    if not isinstance(plain, dict):
        raise TypeError("the definition of its study")
    return plain, {name: array("d", bytes(values)) for name, values in found}


def _about(connection: sqlite3.Connection) -> dict[str, Any]:
    query = "SELECT key, value FROM study WHERE substr(key, 1, ?) <> ? ORDER BY rowid"
    return dict(connection.execute(query, (len(_COLUMN), _COLUMN)).fetchall())


def _different(known: Definition, wanted: Definition) -> Iterator[str]:
    """What differs, one phrase each; of another number of rows that, and columns as far as both go."""
    (there, known_columns), (asked, wanted_columns) = known, wanted
    counts = [{len(values) for values in side.values()} for side in (known_columns, wanted_columns)]
    if counts[0] != counts[1] and all(len(count) == 1 for count in counts):
        rows = [count.pop() for count in counts]
        yield f"rows: {rows[0]} in the store, {rows[1]} in the file"
        known_columns = _cut(known_columns, wanted_columns, min(rows))
        wanted_columns = _cut(wanted_columns, known_columns, min(rows))
    both = (there | {"columns": known_columns}, asked | {"columns": wanted_columns})
    yield from differences(*both, ("in the store", "in the file"))


def _cut(one: "dict[str, array[float]]", other: "dict[str, array[float]]", rows: int) -> "dict[str, array[float]]":
    """Columns with so many rows of those that both have."""
    return {name: values[:rows] if name in other else values for name, values in one.items()}


# Where rows came from


def _now() -> str:
    """The time in UTC, ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def _versions() -> dict[str, str]:
    """Of tmsopt, Python, the libraries that solve, and IPOPT where its file tells; nothing is imported for it."""
    found = {"python": platform.python_version(), **installed(_PACKAGES), "ipopt": ipopt()}
    return {name: version or "unknown" for name, version in found.items()}


def _changed(then: Mapping[str, str], today: Mapping[str, str]) -> list[str]:
    """One line for each version that differs."""
    return [
        f"{name}: {then.get(name, 'unknown')} in the store, {today.get(name, 'unknown')} now"
        for name in dict.fromkeys([*then, *today])
        if then.get(name, "unknown") != today.get(name, "unknown")
    ]


# Columns of rows


def _headers(connection: sqlite3.Connection) -> dict[str, str]:
    """Header → name of its column."""
    return {"number": "number"} | {head: name for name, head in connection.execute("SELECT name, header FROM headers")}


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _values(head: str, column: PartialColumn) -> list[Any]:
    """A column for SQLite, which keeps nan as NULL. In tables of a row NULL is absent, and nan that is there a text."""
    values: list[Any] = column.values.tolist()
    if head not in FIELDS:
        for k in np.flatnonzero(column.present & np.isnan(column.values)).tolist():
            values[k] = "nan"
    return values


def _column(head: str, values: Sequence[Any]) -> PartialColumn:
    """What `_values` was given.

    Raises:
        ValueError, TypeError: for what it did not make.
    """
    kind = FIELDS.get(head, float)
    if head == "status" and not set(values) <= set(STATUSES):
        raise ValueError("a row has no known status")
    if kind is float:
        numbers = np.array(values, dtype=float)
        if head in FIELDS or not (lacks := np.isnan(numbers)).any():
            return full(numbers)
        return PartialColumn(numbers, ~lacks | np.array([value is not None for value in values]))
    if kind is str:
        return full(np.array(["" if value is None else str(value) for value in values], dtype=object))
    return PartialColumn(
        np.array([value or 0 for value in values], dtype=kind), np.array([value is not None for value in values])
    )
