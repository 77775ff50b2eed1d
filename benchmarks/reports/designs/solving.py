"""Solving at equal accuracy, beside optimisers on the eigenvalues."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from benchmarks.reports.tables import Asked, duration, page, table, times
from benchmarks.rivals import OWN, SEEKERS, TOLERANCES, Heat, Run, heat, median_ratio
from benchmarks.suites import PROBLEMS, random_problem
from tmsopt import InputError, Problem, certify, load, models, solve

LIMIT = 10.0
"""Seconds that a rival has for one problem."""

_QUICK = 1.0
_STARTS = 32  # of the search for the reference, all tried
_SUITE = (29, 3, 39, 6)
"""The first problems of the suite with 2, 4, 5 and 7 free parameters whose best design is stable and proved optimal."""


def problems(quick: bool = False) -> Iterator[tuple[str, Problem, float]]:
    """Title, problem, and its optimum in closed form; nan where there is none."""
    yield "EP4 of the paper", load(PROBLEMS / "ep4.toml"), -((0.4 * 0.2) ** -0.25)
    five = Problem(
        model=models.tms,
        fixed={"chi_H": 1.0, "mu": 0.1},
        free={
            "Fr": (0.01, 10),
            "chi_B": (1.01, 5),
            "lambda_s": (0.02, 1.4),
            "zeta_B": (-1.2, -0.3),
            "zeta_H": (-1.0, -0.1),
        },
        constraints={"axis": "nu_H >= 0.02", "layout": "chi_B - chi_H >= 0.1"},
        minimize="abscissa",
    )
    if quick:
        return
    yield "EP4, heights free too", five, -((0.3 * 0.1) ** -0.25)  # ω0 is lowest where both masses are
    yield "what a builder would accept", load(PROBLEMS / "realistic.toml"), math.nan
    for index in _SUITE:
        yield f"random design {index}", random_problem(index), math.nan


def optimum(problem: Problem, closed: float) -> tuple[float, str, Mapping[str, float]]:
    """The least abscissa, how it is known, and a design that has it."""
    found = solve(problem, throw=False, starts=_STARTS, seed=1, exhaustive=True)
    if math.isfinite(closed):
        return closed, "closed form", found.parameters
    try:
        found = certify(found)
    except InputError:  # without SCIP
        return found.value, f"best of {_STARTS} starts", found.parameters
    if not found.bound.proven:
        return found.value, f"best of {_STARTS} starts; not proved", found.parameters
    return found.value, f"branch and bound, within {max(found.bound.gap, 0.0):.0e}", found.parameters


def report(asked: Asked) -> str:
    """The report in Markdown."""
    limit = asked.within(LIMIT, _QUICK)
    heats = [heat(title, p, optimum(p, closed), SEEKERS, limit) for title, p, closed in problems(asked.quick)]
    return page(
        "Solving at equal accuracy",
        asked,
        " ".join(f"{name}: {s.versions}." for name, s in SEEKERS.items() if s.packages and not s.obstacle),
        overview(heats),
        "On how many problems a method comes within a relative error of the optimum, and its time until then over that "
        f"of `tmsopt.solve`: the median of all problems, where one that is never there counts with its {limit:g} s.",
        _problems(heats),
        details(heats),
        _note(limit),
    )


def overview(heats: Sequence[Heat]) -> str:
    """A row per method: on how many problems it got within each tolerance, and the median of its times over ours."""
    rows = []
    for first in heats[0].runs:
        runs = [r for h in heats for r in h.runs if r.method == first.method]
        if all(r.note for r in runs):
            rows.append((first.method, first.note, *[""] * (2 * len(TOLERANCES) - 1), ""))
            continue
        cells = []
        for tolerance in TOLERANCES:
            count, ratio, exact = median_ratio(heats, first.method, tolerance)
            cells += [f"{count} of {len(heats)}", f"{'' if exact else '≥ '}{times(ratio)}"]
        worst = max(h.error(r) for h, r in zip(heats, runs, strict=True))
        rows.append((first.method, *cells, f"{worst:.0e}"))
    header = ["method"]
    for tolerance in TOLERANCES:
        header += [f"within {tolerance:.0e}", "time ratio"]
    return table((*header, "largest error"), rows)


def _problems(heats: Sequence[Heat]) -> str:
    rows = [
        (
            h.title,
            len(h.problem.free),
            len(h.problem.posed.conditions),
            f"{h.optimum:.12g}",
            h.proof,
            duration(h.runs[0].seconds),
        )
        for h in heats
    ]
    return table(("problem", "free", "constraints", "least abscissa", "known by", OWN), rows)


def details(heats: Sequence[Heat]) -> str:
    """A row per problem and method."""
    rows = [
        (h.title, r.method, *[_cell(h, r, t) for t in TOLERANCES], r.evaluations, _off(h.off(r)))
        for h in heats
        for r in h.runs
        if not r.note or r.evaluations
    ]
    header = ("problem", "method", *(f"within {t:.0e}" for t in TOLERANCES), "evaluations in all", "design off by")
    return table(header, rows)


def _cell(of: Heat, run: Run, tolerance: float) -> str:
    moment = run.reached(of.optimum, tolerance)
    if run.note:
        return run.note
    if moment is None:
        return f"never: best error {of.error(run):.0e}" if run.moments else "never: nothing feasible"
    ratio = "" if run.method == OWN else f"× {times(of.ratio(run, tolerance))}: "
    return f"{ratio}{duration(moment.seconds)}, {moment.evaluations}"


def _off(distance: float) -> str:
    return f"{distance:.0e}" if np.isfinite(distance) else "–"


def _note(limit: float) -> str:
    return (
        "A cell has the ratio, the time and the designs evaluated until then; of `tmsopt.solve` the best of several "
        "whole solves, rechecks and all starts included, and IPOPT's evaluations of the factored problem. Rivals "
        "minimise the largest real part of the eigenvalues from the same starts, or from one seed after another, for "
        f"{limit:g} s, and are stopped when they see the optimum, which they could not know. A rival's value is "
        "the least that its own eigenvalues ever had at a design that violates nothing by more than 1e-6; an equality "
        "is solved for a parameter. Differential evolution and CMA-ES (BIPOP restarts) evaluate a generation at once; "
        "Nelder–Mead, annealing and CMA-ES have a penalty for violations, PyGRANSO exact gradients and the box as "
        "constraints. The last column is the distance of the best design from the optimal one in widths of the box: "
        "next to an exceptional point eigenvalues scatter by up to 4e-4, and what a rival sees there is partly luck."
    )
