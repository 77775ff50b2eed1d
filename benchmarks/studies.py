"""Section (c): studies beside bare solves in a loop, over processes and Dask workers, and warm beside cold starts."""

import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import duration, times
from benchmarks.report import origin, table
from tmsopt.design.files import load
from tmsopt.formulation.ipopt import Run
from tmsopt.solver import workspace as families
from tmsopt.studies.engines import cluster, in_process, processes
from tmsopt.studies.run import fill, run_study
from tmsopt.studies.solving import Solver
from tmsopt.studies.store.store import open_store
from tmsopt.studies.study import Study, definition, over_grid

_PROBLEMS = Path(__file__).parent.parent / "problems"


def quick_rows(rows: int) -> Study:
    """EP4 over masses and heights: one start a row, so that whatever is not solving weighs most."""
    side = int(np.sqrt(rows))
    axes = {"mu": np.linspace(0.05, 0.5, side).tolist(), "zeta_H": np.linspace(-0.3, -0.1, rows // side).tolist()}
    return over_grid(load(_PROBLEMS / "ep4.toml"), axes, title="EP4, one start a row")


def long_rows(rows: int, warm: bool = False) -> Study:
    """A bicycle that a builder would accept, over the offset that he asks for: seven free parameters, many starts."""
    problem = load(_PROBLEMS / "realistic.toml")
    forward = {**problem.free, "lambda_s": (0.0, problem.free["lambda_s"][1])}
    limits = {"offset.limit": np.linspace(0.02, 0.08, rows).tolist()}
    return over_grid(replace(problem, free=forward), limits, warm=warm, title="seven parameters, many starts")


@dataclass(frozen=True)
class Replay:
    """Every run of IPOPT that a study took, to be done again and nothing else."""

    runs: Sequence[Callable[[], Any]]

    def __call__(self) -> None:
        for run in self.runs:
            run()


@contextmanager
def _recorded(calls: list[Callable[[], Any]]) -> Iterator[None]:
    """Note every call of a solver, with its solver, start and limits."""
    original = families.ipopt  # type: ignore[attr-defined]

    def recording(*arguments: Any, **options: Any) -> Callable[..., Run]:
        solver: Callable[..., Run] = original(*arguments, **options)

        def run(*start: Any) -> Run:
            calls.append(lambda: solver(*start))
            return solver(*start)

        return run

    families.ipopt = recording  # type: ignore[attr-defined]
    try:
        yield
    finally:
        families.ipopt = original  # type: ignore[attr-defined]


def overhead(study: Study, rounds: int) -> dict[str, float]:
    """Least seconds of a whole study with its store, of its solves in a loop, and of their runs of IPOPT alone."""
    calls: list[Callable[[], Any]] = []
    with _recorded(calls):
        Solver(study)(range(len(study)))
    solver = Solver(study)
    solver((0,))
    ways: Mapping[str, Callable[[], Any]] = {
        "study": lambda: _stored(study, solver),
        "solves": lambda: [solver((number,)) for number in range(len(study))],
        "ipopt": Replay(calls),
    }
    seconds = dict.fromkeys(ways, np.inf)
    for _ in range(rounds):
        for name, way in ways.items():
            began = time.perf_counter()
            way()
            seconds[name] = min(seconds[name], time.perf_counter() - began)
    return seconds | {"runs": float(len(calls))}


def _stored(study: Study, solver: Solver) -> None:
    with tempfile.TemporaryDirectory() as folder, open_store(Path(folder) / "s.sqlite", definition(study)) as store:
        fill(study, store, workers=1)


def scaling(study: Study, workers: int) -> float:
    """Rows per second of so many processes, from the time that all of them have delivered until the last row.

    What it takes to start them is left out: it is seconds, and once.
    """
    units = [(number,) for number in range(len(study))]
    arrived: list[tuple[float, str]] = []
    for row in processes(Solver(study), units, workers):
        arrived.append((time.perf_counter(), row.host))
    skip = 4 * workers
    return (len(arrived) - skip) / (arrived[-1][0] - arrived[skip - 1][0])


def dask_scaling(study: Study, workers: int) -> float:
    """The same of Dask workers of this machine, one thread each."""
    from distributed import LocalCluster

    local = LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None)  # type: ignore[no-untyped-call]
    with local:
        units = [(number,) for number in range(len(study))]
        arrived = [time.perf_counter() for _ in cluster(Solver(study), units, local.scheduler_address)]
    skip = 4 * workers
    return (len(arrived) - skip) / (arrived[-1] - arrived[skip - 1])


def warm_and_cold(rows: int) -> tuple[float, float, float, int]:
    """Seconds warm and cold, the largest relative difference of the optima, and rows started from a neighbour."""
    warm = run_study(long_rows(rows, warm=True), workers=1)
    cold = run_study(long_rows(rows), workers=1)
    pairs = list(zip(warm.rows, cold.rows, strict=True))
    assert all(a.status == b.status for a, b in pairs)
    worst = max(abs(a.objective - b.objective) / abs(b.objective) for a, b in pairs)
    return warm.seconds, cold.seconds, worst, sum(row.warm for row in warm.rows)


def section(command: str, quick: bool = False) -> str:
    """The report in Markdown."""
    small, long = (quick_rows(36), long_rows(4)) if quick else (quick_rows(100), long_rows(8))
    many = quick_rows(100 if quick else 400)
    parts = [
        "## Studies",
        origin(command),
        _overheads([small, long], 1 if quick else 3),
        _scalings(many, 1 if quick else 4),
        _warm(quick),
    ]
    return "\n\n".join(parts) + "\n"


def _overheads(studies: Sequence[Study], rounds: int) -> str:
    rows = []
    for study in studies:
        seconds = overhead(study, rounds)
        n = len(study)
        rows.append(
            (
                study.title,
                n,
                f"{n / seconds['study']:.3g}",
                f"{n / seconds['solves']:.3g}",
                f"{n / seconds['ipopt']:.3g}",
                f"{100 * (seconds['study'] / seconds['solves'] - 1):.1f} %",
                f"{100 * (seconds['study'] / seconds['ipopt'] - 1):.0f} %",
                f"{seconds['runs'] / n:.3g}",
            )
        )
    head = (
        "study", "rows", "rows a second, study", "solves in a loop", "IPOPT alone", "cost over the solves",
        "over IPOPT alone", "runs of IPOPT a row",
    )  # fmt: skip
    note = (
        "One core, the best of rounds in turns. The solves are the same ones, without engine and store; IPOPT alone "
        "does the very same runs again from recorded starts, with the same compiled problem, without choosing starts, "
        "polishing, rechecking, certified numbers and laws."
    )
    return f"### Beside bare solves\n\n{table(head, rows)}\n\n{note}"


def _scalings(study: Study, rounds: int) -> str:
    began = time.perf_counter()
    ways: dict[str, Callable[[], float]] = {
        "in this process": lambda: _here(study),
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
    took = duration(time.perf_counter() - began)
    note = (
        f"{len(study)} rows of {study.title}, from the time that every worker is at work; the best of {rounds} rounds "
        f"in turns; {took} in all."
    )
    return f"### Engines\n\n{table(('engine', 'rows a second', ''), rows)}\n\n{note}"


def _here(study: Study) -> float:
    units = [(number,) for number in range(len(study))]
    arrived = [time.perf_counter() for _ in in_process(Solver(study), units)]
    return (len(arrived) - 4) / (arrived[-1] - arrived[3])


def _warm(quick: bool) -> str:
    warm, cold, worst, started = warm_and_cold(6 if quick else 32)
    n = 6 if quick else 32
    rows = [("cold starts", f"{n / cold:.3g}", ""), ("warm starts", f"{n / warm:.3g}", f"{times(cold / warm)} times")]
    note = (
        f"{n} rows of {long_rows(2).title}; {started} of them started from a neighbour's optimum, and checked against "
        f"cold ends of the block. Objectives differ by {worst:.0e} at most, relative."
    )
    return f"### Warm starts\n\n{table(('sweep', 'rows a second', ''), rows)}\n\n{note}"
