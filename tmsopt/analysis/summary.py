"""Describes a solution in words: its structure, its quality, and warnings."""

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from tmsopt.analysis.limits import is_physical, split_bound
from tmsopt.models.expression import Expression
from tmsopt.models.user_spectrum import describe_user_structure
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ROOT_QUANTITIES, matrices_at
from tmsopt.problem.solution import Bound, Solution
from tmsopt.problem.unit_system import Unit, round_one_way, unit_of
from tmsopt.program import scale_of
from tmsopt.roots.chains import linearise_batch

_ROOT_NAMES = {q.name for q in ROOT_QUANTITIES}
_NO_UNIT = Unit()
_RANGE_SHARES = (0.0, 0.29, 0.5, 0.83, 1.0)  # shares of a range at which the effect of a parameter is evaluated
_MAX_COEFFICIENTS = 12  # largest matrix whose characteristic coefficients are computed
_ROUNDING = 1e-13  # relative rounding error of a few operations
_BOUND_DISTANCE = 1e-12  # largest relative distance to a bound for which the bound counts as reached


def summarise(solution: Solution) -> str:
    """Structure and quality of a solution in one sentence."""
    if solution.status == "infeasible":
        names = ", ".join(solution.violations) or "something"
        if not solution.problem.free:
            return f"the given design violates {names}"
        return f"no design was found that meets every limit; the nearest one violates {names}"
    words = describe_user_structure(solution.problem.model, solution.structure, solution.abscissa > 0)
    if solution.status != "optimal":
        return f"{words}; the search did not converge, so a better design may exist nearby"
    return f"{words}: {_describe_quality(solution)}"


def list_warnings(solution: Solution) -> tuple[str, ...]:
    """Warnings about arbitrary active bounds, bounds reached without a gain, and parameters without effect."""
    if solution.status == "infeasible":
        return ()
    problem = solution.problem.posed
    idle = {name: _warn_of_idle_parameter(solution, name) for name in problem.free}
    return (
        *_warn_of_abscissa_unit(problem),
        *_warn_of_active_bounds(solution),
        *filter(None, idle.values()),
        *(text for name in problem.free if not idle[name] for text in _warn_of_reached_bounds(solution, name)),
    )


def no_design(problem: Posed) -> str:
    """The subject of a sentence that excludes the designs of a problem."""
    return f"no {problem.model.noun}{f' with {problem.locate}' if problem.locate else ''} within the limits"


def state_bound(problem: Posed, bound: Bound, unit: Unit = _NO_UNIT, digits: int = 6) -> str:
    """State that no design has a better objective than the bound, which is rounded to the safe side."""
    is_maximum, objective = problem.sense == "maximize", (problem.minimize or problem.maximize or "").strip()
    value = round_one_way(bound.value / unit.factor, is_maximum, digits) * unit.factor
    return f"{no_design(problem)} has {objective} {'>' if is_maximum else '<'} {unit.show(value, digits)}"


def describe_better(solution: Solution, goal: str) -> str:
    """The predicate of a sentence about a better design: it decays faster, or it has a smaller or larger goal."""
    problem, bound = solution.problem.posed, solution.bound
    margin = f" by more than {bound.gap:.1e}" if bound.tolerance else ""
    if goal != "abscissa" or problem.sense == "maximize" or solution.stability.on_edge:
        return f"has a {'larger' if problem.sense == 'maximize' else 'smaller'} {goal}{margin}"
    return f"{'decays faster' if solution.abscissa < 0 else 'grows more slowly'}{margin}"


def _describe_quality(solution: Solution) -> str:
    problem, bound, goal = solution.problem.posed, solution.bound, solution.problem.posed.goal
    if not problem.free:
        return "the given design, with nothing free"
    if not goal:
        count = solution.freedom.count
        surplus = f"; {count} more parameters are free than the pattern needs" if count > 0 else ""
        return f"a {problem.model.noun} with {problem.locate}, as asked{surplus}"
    if bound.proven:
        return f"{no_design(problem)} {describe_better(solution, goal)} (proved)"
    origin, doubt = solution.starts.sureness[:1], solution.starts.sureness[1:]
    sureness = ", ".join([*origin, "not proved", *doubt])
    if math.isfinite(bound.value):
        return f"{sureness}; {state_bound(problem, bound)}, gap {bound.gap:.2g}"
    end = "largest" if problem.sense == "maximize" else "smallest"
    return f"the {end} {goal} found is {unit_of(problem, goal).show(solution.value, 6)}, {sureness}"


def _warn_of_abscissa_unit(problem: Posed) -> Iterator[str]:
    """Warns that the unit of the abscissa depends on a free parameter."""
    free_units = [name for name in ("w", "g") if name in problem.free]
    if free_units and problem.parameter_set.root_unit == "√(g/w)" and "abscissa" in (problem.minimize or ""):
        advice = 'for the fastest decay in seconds write maximize = "decay_rate"'
        yield f"the abscissa has the unit √(g/w), which varies with {' and '.join(free_units)}: {advice}"


def _warn_of_active_bounds(solution: Solution) -> Iterator[str]:
    """Warns of active bounds that are not physical limits."""
    problem = solution.problem.posed
    bounds = (f"{name}.{end}" for name in problem.free for end in ("min", "max"))
    active = [bound for bound in bounds if bound in solution.active and bound not in problem.constraints]
    if arbitrary := [bound for bound in active if not is_physical(problem, bound)]:
        bounds_text = ", ".join(f"{bound} = {_describe_bound(problem, bound)}" for bound in arbitrary)
        advice = "if a range is a guess, widen it; if it is a real limit, write it as a constraint"
        yield f"ends of ranges limit the design: {bounds_text}; {advice}"


def _describe_bound(problem: Posed, bound: str) -> str:
    _, _, value = split_bound(problem, bound)
    return unit_of(problem, bound).show(value, 10)


def _warn_of_reached_bounds(solution: Solution, name: str) -> Iterator[str]:
    problem, x = solution.problem.posed, solution.parameters[name]
    for end, limit in zip(("min", "max"), problem.free[name], strict=True):
        bound = f"{name}.{end}"
        if bound not in solution.active and abs(x - limit) <= _BOUND_DISTANCE * max(abs(limit), _BOUND_DISTANCE):
            reason = "to first order, relaxing it improves nothing" if problem.objective else "nothing was optimised"
            yield f"{name} is at {bound} = {_describe_bound(problem, bound)}; {reason}"


def _warn_of_idle_parameter(solution: Solution, name: str) -> str:
    """A warning if a parameter has no effect on goal and limits; empty if it has an effect."""
    problem = solution.problem.posed
    lower, upper = problem.free[name]
    points = [solution.parameters[name], *(lower + share * (upper - lower) for share in _RANGE_SHARES)]
    conditions = problem.conditions
    expressions: dict[Any, Expression] = {**conditions, **({None: problem.objective} if problem.objective else {})}
    rows = [_evaluate_signature(problem, {**solution.parameters, name: x}, expressions.values()) for x in points]
    roots_move = _is_varying([monic for monic, _ in rows])
    affected = [
        n
        for k, (n, e) in enumerate(expressions.items())
        if _is_varying([[values[k]] for _, values in rows]) or (roots_move and not _ROOT_NAMES.isdisjoint(e.names))
    ]
    if (problem.locate and roots_move) or None in affected:
        return ""
    if any(n in solution.active or conditions[n].equality for n in affected):
        return ""  # it moves the optimum through an active constraint
    goals = " and ".join(filter(None, (problem.locate, problem.goal)))
    ends = " to ".join(_describe_bound(problem, f"{name}.{end}") for end in ("min", "max"))
    condition = f" that satisfies {', '.join(affected)}" if affected else ""
    return f"{name} has no effect on {goals} here: any value from {ends}{condition} works"


def _evaluate_signature(
    problem: Posed, parameters: dict[str, float], expressions: Iterable[Expression]
) -> tuple[list[float], list[float]]:
    """Monic coefficients in the unit of the roots, and the values of expressions with fixed root quantities.

    Large matrices give their entries instead of coefficients.
    """
    values, unit = problem.values(problem.ordered(parameters)), scale_of(problem).unit
    with np.errstate(all="ignore"):
        if problem.model.polynomial is not None:
            a = np.array([float(c) for c in values.coefficients])
            signature = a / a[0] / unit ** np.arange(len(a))
        else:
            state, is_defined = linearise_batch(matrices_at(problem.model, problem.parameter_set, parameters) + 0j)
            state = state / unit
            signature = np.append(np.poly(state) if len(state) <= _MAX_COEFFICIENTS else state, is_defined or np.nan)
        values = values.with_known(dict.fromkeys(_ROOT_NAMES, 0.5))
        return [*signature.real, *signature.imag], [float(e(values)) for e in expressions]


def _is_varying(rows: list[list[float]]) -> bool:
    """Whether any column changes by more than rounding; a value that does not exist counts as a change."""
    table = np.array(rows)
    if not np.all(np.isfinite(table)):
        return True
    return bool(np.any(np.ptp(table, axis=0) > _ROUNDING * np.abs(table).max()))
