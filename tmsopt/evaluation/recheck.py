"""What a design really is, computed from its parameters alone and without the NLP that produced it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Formula, NotAccepted, formula, symbol
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
"""Violation, relative to the size of the two sides, up to which a constraint counts as satisfied."""

MATCHED = 1e-10
"""Relative change of a coefficient up to which a pattern counts as located."""

_SCATTER = 2e-3  # of the largest root: five times what numeric roots beside a 4-fold one are off


@dataclass(frozen=True)
class Evaluation:
    """A design's roots, objective and violations: in its worst case, where it has several.

    Attributes:
        violations: name → violation relative to the size of the two sides, where beyond tolerance.
        amounts: the same in the units of the sides.
        worst: the case with the largest abscissa, of those looked at.
        least_damped: the case with the least damping ratio.
        fastest: the case with the greatest angular frequency, where the problem asks for that.
        around: the boundaries nearest to the design, where the problem asks for the robustness radius.
        crossing: whether the pattern is violated by eigenvectors alone: roots meet, and no Jordan chain is so long.
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
    around: Robustness | None
    crossing: bool


def recheck(
    problem: Posed,
    parameters: Numbers,
    cases: Sequence[Case] | None = None,
    around: Robustness | None = None,
) -> Evaluation:
    """Evaluate a design independently of any solver: constraints, pattern, roots and objective, in the given cases.

    Args:
        around: the boundaries nearest to this design, where they are known already.
    """
    looked = _look(problem, parameters, problem.cases if cases is None else cases, around)
    violations, amounts = looked.violations(problem.conditions)
    nominal, top, crossing = looked.nominal, looked.worst["abscissa"], False
    structure = looked.each[top]["structure"]
    if not math.isfinite(structure.abscissa):
        exist = all(math.isfinite(float(c)) for c in looked.each[top].coefficients)
        violations["a0" if exist else "coefficients"] = 1.0  # a singular mass matrix, or none
    if problem.pattern is not None:
        a = [float(c) for c in nominal.coefficients]
        distance = pattern_distance(problem.pattern, a, nominal.roundings(), MATCHED)
        crossing = distance <= MATCHED and is_crossing(problem, problem.pattern, parameters)
        if crossing or not distance <= MATCHED:
            violations[problem.pattern.name] = 1.0 if crossing else distance
    of = problem.parameter_set
    names = [n for n in (*public_names(problem.model, of), "damping_ratio") if n not in problem.model.sets[0].names]
    names += [RADIUS] if looked.around is not None else []
    names += [ANGULAR_FREQUENCY] if problem.asks(ANGULAR_FREQUENCY) else []
    if of.rate is not None and structure.roots:  # times and frequencies are those of the worst case
        nominal = nominal.with_known({"abscissa": structure.abscissa, "structure": structure})
    return Evaluation(
        structure=structure,
        realised=realised_abscissa(problem, looked.cases[top].applied(parameters)),
        objective=looked.objective,
        violations=Table(violations),
        amounts=Table(violations | amounts),
        quantities=Table({name: float(nominal[name]) for name in names}),
        dimensionless=Table({n: float(v) for n, v in of.native(parameters).items()}),
        worst=looked.cases[top],
        least_damped=looked.cases[looked.worst["damping_ratio"]],
        fastest=looked.cases[looked.worst.get(ANGULAR_FREQUENCY, top)],
        around=looked.around,
        crossing=crossing,
    )


def missed(
    problem: Posed, parameters: Numbers, cases: Sequence[Case], around: Robustness | None = None
) -> dict[str, float]:
    """Limits on the roots that the exact roots of the parameters as stored miss → by how much, in their own units.

    Args:
        around: as for `recheck`.
    """
    asked = {n: problem.conditions[n] for n in problem.asked_of_roots if RADIUS not in problem.conditions[n].names}
    if not asked:
        return {}
    looked = _look(problem, parameters, cases, around)
    near = {n: c for n, c in asked.items() if any(_is_near(c, v) for v in looked.at(c))}
    exactly = _look(problem, parameters, cases, looked.around, parameters) if near else looked
    return exactly.violations(near)[1]


def judged_exactly(
    problem: Posed, parameters: Mapping[str, Any], cases: Sequence[Case]
) -> tuple[Values, dict[str, float]]:
    """Quantities of a design of exact numbers, and what it violates beyond tolerance, in the units of the sides.

    Those of the roots are the worst over the cases, by exact roots; the robustness radius plays no part.
    """
    looked = _look(problem, {n: float(x) for n, x in parameters.items()}, cases, stored=parameters)
    conditions = {n: c for n, c in problem.conditions.items() if RADIUS not in c.names}
    return looked.nominal, looked.violations(conditions)[1]


def _is_near(condition: Expression, values: Values) -> bool:
    """Whether numeric roots leave it open that a condition is missed."""
    left, right = condition.sides(values)
    slack = -condition.sign * float(condition(values))
    return condition.equality or not slack > _SCATTER * max(1.0, abs(left), abs(right))


def _beyond(problem: Posed, condition: Expression, values: Values) -> bool:
    """Whether no design within `FEASIBLE` of another meets a condition, so that a small excess is none of rounding.

    Parameters move by so much of their size or of their range, root quantities of theirs; (Fr - 1.7)**4 <= 0 is missed
    by 1e-16 at Fr = 1.6999, and by 1e-4 of the speed. By intervals: of the condition, and of its slopes.
    """
    of = problem.parameter_set
    names = (*of.names, *(n for n in ROOT_NAMES if n in condition.names))
    at = np.array([float(values[n]) for n in names])
    ends = np.array([problem.free.get(n, (0.0, 0.0)) for n in names])
    reach = FEASIBLE * np.maximum(np.abs(at), np.where(np.arange(len(at)) < len(of.names), np.ptp(ends, axis=1), 1.0))
    try:
        function = _sloped(problem.model, of.name, condition, names)
        centre, around = (ranges(function, list(zip(at - r, at + r, strict=True))) for r in (0 * reach, reach))
    except NotAccepted:
        return False
    with np.errstate(invalid="ignore"):  # a slope may be without bound
        slack = float(np.abs(around[1:]).max(axis=1) @ reach)
    signs = (1.0, -1.0) if condition.equality else (condition.sign,)
    return any(min(s * e for e in centre[0]) > slack or min(s * e for e in around[0]) > 0 for s in signs)


@lru_cache(maxsize=256)
def _sloped(model: Model, set_name: str, condition: Expression, names: tuple[str, ...]) -> Formula:
    """A condition and its slopes, as a function of parameters and root quantities."""
    symbols, of = {name: symbol(name) for name in names}, model.parameter_set(set_name)
    difference = condition(Values(model, of, {n: symbols[n] for n in of.names}).with_known(symbols))
    return formula([difference, *gradients([difference], list(symbols.values()))[0]], names)


def excesses(problem: Posed, parameters: Numbers, cases: Sequence[Case]) -> dict[str, float]:
    """Amount by which each constraint's limit must be moved for a design: 0 or more, signed for an equality."""
    looked, found = _look(problem, parameters, cases), {}
    for name, condition in problem.conditions.items():
        differences = [float(condition(v)) for v in looked.at(condition)]
        beyond = max(0.0, *(_or_infinite(condition.sign * d) for d in differences))
        found[name] = differences[0] if condition.equality else beyond
    return found


@dataclass(frozen=True)
class _Look:
    """A design in its cases, with root quantities the worst over them.

    Attributes:
        worst: root quantity → number of the case in which it is the worst; the angular frequency where it is asked for.
    """

    problem: Posed
    cases: list[Case]
    nominal: Values
    each: list[Values]
    worst: Mapping[str, int]
    around: Robustness | None

    def at(self, expression: Expression) -> list[Values]:
        """The cases in which a condition must hold, or an objective is the worst."""
        return self.each if depends_on_case(self.problem, expression, self.cases) else [self.nominal]

    @property
    def objective(self) -> float:
        """The objective, the worst over the cases where it differs between them; nan without one."""
        objective, sign = self.problem.objective, self.problem.sign
        if objective is None:
            return math.nan
        return sign * max((sign * float(objective(values)) for values in self.at(objective)), key=_or_infinite)

    def violations(self, conditions: Mapping[str, Expression]) -> tuple[dict[str, float], dict[str, float]]:
        """Violations of conditions beyond tolerance, relative and in the units of the sides."""
        violations, amounts = {}, {}
        for name, condition in conditions.items():
            at = self.at(condition)
            violation, worst = max(((condition.violation(v), v) for v in at), key=lambda pair: _or_infinite(pair[0]))
            if not violation <= FEASIBLE or (violation > 0 and _beyond(self.problem, condition, worst)):
                violations[name] = violation
                amounts[name] = float(condition.excess(float(condition(worst))))
        return violations, amounts


def _look(
    problem: Posed,
    parameters: Numbers,
    cases: Sequence[Case],
    around: Robustness | None = None,
    stored: Mapping[str, Any] | None = None,
) -> _Look:
    """A design in its cases, by the roots of its structure or by those of the parameters exactly as `stored`."""
    listed = [case for case in cases if not case.direction] or [Case()]

    @cache
    def values(case: Case) -> Values:
        found = problem.values(case.applied(parameters))
        if stored is None:
            return found
        exactly = roots_at(problem.model, problem.parameter_set, case.applied(stored))
        return found.with_known({"structure": Structure("undecided", exactly, 0.0)})

    nominal, *each = map(values, (Case(), *listed))
    worst = {
        name: max(range(len(each)), key=lambda k: _or_infinite(sign * each[k][name]))
        for name, sign in WORSE_DIRECTION.items()
        if name != ANGULAR_FREQUENCY or problem.asks(ANGULAR_FREQUENCY)
    }
    shared = {name: each[k][name] for name, k in worst.items()}
    if around is None and problem.asks_radius and stored is None:
        around = find_stability_margins(problem, parameters)
    if around is not None:
        shared[RADIUS] = around.radius
    nominal, *each = (v.with_known({"structure": v["structure"], **shared}) for v in (nominal, *each))
    return _Look(problem, listed, nominal, each, worst, around)


def _or_infinite(value: float) -> float:
    """A number for comparison in which one that does not exist is the worst."""
    return math.inf if math.isnan(value) else value


def realised_abscissa(problem: Posed, parameters: Numbers) -> float:
    """Abscissa of the parameters exactly as stored."""
    found = roots_at(problem.model, problem.parameter_set, parameters)
    return found[0].re if found else math.nan
