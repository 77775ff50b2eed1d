"""A solution in words: its structure, how good it is, and what a reader must be warned of."""

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from tmsopt.analysis.limits import is_physical
from tmsopt.models.expression import Expression
from tmsopt.models.user_spectrum import describe_user_structure
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ROOT_QUANTITIES
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import unit_of

_ROOTS = {q.name for q in ROOT_QUANTITIES}
_PARTS = (0.0, 0.29, 0.5, 0.83, 1.0)  # of a range: a change along it shows at one of these
_UNCHANGED = 1e-13  # relative: rounding of a few operations
_AT = 1e-12  # relative distance to a bound that counts as touching it


def summary(solution: Solution) -> str:
    """Structure and quality of a solution in one sentence."""
    if solution.status == "infeasible":
        names = ", ".join(solution.violations) or "something"
        if not solution.problem.free:
            return f"the design as given violates {names}"
        return f"no design in the box was found that meets all that is asked; the nearest one violates {names}"
    words = describe_user_structure(solution.problem.model, solution.structure, solution.abscissa > 0)
    if solution.status != "optimal":
        return f"{words}; the search did not converge, so a better design may be near"
    return f"{words}: {_quality(solution)}"


def warnings(solution: Solution) -> tuple[str, ...]:
    """Arbitrary bounds that the design leans on, bounds touched for nothing, parameters without effect."""
    if solution.status == "infeasible":
        return ()
    problem = solution.problem.posed
    idle = {name: _idle(solution, name) for name in problem.free}
    return (
        *_timeless(problem),
        *_leaning(solution),
        *filter(None, idle.values()),
        *(text for name in problem.free if not idle[name] for text in _touching(solution, name)),
    )


def none_of(problem: Posed) -> str:
    """Of whom it is said that none is better: the designs that a proof is about."""
    located = f" with {problem.locate}" if problem.locate else ""
    return f"no design{located} in the box{' within the limits' if problem.constraints else ''}"


def faster_than(solution: Solution) -> str:
    """What a design of a lesser abscissa does; on the edge the abscissa does not tell how they grow."""
    if solution.stability.on_edge:
        return "has a lesser abscissa"
    return "decays faster" if solution.abscissa < 0 else "grows more slowly"


def _quality(solution: Solution) -> str:
    problem, bound = solution.problem.posed, solution.bound
    text = problem.goal
    if not problem.free:
        return "the design as given, with nothing free"
    if not text:
        count = solution.freedom.count
        left = f"; {count} more parameters are free than that takes" if count > 0 else ""
        return f"a design with {problem.locate}, as asked{left}"
    by = f" by more than {bound.gap:.1e}" if bound.tolerance else ""
    if bound.proven and text == "abscissa":
        return f"{none_of(problem)} {faster_than(solution)}{by} (proven)"
    if bound.proven:
        return f"{none_of(problem)} has a {'greater' if problem.sense == 'maximize' else 'lesser'} {text}{by} (proven)"
    tried = ", ".join([*solution.starts.sureness, "not proven"])
    if math.isfinite(bound.value):
        side = "above" if problem.sense == "maximize" else "below"
        quantity = "an abscissa" if text == "abscissa" else f"a value of {text}"
        return f"{tried}; {none_of(problem)} has {quantity} {side} {bound.value:.6g}, which leaves {bound.gap:.2g} open"
    end = "greatest" if problem.sense == "maximize" else "least"
    return f"the {end} {text} found is {unit_of(problem, text).show(solution.value, 6)}, {tried}"


def _timeless(problem: Posed) -> Iterator[str]:
    """That an abscissa is counted in a unit of time that the search may change."""
    free = [name for name in ("w", "g") if name in problem.free]
    if free and problem.parameter_set.root_unit == "√(g/w)" and "abscissa" in (problem.minimize or ""):
        advice = 'the fastest decay in seconds is maximize = "decay_rate"'
        yield f"abscissa is counted per √(g/w), and {' and '.join(free)} may vary: {advice}"


def _leaning(solution: Solution) -> Iterator[str]:
    """Active bounds that are no physical ends."""
    problem = solution.problem.posed
    bounds = (f"{name}.{end}" for name in problem.free for end in ("min", "max"))
    active = [bound for bound in bounds if bound in solution.active and bound not in problem.constraints]
    if arbitrary := [bound for bound in active if not is_physical(problem, bound)]:
        named = ", ".join(f"{bound} = {_limit(problem, bound)}" for bound in arbitrary)
        yield f"the optimum leans on {named}: widen what is arbitrary, and state what is real as a constraint"


def _limit(problem: Posed, bound: str) -> str:
    name, end = bound.rsplit(".", 1)
    return unit_of(problem, name).show(problem.free[name][end == "max"], 10)


def _touching(solution: Solution, name: str) -> Iterator[str]:
    problem, x = solution.problem.posed, solution.parameters[name]
    for end, limit in zip(("min", "max"), problem.free[name], strict=True):
        bound = f"{name}.{end}"
        if bound not in solution.active and abs(x - limit) <= _AT * max(abs(limit), _AT):
            gains = "gains nothing to first order" if problem.objective else "was not asked for"
            yield f"{name} is at {bound} = {_limit(problem, bound)}, though moving that bound {gains}"


def _idle(solution: Solution, name: str) -> str:
    """What there is to say of a parameter without effect on what is asked; empty for one with an effect."""
    problem = solution.problem.posed
    lower, upper = problem.free[name]
    points = [solution.parameters[name], *(lower + part * (upper - lower) for part in _PARTS)]
    conditions = problem.conditions
    asked: dict[Any, Expression] = {**conditions, **({None: problem.objective} if problem.objective else {})}
    rows = [_signature(problem, {**solution.parameters, name: x}, asked.values()) for x in points]
    roots_move = _varies([monic for monic, _ in rows])
    affected = [
        n
        for k, (n, e) in enumerate(asked.items())
        if _varies([[values[k]] for _, values in rows]) or (roots_move and not _ROOTS.isdisjoint(e.names))
    ]
    if (problem.locate and roots_move) or None in affected:
        return ""
    what = " and ".join(filter(None, (problem.locate, problem.goal)))
    if any(n in solution.active or conditions[n].equality for n in affected):
        return ""  # it moves the optimum through a constraint that binds
    ends = " … ".join(_limit(problem, f"{name}.{end}") for end in ("min", "max"))
    kept = f" that keeps {', '.join(affected)}" if affected else ""
    return f"{name} has no effect on {what} here: any value in {ends}{kept} serves as well"


def _signature(
    problem: Posed, parameters: dict[str, float], asked: Iterable[Expression]
) -> tuple[list[float], list[float]]:
    """Monic coefficients, and expressions with the roots held: what they read beside the roots."""
    values = problem.values(problem.ordered(parameters))
    a = np.array([float(c) for c in values.coefficients])
    values = values.with_known(dict.fromkeys(_ROOTS, 0.5))
    with np.errstate(all="ignore"):
        return list(a / a[0]), [float(e(values)) for e in asked]


def _varies(rows: list[list[float]]) -> bool:
    """Whether any column of rows changes by more than rounding; one that does not exist counts as a change."""
    table = np.array(rows)
    if not np.all(np.isfinite(table)):
        return True
    return bool(np.any(np.ptp(table, axis=0) > _UNCHANGED * np.abs(table).max()))
