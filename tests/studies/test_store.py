"""The store of a study: no acknowledged row is lost, no other file is touched, every double comes back bit by bit."""

import functools
import json
import math
import os
import random
import sqlite3
import struct
import subprocess
import sys
import tempfile
import time
import tracemalloc
import zlib
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
from helpers.rows import STUDY, row
from hypothesis import given, settings, strategies as st

from tmsopt.errors import InputError
from tmsopt.locks import lock
from tmsopt.records import Table
from tmsopt.studies import Row
from tmsopt.studies.store import open_store, read_store

database = import_module("tmsopt.studies.store.database")
store = import_module("tmsopt.studies.store.opening")

TASKS = ("write", "log")
"""Of a process: write, and write with the write-ahead log that earlier versions had."""
SPECIAL = (math.nan, math.inf, -math.inf, -0.0, 0.0, 5e-324, -2.2250738585072011e-308, 1.7976931348623157e308, 0.1)
posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")


def bits(value: Any) -> Any:
    """Equal for equal bits: nan is itself, and 0.0 is not −0.0."""
    if isinstance(value, float):
        return struct.pack("<d", value)
    return {n: bits(v) for n, v in value.items()} if isinstance(value, Table) else value


def same(one: Row, other: Row) -> bool:
    return {n: bits(v) for n, v in vars(one).items()} == {n: bits(v) for n, v in vars(other).items()}


def refusal(call: Callable[[], Any]) -> str:
    with pytest.raises(InputError) as caught:
        call()
    return str(caught.value)


@pytest.fixture
def path(tmp_path: Path) -> Iterator[Path]:
    """Of a store to be: in memory where the system has such files, since ``kill -9`` asks nothing of a disk."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else tmp_path) as folder:
        yield Path(folder) / "study.sqlite"


# A process that writes, and is killed

WRITER = """
import os, random, sys, time
from pathlib import Path
sys.path.insert(0, str(Path("tests").resolve()))
from helpers.rows import STUDY, row
from tmsopt.studies.store import opening as store
path, task = sys.argv[1:]
with store.open_store(path, STUDY) as opened:
    print(os.getpid(), flush=True)
    if task == "log":  # as earlier versions wrote
        opened._connection.execute("PRAGMA journal_mode=WAL")
    if task == "hold":
        time.sleep(60)
    if task == "fork":
        if os.fork():
            print("forked", flush=True)
        time.sleep(60)
    number = len(opened.done())
    while True:
        batch = [row(n) for n in range(number, number + random.randint(1, 20))]
        opened.add(batch)
        number += len(batch)
        print(number, flush=True)
"""


@contextmanager
def writer(path: Path, task: str = "write") -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A process that has the store open, and its id; killed with SIGKILL in the end."""
    command = [sys.executable, "-c", WRITER, str(path), task]
    root = Path(__file__).parents[2]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=root, start_new_session=True)
    try:
        yield process, int(process.stdout.readline())
    finally:
        process.kill()
        process.stdout.read()
        process.wait()
        process.stdout.close()


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS)
def test_no_acknowledged_row_is_lost_by_kill_9(task: str, path: Path) -> None:
    """The process prints how many rows `add` has acknowledged; whatever it printed must be there, row by row."""
    chance, acknowledged = random.Random(task), 0
    for _ in range(4):
        with writer(path, task) as (process, _):
            time.sleep(chance.uniform(0, 0.05))
            process.kill()
            printed = process.stdout.read().split("\n")[:-1]  # the last line may be cut off
        acknowledged = int(printed[-1]) if printed else acknowledged
        with read_store(path) as opened:
            done = opened.done()
            assert done >= set(range(acknowledged))
            assert done == set(range(len(done)))  # batches are kept as a whole or not at all
            assert [s["ended"] for s in opened.sessions()] == [None] * len(opened.sessions())
            assert sum(s["rows"] for s in opened.sessions()) == len(done)
    assert all(same(found, row(number)) for number, found in enumerate(read_all(path)))
    assert acknowledged > 0


@pytest.mark.parametrize("task", TASKS)
def test_reading_while_another_process_writes(task: str, path: Path) -> None:
    with writer(path, task) as (process, _):
        for _ in range(5):
            acknowledged = int(process.stdout.readline())
            with read_store(path) as opened:
                there = len(opened.done())
                assert there >= acknowledged
                assert [r.number for r in islice(opened.rows(), there)] == list(range(there))  # more are being written
                assert sum(opened.counts().values()) >= acknowledged


@pytest.mark.parametrize("task", TASKS)
def test_a_store_is_recognised_while_another_process_writes(task: str, path: Path) -> None:
    """While it grows its first page may promise more pages than the file has yet."""
    with writer(path, task):
        for _ in range(500):
            database.check(path)


def test_a_store_is_recognised_though_its_writer_was_killed_while_it_grew(path: Path) -> None:
    open_store(path, STUDY).close()
    with path.open("r+b") as stream:  # bytes 28 to 31 of the header: how many pages the file has
        stream.seek(28)
        stream.write((1000).to_bytes(4, "big"))
    database.check(path)


def test_a_second_writer_is_refused_until_the_first_is_gone(path: Path) -> None:
    with writer(path, "hold") as (process, number):
        message = refusal(lambda: open_store(path, STUDY))
        assert f"process {number} on {store.host()}" in message
        assert "another --store" in message
        refusal(lambda: open_store(path, STUDY, fresh=True))
        process.kill()
        process.wait()
        with open_store(path, STUDY) as opened:
            opened.add([row(0)])
            assert str(os.getpid()) in refusal(lambda: open_store(path, STUDY))  # within one process too
    with open_store(path, STUDY) as opened:
        assert opened.done() == {0}
    assert [p.name for p in path.parent.iterdir()] == [path.name]


@posix
def test_a_forked_child_of_a_killed_writer_holds_no_lock(path: Path) -> None:
    with writer(path, "fork") as (process, _):
        assert process.stdout.readline() == "forked\n"
        process.kill()
        process.wait()
        try:
            os.killpg(process.pid, 0)  # the child still runs
            open_store(path, STUDY).close()
        finally:
            os.killpg(process.pid, 9)


@posix
def test_a_lock_on_a_file_that_is_gone_does_not_count(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last holder removes the file after another process opened it: that one must not lock what has no name."""
    name, connect, tries = path.with_name("study.sqlite.lock"), sqlite3.connect, []

    class Late(sqlite3.Connection):
        def execute(self, *given: Any) -> sqlite3.Cursor:
            if given != ("BEGIN IMMEDIATE",):
                return super().execute(*given)
            tries.append(given)
            if len(tries) in (2, 3):  # the first makes the file
                name.unlink()
            done = super().execute(*given)
            if len(tries) in (4, 5):
                name.unlink()
            return done

    with monkeypatch.context() as late:
        late.setattr(sqlite3, "connect", functools.partial(connect, factory=Late))
        held = lock(path)
    assert len(tries) > 6
    assert held is not None
    assert lock(path) is None
    held.release()
    assert not name.exists()


# Rows


@given(
    st.lists(st.sampled_from(SPECIAL) | st.floats(allow_nan=False), min_size=9, max_size=9),
    st.sampled_from(["", "two\nlines", "χ_B \x00 'quoted' \ud800"]),
    st.integers(0, 2**128),
)
@settings(max_examples=25, deadline=None)
def test_a_row_is_the_same_after_json(x: list[float], text: str, seed: int) -> None:
    tables = {name: Table({"a": x[0], text: x[1]}) for name in ("parameters", "reports", "laws", "violations")}
    scalars = dict(zip(("objective", "abscissa", "damping_ratio", "bound", "gap", "seconds"), x[2:8], strict=True))
    made = Row(3, seed, Table({"mu": x[8]}), "failed", cause=text, **tables, **scalars)
    data = json.dumps(made.to_json(), allow_nan=False)
    back = Row.from_json(json.loads(data))
    assert same(back, replace(made))
    assert back.identity == made.identity
    assert replace(back, seconds=1.0, host="elsewhere").identity == made.identity


def test_rows_come_back_bit_by_bit_and_in_order(path: Path) -> None:
    rows = [row(n, objective=x, bound=x, gap=x, parameters=Table({"Fr": x})) for n, x in enumerate(SPECIAL)]
    with open_store(path, STUDY) as opened:
        for one in reversed(rows):
            opened.add([one])
    with read_store(path) as opened:
        assert all(same(a, b) for a, b in zip(opened.rows(), rows, strict=True))
        assert same(opened.row(3), rows[3])
        assert "row 99" in refusal(lambda: opened.row(99))
        assert "open for reading" in refusal(lambda: opened.add(rows))


def test_a_row_is_never_overwritten(path: Path) -> None:
    with open_store(path, STUDY) as opened:
        opened.add([row(1), row(2), row(2)])
        opened.add([row(1, seconds=9.0, host="elsewhere"), row(3)])
        message = refusal(lambda: opened.add([row(4), row(2, abscissa=-7.0, cause="other")]))
        assert "row 2" in message
        assert "abscissa, cause" in message
        opened.add([])
        assert opened.done() == {1, 2, 3}
        assert same(opened.row(1), row(1))
        assert opened.sessions()[0]["rows"] == 3


def test_counts_and_rows_of_one_status(path: Path) -> None:
    with open_store(path, STUDY) as opened:
        opened.add([row(n, status="failed" if n % 3 == 0 else "optimal") for n in range(1200)])
        assert opened.counts() == {"optimal": 800, "failed": 400}
        assert [r.number for r in opened.rows("failed")] == list(range(0, 1200, 3))
        assert list(opened.rows("quarantined")) == []
        opened.forget([0, 1])
        assert opened.counts() == {"optimal": 799, "failed": 399}


def test_a_hundred_thousand_rows(tmp_path: Path) -> None:
    path = tmp_path / "study.sqlite"
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    with closing(sqlite3.connect(path)) as connection, connection:  # copies, without the time to make them
        numbers = "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 99999) SELECT i FROM n"
        connection.execute(f"INSERT INTO rows SELECT i, status, checksum, data FROM ({numbers}), rows")
    with open_store(path, STUDY) as opened:
        for first in range(100_000, 105_000, 100):
            opened.add([Row(n, n, Table(), "optimal") for n in range(first, first + 100)])
        assert opened.done() == set(range(105_000))
        assert opened.counts() == {"optimal": 105_000}


def test_the_rows_are_ahead_of_a_reader_that_pauses(path: Path) -> None:
    """A rollback journal cannot be committed while somebody is reading: reading takes breaks."""
    with open_store(path, STUDY) as opened:
        opened.add([row(n) for n in range(2000)])
        with read_store(path) as reading:
            numbers = reading.rows()
            next(numbers)
            opened.add([row(2000)])
            assert sum(1 for _ in numbers) == 2000


# What the store knows of its study


def test_what_a_store_says_of_itself(path: Path) -> None:
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    with open_store(path, STUDY) as opened:
        assert opened.warnings == ()
        assert opened.moved is None
        about = opened.about()
        assert opened.definition() == STUDY
    assert about["definition"] == {name: value for name, value in STUDY.items() if name != "columns"}
    assert about["seed"] == 7
    assert set(about["versions"]) == {"python", "tmsopt", "casadi", "numpy", "scipy", "python-flint", "ipopt"}
    with read_store(path) as opened:
        assert [(s["rows"], s["pid"], s["ended"] is None) for s in opened.sessions()] == [
            (1, os.getpid(), False),
            (0, os.getpid(), False),
        ]


def changed(**given: Any) -> dict[str, Any]:
    return STUDY | given


@pytest.mark.parametrize(
    ("other", "line"),
    [
        (changed(seed=8), "seed: 7 in the store, 8 in the file"),
        (changed(title="x"), 'title: none in the store, "x" in the file'),
        (
            changed(problem={"parameters": {"mu": 0.2, "zeta_B": -0.4}, "objective": {"minimize": "abscissa"}}),
            "problem.parameters.mu: 0.1 in the store, 0.2 in the file",
        ),
        (
            changed(problem={"parameters": {"mu": 0.1, "zeta_B": -0.4}}),
            'problem.objective: {"minimize": "abscissa"} in the store, none in the file',
        ),
        (
            changed(columns=STUDY["columns"] | {"mu": [0.1, 0.25, 0.35]}),
            "columns.mu: 2 of 3 values differ, the first in row 1: 0.2 in the store, 0.25 in the file",
        ),
        (
            changed(columns=STUDY["columns"] | {"mu": [0.1, 0.2]}),
            "columns.mu: 3 values in the store, 2 in the file",
        ),
        (changed(columns={n: v[:2] for n, v in STUDY["columns"].items()}), "rows: 3 in the store, 2 in the file"),
        (changed(columns={"mu": [0.1, 0.2, 0.3]}), "columns.zeta_B: 3 values in the store, none in the file"),
    ],
)
def test_the_store_of_a_changed_study_is_refused(path: Path, other: dict[str, Any], line: str) -> None:
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    before = path.read_bytes()
    message = refusal(lambda: open_store(path, other))
    assert message.splitlines()[1:] == [f"  {line}"]
    assert "--fresh" in message
    assert "--store" in message
    assert path.read_bytes() == before
    with open_store(path, STUDY) as opened:
        assert opened.done() == {0}


def test_the_same_study_written_in_another_way_is_the_same(path: Path) -> None:
    study = {"columns": {"mu": [1, math.nan]}, "list": [1, 2.0], "x": math.nan}
    open_store(path, study).close()
    open_store(path, {"x": math.nan, "list": (1.0, 2), "columns": {"mu": (1.0, math.nan)}}).close()
    refusal(lambda: open_store(path, study | {"x": True}))
    assert "0.0 in the file" in refusal(lambda: open_store(path, study | {"columns": {"mu": [0.0, math.nan]}}))


def test_fresh_moves_aside_and_never_deletes(path: Path) -> None:
    for number in range(3):
        with open_store(path, changed(seed=number), fresh=True) as opened:
            assert opened.moved == (path.with_name(f"study.{number}.sqlite") if number else None)
            assert opened.done() == set()
            opened.add([row(number)])
    for name, number in (("study.1.sqlite", 0), ("study.2.sqlite", 1), ("study.sqlite", 2)):
        with read_store(path.with_name(name)) as opened:
            assert opened.about()["seed"] == number
            assert opened.done() == {number}
    assert len(list(path.parent.iterdir())) == 3


def test_fresh_keeps_what_a_killed_writer_left_in_its_log(path: Path) -> None:
    with writer(path, "log") as (process, _):
        acknowledged = [int(process.stdout.readline()) for _ in range(3)][-1]
        process.kill()
        process.wait()
    assert path.with_name("study.sqlite-wal").exists()
    with open_store(path, STUDY, fresh=True) as opened:
        assert opened.done() == set()
    with read_store(path.with_name("study.1.sqlite")) as opened:
        assert len(opened.done()) >= acknowledged


def test_fresh_leaves_no_journal_beside_what_it_moves(path: Path) -> None:
    """What a writer leaves that is killed before its journal counts: SQLite clears it with the next commit."""
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    path.with_name("study.sqlite-journal").write_bytes(bytes(1000))
    path.with_name("study.sqlite-shm").write_bytes(bytes(1000))
    open_store(path, STUDY, fresh=True).close()
    assert sorted(p.name for p in path.parent.iterdir()) == ["study.1.sqlite", "study.sqlite"]
    assert len(read_all(path.with_name("study.1.sqlite"))) == 1


def test_a_log_beside_a_store_that_is_gone_is_not_played_into_the_new_one(path: Path) -> None:
    with writer(path, "log") as (process, _):
        process.stdout.readline()
        process.kill()
        process.wait()
    path.unlink()
    with open_store(path, STUDY) as opened:
        assert opened.done() == set()
    assert path.with_name("study.1.sqlite-wal").exists()


def test_other_versions_are_a_warning(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    older = store.versions()
    monkeypatch.setattr(store, "versions", lambda: older | {"tmsopt": "0.9.9"})
    with open_store(path, STUDY) as opened:
        assert opened.warnings == (f"tmsopt: {older['tmsopt']} in the store, 0.9.9 now",)


# Files that are no store, damage, and places that cannot be written


def other_database(path: Path) -> None:
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("CREATE TABLE mine (x)")


def newer_store(path: Path) -> None:
    open_store(path, STUDY).close()
    with closing(sqlite3.connect(path)) as connection:
        connection.execute(f"PRAGMA user_version={database.SCHEMA + 1}")


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda path: path.write_bytes(random.Random(1).randbytes(5000)), "is no store of tmsopt"),
        (lambda path: path.write_text("[parameters]\n"), "is no store of tmsopt"),
        (lambda path: path.write_bytes(b""), "is no store of tmsopt"),
        (other_database, "is no store of tmsopt"),
        (newer_store, f"its schema is {database.SCHEMA + 1}, this version reads up to {database.SCHEMA}"),
    ],
)
def test_a_file_that_is_no_store_is_not_touched(path: Path, make: Callable[[Path], Any], expected: str) -> None:
    make(path)
    before = path.read_bytes()
    calls = (lambda: read_store(path), lambda: open_store(path, STUDY), lambda: open_store(path, STUDY, fresh=True))
    for call in calls:
        assert expected in refusal(call)
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_places_where_no_store_can_be(tmp_path: Path) -> None:
    assert "no regular file" in refusal(lambda: open_store(tmp_path, STUDY))
    assert "does not exist" in refusal(lambda: open_store(tmp_path / "no" / "a.sqlite", STUDY))
    assert "no such file" in refusal(lambda: read_store(tmp_path / "a.sqlite"))
    assert "no name for a file" in refusal(lambda: open_store(tmp_path / ("x" * 300), STUDY))
    if sys.platform == "linux":
        assert "cannot be opened or written" in refusal(lambda: open_store("/proc/a.sqlite", STUDY))
        assert "no regular file" in refusal(lambda: open_store("/dev/null", STUDY))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("damage", ["UPDATE rows SET data = replace(data, '2', '3')", "UPDATE rows SET status = 'failed'",
    "UPDATE rows SET data = substr(data, 1, 40)", "UPDATE rows SET data = x'ff00fe'", "UPDATE rows SET number = 13"])  # fmt: skip
def test_a_damaged_row_is_named(path: Path, damage: str) -> None:
    with open_store(path, STUDY) as opened:
        opened.add([row(11), row(12), row(14)])
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(f"{damage} WHERE number = 12")
    with open_store(path, STUDY) as opened:
        named = "row 13 is damaged" if "number =" in damage else "row 12 is damaged"
        assert named in refusal(lambda: list(opened.rows()))
        opened.forget([12, 13])
        opened.add([row(12)])
        assert [r.number for r in opened.rows()] == [11, 12, 14]


def test_a_damaged_store_is_said_to_be(path: Path) -> None:
    with open_store(path, STUDY) as opened:
        opened.add([row(n) for n in range(1000)])
    whole = path.read_bytes()
    path.write_bytes(whole[:4096] + b"\xa5" * (len(whole) - 4096))
    damaged = path.read_bytes()
    assert "is damaged" in refusal(lambda: open_store(path, STUDY))
    assert path.read_bytes() == damaged
    with open_store(path, STUDY, fresh=True) as opened:
        opened.add([row(0)])
    assert path.with_name("study.1.sqlite").read_bytes() == damaged
    path.write_bytes(whole[: len(whole) // 2])
    assert "damaged" in refusal(lambda: read_all(path))


def read_all(path: Path) -> list[Row]:
    with read_store(path) as opened:
        return list(opened.rows())


def test_text_that_is_none(path: Path) -> None:
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    spoil(path, "UPDATE rows SET status = CAST(x'ff' AS TEXT)")
    with read_store(path) as opened:
        assert "is damaged" in refusal(opened.counts)
        assert "is damaged" in refusal(lambda: list(opened.rows()))


def test_a_damaged_definition_is_said_to_be(path: Path) -> None:
    open_store(path, STUDY).close()
    spoil(path, "UPDATE columns SET doubles = x'00'")
    assert "definition of its study is damaged" in refusal(lambda: open_store(path, STUDY))


# Stores from other people


def spoil(path: Path, script: str, *values: Any) -> None:
    """Change a store as any other program can."""
    with closing(sqlite3.connect(path)) as connection, connection:
        if values:
            connection.execute(script, values)
        else:
            connection.executescript(script)


def spoiled_row(**changes: Any) -> Callable[[Path], None]:
    """A row with another content and a checksum that is right."""

    def change(path: Path) -> None:
        data = json.dumps(row(0).to_json() | changes)
        checksum = zlib.crc32(f"0:optimal:{data}".encode())
        spoil(path, "UPDATE rows SET data = ?, checksum = ? WHERE number = 0", data, checksum)

    return change


def bomb(path: Path) -> None:
    """Where three numbers were, a few kilobytes that would become 128 MB, with a right checksum."""
    squeezed = zlib.compressobj(9)
    packed = b"".join(squeezed.compress(bytes(2**24)) for _ in range(8)) + squeezed.flush()
    spoil(path, "UPDATE columns SET checksum = ?, doubles = ?", zlib.crc32(packed), packed)


def byte(place: int, value: int) -> Callable[[Path], None]:
    def change(path: Path) -> None:
        with path.open("r+b") as stream:
            stream.seek(place)
            stream.write(bytes([value]))

    return change


def told(name: str, value: str) -> Callable[[Path], None]:
    return lambda path: spoil(path, "UPDATE about SET value = ? WHERE name = ?", value, name)


ENDLESS = "WITH RECURSIVE c(n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM c) SELECT n AS number, 'optimal' AS status"
SPOILED: dict[str, tuple[Callable[[Path], None], str]] = {
    "no rows": (lambda p: spoil(p, "DROP TABLE rows"), "is damaged"),
    "an endless view": (
        lambda p: spoil(p, f"DROP TABLE rows; CREATE VIEW rows AS {ENDLESS}, 0 AS checksum, '{{}}' AS data FROM c"),
        "view 'rows' is not that of a store",
    ),
    "a trigger": (
        lambda p: spoil(p, "CREATE TRIGGER t AFTER INSERT ON sessions BEGIN DELETE FROM rows; END"),
        "trigger 't' is not that of a store",
    ),
    "an index": (lambda p: spoil(p, "CREATE INDEX i ON rows (abs(checksum))"), "index 'i' is not that of a store"),
    "a virtual table": (lambda p: spoil(p, "CREATE VIRTUAL TABLE v USING fts4(x)"), "is not that of a store"),
    "a generated column": (
        lambda p: spoil(p, "ALTER TABLE rows ADD COLUMN x AS (hex(zeroblob(1000000)))"),
        "table 'rows' is not that of a store",
    ),
    "a long schema": (
        lambda p: spoil(
            p,
            "PRAGMA writable_schema=ON; UPDATE sqlite_schema SET sql = sql || hex(zeroblob(5000000)) WHERE name = 'rows'",
        ),
        "is damaged",
    ),
    "a page of two tables": (
        lambda p: spoil(
            p,
            "PRAGMA writable_schema=ON; UPDATE sqlite_schema SET rootpage = (SELECT rootpage FROM sqlite_schema "
            "WHERE name = 'rows') WHERE name = 'columns'",
        ),
        "is damaged",
    ),
    "another file format": (byte(19, 3), "is no store of tmsopt"),
    "another schema format": (byte(47, 99), "is no store of tmsopt"),
    "zeros": (bomb, "definition of its study is damaged"),
    "a trillion numbers": (lambda p: spoil(p, f"UPDATE columns SET count = {10**12}"), "definition of its study"),
    "a count below 0": (lambda p: spoil(p, "UPDATE columns SET count = -1"), "definition of its study is damaged"),
    "a count that is none": (lambda p: spoil(p, "UPDATE columns SET count = 'x'"), "definition of its study"),
    "a nested definition": (told("definition", "[" * 100_000 + "]" * 100_000), "more than 100 deep"),
    "a definition 200 deep": (told("definition", "[" * 200 + "]" * 200), "more than 100 deep"),
    "a definition of lists": (told("definition", f"[{'[],' * 1_000_001}0]"), "definition of its study is damaged"),
    "a definition that is none": (told("definition", "[]"), "definition of its study is damaged"),
    "no definition": (lambda p: spoil(p, "DELETE FROM about"), "definition of its study is damaged"),
    "versions that are none": (lambda p: spoil(p, "UPDATE sessions SET versions = '[]'"), "the list of its writers"),
    "a writer without a start": (lambda p: spoil(p, "UPDATE sessions SET started = x'00'"), "started is b'"),
    "a row that is none": (lambda p: spoil(p, "UPDATE rows SET data = '[]'"), "row 0 is damaged"),
    "a row of another number": (spoiled_row(number=7), "it says to be row 7"),
    "parameters that are none": (spoiled_row(parameters=5), "parameters: found 5; accepted: names with numbers"),
    "parameters that are texts": (spoiled_row(parameters={"a": "x"}), "parameters.a: found 'x'; accepted: a number"),
    "no structure": (spoiled_row(structure=None), "structure: found None; accepted: str"),
    "a huge number": (spoiled_row(abscissa=10**400), "abscissa: found a whole number of about 400 digits"),
    "a truth for a number": (spoiled_row(abscissa=True), "abscissa: found True"),
    "a nested row": (spoiled_row(laws=json.loads("[" * 200 + "]" * 200)), "row 0 is damaged"),
    "a status of its own": (spoiled_row(status="fine"), "row 0 is damaged"),
    "a status that is no text": (lambda p: spoil(p, "UPDATE rows SET status = x'00'"), "is damaged"),
}


def read_whole(path: Path) -> None:
    """All that can be asked of a store."""
    with read_store(path) as opened:
        opened.definition(), opened.about(), opened.sessions(), opened.done(), opened.counts(), list(opened.rows())


def continued(path: Path) -> None:
    with open_store(path, STUDY) as opened:
        list(opened.rows())
        opened.counts()


@pytest.mark.parametrize("name", SPOILED)
def test_a_spoiled_store_is_refused_and_moved_aside_by_fresh(name: str, path: Path) -> None:
    """Never run, never believed, in little memory; what its reader does not look at does not stop that reader."""
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    spoil_it, words = SPOILED[name]
    spoil_it(path)
    tracemalloc.start()
    said = [refusal(lambda: read_whole(path)), refusal(lambda: continued(path))]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert all(words in message and str(path) in message for message in said), said
    assert max(map(len, said)) < 1000
    assert peak < 100e6
    before = path.read_bytes()
    if "no store" not in words:
        open_store(path, STUDY, fresh=True).close()
        assert path.with_name("study.1.sqlite").read_bytes()[96:] == before[96:]  # the header says who wrote last
    assert sorted(p.suffix for p in path.parent.iterdir()) == [".sqlite"] * (1 + ("no store" not in words))


def test_a_tree_that_never_ends_is_damage(path: Path) -> None:
    """Inner pages whose children are all one page: 20 of them would be walked 500²⁰ times."""
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    with closing(sqlite3.connect(path)) as connection:
        ((root,),) = connection.execute("SELECT rootpage FROM sqlite_schema WHERE name = 'rows'")
        ((pages,),) = connection.execute("PRAGMA page_count")
    whole = bytearray(path.read_bytes())
    leaf = whole[4096 * (root - 1) : 4096 * root]
    for place in [root, *range(pages + 1, pages + 12)]:
        child = pages + 1 if place == root else place + 1
        cells = [struct.pack(">IB", child, 1 + n % 100) for n in range(100)]
        body = b"".join(cells)
        places = b"".join(struct.pack(">H", 4096 - len(body) + 5 * n) for n in range(100))
        head = struct.pack(">BHHHBI", 5, 0, 100, 4096 - len(body), 0, child)
        page = (head + places).ljust(4096 - len(body), b"\0") + body
        whole[4096 * (place - 1) : 4096 * place] = page
    whole += leaf
    whole[28:32] = struct.pack(">I", len(whole) // 4096)
    path.write_bytes(whole)
    assert "is damaged" in refusal(lambda: read_store(path))
    open_store(path, STUDY, fresh=True).close()


@posix
@pytest.mark.parametrize("ending", ["-journal", "-wal", "-shm", ".lock"])
def test_links_beside_a_store_are_refused(ending: str, path: Path, tmp_path: Path) -> None:
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    victim, beside = tmp_path / "victim", Path(f"{path}{ending}")
    victim.write_bytes(b"kept")
    beside.symlink_to(victim)
    calls = [lambda: open_store(path, STUDY), lambda: open_store(path, STUDY, fresh=True)]
    for call in calls if ending == ".lock" else [*calls, lambda: read_store(path)]:
        assert beside.name in refusal(call)
    assert victim.read_bytes() == b"kept"
    assert beside.is_symlink()


@pytest.mark.parametrize("beside", ["study.sqlite-journal", "study.sqlite.lock"])
def test_a_journal_that_names_another_file_removes_none(beside: str, path: Path, tmp_path: Path) -> None:
    """SQLite removes what a journal of several databases names, once it has played it: any file of the reader's."""
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    victim, magic = tmp_path / "thesis.tex", bytes.fromhex("d9d505f920a163d7")
    victim.write_bytes(b"kept")
    if beside.endswith(".lock"):
        path.with_name(beside).write_bytes(path.read_bytes())
    name = str(victim).encode()
    head = (magic + struct.pack(">5I", 0, 1, path.stat().st_size // 4096, 512, 4096)).ljust(512, b"\0")
    tail = struct.pack(">I", 2**30 // 4096 + 1) + name + struct.pack(">2I", len(name), sum(name)) + magic
    journal = path.with_name(beside if beside.endswith("-journal") else f"{beside}-journal")
    journal.write_bytes(head + tail)
    assert beside in refusal(lambda: open_store(path, STUDY))
    assert beside in refusal(lambda: open_store(path, STUDY, fresh=True))
    assert victim.read_bytes() == b"kept"


@posix
def test_a_full_disk_costs_no_row_that_was_acknowledged(path: Path) -> None:
    """A limit on the size of files stands for the disk: SQLite calls the one an I/O error and the other full."""
    import resource

    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, hard))
        acknowledged = 1
        try:
            for first in range(1, 10_000, 100):
                opened.add([row(n) for n in range(first, first + 100)])
                acknowledged = first + 100
            pytest.fail("the limit was not reached")
        except InputError as error:
            assert "disk" in str(error)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        assert opened.done() == set(range(acknowledged))
        opened.add([row(acknowledged)])
    assert [r.number for r in read_all(path)] == list(range(acknowledged + 1))


# Journals


def test_a_closed_store_is_one_plain_file(path: Path) -> None:
    """So that it can be copied, and read where nothing can be written."""
    with open_store(path, STUDY) as opened:
        opened.add([row(0)])
    assert [p.name for p in path.parent.iterdir()] == [path.name]
    with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro&immutable=1", uri=True)) as connection:
        assert connection.execute("SELECT count(*) FROM rows").fetchone() == (1,)


def test_a_store_of_an_earlier_version_is_written_also_while_somebody_reads_it(path: Path) -> None:
    """Those had a write-ahead log. It goes with the first writer whom no reader hinders, and no row with it."""
    with writer(path, "log") as (process, _):
        acknowledged = int(process.stdout.readline())
    with read_store(path) as reading:
        with open_store(path, STUDY) as opened:
            before = opened.done()
            opened.add([row(len(before))])
        assert reading.done() == before | {len(before)} >= set(range(acknowledged))
    with open_store(path, STUDY) as opened:
        assert opened.done() == before | {len(before)}
    assert [p.name for p in path.parent.iterdir()] == [path.name]


KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, str(Path("tests").resolve()))
from helpers.rows import STUDY, row
from tmsopt.studies.store import opening as store

def killed_after(events):
    def hook(event, given):
        nonlocal events
        events -= event in ("os.rename", "os.remove", "sqlite3.connect")
        if events < 0:
            os.kill(os.getpid(), signal.SIGKILL)
    sys.addaudithook(hook)

store.versions = dict  # reading them takes longer than all else here
path, log, moment, added = sys.argv[1], sys.argv[2] == "log", 0, 0
while True:
    with store.open_store(path, STUDY) as opened:
        if not opened.done():
            opened.add([row(0)])
            added += 1
        if log:
            opened._connection.execute("PRAGMA journal_mode=WAL")
    child = os.fork()
    if not child:
        killed_after(moment)
        store.open_store(path, STUDY, fresh=True)
        os._exit(0)
    if not os.waitpid(child, 0)[1]:
        break
    moment += 1
print(moment, added)
"""


@pytest.mark.slow
@posix
@pytest.mark.parametrize("task", TASKS)
def test_killed_at_every_step_of_moving_aside(path: Path, task: str) -> None:
    """Killed before each file that is opened, renamed or removed: every row is in some store, and no other file stays.

    Rows stay in the store under its name, or under the next number; the last process gets to its end.
    """
    command, root = [sys.executable, "-c", KILLED, str(path), task], Path(__file__).parents[2]
    moments, added = map(int, subprocess.run(command, cwd=root, check=True, stdout=subprocess.PIPE).stdout.split())
    with open_store(path, STUDY) as opened:
        assert opened.done() == set()
    stores = [p for p in path.parent.iterdir() if p.suffix == ".sqlite"]
    assert moments > 10
    assert len(stores) == added + 1
    assert sum(len(read_all(p)) for p in stores) == added
    assert stores == list(path.parent.iterdir())
