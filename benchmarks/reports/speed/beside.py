"""Section *beside*: the time of a solve, each problem by turns with the checkout that ``TMSOPT_BEFORE`` names."""

import os
import statistics
import subprocess
import sys
from collections.abc import Sequence
from itertools import chain
from pathlib import Path

from tqdm import tqdm

from benchmarks.reports.tables import Asked, duration, page, table

_HERE = Path(__file__).parents[3]
_PROBLEMS = {
    "random_designs random_problem": 200,
    "varied_designs varied_problem": 100,
    "hard_designs hard_problem": 100,
}

_SOLVER = """
import sys, time
from importlib import import_module
import tmsopt
tmsopt.solve("problems/ep4.toml")
for line in sys.stdin:
    module, make, index = line.split()
    problem = getattr(import_module(f"benchmarks.suites.{module}"), make)(int(index))
    began = time.process_time()
    tmsopt.solve(problem, throw=False)
    print(time.process_time() - began, flush=True)
"""


def report(asked: Asked) -> str:
    """Medians of the processor time, and of the ratio, by suite."""
    before = os.environ.get("TMSOPT_BEFORE")
    if not before:
        return page("Beside an earlier version", asked, "TMSOPT_BEFORE names no checkout.")
    ours, theirs = (_started(Path(folder)) for folder in (_HERE, before))
    pairs: dict[str, list[tuple[float, float]]] = {}
    for suite, count in _PROBLEMS.items():
        name = suite.split()[0].replace("_", " ")
        some = tqdm(range(asked.of(count, 3)), name)
        pairs[name] = [(_seconds(ours, suite, k), _seconds(theirs, suite, k)) for k in some]
    rows = [_row(*item) for item in (*pairs.items(), ("all", [*chain(*pairs.values())]))]
    header = ["suite", "problems", "median before", "median now", "median of the ratios", "ratio of the sums"]
    return page("Beside an earlier version", asked, "Processor time, each problem by turns.", table(header, rows))


def _row(name: str, pairs: Sequence[tuple[float, float]]) -> list[object]:
    now, then = (statistics.median(each) for each in zip(*pairs, strict=True))
    ratio, total = statistics.median(a / b for a, b in pairs), sum(a for a, _ in pairs) / sum(b for _, b in pairs)
    return [name, len(pairs), duration(then), duration(now), f"{ratio:.2f}", f"{total:.2f}"]


def _started(checkout: Path) -> "subprocess.Popen[str]":
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    command = [sys.executable, "-c", _SOLVER]
    return subprocess.Popen(
        command, cwd=checkout, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )


def _seconds(solver: "subprocess.Popen[str]", suite: str, index: int) -> float:
    assert solver.stdin is not None
    assert solver.stdout is not None
    print(suite, index, file=solver.stdin, flush=True)
    return float(solver.stdout.readline())
