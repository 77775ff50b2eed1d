"""The answers of a checkout: every case in a process of its own, or with a few others."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.suites.equivalence.cases import PROBLEMS, Case

ROOT = PROBLEMS.parent
_LIMIT, _TOGETHER = 180.0, 10  # s for a process; cases that share one


def answer_all(
    cases: Sequence[Case],
    checkout: Path = ROOT,
    seed: int = 0,
    workers: int = 2,
    environment: dict[str, str] | None = None,
    listener: Callable[[int, int], None] = lambda done, most: None,
) -> dict[str, Any]:
    """Name → answer, plain data; ``"no answer"`` where a process crashed or took more than three minutes.

    Args:
        checkout: whose ``tmsopt`` answers.
        seed: of commands and solves that take one.
        environment: variables of the processes.
        listener: called with the number of processes that are done, and of all.
    """
    env = os.environ | (environment or {}) | {"PYTHONPATH": str(checkout), "COLUMNS": "100"}
    commands = [case for case in cases if case.command or case.name == "help/all"]
    functions = [case for case in cases if case not in commands]
    jobs: list[Callable[[], dict[str, Any]]] = [partial(_run, case, env, seed) for case in commands]
    for first in range(0, len(functions), _TOGETHER):
        names = [case.name for case in functions[first : first + _TOGETHER]]
        jobs.append(partial(_call, names, env, seed))
    found: dict[str, Any] = {}
    with ThreadPoolExecutor(workers) as pool:
        for number, future in enumerate([pool.submit(job) for job in jobs], start=1):
            found |= future.result()
            listener(number, len(jobs))
    return {case.name: found.get(case.name, "no answer") for case in cases}


def _run(case: Case, env: dict[str, str], seed: int) -> dict[str, Any]:
    """What a command says: its exit status, JSON or text, and errors; under the name of the case."""
    with tempfile.TemporaryDirectory() as folder:
        for path in PROBLEMS.glob("*.*"):
            if path.suffix != ".png":
                shutil.copy(path, folder)
        words = [*case.command, *(["--seed", str(seed)] if case.seeded else [])] or ["--help"]
        try:
            done = subprocess.run(
                [sys.executable, "-m", "tmsopt", *words],
                capture_output=True,
                text=True,
                timeout=_LIMIT,
                cwd=folder,
                env=env,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return {case.name: "no answer"}
    answer: dict[str, Any] = {"exit": done.returncode, "errors": done.stderr.replace(folder, "")}
    try:
        return {case.name: answer | {"json": json.loads(done.stdout)}}
    except ValueError:
        return {case.name: answer | {"text": done.stdout.replace(folder, "")}}


def _call(names: Sequence[str], env: dict[str, str], seed: int) -> dict[str, Any]:
    """Answers of functions in one process; where that ends, the rest go to another."""
    command = [sys.executable, "-m", "benchmarks.suites.equivalence.python", str(seed), *names]
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile("w+") as out:
        (Path(folder) / "benchmarks").symlink_to(ROOT / "benchmarks")  # these benchmarks, and tmsopt of the checkout
        with suppress(subprocess.TimeoutExpired):
            subprocess.run(command, stdout=out, timeout=_LIMIT * 2, cwd=folder, env=env, check=False)
        out.seek(0)
        lines = out.read().splitlines()
    found = dict(json.loads(line) for line in lines if line.startswith('["') and line.endswith("]"))
    left = [name for name in names if name not in found]
    return found | (_call(left[1:], env, seed) if len(left) > 1 else {})
