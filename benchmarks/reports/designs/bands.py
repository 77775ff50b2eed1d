"""Bicycles for a band of speeds: how they are solved, and whether the claim holds between the scenarios."""

import time
from dataclasses import dataclass

from tqdm import tqdm

from benchmarks.judges import abscissa_below, highest_abscissa
from benchmarks.reports.tables import Asked, duration, page, share, table
from benchmarks.suites import SPEEDS, band_problems
from benchmarks.timing import ipopt_runs, quantile
from tmsopt import Problem, Solution, solve

STARTS = 50
CHECKED = 10_000
"""Speeds at which the roots are computed."""

MARGIN = 1e-6
"""Added to the claimed abscissa for the proof: at the worst speed the claim holds with equality, up to the last bit,
and no enclosure can decide an equality."""


@dataclass(frozen=True)
class Ride:
    """What became of one box.

    Attributes:
        per_start: seconds of a solve that tries all starts, over their number.
        single: median seconds of a run of IPOPT.
        excess: of the largest abscissa over `CHECKED` speeds over the claim; next to multiple roots eigenvalues scatter
            to the right by up to 4e-4.
        proved: whether the abscissa is at most the claim + `MARGIN` at every speed of the band.
        stable: whether it is below 0 at every speed.
        pieces: of the band in the proof.
        own: what the solution itself says of the band, if it does.
    """

    name: str
    solution: Solution
    per_start: float
    single: float
    excess: float
    proved: bool
    stable: bool
    pieces: int
    own: str


def ride(name: str, problem: Problem, starts: int = STARTS) -> Ride:
    """Solve, time and verify one box."""
    solve(problem, starts=1, throw=False)  # imports and first allocations are nobody's time
    with ipopt_runs() as runs:
        began = time.perf_counter()
        solution = solve(problem, starts=starts, exhaustive=True, throw=False)
        seconds = time.perf_counter() - began
    speeds = (solution.parameters, SPEEDS.min, SPEEDS.max)
    cover = solution.cover
    proved, pieces = abscissa_below(*speeds, solution.abscissa + MARGIN)
    return Ride(
        name=name,
        solution=solution,
        per_start=seconds / solution.starts.tried,
        single=quantile(run.seconds for run in runs),
        excess=highest_abscissa(*speeds, CHECKED) - solution.abscissa,
        proved=proved,
        stable=abscissa_below(*speeds, 0.0)[0],
        pieces=pieces,
        own="–" if cover is None else f"{'yes' if cover.proven else 'no'}, {cover.boxes} boxes",
    )


def report(asked: Asked) -> str:
    """The report in Markdown."""
    boxes = list(band_problems().items())[: asked.of(5, 1)]
    starts = 4 if asked.quick else STARTS
    rides = [ride(name, problem, starts) for name, problem in tqdm(boxes, desc="bands of speeds")]
    rows = [
        (
            r.name,
            r.solution.status,
            f"{r.solution.abscissa:.9f}",
            share(k < r.solution.starts.converged for k in range(r.solution.starts.tried)),
            duration(r.single),
            duration(r.per_start),
            f"{r.excess:.0e}",
            f"{'yes' if r.proved else 'no'}, {r.pieces} pieces",
            "yes" if r.stable else "no",
            r.own,
        )
        for r in rides
    ]
    header = (
        "box",
        "status",
        "abscissa",
        "starts feasible",
        "median start",
        "solve / starts",
        f"excess at {CHECKED} speeds",
        "proved between them",
        "stable in all of it",
        "own proof",
    )
    note = (
        f"Six free parameters, Fr from {SPEEDS.min} to {SPEEDS.max} in {SPEEDS.points} scenarios, the worst abscissa "
        f"is minimised; {starts} starts (each sign of the tilt apart), none spared. A start's time is that of a run of "
        "IPOPT; solve / starts has everything in it: speeds that are added, polishing, rechecking. The proof is by "
        f"Liénard and Chipart's conditions on p(s + γ + {MARGIN:.0e}), polynomials in Fr whose Bernstein coefficients "
        "are enclosed in ball arithmetic."
    )
    return page("Bands of speeds", asked, table(header, rows), note)
