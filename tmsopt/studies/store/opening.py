"""Stores opened, for writing by one process at a time or for reading by any."""

import json
import os
import platform
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from tmsopt.disk import differences
from tmsopt.errors import InputError
from tmsopt.locks import Lock, lock
from tmsopt.studies.store import database
from tmsopt.studies.store.asking import explained, refuse, undamaged
from tmsopt.studies.store.definition import Definition
from tmsopt.studies.store.provenance import changed, host, now, versions
from tmsopt.studies.store.store import Store

_MOST = 20  # differences shown


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


def check_same(path: Path | str, definition: Mapping[str, Any]) -> None:
    """That a store, if there is one, is of this study.

    Raises:
        InputError: with the differences where it is not; where it is no store, or damaged.
    """
    path = _placed(path)
    if _occupied(path):
        database.check(path)
        with explained(path), closing(database.connect_to_read(path)) as connection:
            _check_same(connection, path, Definition.of(definition))


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
        _check_same(connection, path, wanted)
        with undamaged(path, "the list of its writers"):
            earlier = [session["versions"] for session in database.sessions(connection) if session["rows"] > 0]
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


def _check_same(connection: sqlite3.Connection, path: Path, wanted: Definition) -> None:
    known = database.definition(connection, path, sum(map(len, wanted.columns.values())))
    if found := list(_different(known, wanted)):
        raise refuse(path, *_changed_study(found))


def _different(known: Definition, wanted: Definition) -> Iterator[str]:
    """What differs, one phrase each; of another number of rows that, and columns as far as both go."""
    counts = [{len(values) for values in side.columns.values()} for side in (known, wanted)]
    if counts[0] != counts[1] and all(len(count) == 1 for count in counts):
        there, asked = (count.pop() for count in counts)
        yield f"rows: {there} in the store, {asked} in the file"
        known, wanted = _cut(known, wanted, min(there, asked)), _cut(wanted, known, min(there, asked))
    yield from differences(known.data, wanted.data, ("in the store", "in the file"))


def _cut(one: Definition, other: Definition, rows: int) -> Definition:
    """A definition with so many rows of the columns that both have."""
    columns = {name: values[:rows] if name in other.columns else values for name, values in one.columns.items()}
    return replace(one, columns=columns)


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
