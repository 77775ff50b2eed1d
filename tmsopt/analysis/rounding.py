"""What rounding the parameters of a design does to its roots, in exact arithmetic."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Any

import flint
import numpy as np

from tmsopt.evaluation.recheck import FEASIBLE, judged_exactly
from tmsopt.evaluation.worst_case import peaks
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, unit_of
from tmsopt.records import Table, plain

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
        damping_ratio: of the rounded design, likewise.
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


def rounded_designs(solution: Solution) -> tuple[Table[Rounded], tuple[Rounded, ...]]:
    """Each free parameter rounded alone, unless it is no longer than that, and all together, to ever more digits."""
    names = list(solution.problem.free)
    alone = [n for n in names if not _short(solution, n, ALONE)]
    found = rounded(solution, [*(([n], ALONE) for n in alone), *((names, digits) for digits in DIGITS if names)])
    return Table(dict(zip(alone, found, strict=False))), found[len(alone) :]


def rounded(solution: Solution, choices: Sequence[tuple[Sequence[str], int]]) -> tuple[Rounded, ...]:
    """A design with some of its parameters rounded, for each choice of these and of significant digits, all at once."""
    if not choices:
        return ()
    problem = solution.problem.posed
    units = {n: unit_of(problem, n) for n in problem.free}
    written = [{n: _rounded(solution, n, units[n], digits) for n in names} for names, digits in choices]
    found = []
    with flint.ctx.workdps(_WORKING):
        designs = [{**solution.parameters, **{n: _exact(x, units[n]) for n, x in row.items()}} for row in written]
        cases = _cases(solution, designs)
        for texts, (_, digits), design, own in zip(written, choices, designs, cases, strict=True):
            with np.errstate(all="ignore"):  # what has no value is nan or inf
                values, violated = judged_exactly(problem, design, own)
                objective = float(problem.objective(values)) if problem.objective else math.nan
            shown = Table({n: f"{text} {units[n].text}".rstrip() for n, text in texts.items()})
            abscissa = float(values["abscissa"])
            all_there = (
                sum(r.multiplicity for r in values["structure"].roots) == problem.model.degree
            )  # none at infinity
            told = all_there and problem.model.carrier is None
            ratio = float(values["damping_ratio"]) if told else math.nan
            beyond = Table(violated | _beyond_box(problem, design))
            loss = abscissa - solution.abscissa
            found.append(Rounded(digits, shown, abscissa, loss, ratio, objective, beyond))
    return tuple(found)


def worst(alone: Mapping[str, Rounded]) -> str:
    """The parameter whose rounding costs most; empty where none costs anything."""
    losing = {name: row.loss for name, row in alone.items() if row.loss > 0}
    return max(losing, key=lambda name: losing[name], default="")


def _cases(solution: Solution, designs: Sequence[Mapping[str, Any]]) -> list[list[Case]]:
    """Of each rounded design: the listed cases, the worst of the design and its own; one that changes nothing else."""
    problem = solution.problem.posed
    listed = [case for case in problem.cases if not case.direction]
    shared = [*listed, *([solution.worst] if solution.worst else [])]
    columns = {n: np.array([float(design[n]) for design in designs]) for n in designs[0]}
    own = peaks(problem, columns, len(designs)) if listed else [[] for _ in designs]
    return [list(dict.fromkeys([*shared, *cases])) or [Case()] for cases in own]


def _beyond_box(problem: Posed, design: Mapping[str, Any]) -> dict[str, float]:
    """Ends of ranges that a design is beyond, by how much."""
    found = {}
    for name, (lower, upper) in problem.free.items():
        value = float(design[name])
        for end, amount, limit in (("min", lower - value, lower), ("max", value - upper, upper)):
            if amount > FEASIBLE * max(1.0, abs(limit)):
                found[f"{name}.{end}"] = amount
    return found


def _short(solution: Solution, name: str, digits: int) -> bool:
    """Whether a parameter has no more digits than that."""
    value, unit = solution.parameters[name], unit_of(solution.problem.posed, name)
    there = float(_rounded(solution, name, unit, digits)) * unit.one
    return abs(there - value) <= _SAME * abs(value)


def _rounded(solution: Solution, name: str, unit: Unit, digits: int) -> str:
    """A parameter in its reported unit, as a decimal of so many significant digits, inwards at an end of its range."""
    value = solution.parameters[name] / unit.one
    low, high = (end / unit.one for end in solution.problem.free.get(name, (-math.inf, math.inf)))
    text = f"{value:#.{digits}g}".removesuffix(".")
    step = Decimal((0, (1,), int(Decimal(text).as_tuple().exponent)))
    for beyond, move in ((float(text) - high, -step), (low - float(text), step)):
        if beyond > FEASIBLE * max(1.0, abs(value)):
            text = str(Decimal(text) + move)
    return text


def _exact(text: str, unit: Unit) -> flint.arb:
    """The decimal in the parameter's own unit, at the precision of the context."""
    if unit.one == _DEGREE:
        return flint.arb(text) * flint.arb.pi() / 180
    share = Fraction(unit.one).limit_denominator(_LARGEST_DENOMINATOR)
    return flint.arb(text) * flint.arb(flint.fmpq(share.numerator, share.denominator))
