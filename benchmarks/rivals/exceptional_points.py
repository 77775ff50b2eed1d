"""Exceptional points by an earlier version and by EasterEig, each in a process of its own. Times are CPU times."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from select import select
from typing import Any

from benchmarks.suites.matrices import System

_SOLVER = """
import json, sys, time
from tmsopt import Problem, models, solve
solve("problems/ep4.toml")
print(flush=True)
for line in sys.stdin:
    system = json.loads(line)
    make = models.from_hamiltonian if "H" in system["matrices"] else models.from_matrices
    began = time.process_time()
    try:
        problem = Problem(make(**system["matrices"]), free=system["free"], locate=system["locate"])
        found = solve(problem, throw=False)
        root = max(found.eigenfrequencies or found.roots, key=lambda root: root.multiplicity)
        answer = {"status": found.status, "parameters": dict(found.parameters), "root": [root.re, root.im]}
    except Exception as error:
        answer = {"status": str(error)}
    print(json.dumps(answer | {"seconds": time.process_time() - began}), flush=True)
"""

_EASTEREIG = """
import contextlib, io, json, os
import matplotlib
matplotlib.use("Agg")
import numpy as np
from eastereig.examples import ThreeDoF, double_pendulum, toy_3dof_2params

def run(example, *arguments):
    began = os.times()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        found = example(*arguments)
    return found, sum(os.times()[:4]) - sum(began[:4])

(_, masses, _), first = run(toy_3dof_2params.main)
(points, _), second = run(ThreeDoF.myMain, 1, 5, [1, 2, 3, 1, 1, 1])
found = [[[z.real, z.imag, w.real, w.imag] for _, z, w in masses]]
found.append([[z.real, z.imag] for point in points for z in point.locate()])
(*_, near, every), third = run(double_pendulum.main)
print(json.dumps([*zip(found, (first, second)), [[float(near), float(every)], third]]))
"""


class Earlier:
    """Another checkout of tmsopt, in a process that is replaced when it takes too long."""

    def __init__(self, checkout: Path, seconds: float) -> None:
        self.checkout, self.seconds = checkout, seconds
        self._start()

    def _start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _SOLVER],
            cwd=self.checkout,
            env={**os.environ, "PYTHONPATH": str(self.checkout)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._calls, self._answers = self._process.stdin, self._process.stdout
        self._answers.readline()

    def solve(self, system: System) -> Mapping[str, Any]:
        """Its status, and perhaps parameters, root and seconds."""
        told = {"matrices": system.matrices, "free": system.free, "locate": system.locate}
        print(json.dumps(told), file=self._calls, flush=True)
        if select([self._answers], [], [], self.seconds)[0]:
            return dict(json.loads(self._answers.readline()))
        self.end()
        self._start()
        return {"status": "out of time", "seconds": self.seconds}

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()


def run_eastereig(python: str) -> list[Any]:
    """Points of its three masses and of its three coupled masses, and its own errors of its pendulums; with seconds."""
    command = [python, "-c", _EASTEREIG]
    environment = {n: x for n, x in os.environ.items() if n != "PYTHONPATH"}
    return list(json.loads(subprocess.run(command, env=environment, capture_output=True, check=True).stdout))
