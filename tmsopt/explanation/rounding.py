"""What rounding the parameters of a design does to its roots, in exact arithmetic."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import flint
import numpy as np

from tmsopt.checks.recheck import FEASIBLE, realised_abscissa
from tmsopt.checks.worst_case import worst_cases
from tmsopt.design.cases import Case
from tmsopt.design.dependence import varies
from tmsopt.design.problem import Problem
from tmsopt.design.quantities import ANGULAR_FREQUENCY, RADIUS
from tmsopt.design.solution import Solution
from tmsopt.design.unit_system import Unit, unit_of
from tmsopt.models import Values
from tmsopt.records import Table, plain
from tmsopt.roots import roots

ALONE = 3
"""Significant digits to which each parameter is rounded alone."""

DIGITS = (2, 3, 4, 6)
"""Significant digits to which all parameters are rounded together."""

_SAME = 1e-15  # relative change that is no rounding: a degree or two written as radians
_DEGREE = math.pi / 180
_LARGEST_DENOMINATOR = 10**6  # of a factor between units, such as 5/18
_WORKING = 140  # decimal digits of the exact numbers


@dataclass(frozen=True)
class Rounded:
    """A design with parameters rounded to significant digits, in the unit in which each is reported.

    Attributes:
        digits: significant digits.
        written: rounded parameter → the decimal number with its unit, e.g. ``23.5 deg``.
        realised: abscissa of the decimals, exact to double precision; the other parameters as stored. With scenarios
            or tolerances, its worst over whole bands and tolerance boxes.
        loss: realised minus ideal abscissa of the design.
        damping_ratio: of the rounded design, in double precision.
        objective: value of the objective expression; nan without one.
        violations: constraint or bound that the rounding violates → by how much, in its own units (rad, SI).
    """

    digits: int
    written: Table[str]
    realised: float
    loss: float
    damping_ratio: float
    objective: float
    violations: Table[float]

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``; numbers that do not exist are None."""
        found = plain(self)
        return {"abscissa_realised" if name == "realised" else name: value for name, value in found.items()}


def rounded_alone(solution: Solution, digits: int = ALONE) -> Table[Rounded]:
    """Each free parameter rounded by itself; one that is no longer than that is left out."""
    return Table({n: rounded(solution, [n], digits) for n in solution.problem.free if not _short(solution, n, digits)})


def rounded_together(solution: Solution, digits: Iterable[int] = DIGITS) -> tuple[Rounded, ...]:
    """All free parameters rounded together, one row per number of digits."""
    return tuple(rounded(solution, list(solution.problem.free), d) for d in digits) if solution.problem.free else ()


def rounded(solution: Solution, names: Iterable[str], digits: int) -> Rounded:
    """A design with some of its parameters rounded to significant digits."""
    problem = solution.problem
    units = {n: unit_of(problem, n) for n in problem.free}
    written = {n: _decimal(solution.parameters[n], units[n], digits) for n in names}
    with flint.ctx.workdps(_WORKING):
        exact: dict[str, Any] = {n: _exact(text, units[n]) for n, text in written.items()}
    plain = {**solution.parameters, **{n: float(x.mid()) for n, x in exact.items()}}
    cases = _cases(solution, plain)
    realised = max(realised_abscissa(problem, c.applied({**solution.parameters, **exact})) for c in cases)
    each = [problem.values(case.applied(plain)) for case in cases]
    ratio = min(_damping_ratio([float(c) for c in values.coefficients]) for values in each)
    known = {"abscissa": realised, "damping_ratio": ratio}  # and better than by fitting structures
    if problem.asks(ANGULAR_FREQUENCY):
        known[ANGULAR_FREQUENCY] = max(values[ANGULAR_FREQUENCY] for values in each)
    values = problem.values(plain)
    for one in (values, *each):
        for name, number in known.items():
            one.define(name, number)
    texts = Table({n: f"{text} {units[n].text}".rstrip() for n, text in written.items()})
    objective = float(problem.objective(values)) if problem.objective else math.nan
    violated = Table(_violations(problem, plain, [values, *each]))
    return Rounded(digits, texts, realised, realised - solution.abscissa, ratio, objective, violated)


def worst(alone: Mapping[str, Rounded]) -> str:
    """The parameter whose rounding costs most; empty where none costs anything."""
    losing = {name: row.loss for name, row in alone.items() if row.loss > 0}
    return max(losing, key=lambda name: losing[name], default="")


def _cases(solution: Solution, rounded: Mapping[str, float]) -> list[Case]:
    """The listed cases, and the worst of the design and of the rounded one; one that changes nothing without any."""
    listed = [case for case in solution.problem.cases if not case.direction]
    worst = [w.case for w in worst_cases(solution.problem, rounded).values()] if listed else []
    return [*listed, *([solution.worst] if solution.worst else []), *worst] or [Case()]


def _violations(problem: Problem, parameters: Mapping[str, float], each: Sequence[Values]) -> dict[str, float]:
    """What is violated in any case beyond tolerance, by how much; the first values are of the nominal design."""
    found = {}
    for name, condition in problem.conditions.items():
        if RADIUS not in condition.names:  # it takes a search of its own
            at = each if varies(problem, condition, problem.cases) else each[:1]
            worst = max(at, key=lambda v: math.inf if math.isnan(x := condition.violation(v)) else x)
            if not condition.violation(worst) <= FEASIBLE:
                found[name] = float(condition.excess(condition(worst)))
    for name, (lower, upper) in problem.free.items():
        x = parameters[name]
        for end, amount, limit in (("min", lower - x, lower), ("max", x - upper, upper)):
            if not amount <= FEASIBLE * max(1.0, abs(limit)):
                found[f"{name}.{end}"] = amount
    return found


def _damping_ratio(coefficients: Sequence[float]) -> float:
    """By numeric roots, for rounding has moved the design far enough from an exceptional point."""
    if coefficients[0] == 0:
        return math.nan
    z = roots(coefficients)
    return float(np.min(-z.real / np.maximum(np.abs(z), 1e-300)))


def _short(solution: Solution, name: str, digits: int) -> bool:
    """Whether a parameter has no more digits than that."""
    value, unit = solution.parameters[name], unit_of(solution.problem, name)
    there = float(_decimal(value, unit, digits)) * unit.one
    return abs(there - value) <= _SAME * abs(value)


def _decimal(value: float, unit: Unit, digits: int) -> str:
    """A number in its reported unit, as a decimal of so many significant digits."""
    return f"{value / unit.one:#.{digits}g}".removesuffix(".")


def _exact(text: str, unit: Unit) -> flint.arb:
    """The decimal in the parameter's own unit, at the precision of the context."""
    if unit.one == _DEGREE:
        return flint.arb(text) * flint.arb.pi() / 180
    share = Fraction(unit.one).limit_denominator(_LARGEST_DENOMINATOR)
    return flint.arb(text) * flint.arb(flint.fmpq(share.numerator, share.denominator))
