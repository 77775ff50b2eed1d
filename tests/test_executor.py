"""Executors: the same results wherever they are computed, and what is left when workers are killed."""

import os
import pickle
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from functools import partial
from typing import Any

import pytest
from helpers import works
from helpers.works import Fake, Unloadable

from tmsopt.errors import InputError
from tmsopt.executor import Crash, EngineError, cluster, cores, in_process, processes
from tmsopt.killable import KillableProcess, ProcessEnded, start_process


def local_cluster(workers, **options):
    distributed = pytest.importorskip("distributed")
    return distributed.LocalCluster(workers, dashboard_address=":0", silence_logs="CRITICAL", **options)


@pytest.fixture(scope="module")
def address():
    """A cluster whose scheduler gives up a task after the first worker it ended."""
    pytest.importorskip("distributed")  # its defaults are set first: the end of `config.set` would remove them
    config = pytest.importorskip("dask").config
    plan = {
        "distributed.scheduler.allowed-failures": 0,
        "distributed.deploy.lost-worker-timeout": "1 hour",  # it closes workers that happen to restart just then
    }
    with config.set(plan), local_cluster(2, threads_per_worker=1) as started:
        yield started.scheduler_address


@pytest.fixture(params=["processes", "cluster"])
def start(request):
    """The executors whose workers can be killed."""
    if request.param == "processes":
        return partial(processes, 2)
    return partial(cluster, request.getfixturevalue("address"))


def values(results):
    return {place: result if isinstance(result, Crash) else result[0] for place, result in results.items()}


# Results


def test_results_are_those_of_this_process(start, tmp_path):
    work = Fake(tmp_path)
    with in_process() as one, start() as many:
        alone, shared = dict(one.map(work, range(300))), dict(many.map(work, range(300)))
        assert list(many.map(work, [])) == []
    assert values(shared) == values(alone)
    assert len(alone) == 300
    assert os.getpid() not in {process for _, process in shared.values()}


class CountCalls:
    calls = 0

    def __call__(self, item):
        self.calls += 1
        return self.calls


def test_what_a_worker_builds_stays(start):
    """One function, loaded once in each worker, also from one map to the next."""
    loaded = CountCalls()
    with start() as executor:
        counts = [result for _ in range(2) for _, result in executor.map(loaded, range(20))]
    assert max(Counter(counts).values()) <= 2
    assert max(counts) >= 20


def test_an_exception_is_raised_here(start, tmp_path):
    with start() as executor:
        with pytest.raises(KeyError, match="7"):
            list(executor.map(Fake(tmp_path, raises=[7]), range(60)))
        assert len(list(executor.map(Fake(tmp_path), range(5)))) == 5


def test_work_that_cannot_be_loaded_is_an_end_with_a_reason(start, tmp_path):
    with start() as executor, pytest.raises(EngineError, match=r"cannot load the work: ValueError.*not a number"):
        list(executor.map(Unloadable(tmp_path), range(3)))


# Workers that end


@pytest.mark.slow
def test_a_crash_costs_its_item_alone(start, tmp_path):
    """Item 11 kills once and comes when it is tried again, item 23 kills whenever it is tried."""
    notes = []
    with start(notes.append) as executor:
        found = list(executor.map(Fake(tmp_path, 0.01, once=[11], always=[23]), range(40)))
    assert Counter(place for place, _ in found) == Counter(range(40))
    assert [place for place, result in found if isinstance(result, Crash)] == [23]
    assert any("worker died" in note and "alone" in note for note in notes)


@pytest.mark.slow
def test_a_process_tells_how_it_ended(tmp_path):
    notes = []
    with processes(2, notes.append) as executor:
        found = dict(executor.map(Fake(tmp_path, always=[1], leaves=[2]), range(3)))
    assert (found[1], found[2]) == (Crash("signal 9"), Crash("exit code 3"))
    assert found[0][0] == 0
    assert any("signal 9" in note for note in notes)


@pytest.mark.slow
def test_kills_from_outside_cost_nothing(tmp_path):
    """Also where a worker is killed while it writes an answer that fills the pipe."""
    chance = random.Random(0)
    with processes(2) as executor:
        killed, found = 0, dict[int, Any]()
        for place, result in executor.map(works.Big(tmp_path, 0.002), range(3000)):
            found[place] = result
            if killed < 10 and len(found) >= 200 * (killed + 1):
                killed += 1
                threading.Timer(chance.uniform(0, 0.1), os.kill, (result[1], signal.SIGKILL)).start()
    assert killed == 10
    assert values(found) == {n: len(str(n / 7)) * 1e5 for n in range(3000)}


def test_no_worker_at_all_is_refused():
    with pytest.raises(InputError, match="workers: found 0; accepted: 1 or more"):
        processes(0)


def test_workers_that_cannot_start_are_an_end_with_a_reason(monkeypatch):
    monkeypatch.setattr("sys.executable", "/bin/false")
    with processes(2) as executor, pytest.raises(EngineError, match="end before they start"):
        list(executor.map(abs, range(3)))


# Ends


def test_nothing_is_left_when_nobody_listens(tmp_path):
    with processes(2) as executor:
        results = executor.map(Fake(tmp_path, 0.01), range(10**5))
        workers = {next(results)[1][1] for _ in range(20)}
        results.close()
        assert workers
        assert not [pid for pid in workers if running(pid)]


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
@pytest.mark.skipif(sys.platform == "win32", reason="signals to process groups")
@pytest.mark.usefixtures("interruptible")
def test_workers_end_with_the_program(how, tmp_path):
    """Ctrl-C reaches all processes of a terminal at once, kill -9 only the program; neither leaves anything."""
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
    while any(running(pid) for pid in workers) and time.monotonic() < until:
        time.sleep(0.02)
    assert not [pid for pid in workers if running(pid)]


def running(pid):
    """Whether a process exists and is not a zombie that its reaper has still to read."""
    ended = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True, check=False)
    return bool(ended.stdout.strip()) and not ended.stdout.startswith("Z")


def test_a_killable_process_answers_raises_and_ends():
    process = KillableProcess()
    try:
        assert process.call(abs, -3).result(timeout=60) == 3
        assert isinstance(process.call(abs, "x").exception(timeout=60), TypeError)
        answer = process.call(time.sleep, 1000)
        time.sleep(0.1)
    finally:
        process.end()
    assert isinstance(answer.exception(timeout=60), ProcessEnded)
    assert isinstance(process.call(abs, 1).exception(timeout=60), ProcessEnded)


@pytest.mark.parametrize("end", [None, -3], ids=["between calls", "while it writes a call"])
def test_a_process_ends_if_its_parent_dies(end):
    with start_process() as process:
        process.stdin.write(pickle.dumps(bool) + (pickle.dumps((abs, (1,)))[:end] if end else b""))
        process.stdin.close()
        try:
            process.wait(timeout=30)
        finally:
            process.kill()


# Clusters that are refused


def test_workers_of_two_threads_are_refused(tmp_path):
    with (
        local_cluster(1, threads_per_worker=2, processes=False, protocol="tcp://") as started,
        cluster(started.scheduler_address) as executor,
        pytest.raises(InputError, match=r"has 2: start every worker with 'dask worker ADDRESS --nthreads 1'"),
    ):
        list(executor.map(Fake(tmp_path), range(3)))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("wrong", ["nowhere", "tcp://127.0.0.1:99999", "http://127.0.0.1:1"])
def test_an_address_without_a_scheduler_is_refused(wrong, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("tmsopt.executor.PATIENCE", 0.5)
    with cluster(wrong) as executor, pytest.raises(InputError, match=f"no Dask scheduler answers at '{wrong}'"):
        list(executor.map(abs, range(3)))


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with cluster("tcp://127.0.0.1:1") as executor, pytest.raises(InputError, match=r'pip install "tmsopt\[cluster\]"'):
        list(executor.map(abs, range(3)))


@pytest.mark.slow
def test_a_scheduler_that_is_lost_is_an_end_with_a_reason(tmp_path):
    """What has come by then stands."""
    with local_cluster(1, threads_per_worker=1) as started, cluster(started.scheduler_address) as executor:
        results = executor.map(Fake(tmp_path, 0.01), range(10**5))
        found = [next(results) for _ in range(5)]
        started.close()
        with pytest.raises(EngineError, match=r"scheduler at .* is lost"):
            found.extend(results)
    assert len(found) >= 5


def test_there_is_a_core():
    assert cores() >= 1
