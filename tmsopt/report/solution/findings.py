"""What there is to say of a solution beside its numbers, found out for its report."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from tmsopt.critical_speeds import Speeds, speed_of, speeds
from tmsopt.design.solution import Solution
from tmsopt.diagnosis import Diagnosis, diagnose
from tmsopt.errors import InputError
from tmsopt.explanation import Explanation, explain
from tmsopt.margins import Robustness, robustness

T = TypeVar("T")


@dataclass(frozen=True)
class Findings:
    """Each None where it was not asked for, or does not apply.

    Attributes:
        explanation: limits and what they are worth, warnings, rounding, local optimality.
        robustness: the nearest boundaries.
        speeds: where the design is stable, and what happens at the ends.
        diagnoses: how its multiple roots split.
    """

    explanation: Explanation | None = None
    robustness: Robustness | None = None
    speeds: Speeds | None = None
    diagnoses: tuple[Diagnosis, ...] = ()


def findings(solution: Solution, full: bool = False) -> Findings:
    """Of a solution; with gains of limits that are solved again, and how roots split, where all is wanted."""
    if solution.interrupted:
        return Findings()
    finite = math.isfinite(solution.abscissa)
    sought = finite and solution.status != "infeasible"
    return Findings(
        explain(solution, resolve=full),
        robustness(solution) if sought else None,
        _unless_refused(lambda: _at_any_speed(solution)) if sought else None,
        diagnose(solution) if full and solution.status == "optimal" else (),
    )


def _at_any_speed(solution: Solution) -> Speeds | None:
    """Whatever the box of the speed is: where the design would be stable beyond it counts too."""
    of = solution.problem.parameter_set
    name = speed_of(of)
    return speeds(solution, name, between=(of[name].range.lower, of[name].range.upper)) if name else None


def _unless_refused(found: Callable[[], T]) -> T | None:
    """None for a model without a speed, and for a design with scenarios, which has no speed of its own."""
    try:
        return found()
    except InputError:
        return None
