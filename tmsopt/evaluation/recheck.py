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
from tmsopt.models import Model, Values
from tmsopt.models.expression import Expression
from tmsopt.models.user_spectrum import public_names
from tmsopt.problem.cases import Case
from tmsopt.problem.dependence import WORSE_DIRECTION, depends_on_case
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, ROOT_NAMES, roots_at
from tmsopt.problem.verdict.meetings import is_crossing
from tmsopt.records import Numbers, Table
from tmsopt.roots import Structure, pattern_distance

FEASIBLE = 1e-9
"""Largest violation of a constraint that counts as satisfied, relative to the size of its two sides or 1."""

MATCHED = 1e-10
"""Largest relative change of a coefficient for which a pattern counts as located."""

_ROOT_SCATTER = 2e-3  # five times the relative error of numeric roots next to a 4-fold root


@dataclass(frozen=True)
class Evaluation:
    """A design's roots, objective and violations, in its worst case if it has several.

    Attributes:
        violations: name of a constraint → violation relative to the size of its two sides, if above the tolerance.
        amounts: name of a constraint → violation in the units of its sides.
        worst: the evaluated case with the largest abscissa.
        least_damped: the case with the least damping ratio.
        fastest: the case with the greatest angular frequency, if the problem uses it.
        robustness: the boundaries nearest to the design, if the problem uses the robustness radius.
        crossing: whether the roots satisfy the pattern, but the eigenvectors do not: Jordan chains are too short.
    """

    structure: Structure
    realised: float
    objective: float
    violations: Table[float]
    amounts: Table[float]
    quantities: Table[float]
    dimensionless: Table[float]
    worst: Case
    least_damped: Case
    fastest: Case
    robustness: Robustness | None
    crossing: bool


def recheck(
    problem: Posed, parameters: Numbers, cases: Sequence[Case] | None = None, robustness: Robustness | None = None
) -> Evaluation:
    """Evaluate constraints, pattern, roots and objective of a design in the given cases, independently of any solver.

    Args:
        robustness: the boundaries nearest to this design, if they are already known.
    """
    evaluated = _evaluate_cases(problem, parameters, problem.cases if cases is None else cases, robustness)
    violations, amounts = evaluated.violations(problem.conditions)
    nominal, worst_index, crossing = evaluated.nominal, evaluated.worst["abscissa"], False
    structure = evaluated.each[worst_index]["structure"]
    if not math.isfinite(structure.abscissa):
        exist = all(math.isfinite(float(c)) for c in evaluated.each[worst_index].coefficients)
        violations["a0" if exist else "coefficients"] = 1.0  # a singular mass matrix, or undefined
    if problem.pattern is not None:
        a = [float(c) for c in nominal.coefficients]
        distance = pattern_distance(problem.pattern, a, nominal.roundings(), MATCHED)
        crossing = distance <= MATCHED and is_crossing(problem, problem.pattern, parameters)
        if crossing or not distance <= MATCHED:
            violations[problem.pattern.name] = 1.0 if crossing else distance
    parameter_set = problem.parameter_set
    names = [
        n
        for n in (*public_names(problem.model, parameter_set), "damping_ratio")
        if n not in problem.model.sets[0].names
    ]
    names += [RADIUS] if evaluated.robustness is not None else []
    names += [ANGULAR_FREQUENCY] if problem.asks(ANGULAR_FREQUENCY) else []
    if parameter_set.rate is not None and structure.roots:  # times and frequencies belong to the worst case
        nominal = nominal.with_known({"abscissa": structure.abscissa, "structure": structure})
    return Evaluation(
        structure=structure,
        realised=realised_abscissa(problem, evaluated.cases[worst_index].applied(parameters)),
        objective=evaluated.objective,
        violations=Table(violations),
        amounts=Table(violations | amounts),
        quantities=Table({name: float(nominal[name]) for name in names}),
        dimensionless=Table({n: float(v) for n, v in parameter_set.native(parameters).items()}),
        worst=evaluated.cases[worst_index],
        least_damped=evaluated.cases[evaluated.worst["damping_ratio"]],
        fastest=evaluated.cases[evaluated.worst.get(ANGULAR_FREQUENCY, worst_index)],
        robustness=evaluated.robustness,
        crossing=crossing,
    )


def find_missed_limits(
    problem: Posed, parameters: Numbers, cases: Sequence[Case], robustness: Robustness | None = None
) -> dict[str, float]:
    """Limits that the exact roots of the stored parameters miss → the amount, in units of the limit.

    Args:
        robustness: as for `recheck`.
    """
    conditions = {n: problem.conditions[n] for n in problem.asked_of_roots if RADIUS not in problem.conditions[n].names}
    if not conditions:
        return {}
    evaluated = _evaluate_cases(problem, parameters, cases, robustness)
    doubtful = {n: c for n, c in conditions.items() if any(_may_be_missed(c, v) for v in evaluated.relevant_cases(c))}
    exact_values = (
        _evaluate_cases(problem, parameters, cases, evaluated.robustness, parameters) if doubtful else evaluated
    )
    return exact_values.violations(doubtful)[1]


def recheck_exactly(
    problem: Posed, parameters: Mapping[str, Any], cases: Sequence[Case]
) -> tuple[Values, dict[str, float]]:
    """Quantities of a design of exact numbers, and its violations above the tolerance in the units of the sides.

    Root quantities come from exact roots and are the worst over the cases. The robustness radius is ignored.
    """
    evaluated = _evaluate_cases(problem, {n: float(x) for n, x in parameters.items()}, cases, stored=parameters)
    conditions = {n: c for n, c in problem.conditions.items() if RADIUS not in c.names}
    return evaluated.nominal, evaluated.violations(conditions)[1]


def _may_be_missed(condition: Expression, values: Values) -> bool:
    """Whether errors of numeric roots may hide that a condition is missed."""
    left, right = condition.sides(values)
    slack = -condition.sign * float(condition(values))
    return condition.equality or not slack > _ROOT_SCATTER * max(1.0, abs(left), abs(right))


def _is_out_of_reach(problem: Posed, condition: Expression, values: Values) -> bool:
    """Whether no design within a relative distance `FEASIBLE` satisfies a condition.

    Then its excess, however small, is no rounding error. For example, Fr = 1.6999 violates (Fr - 1.7)**4 <= 0 by only
    1e-16, but Fr is 1e-4 away. Parameters vary relative to their size or range, root quantities relative to their size
    or 1. Interval arithmetic bounds the condition and its slopes.
    """
    parameter_set = problem.parameter_set
    names = (*parameter_set.names, *(n for n in ROOT_NAMES if n in condition.names))
    at = np.array([float(values[n]) for n in names])
    ends = np.array([problem.free.get(n, (0.0, 0.0)) for n in names])
    reach = FEASIBLE * np.maximum(
        np.abs(at), np.where(np.arange(len(at)) < len(parameter_set.names), np.ptp(ends, axis=1), 1.0)
    )
    try:
        function = _trace_condition(problem.model, parameter_set.name, condition, names)
        centre, around = (ranges(function, list(zip(at - r, at + r, strict=True))) for r in (0 * reach, reach))
    except UnsupportedOperation:
        return False
    with np.errstate(invalid="ignore"):  # a slope may be unbounded
        slack = float(np.abs(around[1:]).max(axis=1) @ reach)
    signs = (1.0, -1.0) if condition.equality else (condition.sign,)
    return any(min(s * e for e in centre[0]) > slack or min(s * e for e in around[0]) > 0 for s in signs)


@lru_cache(maxsize=256)
def _trace_condition(model: Model, set_name: str, condition: Expression, names: tuple[str, ...]) -> Formula:
    """A condition and its gradient as a function of parameters and root quantities."""
    symbols, parameter_set = {name: symbol(name) for name in names}, model.parameter_set(set_name)
    difference = condition(
        Values(model, parameter_set, {n: symbols[n] for n in parameter_set.names}).with_known(symbols)
    )
    return formula([difference, *gradients([difference], list(symbols.values()))[0]], names)


def measure_excesses(problem: Posed, parameters: Numbers, cases: Sequence[Case]) -> dict[str, float]:
    """How far each limit must move until a design satisfies it: 0 or more, with a sign for an equality."""
    evaluated, excesses = _evaluate_cases(problem, parameters, cases), {}
    for name, condition in problem.conditions.items():
        differences = [float(condition(v)) for v in evaluated.relevant_cases(condition)]
        excess = max(0.0, *(_replace_nan(condition.sign * d) for d in differences))
        excesses[name] = differences[0] if condition.equality else excess
    return excesses


@dataclass(frozen=True)
class _CaseValues:
    """The values of a design in its cases; root quantities have their worst values over the cases.

    Attributes:
        worst: root quantity → index of its worst case; the angular frequency only if the problem uses it.
    """

    problem: Posed
    cases: list[Case]
    nominal: Values
    each: list[Values]
    worst: Mapping[str, int]
    robustness: Robustness | None

    def relevant_cases(self, expression: Expression) -> list[Values]:
        """Values in the cases where a condition must hold, or over which an objective is the worst."""
        return self.each if depends_on_case(self.problem, expression, self.cases) else [self.nominal]

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
        """Violations above the tolerance, relative and in the units of the sides."""
        violations, amounts = {}, {}
        for name, condition in conditions.items():
            at = self.relevant_cases(condition)
            violation, worst = max(((condition.violation(v), v) for v in at), key=lambda pair: _replace_nan(pair[0]))
            if not violation <= FEASIBLE or (violation > 0 and _is_out_of_reach(self.problem, condition, worst)):
                violations[name] = violation
                amounts[name] = float(condition.excess(float(condition(worst))))
        return violations, amounts


def _evaluate_cases(
    problem: Posed,
    parameters: Numbers,
    cases: Sequence[Case],
    robustness: Robustness | None = None,
    stored: Mapping[str, Any] | None = None,
) -> _CaseValues:
    """Evaluate a design in its cases, with roots of its structure or exact roots of the `stored` parameters."""
    stated_cases = [case for case in cases if not case.direction] or [Case()]

    @cache
    def values(case: Case) -> Values:
        case_values = problem.values(case.applied(parameters))
        if stored is None:
            return case_values
        exact_roots = roots_at(problem.model, problem.parameter_set, case.applied(stored))
        return case_values.with_known({"structure": Structure("undecided", exact_roots, 0.0)})

    nominal, *each = map(values, (Case(), *stated_cases))
    worst = {
        name: max(range(len(each)), key=lambda k: _replace_nan(sign * each[k][name]))
        for name, sign in WORSE_DIRECTION.items()
        if name != ANGULAR_FREQUENCY or problem.asks(ANGULAR_FREQUENCY)
    }
    shared = {name: each[k][name] for name, k in worst.items()}
    if robustness is None and problem.asks_radius and stored is None:
        robustness = find_stability_margins(problem, parameters)
    if robustness is not None:
        shared[RADIUS] = robustness.radius
    nominal, *each = (v.with_known({"structure": v["structure"], **shared}) for v in (nominal, *each))
    return _CaseValues(problem, stated_cases, nominal, each, worst, robustness)


def _replace_nan(value: float) -> float:
    return math.inf if math.isnan(value) else value


def realised_abscissa(problem: Posed, parameters: Numbers) -> float:
    """The abscissa of the parameters exactly as they are stored."""
    roots = roots_at(problem.model, problem.parameter_set, parameters)
    return roots[0].re if roots else math.nan
