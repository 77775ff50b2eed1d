"""What rounding the parameters of a design does to its roots, in exact arithmetic."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from tmsopt.evaluation.recheck import FEASIBLE, is_violated, realised_roots
from tmsopt.evaluation.worst_case import peaks
from tmsopt.models import Values
from tmsopt.problem.cases import Case
from tmsopt.problem.dependence import depends_on_case
from tmsopt.problem.problem import Problem
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, ROOT_NAMES
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, unit_of
from tmsopt.program.judgement import values_of
from tmsopt.records import Array, Table, plain

ALONE = 3
"""Significant digits to which each parameter is rounded alone."""

DIGITS = (2, 3, 4, 6)
"""Significant digits to which all parameters are rounded together."""

_MOTION = ("abscissa", "damping_ratio", ANGULAR_FREQUENCY)
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
    problem, m = solution.problem, len(choices)
    units = {n: unit_of(problem, n) for n in problem.free}
    written = [{n: _rounded(solution, n, units[n], digits) for n in names} for names, digits in choices]
    with flint.ctx.workdps(_WORKING):
        nominal = [{**solution.parameters, **{n: _exact(x, units[n]) for n, x in row.items()}} for row in written]
        each = [(k, case.applied(nominal[k])) for k, cases in enumerate(_cases(solution, nominal)) for case in cases]
        designs, owner = [design for _, design in each], np.array([k for k, _ in each])
        motion = np.array([_motion(problem, design) for design in designs]).T
    whose = np.concatenate([np.arange(m), owner])
    with np.errstate(all="ignore"):  # what has no value is nan or inf
        values = values_of(problem, _doubles([*nominal, *designs]), whose.shape)
    known = {}
    for name, of, worst_of in zip(_MOTION, motion, (np.max, np.min, np.max), strict=True):
        known[name] = np.array([worst_of(of[owner == k]) for k in range(m)])
        values.define(name, known[name][whose])
    objective = np.broadcast_to(problem.objective(values) if problem.objective else math.nan, whose.shape)
    violated = _violations(problem, values, whose, m)
    found = []
    for k, (texts, (_, digits)) in enumerate(zip(written, choices, strict=True)):
        shown = Table({n: f"{text} {units[n].text}".rstrip() for n, text in texts.items()})
        abscissa, ratio = (float(known[name][k]) for name in _MOTION[:2])
        ratio = ratio if problem.model.carrier is None else math.nan
        loss = abscissa - solution.abscissa
        found.append(Rounded(digits, shown, abscissa, loss, ratio, float(objective[k]), Table(violated[k])))
    return tuple(found)


def _motion(problem: Problem, design: Mapping[str, Any]) -> tuple[float, float, float]:
    """Abscissa, damping ratio and greatest angular frequency of a design exactly as it is; nan where there is none."""
    roots = realised_roots(problem, design)
    if sum(root.multiplicity for root in roots) < problem.model.degree:  # one is at infinity
        return max((root.re for root in roots), default=math.nan), math.nan, math.nan
    ratios = (-root.re / (math.hypot(root.re, root.im) or 1.0) for root in roots)
    return roots[0].re, min(ratios) + 0.0, max(abs(root.im) for root in roots)


def worst(alone: Mapping[str, Rounded]) -> str:
    """The parameter whose rounding costs most; empty where none costs anything."""
    losing = {name: row.loss for name, row in alone.items() if row.loss > 0}
    return max(losing, key=lambda name: losing[name], default="")


def _cases(solution: Solution, designs: Sequence[Mapping[str, Any]]) -> list[list[Case]]:
    """Of each rounded design: the listed cases, the worst of the design and its own; one that changes nothing else."""
    problem = solution.problem
    listed = [case for case in problem.cases if not case.direction]
    shared = [*listed, *([solution.worst] if solution.worst else [])]
    own = peaks(problem, _doubles(designs), len(designs)) if listed else [[] for _ in designs]
    return [list(dict.fromkeys([*shared, *cases])) or [Case()] for cases in own]


def _doubles(designs: Sequence[Mapping[str, Any]]) -> dict[str, Array]:
    """Parameters of several designs as columns."""
    return {n: np.array([float(design[n]) for design in designs]) for n in designs[0]}


def _violations(problem: Problem, values: Values, whose: NDArray[np.int64], count: int) -> list[dict[str, float]]:
    """What each design violates in any case beyond tolerance, by how much.

    Args:
        values: of all designs, nominal, and then of their cases.
        whose: number of the design that each is one of.
    """
    found: list[dict[str, float]] = [{} for _ in range(count)]
    for name, condition in problem.conditions.items():
        if RADIUS in condition.names:  # it takes a search of its own
            continue
        left, right = (np.broadcast_to(np.asarray(side, dtype=float), whose.shape) for side in condition.each(values))
        excess = condition.excess(left - right)
        relative = excess / np.maximum(1.0, np.maximum(np.abs(left), np.abs(right)))
        relative = np.where(np.isfinite(left - right), relative, np.inf)
        names = (*problem.parameter_set.names, *(n for n in ROOT_NAMES if n in condition.names))
        at = whose if depends_on_case(problem, condition, problem.cases) else whose[:count]
        for k in range(count):
            own = np.flatnonzero(at == k)
            worst = own[relative[own].argmax()]
            one = {n: float(np.broadcast_to(values[n], whose.shape)[worst]) for n in names}
            if is_violated(problem, condition, float(relative[worst]), one):
                found[k][name] = float(excess[worst])
    for name, (lower, upper) in problem.free.items():
        for end, amounts, limit in (("min", lower - values[name], lower), ("max", values[name] - upper, upper)):
            for k in np.flatnonzero(amounts[:count] > FEASIBLE * max(1.0, abs(limit))).tolist():
                found[k][f"{name}.{end}"] = float(amounts[k])
    return found


def _short(solution: Solution, name: str, digits: int) -> bool:
    """Whether a parameter has no more digits than that."""
    value, unit = solution.parameters[name], unit_of(solution.problem, name)
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
