"""What a design really is, computed from its parameters alone and without the NLP that produced it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import flint

from tmsopt.design.frozen import Table
from tmsopt.design.problem import Problem
from tmsopt.roots import PATTERNS, Structure, exact_abscissa, pattern_distance

FEASIBLE = 1e-9
"""Violation, relative to the size of the two sides, up to which a constraint counts as satisfied."""

MATCHED = 1e-10
"""Relative change of a coefficient up to which a pattern counts as located."""

_DIGITS = 120  # products of five doubles are exact, and the tangent is right far beyond the answer


@dataclass(frozen=True)
class Checked:
    """A design's roots, objective and violations."""

    structure: Structure
    realised: float
    objective: float
    violations: Table[float]
    quantities: Table[float]
    dimensionless: Table[float]


def recheck(problem: Problem, parameters: Mapping[str, float]) -> Checked:
    """Evaluate a design independently of any solver: constraints, pattern, roots and objective."""
    values = problem.values(parameters)
    conditions = {name: c.violation(values) for name, c in problem.conditions.items()}
    violations = {name: v for name, v in conditions.items() if not v <= FEASIBLE}
    if not math.isfinite(values["structure"].abscissa):
        violations["a0"] = 1.0  # a singular mass matrix
    if problem.locate:
        distance = pattern_distance(PATTERNS[problem.locate], [float(c) for c in values.coefficients])
        if not distance <= MATCHED:
            violations[problem.locate] = distance
    objective = float(problem.objective(values)) if problem.objective else math.nan
    of = problem.parameter_set
    names = [n for n in (*problem.model.quantity_names(of), "damping_ratio") if n not in problem.model.sets[0].names]
    return Checked(
        structure=values["structure"],
        realised=realised_abscissa(problem, parameters),
        objective=objective,
        violations=Table(violations),
        quantities=Table({name: float(values[name]) for name in names}),
        dimensionless=Table({n: float(v) for n, v in of.native(parameters).items()}),
    )


def realised_abscissa(problem: Problem, parameters: Mapping[str, float]) -> float:
    """Abscissa of the parameters exactly as stored: coefficients at 120 digits, roots isolated in ball arithmetic."""
    with flint.ctx.workdps(_DIGITS):
        exact = {name: flint.arb(value) for name, value in parameters.items()}
        coefficients = problem.model.coefficients(exact, problem.parameter_set)
    leading = next((k for k, c in enumerate(coefficients) if c.mid() != 0), None)
    if leading is None or leading == len(coefficients) - 1:
        return math.nan
    return exact_abscissa(coefficients[leading:])
