"""What there is to say of a solution beside its numbers, found out for its report."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from tmsopt.analysis import Diagnosis, Explanation, diagnose, explain
from tmsopt.boundaries import Robustness, robustness, robustness_at
from tmsopt.dynamics import stable_speeds
from tmsopt.errors import InputError
from tmsopt.problem.solution import Solution
from tmsopt.progress import Listener, start_steps

T = TypeVar("T")


@dataclass(frozen=True)
class Findings:
    """Each None where it was not asked for, or does not apply.

    Attributes:
        explanation: limits and what they are worth, warnings, rounding, local optimality.
        robustness: the nearest boundaries, of stability and where all is wanted of heavy damping.
        stable: bands of its speed in which the design is stable.
        diagnoses: how its multiple roots split.

    Example:
        >>> found = tmsopt.report.Findings(stable=((1.5931, float("inf")),))
        >>> "stable in Fr: from 1.5931" in tmsopt.report.design_report(tmsopt.solve("problems/ep4.toml"), found)
        True

    More: docs/how_to/report.md
    """

    explanation: Explanation | None = None
    robustness: Robustness | None = None
    stable: tuple[tuple[float, float], ...] | None = None
    diagnoses: tuple[Diagnosis, ...] = ()


def findings(solution: Solution, full: bool = False, progress: Listener | None = None) -> Findings:
    """Of a solution; with gains of limits that are solved again, and how roots split, where all is wanted.

    Example:
        >>> found = tmsopt.report.findings(tmsopt.solve("problems/benchmark.toml"))
        >>> [[f"{v:.6f} m/s" for v in band] for band in found.stable]  # above the speed of weaving
        [['2.841008 m/s', 'inf m/s']]

    More: docs/how_to/report.md
    """
    if solution.interrupted:
        return Findings()
    finite = math.isfinite(solution.abscissa)
    sought = finite and solution.status != "infeasible"
    return Findings(
        explain(solution, resolve=full, progress=progress),
        _around(solution, full, progress) if sought else None,
        _unless_refused(lambda: stable_speeds(solution)) if sought else None,
        diagnose(solution, progress=progress) if full and solution.status == "optimal" else (),
    )


def _around(solution: Solution, full: bool, progress: Listener | None) -> Robustness:
    """The nearest boundaries; that of heavy damping, which a screen has no line for, where all is wanted."""
    if full:
        return robustness(solution, progress=progress)
    start_steps(progress, "looking for the nearest boundaries")
    return robustness_at(solution.problem.posed, solution.parameters)


def _unless_refused(found: Callable[[], T]) -> T | None:
    """None for a design with scenarios, which has no speed of its own."""
    try:
        return found()
    except InputError:
        return None
