"""Section (f): how the time grows with free parameters, scenarios and grid points."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from benchmarks.judges.bands import band_problems
from benchmarks.reports.speed.charts import PROBLEM, by_blocks, grid_coefficients, stacked
from benchmarks.reports.tables import origin, table
from benchmarks.suites.random_designs import random_problem
from benchmarks.timing import best, duration, exponent, times
from tmsopt import chart, load, solve
from tmsopt.design.problem import Problem

_FREE = (2, 3, 4, 5, 6, 7)
_EACH = 5  # random problems with each number of free parameters
_SPEEDS = (1, 2, 4, 8, 16)
_BOXES = 3
_POINTS = (10**4, 10**5, 10**6, 10**7)
_STACKED = 10**6  # designs beyond which stacked eigenvalues need not be waited for


@dataclass(frozen=True)
class Solved:
    """A solve: how long, and from how many starts.

    Attributes:
        optimal: whether it ended so; others end at other times for other reasons.
    """

    seconds: float
    starts: int
    optimal: bool


def timed(problems: Sequence[Problem], rounds: int) -> list[Solved]:
    """The fastest solve of each over some rounds, in which all take turns."""
    found = [[solve(problem, throw=False) for problem in problems] for _ in range(rounds)]
    return [
        Solved(min(one.seconds for one in turns), turns[0].starts.tried, turns[0].status == "optimal")
        for turns in zip(*found, strict=True)
    ]


def by_freedom(quick: bool) -> list[tuple[int, list[Solved]]]:
    """The first random designs with each number of free parameters that have an optimum."""
    wanted = 2 if quick else _EACH
    groups = {free: list(islice(_with_optimum(free), wanted)) for free in (_FREE[:3] if quick else _FREE)}
    return _grouped(groups, 1 if quick else 3)


def _with_optimum(free: int) -> Iterator[Problem]:
    every = (p for p in map(random_problem, range(200)) if len(p.free) == free)
    return (p for p in every if solve(p, throw=False).status == "optimal")


def _grouped(groups: Mapping[int, Sequence[Problem]], rounds: int) -> list[tuple[int, list[Solved]]]:
    found = iter(timed([p for problems in groups.values() for p in problems], rounds))
    return [(size, list(islice(found, len(problems)))) for size, problems in groups.items()]


def by_scenarios(quick: bool) -> list[tuple[int, list[Solved]]]:
    """The band designs of six free parameters at 1, 2, 4 … speeds of the band, and nothing asked between them."""
    boxes = list(band_problems().values())[: 1 if quick else _BOXES]
    groups = {n: [replace(p, scenarios={"Fr": _speeds(n)}) for p in boxes] for n in (_SPEEDS[:3] if quick else _SPEEDS)}
    return _grouped(groups, 1 if quick else 2)


def _speeds(count: int) -> tuple[float, ...]:
    return tuple(np.linspace(1.2, 2.4, count).tolist()) if count > 1 else (1.8,)


def by_points(quick: bool) -> list[tuple[int, float, float]]:
    """Designs of a chart, its seconds, and those of stacked eigenvalues; nan where they are not waited for."""
    problem = load(PROBLEM, asks=False)
    rows = []
    for points in _POINTS[:2] if quick else _POINTS:
        across = math.isqrt(points)
        size = (across, points // across)
        works: dict[str, Callable[[], Any]] = {"chart": partial(chart, problem, points=size, boundaries=False)}
        if points <= _STACKED:
            works["stacked"] = partial(by_blocks, stacked, grid_coefficients(problem, points))
        seconds = best(works, 1 if points > _STACKED else 3)
        rows.append((size[0] * size[1], seconds["chart"], seconds.get("stacked", math.nan)))
    return rows


def section(command: str, quick: bool = False) -> str:
    """The report in Markdown."""
    parts = [
        "## Growth",
        origin(command),
        "### With free parameters",
        _solves("free", by_freedom(quick)),
        "The first random designs of the suite with each number that have an optimum: medians.",
        "### With scenarios",
        _solves("speeds", by_scenarios(quick)),
        "Band designs of `benchmarks.judges.bands`, six free parameters, the worst abscissa over separate speeds: "
        "medians. A speed adds its own factors and equations to the problem.",
        "### With grid points",
        _charts(by_points(quick)),
    ]
    return "\n\n".join(parts) + "\n"


def _solves(what: str, rows: Sequence[tuple[int, Sequence[Solved]]]) -> str:
    sizes = [size for size, _ in rows]
    whole = [_median([s.seconds for s in solved]) for _, solved in rows]
    each = [_median([s.seconds / s.starts for s in solved]) for _, solved in rows]
    lines = [
        (
            size,
            f"{sum(s.optimal for s in solved)} of {len(solved)}",
            duration(w),
            times(w / whole[0]),
            duration(e),
            times(e / each[0]),
        )
        for (size, solved), w, e in zip(rows, whole, each, strict=True)
    ]
    found = table((what, "optimal", "solve", "ratio", "a start", "ratio"), lines)
    laws = f"{what}^{exponent(sizes, whole):.2f}, of a start ~ {what}^{exponent(sizes, each):.2f}"
    return f"{found}\n\nTime of a solve ~ {laws}."


def _charts(rows: Sequence[tuple[int, float, float]]) -> str:
    lines = [
        (f"{n:.0e}", duration(own), duration(own / n), duration(rival), times(rival / own)) for n, own, rival in rows
    ]
    sizes, own, rival = zip(*rows, strict=True)
    found = table(("designs", "chart", "a design", "stacked eigvals", "over the chart"), lines)
    return (
        f"{found}\n\nTime of a chart ~ designs^{exponent(sizes, own):.2f}, "
        f"of stacked eigenvalues ~ designs^{exponent(sizes, rival):.2f}."
    )


def _median(numbers: Sequence[float]) -> float:
    return float(np.median(numbers)) if numbers else math.nan
