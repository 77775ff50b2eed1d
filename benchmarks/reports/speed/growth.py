"""How the time grows with free parameters and scenarios."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from benchmarks.judges import Attempt, attempt
from benchmarks.reports.tables import Asked, duration, page, table, times
from benchmarks.suites import band_problems, random_problem
from benchmarks.timing import exponent, quantile
from tmsopt import Problem, solve

_FREE = (2, 3, 4, 5, 6, 7)
_EACH = 5  # random problems with each number of free parameters
_SPEEDS = (1, 2, 4, 8, 16)
_BOXES = 3


def timed(problems: Sequence[Problem], rounds: int) -> list[Attempt]:
    """The fastest solve of each over some rounds, in which all take turns."""
    found = [[attempt("default", problem) for problem in problems] for _ in range(rounds)]
    return [min(turns, key=lambda own: own.seconds) for turns in zip(*found, strict=True)]


def by_freedom(quick: bool) -> list[tuple[int, list[Attempt]]]:
    """The first random designs with each number of free parameters that have an optimum."""
    wanted = 2 if quick else _EACH
    groups = {free: list(islice(_with_optimum(free), wanted)) for free in (_FREE[:3] if quick else _FREE)}
    return _grouped(groups, 1 if quick else 3)


def _with_optimum(free: int) -> Iterator[Problem]:
    every = (p for p in map(random_problem, range(200)) if len(p.free) == free)
    return (p for p in every if solve(p, throw=False).status == "optimal")


def _grouped(groups: Mapping[int, Sequence[Problem]], rounds: int) -> list[tuple[int, list[Attempt]]]:
    found = iter(timed([p for problems in groups.values() for p in problems], rounds))
    return [(size, list(islice(found, len(problems)))) for size, problems in groups.items()]


def by_scenarios(quick: bool) -> list[tuple[int, list[Attempt]]]:
    """The band designs of six free parameters at 1, 2, 4 … speeds of the band, and nothing asked between them."""
    boxes = list(band_problems().values())[: 1 if quick else _BOXES]
    groups = {n: [replace(p, scenarios={"Fr": _speeds(n)}) for p in boxes] for n in (_SPEEDS[:3] if quick else _SPEEDS)}
    return _grouped(groups, 1 if quick else 2)


def _speeds(count: int) -> tuple[float, ...]:
    return tuple(np.linspace(1.2, 2.4, count).tolist()) if count > 1 else (1.8,)


def report(asked: Asked) -> str:
    """The report in Markdown."""
    return page(
        "Growth",
        asked,
        "### With free parameters",
        _solves("free", by_freedom(asked.quick)),
        "The first random designs of the suite with each number that have an optimum: medians.",
        "### With scenarios",
        _solves("speeds", by_scenarios(asked.quick)),
        "Band designs of six free parameters, the worst abscissa over separate speeds: medians. A speed adds its own "
        "factors and equations to the problem.",
    )


def _solves(what: str, rows: Sequence[tuple[int, Sequence[Attempt]]]) -> str:
    sizes = [size for size, _ in rows]
    whole = [quantile(s.seconds for s in solved) for _, solved in rows]
    each = [quantile(s.per_start for s in solved) for _, solved in rows]
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
