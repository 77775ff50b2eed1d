"""Engines: the same rows wherever they are solved, and what is left when workers are killed."""

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from helpers.works import Fake, Unloadable

from tmsopt.errors import InputError
from tmsopt.processes import cores
from tmsopt.studies import Row
from tmsopt.studies.engines import Assignments, EngineError, cluster, in_process, processes

Units = Sequence[tuple[int, ...]]
Engine = Callable[..., Iterator[Row]]
BLOCKS: Units = [tuple(range(n, n + 5)) for n in range(0, 60, 5)]


def singles(count: int) -> Units:
    return [(n,) for n in range(count)]


def identities(rows: Sequence[Row]) -> list[str]:
    return [row.identity for row in sorted(rows, key=lambda row: row.number)]


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A cluster whose scheduler gives up a task after the first worker it ended: the engine must not."""
    distributed = pytest.importorskip("distributed")
    import dask

    plan = {
        "distributed.scheduler.allowed-failures": 0,
        "distributed.deploy.lost-worker-timeout": "1 hour",  # it closes workers that happen to restart just then
    }
    with (
        dask.config.set(plan),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs="CRITICAL"
        ) as started,
    ):
        yield started.scheduler_address


@pytest.fixture(params=["processes", "cluster"])
def engine(request: pytest.FixtureRequest) -> Engine:
    """The engines whose workers can be killed, as functions of work, units and note."""
    if request.param == "processes":
        return lambda work, units, note=lambda line: None: processes(work, units, 2, note)
    at = request.getfixturevalue("address")
    return lambda work, units, note=lambda line: None: cluster(work, units, at, note)


# The same rows


@pytest.mark.slow
@pytest.mark.parametrize("units", [singles(60), BLOCKS], ids=["rows", "blocks"])
def test_rows_are_the_same_bits_as_in_this_process(engine: Engine, units: Units, tmp_path: Path) -> None:
    here = list(in_process(Fake(tmp_path), units))
    there = list(engine(Fake(tmp_path), units))
    assert identities(there) == identities(here)
    assert len(here) == 60
    assert str(os.getpid()) not in {row.host for row in there}


def test_number_of_workers_does_not_matter(tmp_path: Path) -> None:
    work = Fake(tmp_path, raises=(7,))
    assert identities(list(processes(work, BLOCKS, 1))) == identities(list(processes(work, BLOCKS, 3)))


def test_an_exception_fails_its_row_alone_and_the_same_everywhere(engine: Engine, tmp_path: Path) -> None:
    work = Fake(tmp_path, raises=(7, 31))
    here, there = list(in_process(work, BLOCKS)), list(engine(work, BLOCKS))
    assert identities(there) == identities(here)
    assert {row.number: row.cause for row in there if row.status == "failed"} == {7: "KeyError(7)", 31: "KeyError(31)"}


def test_rows_that_were_not_asked_for_are_no_rows(tmp_path: Path) -> None:
    work = Fake(tmp_path)
    (row,) = in_process(_Wrong(tmp_path), [(4,)])
    assert row.status == "failed"
    assert "[3] came back for [4]" in row.cause
    assert [row.status for row in in_process(work, [])] == []


class _Wrong(Fake):
    def __call__(self, numbers: tuple[int, ...]) -> Sequence[Row]:
        return super().__call__(tuple(n - 1 for n in numbers))


# Workers that end


@pytest.mark.slow
def test_killed_workers_cost_the_row_they_were_at(engine: Engine, tmp_path: Path) -> None:
    """Row 11 kills once and comes the second time, row 23 kills whenever it is tried; no other row is lost with them."""
    notes: list[str] = []
    work = Fake(tmp_path, 0.01, once=(11,), always=(23,))
    rows = list(engine(work, singles(40), notes.append))
    assert Counter(row.number for row in rows) == Counter(range(40))
    (lost,) = (row for row in rows if row.status != "optimal")
    assert (lost.number, lost.status) == (23, "quarantined")
    assert lost.cause.startswith("ended its worker twice")
    assert any("died" in note and "while solving row" in note and "alone" in note for note in notes)
    assert any(note.endswith("row 23 is quarantined") for note in notes)


def test_finished_rows_of_a_killed_process_are_not_solved_again(tmp_path: Path) -> None:
    """Also where the next row kills in the instant it begins."""
    work, notes = Fake(tmp_path, once=(11, 30)), list[str]()
    assert Counter(row.number for row in processes(work, singles(60), 2, notes.append)) == Counter(range(60))
    assert {n: work.tries(n) for n in range(60) if work.tries(n) != 1} == {11: 2, 30: 2}
    assert sorted(note.partition(" while solving ")[2] for note in notes) == [
        f"row {n}; row {n} will be tried again, alone" for n in (11, 30)
    ]


@pytest.mark.slow
def test_a_block_that_kills_is_taken_apart(tmp_path: Path) -> None:
    rows = list(processes(Fake(tmp_path, always=(23,)), BLOCKS, 2))
    assert Counter(row.number for row in rows) == Counter(range(60))
    assert [row.number for row in rows if row.status == "quarantined"] == [23]
    alone = {row.number: row.objective for row in in_process(Fake(tmp_path), [(20,), (21,), (22,), (24,)])}
    assert {row.number: row.objective for row in rows if row.number in alone} == alone


def test_a_process_tells_how_it_ended(tmp_path: Path) -> None:
    rows = list(processes(Fake(tmp_path, always=(1,), leaves=(2,)), singles(3), 1))
    causes = {row.number: row.cause for row in rows if row.status == "quarantined"}
    assert causes == {1: "ended its worker twice (signal 9)", 2: "ended its worker twice (exit code 3)"}


def test_work_that_cannot_be_loaded_is_an_end_with_a_reason(engine: Engine, tmp_path: Path) -> None:
    with pytest.raises(EngineError, match=r"cannot load the study: ValueError.*not a study"):
        list(engine(Unloadable(tmp_path), singles(3)))


def test_no_worker_at_all_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="workers: 0; accepted: 1 or more"):
        list(processes(Fake(tmp_path), singles(3), 0))


# Ends


def test_nothing_is_left_when_nobody_listens(tmp_path: Path) -> None:
    rows = processes(Fake(tmp_path, 0.01), singles(10**5), 2)
    hosts = {int(next(rows).host) for _ in range(20)}
    rows.close()  # type: ignore[attr-defined]  # it is a generator
    assert hosts
    assert not [pid for pid in hosts if _running(pid)]


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
@pytest.mark.skipif(sys.platform == "win32", reason="signals to process groups")
@pytest.mark.usefixtures("interruptible")
def test_workers_end_with_the_program(how: signal.Signals, tmp_path: Path) -> None:
    """Ctrl-C reaches all processes of a terminal at once, kill -9 only the program; neither leaves anything."""
    from helpers import works

    program = subprocess.Popen(
        [sys.executable, works.__file__, str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert program.stdout is not None
    workers = [int(program.stdout.readline()) for _ in range(2)]
    (os.killpg if how is signal.SIGINT else os.kill)(program.pid, how)
    try:
        out, err = program.communicate(timeout=30)
    except subprocess.TimeoutExpired:
        os.killpg(program.pid, signal.SIGKILL)  # or it would work on beside all other tests
        raise
    assert (out, err) == ("interrupted\n" if how is signal.SIGINT else "", "")
    until = time.monotonic() + 20
    while any(_running(pid) for pid in workers) and time.monotonic() < until:
        time.sleep(0.02)
    assert not [pid for pid in workers if _running(pid)]


def _running(pid: int) -> bool:
    """Whether a process exists and is not a zombie that its reaper has still to read."""
    ended = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True, check=False)
    return bool(ended.stdout.strip()) and not ended.stdout.startswith("Z")


# Clusters that are refused


def test_workers_of_two_threads_are_refused(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, protocol="tcp://", dashboard_address=":0"
        ) as started,
        pytest.raises(InputError, match=r"has 2: start every worker with 'dask worker ADDRESS --nthreads 1'"),
    ):
        list(cluster(Fake(tmp_path), singles(3), started.scheduler_address))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("wrong", ["nowhere", "tcp://127.0.0.1:99999", "http://127.0.0.1:1"])
def test_an_address_without_a_scheduler_is_refused(wrong: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("tmsopt.studies.engines.dask_workers.PATIENCE", 0.5)
    with pytest.raises(InputError, match=f"no Dask scheduler answers at '{wrong}'"):
        list(cluster(Fake(tmp_path), singles(3), wrong))


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r'pip install "tmsopt\[cluster\]"'):
        list(cluster(Fake(tmp_path), singles(3), "tcp://127.0.0.1:1"))


# The rules, with no workers at all


def test_a_row_that_ended_a_worker_is_tried_again_in_no_company() -> None:
    """Short units are sent several at a time, but none to a worker that holds a suspect."""
    assignments = Assignments(Fake(Path()), singles(200), lambda line: None)
    assignments.join("first")
    while (batch := assignments.batch("first")) != () and len(batch) < 4:
        for unit in batch:
            assignments.delivered("first", unit, 0.001)
    suspect = batch[0]
    assignments.ended("first", "a worker died", "")
    assignments.join("second")
    assert assignments.batch("second") == (suspect,)
    assert assignments.batch("second") == ()
    assignments.delivered("second", suspect, 0.001)
    assert len(assignments.batch("second")) > 1


@pytest.mark.parametrize("seed", range(50))
def test_every_row_is_settled_once_whatever_happens(seed: int) -> None:
    """Workers that come, deliver, end, leave and are late, in any order."""
    chance = random.Random(seed)
    size = chance.randint(1, 4)
    units = [tuple(range(n, n + size)) for n in range(0, 12 * size, size)]
    work = Fake(Path())
    assignments = Assignments(work, units, lambda line: None)
    settled: Counter[int] = Counter()
    held: dict[str, list[tuple[int, ...]]] = {}
    late: list[tuple[str, tuple[int, ...]]] = []
    ends: Counter[int] = Counter()
    for step in range(2000):
        if not assignments.unfinished:
            break
        if not held:
            held[str(step)] = []
            assignments.join(str(step))
        for worker, mine in held.items():
            mine.extend(assignments.batch(worker))
        worker = chance.choice(list(held))
        mine = held[worker]
        event = chance.choice(["deliver"] * 4 + ["end", "leave", "join", "late"])
        if event == "deliver" and mine:
            unit = mine.pop(0)
            assert assignments.delivered(worker, unit, chance.random())
            settled.update(unit)
        elif event == "late" and late:
            assert not assignments.delivered(*late.pop(), 0.1)
        elif event == "end":
            late.extend((worker, unit) for unit in held.pop(worker))
            ends.update(mine[0] if mine else ())
            settled.update(row.number for row in assignments.ended(worker, "a worker died", ""))
        elif event == "leave":
            late.extend((worker, unit) for unit in held.pop(worker))
            assignments.returned(worker)
        elif event == "join" and len(held) < 4:
            held[f"another {step}"] = []
            assignments.join(f"another {step}")
    assert not assignments.unfinished
    assert settled == Counter(range(12 * size))
    assert max(ends.values(), default=0) <= (2 if size == 1 else 4)  # twice in its block, twice alone


@pytest.mark.parametrize(("seconds", "least", "most"), [(0.001, 0.1, 0.2), (0.01, 0.19, 0.21), (0.3, 0.3, 0.3)])
def test_batches_take_a_fifth_of_a_second_and_get_smaller_towards_the_end(
    seconds: float, least: float, most: float, tmp_path: Path
) -> None:
    assignments = Assignments(Fake(tmp_path), singles(5000), lambda line: None)
    assignments.join("a")
    assignments.join("b")
    sizes: list[int] = []
    while assignments.unfinished:
        for worker in "ab":
            batch = assignments.batch(worker)
            sizes += [len(batch)] if batch else []
            for unit in batch:
                assignments.delivered(worker, unit, seconds)
    assert sizes[:3] == [1, 1, 1]
    assert least <= max(sizes) * seconds <= most
    assert sizes[-1] == 1


def test_there_is_a_core() -> None:
    assert cores() >= 1
