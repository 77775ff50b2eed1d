"""Computes the effect of rounded parameters on the roots of a design, in exact arithmetic."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Any

import flint
import numpy as np

from tmsopt.evaluation.recheck import FEASIBILITY_TOLERANCE, recheck_exactly
from tmsopt.evaluation.worst_case import find_worst_cases
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import Unit, unit_of
from tmsopt.records import Table, plain

SINGLE_DIGITS = 3
"""Significant digits if only one parameter is rounded."""

DIGITS = (2, 3, 4, 6)
"""Significant digits to which all parameters are rounded together."""

_CONVERSION_ERROR = 1e-15  # largest relative error of the conversion of a unit, such as radians to degrees
_DEGREE = math.pi / 180
_LARGEST_DENOMINATOR = 10**6  # largest denominator of a factor between units, such as 5/18
_DECIMALS = 140  # decimal digits of the exact numbers


@dataclass(frozen=True)
class RoundedDesign:
    """A design with parameters rounded to significant digits, each in the unit of the report.

    Attributes:
        digits: significant digits.
        written: rounded parameter → the decimal number with its unit, e.g. ``23.5 deg``.
        realised: abscissa of the decimal numbers, exact to double precision; the other parameters are as stored. With
            scenarios or tolerances, it is the worst abscissa over all bands and tolerance boxes.
        loss: realised abscissa minus the ideal abscissa of the design.
        damping_ratio: damping ratio of the rounded design, also the worst one.
        objective: value of the objective; nan without an objective.
        violations: constraint or bound that the rounding violates → amount, in the unit of the constraint (rad, SI).
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
        data = plain(self)
        return {"abscissa_realised" if name == "realised" else name: value for name, value in data.items()}


def list_rounded_designs(solution: Solution) -> tuple[Table[RoundedDesign], tuple[RoundedDesign, ...]]:
    """Each free parameter rounded alone, if it has more digits, and all of them together to 2, 3, 4 and 6 digits."""
    names = list(solution.problem.free)
    names_alone = [n for n in names if not _has_few_digits(solution, n)]
    designs = round_design(
        solution, [*(([n], SINGLE_DIGITS) for n in names_alone), *((names, digits) for digits in DIGITS if names)]
    )
    return Table(dict(zip(names_alone, designs, strict=False))), designs[len(names_alone) :]


def round_design(solution: Solution, choices: Sequence[tuple[Sequence[str], int]]) -> tuple[RoundedDesign, ...]:
    """The design with some parameters rounded, for each choice (names, significant digits)."""
    problem, rounded_designs = solution.problem.posed, []
    with flint.ctx.workdps(_DECIMALS), np.errstate(all="ignore"):  # undefined values become nan or inf
        for names, digits in choices:
            units = {n: unit_of(problem, n) for n in names}
            written = {n: _format_decimal(solution, n, unit, digits) for n, unit in units.items()}
            design = {**solution.parameters, **{n: _parse_exact(text, units[n]) for n, text in written.items()}}
            values, violated = recheck_exactly(problem, design, _list_cases(solution, design))
            abscissa, roots = float(values["abscissa"]), values["structure"].roots
            has_ratio = sum(r.multiplicity for r in roots) == problem.model.degree and not problem.model.is_complex
            row = RoundedDesign(
                digits=digits,
                written=Table({n: f"{text} {units[n].text}".rstrip() for n, text in written.items()}),
                realised=abscissa,
                loss=abscissa - solution.abscissa,
                damping_ratio=float(values["damping_ratio"]) if has_ratio else math.nan,  # nan with a root at infinity
                objective=float(problem.objective(values)) if problem.objective else math.nan,
                violations=Table(violated | _find_range_violations(problem, design)),
            )
            rounded_designs.append(row)
    return tuple(rounded_designs)


def _list_cases(solution: Solution, design: Mapping[str, Any]) -> list[Case]:
    """The cases of the problem, the worst case of the unrounded design, and the worst cases of the rounded design."""
    problem = solution.problem.posed
    cases = [*problem.cases, *filter(None, [solution.worst])]
    if problem.scenarios or problem.tolerances:
        cases += [w.case for w in find_worst_cases(problem, {n: float(x) for n, x in design.items()}).values()]
    return cases


def _find_range_violations(problem: Posed, design: Mapping[str, Any]) -> dict[str, float]:
    """Ends of ranges that a design exceeds → the amount."""
    return {
        f"{name}.{end}": amount
        for name, ends in problem.free.items()
        for end, limit, sign in zip(("min", "max"), ends, (-1.0, 1.0), strict=True)
        if (amount := sign * (float(design[name]) - limit)) > FEASIBILITY_TOLERANCE * max(1.0, abs(limit))
    }


def _has_few_digits(solution: Solution, name: str) -> bool:
    """Whether a parameter has so few digits that rounding leaves it unchanged."""
    value, unit = solution.parameters[name], unit_of(solution.problem.posed, name)
    rounded_value = float(_format_decimal(solution, name, unit, SINGLE_DIGITS)) * unit.factor
    return abs(rounded_value - value) <= _CONVERSION_ERROR * abs(value)


def _format_decimal(solution: Solution, name: str, unit: Unit, digits: int) -> str:
    """A parameter in the unit of the report as a decimal; at an end of its range it is rounded inwards."""
    value = solution.parameters[name] / unit.factor
    low, high = (end / unit.factor for end in solution.problem.free.get(name, (-math.inf, math.inf)))
    text = f"{value:#.{digits}g}".removesuffix(".")
    step = Decimal((0, (1,), int(Decimal(text).as_tuple().exponent)))
    for excess, change in ((float(text) - high, -step), (low - float(text), step)):
        if excess > FEASIBILITY_TOLERANCE * max(1.0, abs(value)):
            text = str(Decimal(text) + change)
    return text


def _parse_exact(text: str, unit: Unit) -> flint.arb:
    """The decimal number in the unit in which the parameter is stored, at the precision of the context."""
    if unit.factor == _DEGREE:
        return flint.arb(text) * flint.arb.pi() / 180
    ratio = Fraction(unit.factor).limit_denominator(_LARGEST_DENOMINATOR)
    return flint.arb(text) * flint.arb(flint.fmpq(ratio.numerator, ratio.denominator))
