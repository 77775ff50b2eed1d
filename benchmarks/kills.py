"""Ten thousand rows through twenty kills: ``python -m benchmarks.kills``.

The study runs in a process of its own that notes every row when it is solved and again when the store has acknowledged
it. Sometimes that process is killed and started again, sometimes one of its workers; of a Dask cluster, workers.
"""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from tqdm import tqdm

from benchmarks.report import keep, kept, origin, table
from tmsopt.design.files import load
from tmsopt.solver.solve import solve
from tmsopt.studies.monte_carlo import monte_carlo
from tmsopt.studies.row import Row
from tmsopt.studies.run import fill
from tmsopt.studies.solving import Solver
from tmsopt.studies.store.store import Store, open_store, read_store
from tmsopt.studies.study import Study, definition

_EP4 = Path(__file__).parent.parent / "problems" / "ep4.toml"
_PAUSE = (0.3, 3.0)  # s of work between kills
_SAMPLE = 100  # rows solved again here, and compared


def drawn(rows: int) -> Study:
    """The EP4 as a workshop builds it: rows of a hundredth of a second."""
    return monte_carlo(solve(load(_EP4)), rows, tolerances={"chi_B": 0.005, "lambda_s": 0.01, "Fr": 0.02})


class Watched:
    """A store that notes rows before and after it has acknowledged them."""

    def __init__(self, store: Store, log: Path) -> None:
        self._store, self._log = store, log.open("a", encoding="ascii", buffering=1)

    def done(self) -> set[int]:
        """As of the store."""
        return self._store.done()

    def add(self, rows: Sequence[Row]) -> None:
        """To the store, noted."""
        self._note("solved", rows)
        self._store.add(rows)
        self._note("kept", rows)

    def _note(self, word: str, rows: Sequence[Row]) -> None:
        self._log.write("".join(f"{word} {row.number}\n" for row in rows))


def carry_out(path: str, log: str, rows: int, workers: int | None, scheduler: str | None) -> None:
    """The study, in a process that may be killed."""
    study = drawn(rows)
    with open_store(Path(path), definition(study)) as store:
        watched: Any = Watched(store, Path(log))
        fill(study, watched, workers=workers, scheduler=scheduler, note=lambda line: print(line, file=sys.stderr))


@dataclass(frozen=True)
class Told:
    """What was found after all kills.

    Attributes:
        kills: of the study's process, and of workers.
        rows: in the store.
        lost: rows that were acknowledged once and are not there.
        twice: rows solved again after they had been acknowledged.
        again: rows solved, not yet acknowledged when the process was killed, and solved again.
        different: of a sample solved here once more, rows with other bits.
    """

    kills: tuple[int, int]
    rows: int
    lost: int
    twice: int
    again: int
    quarantined: int
    different: int
    seconds: float


def survived(rows: int, kills: int, seed: int, scheduler: bool) -> Told:
    """Run the study to its end through so many kills at random moments."""
    rng = random.Random(seed)
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, _workers(scheduler) as (address, pids):
        path, log = Path(folder) / "s.sqlite", Path(folder) / "log"
        start = _starter(path, log, rows, address)
        process = start()
        counts = [0, 0]
        with tqdm(total=kills, desc="kills") as bar:
            while sum(counts) < kills and _goes_on(process, path, rng.uniform(*_PAUSE)):
                workers = pids() if address else _children(process.pid)
                of_worker = bool(address) or (rng.random() < 0.5 and bool(workers))
                os.kill(rng.choice(workers) if of_worker else process.pid, signal.SIGKILL)
                counts[of_worker] += 1
                bar.update()
                if not of_worker:
                    process.wait()
                    process = start()
        process.wait()
        return _judged(path, log, rows, (counts[0], counts[1]), time.perf_counter() - began)


def _starter(path: Path, log: Path, rows: int, address: str | None) -> Callable[[], "subprocess.Popen[bytes]"]:
    arguments = (str(path), str(log), rows, None if address else 2, address)
    code = f"from benchmarks.kills import carry_out; carry_out(*{arguments!r})"
    return lambda: subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL)


def _goes_on(process: "subprocess.Popen[bytes]", path: Path, pause: float) -> bool:
    """Wait until rows come in, and a while longer; whether the study is still at work then."""
    known = _count(path)
    while process.poll() is None and _count(path) <= known:
        time.sleep(0.02)
    ends = time.perf_counter() + pause
    while process.poll() is None and time.perf_counter() < ends:
        time.sleep(0.02)
    return process.poll() is None


def _count(path: Path) -> int:
    try:
        with read_store(path) as store:
            return len(store.done())
    except ValueError:  # not made yet
        return 0


def _children(pid: int) -> list[int]:
    found = subprocess.run(["ps", "-o", "pid=,args=", "--ppid", str(pid)], capture_output=True, text=True, check=False)
    return [int(line.split()[0]) for line in found.stdout.splitlines() if "tmsopt.processes" in line]


@contextmanager
def _workers(wanted: bool) -> Iterator[tuple[str | None, Callable[[], list[int]]]]:
    """A Dask cluster of two workers that are started again when they die; its address, and their processes."""
    if not wanted:
        yield None, list
        return
    import dask
    from distributed import LocalCluster

    settings: Any = dask.config
    settings.set({"distributed.deploy.lost-worker-timeout": "1 hour"})  # it closes workers that restart just then
    local = LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)  # type: ignore[no-untyped-call]
    with local:
        yield local.scheduler_address, lambda: [n.pid for n in local.workers.values() if n.pid is not None]


def _judged(path: Path, log: Path, rows: int, kills: tuple[int, int], seconds: float) -> Told:
    acknowledged: set[int] = set()
    solved: Counter[int] = Counter()
    twice = 0
    for line in log.read_text(encoding="ascii").splitlines():
        word, number = line.split()
        if word == "kept":
            acknowledged.add(int(number))
        else:
            solved[int(number)] += 1
            twice += int(number) in acknowledged
    study = drawn(rows)
    with read_store(path) as store:
        there = store.done()
        sample = random.Random(0).sample(sorted(there), min(_SAMPLE, len(there)))
        different = sum(store.row(n).identity != Solver(study)((n,))[0].identity for n in sample)
        quarantined = store.counts().get("quarantined", 0)
    again = sum(count - 1 for count in solved.values()) - twice
    lost = len(acknowledged - there)
    return Told(kills, len(there), lost, twice, again, quarantined, different, seconds)


def section(command: str, rows: int = 10_000, kills: int = 20, seed: int = 0) -> str:
    """The report in Markdown."""
    found = {"2 processes": survived(rows, kills, seed, False), "2 Dask workers": survived(rows, kills, seed, True)}
    head = (
        "engine",
        "kills of the study, of workers",
        "rows in the end",
        "acknowledged and lost",
        "acknowledged and solved again",
        "in flight when killed",
        "quarantined",
        f"of {_SAMPLE} solved once more, with other bits",
        "s",
    )
    lines = [
        (
            name, f"{told.kills[0]}, {told.kills[1]}", f"{told.rows} of {rows}", told.lost, told.twice, told.again,
            told.quarantined, told.different, f"{told.seconds:.0f}",
        )
        for name, told in found.items()
    ]  # fmt: skip
    note = (
        "Monte Carlo rows of the EP4; kill -9 at random moments while rows come in. A row is acknowledged when the "
        "store has it; one in flight was solved and not yet acknowledged when its process was killed, and is solved "
        "again."
    )
    return f"## Kills\n\n{origin(command)}\n\n{table(head, lines)}\n\n{note}\n"


@click.command()
@click.option("--rows", default=10_000, show_default=True)
@click.option("--kills", default=20, show_default=True)
@click.option("--seed", default=0, show_default=True, help="of the moments")
@kept
def main(rows: int, kills: int, seed: int, output: Path) -> None:
    """Kill a study and its workers again and again; count what is lost, and what is solved twice."""
    text = section(f"python -m benchmarks.kills --rows {rows} --kills {kills}", rows, kills, seed)
    click.echo(text)
    keep(output, "kills", text)


if __name__ == "__main__":
    main()
