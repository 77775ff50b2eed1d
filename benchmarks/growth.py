"""Section (f): how the time grows with free parameters, scenarios and grid points."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.band import band_problems
from benchmarks.charts import by_blocks, grid_coefficients, stacked
from benchmarks.measure import best, duration, exponent, times
from benchmarks.report import origin, table
from benchmarks.suite import random_problem
from tmsopt import chart, load, solve
from tmsopt.design.problem import Problem

_FREE = (2, 3, 4, 5, 6, 7)
_EACH = 5  # random problems with each number of free parameters
_SPEEDS = (1, 2, 4, 8, 16, 32)
_POINTS = (10**4, 10**5, 10**6, 10**7)
_STACKED = 10**6  # designs beyond which stacked eigenvalues need not be waited for
_CHART = Path(__file__).parent.parent / "problems" / "chart.toml"


@dataclass(frozen=True)
class Solved:
    """A solve: how long, and from how many starts.

    Attributes:
        optimal: whether it ended so; others end at other times for other reasons.
    """

    seconds: float
    starts: int
    optimal: bool


def timed(problem: Problem, repeats: int) -> Solved:
    """The fastest of a few solves."""
    found = [solve(problem, throw=False) for _ in range(repeats)]
    first = found[0]
    return Solved(min(f.seconds for f in found), first.starts.tried, first.status == "optimal")


def by_freedom(quick: bool) -> list[tuple[int, list[Solved]]]:
    """Optimal solves of the first random designs with each number of free parameters."""
    return [
        (free, _optimal(free, 2 if quick else _EACH, 1 if quick else 3)) for free in (_FREE[:3] if quick else _FREE)
    ]


def _optimal(free: int, wanted: int, repeats: int) -> list[Solved]:
    found: list[Solved] = []
    for problem in _suite(free):
        if len(found) < wanted and (one := timed(problem, 1)).optimal:
            found.append(timed(problem, repeats) if repeats > 1 else one)
        if len(found) == wanted:
            break
    return found


def _suite(free: int) -> Iterator[Problem]:
    return (p for p in map(random_problem, range(200)) if len(p.free) == free)


def by_scenarios(quick: bool) -> list[tuple[int, list[Solved]]]:
    """The band designs of six free parameters at 1, 2, 4 … speeds of the band, and nothing asked between them."""
    boxes = list(band_problems().values())[: 1 if quick else None]
    rows = []
    for count in _SPEEDS[:3] if quick else _SPEEDS:
        speeds = tuple(np.linspace(1.2, 2.4, count).tolist()) if count > 1 else (1.8,)
        rows.append((count, [timed(replace(p, scenarios={"Fr": speeds}), 1 if quick else 2) for p in boxes]))
    return rows


def by_points(quick: bool) -> list[tuple[int, float, float]]:
    """Designs of a chart, its seconds, and those of stacked eigenvalues; nan where they are not waited for."""
    problem = load(_CHART, asks=False)
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
        "Band designs of `benchmarks.band`, six free parameters, the worst abscissa over separate speeds: medians. A "
        "speed adds its own factors and equations to the problem.",
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
