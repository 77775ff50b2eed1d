"""Evaluates a design from its parameters only, independently of the program that produced it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Formula, UnsupportedOperation, formula, symbol
from tmsopt.algebra.intervals import ranges
from tmsopt.algebra.kinds import gradients
from tmsopt.boundaries.nearest import Robustness, find_stability_margins
from tmsopt.chains.meetings import has_regular_lead, is_crossing, mismatch
from tmsopt.models import Model, Values
from tmsopt.models.expression import Expression
from tmsopt.problem.cases import Case
from tmsopt.problem.dependence import WORSE_DIRECTION, depends_on_case
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, ROOT_NAMES, roots_at
from tmsopt.records import Numbers, Table
from tmsopt.roots import Structure, pattern_distance

FEASIBILITY_TOLERANCE = 1e-9
"""Largest violation of a constraint that counts as satisfied, relative to the size of its two sides or 1."""

_PATTERN_TOLERANCE = 1e-10
"""Largest relative change of a coefficient for which a pattern counts as located."""

_ROOT_SCATTER = 2e-3  # five times the relative error of numeric roots near a 4-fold root


@dataclass(frozen=True)
class Evaluation:
    """The roots, objective and violations of a design; with several cases, in the worst case.

    Attributes:
        structure: the structure of the roots, with the abscissa of the ideal design.
        abscissa_realised: the abscissa of the parameters exactly as stored in double precision.
        violations: name of a constraint → violation relative to the size of its two sides, if above the tolerance.
        amounts: name of a constraint → violation in the units of its sides.
        worst: the evaluated case with the largest abscissa.
        least_damped: the case with the least damping ratio.
        fastest: the case with the greatest angular frequency, if the problem uses it.
        robustness: the boundaries nearest to the design, if the problem uses the robustness radius.
        is_crossing: whether the roots satisfy the pattern, but the eigenvectors do not: Jordan chains are too short.
    """

    structure: Structure
    abscissa_realised: float
    objective: float
    violations: Table[float]
    amounts: Table[float]
    quantities: Table[float]
    dimensionless: Table[float]
    worst: Case
    least_damped: Case
    fastest: Case
    robustness: Robustness | None
    is_crossing: bool


def recheck(
    problem: Posed, parameters: Numbers, cases: Sequence[Case] | None = None, robustness: Robustness | None = None
) -> Evaluation:
    """Evaluate constraints, pattern, roots and objective of a design in the given cases, independently of any solver.

    Args:
        robustness: the boundaries nearest to this design, if they are already known.
    """
    evaluation = _evaluate_cases(problem, parameters, problem.cases if cases is None else cases, robustness)
    violations, amounts = evaluation.violations(problem.conditions)
    nominal, worst_index, crosses = evaluation.nominal, evaluation.worst_indices["abscissa"], False
    structure = evaluation.case_values[worst_index]["structure"]
    if not math.isfinite(structure.abscissa):
        are_finite = all(math.isfinite(float(c)) for c in evaluation.case_values[worst_index].coefficients)
        # a singular mass matrix, or undefined coefficients
        violations["a0" if are_finite else "coefficients"] = 1.0
    if problem.pattern is not None:
        model = problem.model
        has_chains = model.statement is not None and model.pencil is not None
        if has_chains and (model.polynomial is None or has_regular_lead(problem, parameters)):
            distance = mismatch(problem, problem.pattern, parameters)
            crosses = not distance <= _PATTERN_TOLERANCE and is_crossing(problem, problem.pattern, parameters)
        else:
            a = [float(c) for c in nominal.coefficients]
            distance = pattern_distance(problem.pattern, a, nominal.roundings(), _PATTERN_TOLERANCE)
            crosses = distance <= _PATTERN_TOLERANCE and is_crossing(problem, problem.pattern, parameters)
        if crosses or not distance <= _PATTERN_TOLERANCE:
            violations[problem.pattern.name] = min(1.0, distance)
    parameter_set = problem.parameter_set
    names = [
        n
        for n in (*problem.model.quantity_names(parameter_set), "damping_ratio")
        if n not in problem.model.sets[0].names
    ]
    names += [RADIUS] if evaluation.robustness is not None else []
    names += [ANGULAR_FREQUENCY] if problem.asks(ANGULAR_FREQUENCY) else []
    if parameter_set.rate is not None and structure.roots:  # times and frequencies belong to the worst case
        nominal = nominal.with_known({"abscissa": structure.abscissa, "structure": structure})
    return Evaluation(
        structure=structure,
        abscissa_realised=realised_abscissa(problem, evaluation.cases[worst_index].applied(parameters)),
        objective=evaluation.objective,
        violations=Table(violations),
        amounts=Table(violations | amounts),
        quantities=Table({name: float(nominal[name]) for name in names}),
        dimensionless=Table({n: float(v) for n, v in parameter_set.native(parameters).items()}),
        worst=evaluation.cases[worst_index],
        least_damped=evaluation.cases[evaluation.worst_indices["damping_ratio"]],
        fastest=evaluation.cases[evaluation.worst_indices.get(ANGULAR_FREQUENCY, worst_index)],
        robustness=evaluation.robustness,
        is_crossing=crosses,
    )


def find_missed_limits(
    problem: Posed, parameters: Numbers, cases: Sequence[Case], robustness: Robustness | None = None
) -> dict[str, float]:
    """Limit that the exact roots of the stored parameters violate → violation in the units of the limit.

    Args:
        robustness: as for `recheck`.
    """
    conditions = {n: problem.conditions[n] for n in problem.asked_of_roots if RADIUS not in problem.conditions[n].names}
    if not conditions:
        return {}
    evaluation = _evaluate_cases(problem, parameters, cases, robustness)
    doubtful = {n: c for n, c in conditions.items() if any(_may_be_missed(c, v) for v in evaluation.relevant_cases(c))}
    if doubtful:
        evaluation = _evaluate_cases(problem, parameters, cases, evaluation.robustness, parameters)
    _, amounts = evaluation.violations(doubtful)
    return amounts


def recheck_exactly(
    problem: Posed, parameters: Mapping[str, Any], cases: Sequence[Case]
) -> tuple[Values, dict[str, float]]:
    """Quantities of a design of exact numbers, and its violations above the tolerance, in the units of the limits.

    Root quantities come from exact roots and are the worst over the cases. The robustness radius is ignored.
    """
    doubles = {n: float(x) for n, x in parameters.items()}
    evaluation = _evaluate_cases(problem, doubles, cases, exact_parameters=parameters)
    conditions = {n: c for n, c in problem.conditions.items() if RADIUS not in c.names}
    _, amounts = evaluation.violations(conditions)
    return evaluation.nominal, amounts


def _may_be_missed(condition: Expression, values: Values) -> bool:
    """Whether errors of numeric roots may hide the violation of a condition."""
    left, right = condition.sides(values)
    slack = -condition.sign * float(condition(values))
    return condition.equality or not slack > _ROOT_SCATTER * max(1.0, abs(left), abs(right))


def _is_out_of_reach(problem: Posed, condition: Expression, values: Values) -> bool:
    """Whether no design within a relative distance `FEASIBILITY_TOLERANCE` satisfies a condition.

    In this case even a very small violation is no rounding error. For example, Fr = 1.6999 violates
    (Fr - 1.7)**4 <= 0 by only 1e-16, but Fr is 1e-4 away. The distance is relative to the size or the range of a
    parameter, and to the size of a root quantity or 1. Interval arithmetic bounds the condition and its slopes.
    """
    parameter_set = problem.parameter_set
    names = (*parameter_set.names, *(n for n in ROOT_NAMES if n in condition.names))
    point = np.array([float(values[n]) for n in names])
    ends = np.array([problem.free.get(n, (0.0, 0.0)) for n in names])
    distances = FEASIBILITY_TOLERANCE * np.maximum(
        np.abs(point), np.where(np.arange(len(point)) < len(parameter_set.names), np.ptp(ends, axis=1), 1.0)
    )
    try:
        function = _trace_condition(problem.model, parameter_set.name, condition, names)
        at_point, around = (
            ranges(function, list(zip(point - r, point + r, strict=True))) for r in (0 * distances, distances)
        )
    except UnsupportedOperation:
        return False
    with np.errstate(invalid="ignore"):  # a slope may be unbounded
        change = float(np.abs(around[1:]).max(axis=1) @ distances)
    signs = (1.0, -1.0) if condition.equality else (condition.sign,)
    return any(min(s * e for e in at_point[0]) > change or min(s * e for e in around[0]) > 0 for s in signs)


@lru_cache(maxsize=256)
def _trace_condition(model: Model, set_name: str, condition: Expression, names: tuple[str, ...]) -> Formula:
    """A condition and its gradient as a function of parameters and root quantities."""
    symbols, parameter_set = {name: symbol(name) for name in names}, model.parameter_set(set_name)
    difference = condition(
        Values(model, parameter_set, {n: symbols[n] for n in parameter_set.names}).with_known(symbols)
    )
    return formula([difference, *gradients([difference], list(symbols.values()))[0]], names)


def measure_excesses(problem: Posed, parameters: Numbers, cases: Sequence[Case]) -> dict[str, float]:
    """Limit → how far it must move until the design satisfies it: 0 or more, with a sign for an equality."""
    evaluation, excesses = _evaluate_cases(problem, parameters, cases), {}
    for name, condition in problem.conditions.items():
        differences = [float(condition(v)) for v in evaluation.relevant_cases(condition)]
        excess = max(0.0, *(_replace_nan(condition.sign * d) for d in differences))
        excesses[name] = differences[0] if condition.equality else excess
    return excesses


@dataclass(frozen=True)
class _CaseEvaluation:
    """The values of a design in its cases; root quantities have their worst values over the cases.

    Attributes:
        worst_indices: root quantity → index of its worst case; the angular frequency only if the problem uses it.
    """

    problem: Posed
    cases: list[Case]
    nominal: Values
    case_values: list[Values]
    worst_indices: Mapping[str, int]
    robustness: Robustness | None

    def relevant_cases(self, expression: Expression) -> list[Values]:
        """Values in the cases that a condition or an objective must consider; only the nominal ones if cases agree."""
        return self.case_values if depends_on_case(self.problem, expression, self.cases) else [self.nominal]

    @property
    def objective(self) -> float:
        """The objective, in its worst case if it depends on the case; nan without an objective."""
        objective, sign = self.problem.objective, self.problem.sign
        if objective is None:
            return math.nan
        return sign * max(
            (sign * float(objective(values)) for values in self.relevant_cases(objective)), key=_replace_nan
        )

    def violations(self, conditions: Mapping[str, Expression]) -> tuple[dict[str, float], dict[str, float]]:
        """Violations above the tolerance: name → relative violation, and name → violation in the units of the limit."""
        violations, amounts = {}, {}
        for name, condition in conditions.items():
            pairs = ((condition.violation(v), v) for v in self.relevant_cases(condition))
            violation, worst = max(pairs, key=lambda pair: _replace_nan(pair[0]))
            if not violation <= FEASIBILITY_TOLERANCE or (
                violation > 0 and _is_out_of_reach(self.problem, condition, worst)
            ):
                violations[name] = violation
                amounts[name] = float(condition.excess(float(condition(worst))))
        return violations, amounts


def _evaluate_cases(
    problem: Posed,
    parameters: Numbers,
    cases: Sequence[Case],
    robustness: Robustness | None = None,
    exact_parameters: Mapping[str, Any] | None = None,
) -> _CaseEvaluation:
    """Evaluate a design in its cases, with roots of its structure, or with the exact roots of `exact_parameters`."""
    listed_cases = [case for case in cases if not case.direction] or [Case()]

    @cache
    def values_in(case: Case) -> Values:
        values = problem.values(case.applied(parameters))
        if exact_parameters is None:
            return values
        exact_roots = roots_at(problem.model, problem.parameter_set, case.applied(exact_parameters))
        return values.with_known({"structure": Structure("undecided", exact_roots, 0.0)})

    nominal, *case_values = map(values_in, (Case(), *listed_cases))
    worst_indices = {
        name: max(range(len(case_values)), key=lambda k: _replace_nan(sign * case_values[k][name]))
        for name, sign in WORSE_DIRECTION.items()
        if name != ANGULAR_FREQUENCY or problem.asks(ANGULAR_FREQUENCY)
    }
    worst_values = {name: case_values[k][name] for name, k in worst_indices.items()}
    if robustness is None and problem.asks_radius and exact_parameters is None:
        robustness = find_stability_margins(problem, parameters)
    if robustness is not None:
        worst_values[RADIUS] = robustness.radius
    nominal, *case_values = (
        v.with_known({"structure": v["structure"], **worst_values}) for v in (nominal, *case_values)
    )
    return _CaseEvaluation(problem, listed_cases, nominal, case_values, worst_indices, robustness)


def _replace_nan(value: float) -> float:
    return math.inf if math.isnan(value) else value


def realised_abscissa(problem: Posed, parameters: Numbers) -> float:
    """The abscissa of the parameters exactly as they are stored."""
    roots = roots_at(problem.model, problem.parameter_set, parameters)
    return roots[0].re if roots else math.nan
