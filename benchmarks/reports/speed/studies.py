"""Studies beside bare solves in a loop, over processes and Dask workers, and warm beside cold starts."""

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.reports.tables import Asked, page, table, times
from benchmarks.suites import PROBLEMS
from benchmarks.timing import best, ipopt_runs
from tmsopt import Study, load, over_grid, run_study
from tmsopt.executor import Executor, cluster, in_process, processes
from tmsopt.studies import Solver


def quick_rows(rows: int) -> Study:
    """The least speed over masses and heights: some 15 starts a row, so that what is not solving weighs most."""
    side = int(np.sqrt(rows))
    axes = {"mu": np.linspace(0.05, 0.5, side).tolist(), "zeta_H": np.linspace(-0.3, -0.1, rows // side).tolist()}
    return over_grid(load(PROBLEMS / "least_speed.toml"), axes, title="least speed, three parameters")


def long_rows(rows: int, warm: bool = False) -> Study:
    """A bicycle that a builder would accept, over the offset that he asks for: seven free parameters, many starts."""
    problem = load(PROBLEMS / "realistic.toml")
    forward = {**problem.free, "lambda_s": (0.0, problem.free["lambda_s"][1])}
    limits = {"offset.limit": np.linspace(0.02, 0.08, rows).tolist()}
    return over_grid(replace(problem, free=forward), limits, warm=warm, title="seven parameters, many starts")


def overhead(study: Study, rounds: int) -> dict[str, float]:
    """Least seconds of a whole study with its store, of its solves in a loop, and of their runs of IPOPT alone."""
    with ipopt_runs() as runs:
        Solver(study)(range(len(study)))
    solver = Solver(study)
    solver((0,))
    ways: Mapping[str, Callable[[], Any]] = {
        "study": lambda: _stored(study),
        "solves": lambda: [solver((number,)) for number in range(len(study))],
        "ipopt": lambda: [run.again() for run in list(runs)],
    }
    return best(ways, rounds) | {"runs": float(len(runs))}


def _stored(study: Study) -> None:
    with tempfile.TemporaryDirectory() as folder:
        run_study(study, Path(folder) / "s.sqlite", workers=1)


def scaling(study: Study, workers: int) -> float:
    """Rows per second of so many processes; 0: in this one.

    From the time that all of them have delivered until the last row: what it takes to start them is seconds, and once.
    """
    return _rate(study, processes(workers) if workers else in_process(), max(workers, 1))


def dask_scaling(study: Study, workers: int) -> float:
    """The same of Dask workers of this machine, one thread each."""
    from distributed import LocalCluster

    local = LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None)  # type: ignore[no-untyped-call]
    with local:
        return _rate(study, cluster(local.scheduler_address), workers)


def _rate(study: Study, executor: Executor, workers: int) -> float:
    with executor:
        rows = executor.map(Solver(study), [(number,) for number in range(len(study))])
        arrived = [time.perf_counter() for _ in rows]
    skip = 4 * workers
    return (len(arrived) - skip) / (arrived[-1] - arrived[skip - 1])


def report(asked: Asked) -> str:
    """The report in Markdown."""
    quick = asked.quick
    small, long = (quick_rows(16), long_rows(4)) if quick else (quick_rows(64), long_rows(8))
    many = quick_rows(36 if quick else 196)
    return page(
        "Studies",
        asked,
        "### Beside bare solves",
        _overheads([small, long], 1 if quick else 3),
        "One core, the best of rounds in turns. The solves are the same ones, without engine and store; IPOPT alone "
        "does the very same runs again from recorded starts, with the same compiled problem, without choosing starts, "
        "polishing, rechecking, certified numbers and laws.",
        "### Engines",
        _scalings(many, 1 if quick else 3),
        "### Warm starts",
        _warm(6 if quick else 32),
    )


def _overheads(studies: Sequence[Study], rounds: int) -> str:
    rows = []
    for study in studies:
        seconds = overhead(study, rounds)
        n = len(study)
        rows.append(
            (
                study.title,
                n,
                *(f"{n / seconds[each]:.3g}" for each in ("study", "solves", "ipopt")),
                f"{100 * (seconds['study'] / seconds['solves'] - 1):.1f} %",
                f"{100 * (seconds['study'] / seconds['ipopt'] - 1):.0f} %",
                f"{seconds['runs'] / n:.3g}",
            )
        )
    head = (
        "study",
        "rows",
        "rows a second, study",
        "solves in a loop",
        "IPOPT alone",
        "cost over the solves",
        "over IPOPT alone",
        "runs of IPOPT a row",
    )
    return table(head, rows)


def _scalings(study: Study, rounds: int) -> str:
    ways: dict[str, Callable[[], float]] = {
        "in this process": lambda: scaling(study, 0),
        "1 process": lambda: scaling(study, 1),
        "2 processes": lambda: scaling(study, 2),
    }
    if find_spec("distributed"):
        ways |= {"1 Dask worker": lambda: dask_scaling(study, 1), "2 Dask workers": lambda: dask_scaling(study, 2)}
    rates = dict.fromkeys(ways, 0.0)
    for _ in range(rounds):
        for name, way in ways.items():
            rates[name] = max(rates[name], way())
    beside = {"2 processes": "1 process", "2 Dask workers": "1 Dask worker"}
    rows = [
        (name, f"{rate:.3g}", f"{rate / rates[beside[name]]:.2f} times {beside[name]}" if name in beside else "")
        for name, rate in rates.items()
    ]
    note = (
        f"{len(study)} rows of {study.title}, from the time that every worker is at work; the best of {rounds} rounds "
        "in turns."
    )
    return f"{table(('engine', 'rows a second', ''), rows)}\n\n{note}"


def _warm(n: int) -> str:
    warm, cold = (run_study(long_rows(n, warm), workers=1) for warm in (True, False))
    pairs = list(zip(warm.rows, cold.rows, strict=True))
    assert all(a.status == b.status for a, b in pairs)
    worst = max(abs(a.objective - b.objective) / abs(b.objective) for a, b in pairs)
    started = sum(row.warm for row in warm.rows)
    rows = [
        ("cold starts", f"{n / cold.seconds:.3g}", ""),
        ("warm starts", f"{n / warm.seconds:.3g}", f"{times(cold.seconds / warm.seconds)} times"),
    ]
    note = (
        f"{n} rows of {long_rows(2).title}; {started} of them started from a neighbour's optimum, and checked against "
        f"cold ends of the block. Objectives differ by {worst:.0e} at most, relative."
    )
    return f"{table(('sweep', 'rows a second', ''), rows)}\n\n{note}"
