"""Sixty matrices with exceptional points and ten without: which are found, to which error, and which are proved.

``TMSOPT_BEFORE`` names a checkout of an earlier version, and ``TMSOPT_EASTEREIG`` a Python that has EasterEig.
"""

import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import TimeoutError as OutOfTime
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.reports.tables import Asked, duration, facts, median, page, share, table
from benchmarks.rivals.exceptional_points import Earlier, run_eastereig
from benchmarks.suites import matrices
from tmsopt import Problem, Solution, models, prove, solve
from tmsopt.killable import KillableProcess

_SECONDS = 10.0
_FALSE = 1e-9  # from this backward error on, a point is none, and not only inaccurate
_DIGITS = 1e-30  # error of the parameters of a proof; their texts have 35 digits
_PROVED_SIZE = 40  # larger matrices are not proved


class Row(NamedTuple):
    """What became of a system. The error and the backward error are shares of the norm of the matrix."""

    system: matrices.System
    status: str
    seconds: float
    error: float = float("inf")
    backward: float = float("inf")
    proof: str = "–"
    earlier: str = "–"

    @property
    def right(self) -> bool:
        """Whether a point is found to the error that is asked for; or none, if there is none."""
        return self.error <= matrices.ERROR if self.system.points else self.status in ("infeasible", "not_converged")

    @property
    def cells(self) -> tuple[object, ...]:
        """A row of the table."""
        s, numbers = self.system, [f"{x:.0e}" if x < float("inf") else "–" for x in (self.error, self.backward)]
        found = "yes" if self.right else f"**no**: {self.status}"
        return (
            s.name,
            s.dimension,
            s.locate,
            found,
            *numbers,
            self.proof,
            duration(self.seconds),
            self.earlier,
            s.source,
        )


class _Worker:
    """A process that is replaced when it takes too long."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._start()

    def _start(self) -> None:
        self._process = KillableProcess(_prepare)
        self._process.answer(bool)

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """The answer, or why there is none."""
        try:
            return self._process.call(function, *arguments).result(self.seconds)
        except OutOfTime:
            self.end()
            self._start()
            return f"out of time, {self.seconds:g} s"
        except Exception as error:
            return " ".join(f"{type(error).__name__}: {error}".split())[:80]

    def end(self) -> None:
        """End the process."""
        self._process.end()


def _prepare() -> None:
    _solve(next(s for s in matrices.systems() if s.name == "lossy dimer"))


def _solve(system: matrices.System) -> Solution:
    make: Callable[..., models.Model] = models.from_hamiltonian if "H" in system.matrices else models.from_matrices
    model = make(**{key: [[*row] for row in rows] for key, rows in system.matrices.items()})
    return solve(Problem(model, free=system.free, locate=system.locate), throw=False)


def _timed(system: matrices.System) -> tuple[Solution, float]:
    began = time.process_time()
    return _solve(system), time.process_time() - began


def _row(system: matrices.System, worker: _Worker) -> Row:
    answer = worker.call(_timed, system)
    if isinstance(answer, str):
        return Row(system, answer, worker.seconds)
    found, seconds = answer
    row = Row(system, found.status, seconds)
    if row.status != "optimal":
        return row
    if system.points:
        verdict = _judge(system, found, found.parameters)
        row = row._replace(error=max(verdict.errors), backward=verdict.backward)
    if system.dimension <= _PROVED_SIZE:
        told = worker.call(prove, found)
        if not isinstance(told, str) and told.proved:
            balls = {n: x.value for n, x in told.parameters.items()}
            right = system.points and max(_judge(system, found, balls).errors[:-1]) <= _DIGITS
            return row._replace(proof="yes" if right else "**false**")
        why = told if isinstance(told, str) else f"no: {told.reason}"
        row = row._replace(proof=why.split(": the pattern")[0].split("; ")[0])
    return row


def _ask_earlier(system: matrices.System, earlier: Earlier) -> str:
    found = earlier.solve(system)
    status, seconds = found["status"], duration(found["seconds"])
    if "accepted: up to" in status:
        return "too large"
    if status != "optimal":
        return f"{'none' if status in ('infeasible', 'not_converged') else status}, {seconds}"
    if not system.points:
        return f"**false**, {seconds}"
    verdict = matrices.judge(system, [found["parameters"][n] for n in system.free], complex(*found["root"]))
    return f"{max(verdict.errors):.0e}, {seconds}"


def _compare_eastereig(python: str, worker: _Worker) -> str:
    """A table of its examples with matrices: errors of the parameters, and times."""
    *two, pendulums = run_eastereig(python)
    three_masses = next(s for s in matrices.systems() if s.name == "three masses, complex")
    systems = [three_masses, *matrices.small("examples")]
    errors = [
        [min(max(abs(float(a) - b) for a, b in zip(known, p, strict=False)) for known in s.known) for p in points]
        for s, (points, _) in zip(systems, two, strict=False)
    ]
    rows = []
    for s, error, (_, seconds) in zip(systems, [*errors, pendulums[0]], [*two, pendulums], strict=True):
        own = _row(s, worker)
        rows.append(
            (s.name, s.locate, f"{max(error):.0e}", duration(seconds), f"{own.error:.0e}", duration(own.seconds))
        )
    header = ("example of EasterEig", "pattern", "largest error", "time", "error of tmsopt", "time")
    return table(header, rows)


def _judge(system: matrices.System, found: Solution, parameters: Mapping[str, Any]) -> matrices.Verdict:
    root = max(found.eigenfrequencies or found.roots, key=lambda r: r.multiplicity)
    return matrices.judge(system, [parameters[n] for n in system.free], complex(root.re, root.im))


def report(asked: Asked) -> str:
    """The page: a row for each system, and totals."""
    every, worker = matrices.systems(), _Worker(asked.within(_SECONDS, 3.0))
    try:
        rows = [_row(s, worker) for s in every[:: max(1, len(every) // asked.of(len(every), 7))]]
        before, python = os.environ.get("TMSOPT_BEFORE"), os.environ.get("TMSOPT_EASTEREIG")
        if before:
            earlier = Earlier(Path(before), worker.seconds)
            rows = [row._replace(earlier=_ask_earlier(row.system, earlier)) for row in rows]
            earlier.end()
        examples = _compare_eastereig(python, worker) if python else "TMSOPT_EASTEREIG names no Python."
    finally:
        worker.end()
    known, none = ([r for r in rows if bool(r.system.points) is there] for there in (True, False))
    totals = [
        (f"found, to {matrices.ERROR:.0e} of the norm", share(r.right for r in known)),
        ("of these, proved", share(r.proof == "yes" for r in known if r.right and r.system.dimension <= _PROVED_SIZE)),
        ("no point, and none is found", share(r.right for r in none)),
        ("false: found where there is none", sum(r.status == "optimal" and r.backward > _FALSE for r in rows)),
        ("false proofs", sum(r.proof == "**false**" for r in rows)),
        ("median time", median(r.seconds for r in known if r.right)),
    ]
    header = ("system", "n", "pattern", "right", "error", "backward error", "proved", "time", "earlier", "source")
    return page(
        "Exceptional points of matrices", asked, facts(totals), table(header, [r.cells for r in rows]), examples, _ABOUT
    )


_ABOUT = (
    "*n* is the size of H or A; M, D and K are joined to A. An error is the largest of the parameters and of the "
    "eigenvalue, from the nearest known point; a backward error is the norm of a change of the matrix after which the "
    "eigenvalue is defective to the order of the pattern. Both are shares of the norm of the matrix, in 80 digits. "
    f"Matrices up to n = {_PROVED_SIZE} are proved. Times are those of the processor. *Earlier* is the checkout that "
    "TMSOPT_BEFORE names: error and time, *none* for no point, *false* for a point where there is none. The examples "
    "of EasterEig are run as they are, and errors are those of the parameters; for the pendulums it states its own."
)
