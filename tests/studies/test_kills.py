"""Twenty thousand rows through thirty kills at random moments: of the study, and of its workers."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from helpers.rows import assert_same, stored

from tmsopt.studies import load_study, prepare_study, read_results, solve_row, view_store

ROWS, KILLS, SAMPLE = 20_000, 30, 25
PAUSE = (0.3, 2.0)
"""s of work between kills: some shorter than the second after which rows are committed, some longer."""

GRACE = 0.5  # s between the looks of a worker at its parent
PATIENCE = 60.0  # s for the first row of a study that starts


def workers_of(pid):
    found = subprocess.run(
        ["ps", "-ww", "-o", "pid=,args=", "--ppid", str(pid)], capture_output=True, text=True, check=False
    )
    return [int(line.split()[0]) for line in found.stdout.splitlines() if "tmsopt.killable" in line]


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="finds workers by ps --ppid")
def test_nothing_is_lost_or_solved_twice(tmp_path):
    """What the store has acknowledged stays there and is never solved again; rows are those of any other run."""
    (tmp_path / "built.toml").write_text(  # of the angular frequency each row is judged for itself
        f'title = "built"\n[study]\nmethod = "sobol"\nrows = {ROWS}\n[vary]\nFr = {{ min = 1, max = 3 }}\n'
        'chi_B = { min = 1.2, max = 1.6 }\n[problem]\nmodel = "tms"\n[problem.parameters]\nchi_H = 1.0\nzeta_H = -0.2\n'
        "zeta_B = -0.4\nmu = 0.1\nchi_B = 1.4\nFr = 2\nlambda_s = 0.35\n[problem.objective]\n"
        'minimize = "angular_frequency"\n',
        encoding="utf-8",
    )
    path, rng = tmp_path / "s.sqlite", random.Random(0)
    command = [sys.executable, "-m", "tmsopt", "study", "built.toml", "--workers", "2", "--store", str(path), "--json"]

    def start():
        return subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    process, acknowledged, killed, workers = start(), set[int](), {"study": 0, "worker": 0}, set[int]()
    try:
        for _ in range(KILLS):
            until = time.monotonic() + PATIENCE
            while len(stored(path)) <= len(acknowledged):
                assert time.monotonic() < until, "no row came"
                time.sleep(0.05)
            time.sleep(rng.uniform(*PAUSE))
            assert process.poll() is None, "the study ended before all kills; give it more rows"
            there = workers_of(process.pid)
            workers.update(there)
            if there and rng.random() < 0.5:
                os.kill(rng.choice(there), signal.SIGKILL)
                killed["worker"] += 1
            else:
                process.kill()
                process.wait()
                killed["study"] += 1
                process = start()
            now = stored(path)
            assert acknowledged <= now
            acknowledged = now
        assert process.wait() == 0
    finally:
        process.kill()
    assert min(killed.values()) >= KILLS // 4
    with view_store(path) as store:
        added = sum(session["rows"] for session in store.sessions())
    study = prepare_study(load_study(tmp_path / "built.toml"))
    rows = read_results(study, path).rows
    assert [row.number for row in rows] == list(range(ROWS))
    assert added == ROWS
    assert {row.status for row in rows} == {"optimal"}
    numbers = rng.sample(range(ROWS), SAMPLE)
    assert_same([solve_row(study, number).row for number in numbers], [rows[number] for number in numbers])
    time.sleep(2 * GRACE)
    assert not {pid for pid in workers if Path(f"/proc/{pid}").exists()}
