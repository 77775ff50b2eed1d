"""Gains of a controller beside python-control (pole placement, LQR, impulse responses) and searches of SciPy."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.optimize import Bounds, differential_evolution, minimize

from benchmarks.reports.tables import Asked, duration, median, page, share, table, times
from benchmarks.rivals import poles
from benchmarks.suites import PROBLEMS
from benchmarks.timing import best
from tmsopt import Problem, Solution, load, solve
from tmsopt.records import Array

_NAMES = ("k_phi", "k_delta", "k_phidot", "k_deltadot")
_HEADER = ("question", "theirs", "time", "ours", "time", "time, ours over theirs")


def _rows(problem: Problem, design: Solution, repeats: int) -> Iterator[tuple[object, ...]]:
    import control  # of the extra bench

    assert problem.model.pencil is not None
    passive = problem.model.pencil(problem.posed.ordered(dict.fromkeys(problem.free, 0.0)))
    M, D, K = (np.array(m, dtype=float) for m in passive)
    inverse = np.linalg.inv(M)
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ K, -inverse @ D]])
    b, at, four = np.array([[0], [0], *inverse[:, 1:]]), np.linspace(0, 3, 301), [design.abscissa] * 4
    located = replace(problem, minimize=None, locate="EP4", constraints={"there": f"abscissa == {four[0]!r}"})
    norm = float(np.linalg.norm(regulated := control.lqr(A, b, np.eye(4), [[1]])[0]))
    limited = replace(problem, constraints={"norm": f"{' + '.join(f'{n}**2' for n in _NAMES)} <= {norm**2!r}"})
    loop = A - b * [design.parameters[n] for n in _NAMES]
    system = control.ss(loop, b, np.eye(4), np.zeros((4, 1)))
    every: dict[str, tuple[Callable[[], Any], Callable[[], Any]]] = {
        "gains that place the roots": (lambda: control.acker(A, b, four), lambda: solve(located)),
        "least abscissa": (lambda: control.lqr(A, b, np.eye(4), [[1]]), lambda: solve(limited)),
        "motion": (lambda: control.impulse_response(system, at), lambda: [expm(loop * t) @ b for t in at]),
    }
    took = best({f"{n} {k}": work for n, both in every.items() for k, work in enumerate(both)}, repeats)
    placed, bounded, motion = (ours() for _, ours in every.values())
    gains = np.array([placed.parameters[n] for n in _NAMES])
    told = control.impulse_response(system, at).outputs[:, 0].T
    said = [
        ("`control.acker`", f"`locate` EP4, within {np.abs(gains - control.acker(A, b, four)).max():.0e}"),
        (
            f"`control.lqr`, Q = I, R = 1: norm {norm:.4g}, {np.linalg.eigvals(A - b @ regulated).real.max():.5g} 1/s",
            f"of that norm at most: {bounded.abscissa:.5g} 1/s",
        ),
        ("`control.impulse_response`", f"`expm`, within {np.abs(np.array(motion)[..., 0] - told).max():.0e}"),
    ]
    for name, (theirs, ours) in zip(every, said, strict=True):
        one, other = took[f"{name} 0"], took[f"{name} 1"]
        yield name, theirs, duration(one), ours, duration(other), times(other / one)


def _searched(problem: Problem, least: float, count: int) -> str:
    at, ends, seconds = poles(problem), [], []
    low, high = np.array(list(problem.free.values())).T
    bounds = Bounds(low, high)
    way: dict[str, Any] = {"method": "Nelder-Mead", "options": {"xatol": 1e-12, "fatol": 1e-12, "maxfev": 20_000}}

    def abscissa(x: Array) -> float:
        return at(x)[0]

    for start in np.random.default_rng(0).uniform(low, high, (count, len(low))):
        began = time.process_time()
        answer: Any = minimize(abscissa, start, bounds=bounds, **way)
        seconds.append(time.process_time() - began)
        ends.append(at.stored(np.asarray(answer.x)) - least)
    began = time.process_time()
    evolved = float(differential_evolution(abscissa, bounds, rng=0, tol=1e-8, maxiter=5000).fun) - least
    took = duration(time.process_time() - began)
    within = ", ".join(f"{share(e <= w for e in ends)} within {w:g}" for w in (1, 0.1, 0.01))
    return (
        f"SciPy's Nelder–Mead on the eigenvalues from {count} random starts: {within} of our {least:.7f} 1/s, the best "
        f"{min(ends):.2g} off, {median(seconds)} each; its differential evolution ends {evolved:.2g} off after "
        f"{took}. `control.place` and `place_poles` refuse roots that are repeated more often than there are torques."
    )


def report(asked: Asked) -> str:
    """The report in Markdown."""
    design = solve(problem := load(PROBLEMS / "balance_assist.toml"))
    rows = table(_HEADER, _rows(problem, design, 1 if asked.quick else 5))
    about = (
        f"`problems/balance_assist.toml` beside python-control {version('control')}: gains in N m/rad and N m s/rad, "
        "the motion for 3 s after a push of 1 N m s on the handlebar. LQR asks for the least cost and not for decay. "
        "Theirs are formulas, ours searches that take limits as well; the best of five whole calls."
    )
    return page(
        "Beyond the passive bicycle",
        asked,
        "### A controller",
        about,
        rows,
        _searched(problem, design.abscissa, asked.of(20, 2)),
    )
