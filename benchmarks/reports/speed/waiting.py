"""How long people wait for what takes longest, beside an earlier version in a checkout of its own.

``TMSOPT_BEFORE=../before python -m benchmarks --only waiting`` after ``git worktree add ../before 9c10c19``; without
the variable there is nothing beside.
"""

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tqdm import tqdm

from benchmarks.reports.tables import Asked, duration, page, table, times

_ROUNDS, _LONG = 5, 6.0  # s of a round, beyond which there are three, and one beyond three times as many
_FEW = 8  # every so manieth, where it is only to be seen that all runs
_HERE = Path(__file__).parents[3]

_START = """
import json, time
from dataclasses import replace
import tmsopt
tmsopt.solve("problems/ep4.toml")
def solved(name, **changed):
    return tmsopt.solve(replace(tmsopt.load(f"problems/{name}.toml"), **changed), throw=False)
def robot(**changed):
    problem = tmsopt.load("problems/point_mass_robot.toml")
    return replace(problem, **{**changed, "constraints": {**problem.constraints, **changed.get("constraints", {})}})
def ends(front):
    return sum(front.ideal.values()) if isinstance(front.ideal, dict) else sum(front.ideal)
def needed(problem):
    return sum(tmsopt.solve(problem, throw=False).relaxation.amounts.values())
"""

_COUNTED = """
import casadi
made, ran, spent = casadi.nlpsol, [], dict(solver=0.0, building=0.0, built=0)
class Counted:
    def __init__(self, *given):
        began = time.perf_counter()
        self.solver = made(*given)
        spent["building"] += time.perf_counter() - began
        spent["built"] += 1
    def __call__(self, **given):
        began = time.perf_counter()
        answer = self.solver(**given)
        spent["solver"] += time.perf_counter() - began
        ran.append(self.solver.stats()["iter_count"])
        return answer
    def __getattr__(self, name):
        return getattr(self.solver, name)
casadi.nlpsol = Counted
"""

_END = """
ran.clear()
spent = dict(solver=0.0, building=0.0, built=0)
began = time.perf_counter()
value = float(work())
seconds = time.perf_counter() - began
print(json.dumps([seconds, value, spent["solver"], spent["building"], spent["built"], len(ran), sum(ran)]))
"""

WORKS: Mapping[str, str] = {
    "the most tolerant design": "work = lambda: solved('tolerant').value",
    "front of 25 designs": "work = lambda: ends(tmsopt.pareto('problems/pareto.toml'))",
    "front of 3 over a band of speeds": """
problem = replace(tmsopt.load("problems/speed_band.toml"), minimize=None, pareto=("abscissa", "chi_B"))
work = lambda: ends(tmsopt.pareto(problem, points=3))""",
    "best over a band of speeds": "work = lambda: solved('speed_band').value",
    "a robot with tolerances": """
problem = robot(tolerances={"x_B": 0.01, "z_B": 0.01, "lambda_s": 0.0175})
work = lambda: tmsopt.solve(problem, throw=False).value""",
    "2 000 built bicycles judged": """
study = tmsopt.monte_carlo(tmsopt.solve("problems/ep4.toml"), 2000, tolerances={"chi_B": 0.005, "Fr": 0.02})
work = lambda: tmsopt.run_study(study, workers=1).summary.stable""",
    "chart of 400 × 300 with its boundaries": """
tmsopt.chart("problems/chart.toml", boundaries=False)
work = lambda: tmsopt.chart("problems/chart.toml").abscissa.min()""",
    "robustness of a 12 × 12 matrix with 144 parameters": """
import numpy as np
drawn = np.random.default_rng(0).normal(size=(12, 12)) - 6 * np.eye(12)
names = [[f"p{i}{k}" for k in "abcdefghijkl"] for i in "abcdefghijkl"]
model = tmsopt.models.from_matrices(A=names)
problem = tmsopt.Problem(model, fixed=dict(zip(sum(names, []), drawn.ravel().tolist())))
work = lambda: tmsopt.robustness(problem).radius""",
    "default report of realistic.toml": """
solution = solved("realistic")
work = lambda: len(solution.report())""",
    "everything of realistic.toml (--full)": """
solution = solved("realistic")
work = lambda: len(solution.analysis.diagnoses)""",
    "growth over the speed, realistic.toml": """
solution = solved("realistic")
work = lambda: len(tmsopt.growth(solution).events)""",
    "critical speeds of the Whipple benchmark": """
work = lambda: tmsopt.speeds("problems/whipple_benchmark.toml").stable[0][0]""",
    "infeasible: a robot too fast to decay": """
problem = robot(constraints={"fast": "abscissa <= -12"})
work = lambda: needed(problem)""",
    "infeasible: loads that do not add up": """
problem = robot(constraints={"more": "N_R >= 150", "most": "N_F >= 150"})
work = lambda: needed(problem)""",
    "infeasible: a robot over a band of speeds": """
problem = robot()
free, limits = {n: e for n, e in problem.free.items() if n != "v"}, {**problem.constraints, "fast": "abscissa <= -3"}
problem = replace(problem, free=free, scenarios={"v": tmsopt.Band(1.0, 2.0, 5)}, constraints=limits)
work = lambda: needed(problem)""",
    "infeasible: an EP4 that decays too fast": """
problem = robot(minimize=None, locate="EP4", constraints={"fast": "abscissa <= -8"})
work = lambda: needed(problem)""",
}
"""By what it is: Python that defines `work`, which gives a number that must stay the same."""

COLD: Mapping[str, tuple[str, ...]] = {
    "tmsopt solve problems/ep4.toml": ("solve", "problems/ep4.toml"),
    "tmsopt solve problems/realistic.toml": ("solve", "problems/realistic.toml"),
    "tmsopt solve problems/point_mass_robot.toml": ("solve", "problems/point_mass_robot.toml"),
    "tmsopt speeds problems/whipple_benchmark.toml": ("speeds", "problems/whipple_benchmark.toml"),
    "tmsopt study problems/study_built.toml": ("study", "problems/study_built.toml", "--store", "{}/s.sqlite"),
    "tmsopt chart problems/chart.toml": ("chart", "problems/chart.toml"),
    "tmsopt figure all": ("figure", "all", "--output", "{}"),
}
"""Commands in a process of their own; ``{}`` is a folder that is empty at first."""


def warm(work: str, tree: Path) -> list[float]:
    """Of a work in a checkout once the package is imported: seconds, its number, and what `_parts` shows."""
    found: list[float] = json.loads(_run(tree, "-c", f"{_COUNTED}{_START}{work}{_END}").splitlines()[-1])
    return found


def cold(words: tuple[str, ...], tree: Path) -> list[float]:
    """Seconds of a command from start to end, and 0."""
    with TemporaryDirectory() as folder:
        began = time.perf_counter()
        _run(tree, "-m", "tmsopt", *(word.format(folder) for word in words))
        return [time.perf_counter() - began, 0.0]


def _run(tree: Path, *words: str) -> str:
    """What Python prints.

    Raises:
        subprocess.CalledProcessError: when it ended badly.
    """
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    return subprocess.run(
        [sys.executable, *words], cwd=tree, env=environment, check=True, capture_output=True, text=True
    ).stdout


def report(asked: Asked) -> str:
    """The report in Markdown."""
    before = os.environ.get("TMSOPT_BEFORE")
    trees = [*([Path(before).resolve()] if before else []), _HERE]
    works: list[tuple[str, Any]] = [
        *((name, partial(warm, work)) for name, work in WORKS.items()),
        *((f"`{name}`", partial(cold, words)) for name, words in COLD.items()),
    ]
    rows, parts = [], []
    for name, work in tqdm(works[:: _FEW if asked.quick else 1], desc="waiting"):
        found = [[work(tree) for tree in trees]]
        for _ in range(0 if asked.quick else _rounds(sum(one[0] for one in found[0])) - 1):
            found.append([work(tree) for tree in trees])  # by turns
        seconds = [statistics.median(one[k][0] for one in found) for k in range(len(trees))]
        apart = max(abs(one[0][1] - one[-1][1]) / max(1.0, abs(one[0][1])) for one in found)
        beside = (duration(seconds[0]), times(seconds[0] / seconds[-1]), f"{apart:.0e}") if before else ("–",) * 3
        rows.append((name, duration(seconds[-1]), *beside))
        tqdm.write("  ".join(rows[-1]))
        parts += [_parts(name, tree is _HERE, *one) for tree, one in zip(trees, found[0], strict=True) if len(one) > 2]
    header = ("what", "time", "before", "times as fast", "the answer differs by")
    note = (
        f"Medians of {_ROUNDS} rounds by turns, of 3 where a round takes over {_LONG:.0f} s and of 1 over "
        f"{3 * _LONG:.0f} s, each in a process of its own; of commands with its start, of the others without start, "
        "imports and a first solve."
    )
    columns = ("what", "which", "time", "in IPOPT", "building solvers", "the rest", "solvers", "runs", "iterations")
    shares = ("### Where the time goes", table(columns, parts), "Of one process: fronts may use others beside it.")
    return page("Waiting", asked, table(header, rows), note, *shares)


def _rounds(seconds: float) -> int:
    """How often what takes so long is measured."""
    return _ROUNDS if seconds < _LONG else 3 if seconds < 3 * _LONG else 1


def _parts(
    name: str, now: bool, whole: float, value: float, solver: float, building: float, *counts: float
) -> tuple[object, ...]:
    rest = (solver / whole, building / whole, 1 - (solver + building) / whole)
    return name, "now" if now else "before", duration(whole), *(f"{part:.0%}" for part in rest), *map(int, counts)
