"""The store of a study: no acknowledged row is lost, no other file is touched, numbers come back as they were."""

import csv
import itertools
import math
import os
import random
import shutil
import sqlite3
import subprocess
import sys
import tempfile
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.oracles import abscissa_60, polynomial_60
from helpers.rows import STUDY, faults, numbers_in, row, stored
from helpers.works import little_room

from tmsopt.models import tms
from tmsopt.problem import Problem, load
from tmsopt.records import Table
from tmsopt.studies import (
    RowTable,
    Study,
    batch_rows,
    check_same_study,
    open_store,
    read_results,
    run_study,
    view_store,
)

SPECIAL = (math.nan, math.inf, -math.inf, 0.0, 5e-324, -2.2250738585072011e-308, 1.7976931348623157e308, 0.1)
OLD = Path(__file__).parent / "stores"
posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")


def rows_of(path, study=STUDY):
    with view_store(path) as opened:
        return list(RowTable(study, opened.read_batches()))


def keep(path, *rows, study=STUDY, **options):
    """Store rows, and give the warnings."""
    with open_store(path, study, **options) as opened:
        opened.add(batch_rows(rows))
        return opened.warnings


@pytest.fixture
def path(tmp_path):
    """Of a store to be: in memory where the system has such files, since ``kill -9`` asks nothing of a disk."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else tmp_path) as folder:
        yield Path(folder) / "study.sqlite"


# A process that writes, and is killed

WRITER = """
import os, random, sys, time
from pathlib import Path
sys.path.insert(0, str(Path("tests").resolve()))
from helpers.oracles import abscissa_60, polynomial_60
from helpers.rows import STUDY, numbers_in, row
from tmsopt.studies import batch_rows, open_store
path, task = sys.argv[1:]
with open_store(path, STUDY) as opened:
    print(os.getpid(), flush=True)
    if task == "hold":
        time.sleep(60)
    number = len(numbers_in(opened))
    while True:
        batch = [row(n) for n in range(number, number + random.randint(1, 20))]
        opened.add(batch_rows([*batch]))
        number += len(batch)
        print(number, flush=True)
"""


@contextmanager
def writer(path, task="write"):
    """A process that has the store open, and its id; killed with SIGKILL in the end."""
    command = [sys.executable, "-c", WRITER, str(path), task]
    root = Path(__file__).parents[2]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=root, start_new_session=True)
    assert process.stdout is not None
    try:
        yield process, int(process.stdout.readline())
    finally:
        process.kill()
        process.stdout.read()
        process.wait()
        process.stdout.close()


def test_a_second_writer_is_refused_until_the_first_is_gone(path):
    with writer(path, "hold") as (process, number):
        message = faults(open_store, path, STUDY)
        assert f"process {number} on " in message
        assert "another --store" in message
        faults(open_store, path, STUDY, fresh=True)
        process.kill()
        process.wait()
        with open_store(path, STUDY) as opened:
            opened.add(batch_rows([row(0)]))
            assert str(os.getpid()) in faults(open_store, path, STUDY)  # within one process too
    assert stored(path) == {0}
    assert [p.name for p in path.parent.iterdir()] == [path.name]  # one plain file, which can be copied
    with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro&immutable=1", uri=True)) as connection:
        assert connection.execute("SELECT number, status, abscissa FROM rows").fetchall() == [(0, "optimal", -1.0)]


# Rows


def test_numbers_come_back_and_rows_are_in_order(path):
    """Also nan where it is a value, and names that differ in capitals alone."""
    limits = {"c": "Fr <= 2", "C": "Fr <= 3", 'it\'s "c"': "Fr <= 4"}
    study = replace(STUDY, report=["Fr"], problem=replace(STUDY.problem, constraints=limits))
    kept = [
        row(
            n,
            objective=x,
            bound=x,
            gap=x,
            reports=Table({"Fr": x}),
            violations=Table(dict.fromkeys(limits, 1 / (n + 1))),
        )
        for n, x in enumerate(SPECIAL)
    ]
    kept += [row(len(SPECIAL), status="failed", cause="two\nlines 'quoted' χ", host="here", proven=True, warm=True)]
    kept += [row(len(kept) + 1, reports=Table({"Fr": -math.inf}), laws=Table({"w0": -math.inf, "epset": -math.nan}))]
    for one in reversed(kept):
        keep(path, one, study=study)
    found = rows_of(path, study)
    assert dict(found.pop().laws) == {"w0": -math.inf}
    assert list(map(str, found)) == list(map(str, kept[:-1]))


def test_a_store_holds_more_numbers_than_a_table_of_sqlite_has_columns(path):
    study = replace(STUDY, report=[f"Fr + {k}" for k in range(1000)])
    limits = {f"c{k}": f"Fr <= {k}" for k in range(1000)}
    study = replace(study, problem=replace(STUDY.problem, constraints=limits))
    one = row(0, reports=Table(dict.fromkeys(study.report, 1.5)), violations=Table(dict.fromkeys(limits, 0.1)))
    keep(path, one, study=study)
    assert rows_of(path, study) == [one]


def test_a_row_is_never_overwritten_and_may_be_forgotten(path):
    keep(path, row(1), row(2))
    with open_store(path, STUDY) as opened:
        opened.add(batch_rows([row(1, seconds=9.0, host="elsewhere"), row(3)]))
        opened.add(batch_rows([]))
        assert numbers_in(opened) == [1, 2, 3]
        assert [session["rows"] for session in opened.sessions()] == [2, 1]
        opened.forget([2])
    assert rows_of(path) == [row(1), row(3)]


# What the store knows of its study


def test_what_a_store_says_of_itself(path):
    assert keep(path, row(0)) == keep(path) == ()
    with view_store(path) as opened:
        about, sessions = opened.about(), opened.sessions()
    assert about["schema"] == 3
    assert about["definition"]["seed"] == about["seed"] == 7
    assert "columns" not in about["definition"]
    assert set(about["versions"]) == {"python", "tmsopt", "casadi", "numpy", "scipy", "python-flint", "ipopt"}
    pid = os.getpid()
    assert [(s["rows"], s["pid"], s["ended"] is None) for s in sessions] == [(1, pid, False), (0, pid, False)]


SMALL = Study(STUDY.problem, {"mu": [0.1, 0.2, 0.3], "zeta_B": [-0.4, -0.5, -0.6]}, seed=7)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"seed": 8}, "seed: 7 in the store, 8 in the file"),
        ({"starts": 3}, "starts: 64 in the store, 3 in the file"),
        (
            {"problem": replace(SMALL.problem, fixed={**SMALL.problem.fixed, "zeta_H": -0.3})},
            "problem.fixed.zeta_H: -0.2 in the store, -0.3 in the file",
        ),
        (
            {"columns": {**SMALL.columns, "mu": [0.1, 0.25, 0.35]}},
            "columns.mu: 2 of 3 values differ, the first in row 1: 0.2 in the store, 0.25 in the file",
        ),
        ({"columns": {n: v[:2] for n, v in SMALL.columns.items()}}, "columns.mu: 3 values in the store, 2 in the file"),
        ({"columns": {"mu": [0.1, 0.2, 0.3]}}, "columns.zeta_B: 3 values in the store, none in the file"),
    ],
    ids=str,
)
def test_the_store_of_a_changed_study_is_refused(path, change, line):
    keep(path, row(0), study=SMALL)
    before = path.read_bytes()
    message = faults(open_store, path, replace(SMALL, **change))
    advice, *lines = message.splitlines()
    assert lines[0] == f"  {line}"
    assert len(lines) == (2 if "2 in the file" in line else 1)
    assert "--fresh" in advice
    assert "--store" in advice
    assert path.read_bytes() == before
    assert stored(path) == {0}


def test_fresh_moves_aside_and_never_deletes(path):
    for number in range(3):
        warnings = keep(path, row(number), study=replace(STUDY, seed=number), fresh=True)
        assert warnings == (f"moved the old store to {path.with_name(f'study.{number}.sqlite')}",) * (number > 0)
    for name, number in (("study.1.sqlite", 0), ("study.2.sqlite", 1), ("study.sqlite", 2)):
        with view_store(path.with_name(name)) as opened:
            assert (opened.about()["seed"], numbers_in(opened)) == (number, [number])
    assert len(list(path.parent.iterdir())) == 3


@pytest.mark.parametrize("gone", [False, True], ids=["fresh", "the store is gone"])
def test_what_a_killed_writer_left_in_its_log_is_moved_aside(gone, path):
    """With the store; or alone, and then it is not played into the new store."""
    with writer(path) as (process, _):
        acknowledged = [int(process.stdout.readline()) for _ in range(3)][-1]
        process.kill()
        process.wait()
    assert path.with_name("study.sqlite-wal").exists()
    if gone:
        path.unlink()
    keep(path, fresh=not gone)
    assert stored(path) == set()
    assert path.with_name("study.1.sqlite-wal").exists() == gone
    assert gone or len(stored(path.with_name("study.1.sqlite"))) >= acknowledged


def test_other_versions_are_a_warning(path, monkeypatch):
    keep(path, row(0))
    with view_store(path) as opened:
        there = opened.about()["versions"]
    monkeypatch.setattr("tmsopt.studies.store._versions", lambda: there | {"tmsopt": "0.9.9"})
    assert keep(path) == (f'tmsopt: "{there["tmsopt"]}" in the store, "0.9.9" now',)


# Files that are no store, damage, and places that cannot be written


def other_database(path):
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("CREATE TABLE mine (x)")


def newer_store(path):
    keep(path)
    spoil(path, "PRAGMA user_version=4")


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda path: path.write_bytes(random.Random(1).randbytes(5000)), "is not a store of tmsopt"),
        (lambda path: path.write_text("[parameters]\n"), "is not a store of tmsopt"),
        (lambda path: path.write_bytes(b""), "is not a store of tmsopt"),
        (other_database, "is not a store of tmsopt"),
        (newer_store, "its schema is 4, this version reads up to 3"),
    ],
)
def test_a_file_that_is_no_store_is_not_touched(path, make, expected):
    make(path)
    before = path.read_bytes()
    assert expected in faults(view_store, path)
    for fresh in (False, True):
        assert expected in faults(open_store, path, STUDY, fresh=fresh)
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_places_where_no_store_can_be(tmp_path):
    assert "not a regular file" in faults(open_store, tmp_path, STUDY)
    assert "does not exist" in faults(open_store, tmp_path / "no" / "a.sqlite", STUDY)
    assert "no such file" in faults(view_store, tmp_path / "a.sqlite")
    assert "name" in faults(open_store, tmp_path / ("x" * 300), STUDY)
    if sys.platform == "linux":
        assert "written" in faults(open_store, "/proc/a.sqlite", STUDY)
        assert "not a regular file" in faults(open_store, "/dev/null", STUDY)
    assert list(tmp_path.iterdir()) == []


def spoil(path, script):
    """Change a store as any other program can."""
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.executescript(script)


ENDLESS = "WITH RECURSIVE c(n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM c) SELECT n AS number FROM c"
NESTED = "[" * 100_000 + "]" * 100_000


@pytest.mark.parametrize(
    "script",
    [
        "DROP TABLE rows",
        f"DROP TABLE rows; CREATE VIEW rows AS {ENDLESS}",
        "CREATE TRIGGER t AFTER INSERT ON sessions BEGIN DELETE FROM rows; END",
        "CREATE VIRTUAL TABLE v USING fts4(x)",
        "UPDATE rows SET status = 'fine'",
        "UPDATE rows SET status = CAST(x'ff' AS TEXT)",
        "UPDATE rows SET abscissa = 'none'",
        "UPDATE rows SET numbers = CAST('text' AS TEXT)",
        "UPDATE rows SET numbers = x'00112233' || zeroblob(9000)",
        "UPDATE sessions SET versions = '7'",
        "DELETE FROM study WHERE key = 'definition'",
        "UPDATE columns SET doubles = x'00'",
        f"UPDATE study SET value = '{NESTED}' WHERE key = 'definition'",
        "UPDATE study SET value = '[]' WHERE key = 'definition'",
    ],
)
def test_a_spoiled_store_is_refused_and_moved_aside_by_fresh(script, path):
    """Nothing of it is run or believed."""

    def read_whole():
        check_same_study(path, STUDY)
        with view_store(path) as opened:
            opened.about(), opened.sessions(), opened.read_batches()

    def go_on():
        with open_store(path, STUDY) as opened:
            opened.read_batches()

    keep(path, row(0))
    spoil(path, script)
    for message in (faults(read_whole), faults(go_on)):
        assert "damaged" in message or "another study" in message
        assert "--fresh" in message
        assert len(message) < 2000
    keep(path, fresh=True)
    assert stored(path) == set()
    assert sorted(p.name for p in path.parent.iterdir()) == ["study.1.sqlite", "study.sqlite"]


def test_a_damaged_file_is_said_to_be(path):
    keep(path, *map(row, range(1000)))
    whole = path.read_bytes()
    for damaged in (whole[:4096] + b"\xa5" * (len(whole) - 4096), whole[: len(whole) // 2]):
        path.write_bytes(damaged)
        assert "is damaged" in faults(open_store, path, STUDY)
        assert "is damaged" in faults(rows_of, path)
        assert path.read_bytes() == damaged
    keep(path, row(0), fresh=True)
    assert path.with_name("study.1.sqlite").exists()


@posix
def test_a_full_disk_costs_no_row_that_was_acknowledged(path):
    """A limit on the size of files stands for the disk: SQLite calls the one an I/O error and the other full."""
    acknowledged = [0]

    def fill():
        for first in itertools.count(0, 100):
            opened.add(batch_rows([*map(row, range(first, first + 100))]))
            acknowledged.append(first + 100)

    with open_store(path, SMALL) as opened:
        with little_room(200_000):
            assert "disk" in faults(fill)
        assert numbers_in(opened) == list(range(acknowledged[-1]))
        opened.add(batch_rows([row(acknowledged[-1])]))
    assert stored(path) == set(range(acknowledged[-1] + 1))
    assert acknowledged[-1] > 0


# Stores of tmsopt 1.1, whose rows were exported by it: solved ones of schema 1, and judged ones of schema 2

EP4 = replace(load("problems/ep4.toml"), constraints={"slow": "Fr <= 2.0", "trail": "nu_H >= 0.01"})
FIXED = {"chi_H": 1.0, "zeta_H": -0.2, "zeta_B": -0.4, "mu": 0.1, "chi_B": 1.4, "Fr": 2.0, "lambda_s": 0.35}
LIMITS = {"decay": "abscissa <= -0.3", "slow": "Fr <= 2.5"}
STUDIES = {
    "solved": Study(
        EP4,
        {
            "zeta_B": [-0.3, -0.5, -0.7, -0.4],
            "slow.limit": [4.0, 3.0, 0.5, 3.0],
            "chi_B.min": [1.01, 1.01, 1.01, 6.0],
        },
        report=("2*Fr",),
        seed=3,
        starts=4,
    ),
    "judged": Study(
        Problem(tms, fixed=FIXED, minimize="abscissa", constraints=LIMITS),
        {"Fr": [1.0, 1.5, 2.0, 2.2, 2.4, 2.6, 2.8, 3.0], "chi_B": [1.2, 1.4, 1.6, 1.4, 1.2, 1.4, 1.4, 1.6]},
        report=("2*Fr",),
        seed=5,
    ),
}


def assert_same_table(one, other, ignored=()):
    """Texts are equal, and numbers to 1e-9 of their size; rounding errors of laws by themselves."""
    tables = [list(csv.DictReader(path.read_text(encoding="utf-8").splitlines())) for path in (one, other)]
    assert list(tables[0][0]) == list(tables[1][0])
    for a, b in zip(*tables, strict=True):
        for name in a.keys() - set(ignored):
            if a[name] != b[name]:
                assert float(a[name]) == pytest.approx(float(b[name]), rel=1e-9, abs=1e-13), (name, a["number"])


@pytest.mark.parametrize("name", STUDIES)
def test_a_store_of_version_1_is_read_exported_and_goes_on(name, path, tmp_path):
    study, exported = STUDIES[name], tmp_path / "rows.csv"
    shutil.copy(OLD / f"{name}.sqlite", path)
    before = path.read_bytes()
    read_results(study, path).export(exported)
    assert_same_table(exported, OLD / f"{name}.csv")
    assert path.read_bytes() == before
    again = run_study(study, path, workers=1)
    assert (again.found, again.solved) == (len(study), 0)
    with open_store(path, study) as opened:
        assert opened.about()["schema"] == 3
        assert [s["rows"] for s in opened.sessions()] == [len(study), 0, 0]
        opened.forget([1, 3])
    last = run_study(study, path, workers=1)
    assert (last.found, last.solved) == (len(study) - 2, 2)
    last.export(exported)
    # Last bits of a design, which move its fourfold root by 1e-4, are another processor's own; starts are its search's.
    assert_same_table(exported, OLD / f"{name}.csv", ("seconds", "host", "abscissa_realised", "starts"))
    solved = last.rows[1]
    exact = float(abscissa_60(polynomial_60(**solved.parameters)))
    assert solved.abscissa_realised == pytest.approx(exact, rel=1e-9)
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_a_damaged_store_of_version_1_is_refused(path):
    for name, script in (
        ("solved", "UPDATE rows SET data = '[]'"),
        ("solved", "UPDATE columns SET doubles = x'00'"),
        ("solved", "UPDATE columns SET doubles = x'0011'"),
        ("judged", "UPDATE blocks SET data = x'00'"),
        ("judged", "DELETE FROM about"),
    ):
        shutil.copy(OLD / f"{name}.sqlite", path)
        spoil(path, script)
        before = path.read_bytes()
        assert "is damaged" in faults(read_results, STUDIES[name], path)
        assert "is damaged" in faults(open_store, path, STUDIES[name])
        assert path.read_bytes() == before
