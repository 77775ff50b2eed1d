"""The store of a study: rows in one SQLite file, safe from ``kill -9``, with one writer and any number of readers."""

import json
import os
import platform
import sqlite3
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any

from tmsopt.disk import differences, from_json
from tmsopt.errors import InputError
from tmsopt.locks import Lock, lock
from tmsopt.studies.row import STATUSES, Row
from tmsopt.studies.store import database
from tmsopt.studies.store.asking import DAMAGED, ask, explained, refuse
from tmsopt.studies.store.definition import Definition
from tmsopt.studies.store.packing import SELECT, packed, unpacked
from tmsopt.studies.store.provenance import changed, host, now, versions

_CHUNK = 100  # rows read at once: a reader that pauses between rows must not hold up the writer; 100 MB at most
_MOST = 20  # differences shown


class Store:
    """Rows of one study, open for writing (`open_store`) or reading (`read_store`); a context manager.

    Attributes:
        path: of the file.
        warnings: what the user should know, one line each, such as other versions of the libraries.
        moved: where ``fresh`` put the store that was there before.
    """

    def __init__(
        self, path: Path, connection: sqlite3.Connection, held: Lock | None = None, session: int = 0,
        warnings: Sequence[str] = (), moved: Path | None = None,
    ) -> None:  # fmt: skip
        self.path, self.warnings, self.moved = path, tuple(warnings), moved
        self._connection, self._lock, self._session = connection, held, session
        self._closed, self._turn = False, threading.Lock()

    def __enter__(self) -> "Store":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file, and give up the right to write it; a second time does nothing."""
        if self._closed:
            return
        self._closed = True
        if self._lock is None:
            self._connection.close()
            return
        try:
            with suppress(sqlite3.Error):  # on a full disk there is a better error than this one
                self._connection.execute("UPDATE sessions SET ended = ? WHERE id = ?", (now(), self._session))
        finally:
            self._connection.close()
            self._lock.release()

    def add(self, rows: Sequence[Row]) -> None:
        """Keep rows, all or none; when it returns they are safe from ``kill -9``.

        A row that is there already, bit by bit but for time and host, is passed over.

        Raises:
            InputError: when another row of that number is there; on a full disk; when open for reading only.
        """
        self._check_writable()
        if not rows:
            return
        kept = [packed(row) for row in rows]
        with self._turn, explained(self.path):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                new = self._connection.executemany("INSERT OR IGNORE INTO rows VALUES (?, ?, ?, ?)", kept).rowcount
                if new < len(rows):
                    self._check_same(rows)
                self._connection.execute("UPDATE sessions SET rows = rows + ? WHERE id = ?", (new, self._session))
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")
                raise

    def _check_same(self, rows: Sequence[Row]) -> None:
        for row in rows:
            there = self.row(row.number)
            if there.identity != row.identity:
                mine, theirs = json.loads(row.identity), json.loads(there.identity)
                unlike = ", ".join(name for name in mine if mine[name] != theirs.get(name))
                message = (
                    f"row {row.number} is there already and differs from the new one in {unlike}; nothing was changed"
                )
                raise refuse(self.path, message)

    def done(self) -> set[int]:
        """The numbers of all rows in the store."""
        with explained(self.path):
            return {number for (number,) in ask(self._connection, "SELECT number FROM rows")}

    def counts(self) -> dict[str, int]:
        """Status → rows that have it, in the order of `STATUSES`; none that no row has."""
        with explained(self.path):
            found = dict(ask(self._connection, "SELECT status, count(*) FROM rows GROUP BY status LIMIT 100"))
        if unknown := [status for status in found if status not in STATUSES]:
            raise refuse(self.path, f"{DAMAGED} (a row has the status {unknown[0]!r:.60})")
        return {status: found[status] for status in STATUSES if status in found}

    def outside(self, most: int) -> int | None:
        """The number of a row that a study of so many rows cannot have; None where there is none."""
        query = "SELECT number FROM rows WHERE number < 0 OR number >= ? LIMIT 1"
        with explained(self.path):
            return next((number for (number,) in ask(self._connection, query, (most,))), None)

    def row(self, number: int) -> Row:
        """One row.

        Raises:
            InputError: when it is not there or damaged.
        """
        with explained(self.path):
            found = ask(self._connection, f"{SELECT} WHERE number = ?", (number,))
        if not found:
            raise refuse(self.path, f"row {number} is not in the store")
        return self._unpacked(*found[0])

    def rows(self, status: str | None = None) -> Iterator[Row]:
        """All rows, or those of one status, in order of number; rows added meanwhile may or may not be among them.

        Raises:
            InputError: on reaching a row that is damaged.
        """
        where = "" if status is None else " AND status = :status"
        query = f"{SELECT} WHERE number > :last{where} ORDER BY number LIMIT {_CHUNK}"
        last = -1
        while True:
            with explained(self.path):
                found = ask(self._connection, query, {"last": last, "status": status})
            for line in found:
                yield self._unpacked(*line)
            if len(found) < _CHUNK:
                return
            last = found[-1][0]

    def definition(self) -> dict[str, Any]:
        """The study as it was given to `open_store`; numbers in columns as doubles."""
        with explained(self.path):
            return database.definition(self._connection, self.path).to_json()

    def about(self) -> dict[str, Any]:
        """Schema, definition without its columns, seed, when, where and with which versions the store was made."""
        with explained(self.path):
            found: dict[str, Any] = database.about(self._connection)
            ((schema,),) = ask(self._connection, "PRAGMA user_version")
        with _undamaged(self.path, "what it says of itself"):
            for name in ("definition", "seed", "versions"):
                found[name] = from_json(found[name])
        return {"schema": schema} | found

    def sessions(self) -> list[dict[str, Any]]:
        """Every process that wrote, in order: started, ended (None where killed), pid, host, versions, rows added."""
        with explained(self.path), _undamaged(self.path, "the list of its writers"):
            return database.sessions(self._connection)

    def forget(self, numbers: Iterable[int]) -> None:
        """Remove rows, such as damaged ones, so that they are solved again.

        Raises:
            InputError: when open for reading only.
        """
        self._check_writable()
        with self._turn, explained(self.path):
            self._connection.executemany("DELETE FROM rows WHERE number = ?", [(number,) for number in numbers])

    def _check_writable(self) -> None:
        if self._lock is None:
            raise refuse(self.path, "is open for reading; open_store opens it for writing")

    def _unpacked(self, number: int, status: bytes, checksum: int, data: bytes) -> Row:
        try:
            return unpacked(number, status, checksum, data)
        except ValueError as error:
            command = f"sqlite3 '{self.path}' 'DELETE FROM rows WHERE number = {number}'"
            advice = f"{command} (or Store.forget([{number}])) removes it, and the same study solves it again"
            raise refuse(self.path, f"row {number} is damaged ({error}); {advice}") from error


def open_store(path: Path | str, definition: Mapping[str, Any], *, fresh: bool = False) -> Store:
    """Open the store of a study for writing; made if absent.

    Args:
        path: of the file.
        definition: the study as plain data; ``columns`` in it holds name → one number per row.
        fresh: move a store that is there aside, to ``name.1.sqlite`` or the next number, and start a new one.

    Raises:
        InputError: when the store holds another study (with the differences), another process writes it, the file is
            no store, is damaged or of a newer tmsopt, or the place cannot be written.
    """
    path, wanted, today = _placed(path), Definition.of(definition), versions()
    if _occupied(path):
        database.check(path)
    try:
        with explained(path):
            held = lock(path)
    except OSError as error:
        raise refuse(path, f"is no name for a file here ({error.strerror})") from error
    if held is None:
        raise refuse(path, _holder(path))
    try:
        with explained(path):
            return _opened(path, wanted, today, fresh, held)
    except OSError as error:
        held.release()
        raise refuse(path, f"cannot be written: {error.strerror or error}") from error
    except BaseException:
        held.release()
        raise


def read_store(path: Path | str) -> Store:
    """Open a store for reading, also while another process writes it.

    Raises:
        InputError: when there is no such file, or it is no store of tmsopt.
    """
    path = _placed(path)
    if not _occupied(path):
        raise refuse(path, "no such file")
    database.check(path)
    with explained(path):
        return Store(path, database.connect_to_read(path))


def _opened(path: Path, wanted: Definition, today: dict[str, str], fresh: bool, held: Lock) -> Store:
    moved = None
    if _occupied(path):
        database.check(path)  # again: what it was before the lock may be gone
        moved = database.aside(path) if fresh else None
    elif database.leftovers(path):
        moved = database.aside(path)
    if not _occupied(path):
        database.create(path, wanted, today, platform.platform())
    with closing(database.connect_to_read(path)) as connection:  # what is refused is not changed
        known = database.definition(connection, path, sum(map(len, wanted.columns.values())))
        found = list(differences(known.data, wanted.data, ("in the store", "in the file")))
        with _undamaged(path, "the list of its writers"):
            earlier = [session["versions"] for session in database.sessions(connection) if session["rows"] > 0]
    if found:
        raise refuse(path, *_changed_study(found))
    warnings = list(dict.fromkeys(line for then in earlier for line in changed(then, today)))
    connection = database.connect_to_write(path)
    try:
        line = (now(), os.getpid(), host(), json.dumps(today))
        query = "INSERT INTO sessions (started, pid, host, versions) VALUES (?, ?, ?, ?)"
        session = connection.execute(query, line).lastrowid
        return Store(path, connection, held, session or 0, warnings, moved)
    except BaseException:
        connection.close()
        raise


@contextmanager
def _undamaged(path: Path, what: str) -> Iterator[None]:
    """What is read there can be read.

    Raises:
        InputError: when it cannot.
    """
    try:
        yield
    except (KeyError, ValueError) as error:
        raise error if isinstance(error, InputError) else refuse(path, f"{DAMAGED} ({what}: {error})") from error


def _placed(path: Path | str) -> Path:
    try:
        path = Path(path).resolve()  # a link's lock is that of the store
        if not path.parent.is_dir():
            raise refuse(path, f"the folder {path.parent} does not exist; make it, or give another --store")
    except (OSError, RuntimeError) as error:  # a name too long, or links in a circle
        raise refuse(Path(path), f"is no name for a file here ({error})") from error
    return path


def _occupied(path: Path) -> bool:
    return os.path.lexists(path)


def _changed_study(found: Sequence[str]) -> list[str]:
    more = [f"and {len(found) - _MOST} more"] if len(found) > _MOST else []
    advice = "to keep it and start a new store, add --fresh, which moves this one aside; or give another --store"
    return [f"holds the rows of another study; {advice}. What differs:", *found[:_MOST], *more]


def _holder(path: Path) -> str:
    """Who writes a store just now, as the store tells it."""
    who = "another process, which has only just begun,"
    if _occupied(path):
        last = []
        with suppress(InputError), read_store(path) as store:  # it may be moved aside just now
            last = store.sessions()[-1:]
        if last and last[0]["ended"] is None:
            who = f"process {last[0]['pid']} on {last[0]['host']}, since {last[0]['started']},"
    return f"{who} writes this store; wait for it or end it, or give another --store"
