"""Sub-problems of a Pareto front, solved in parallel: minimise one objective with limits on the others."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Any, TypeVar

from tmsopt.evaluation.recheck import recheck
from tmsopt.executor import Crash, EngineError, Executor
from tmsopt.fronts.front import FrontPoint
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.program.options import STARTS, Options
from tmsopt.search.solve import solve_any_status

MAX_PARALLEL = 4
"""Largest number of sub-problems at a time.

It does not depend on the number of processes, because the next sub-problems depend on all results.
"""

T = TypeVar("T")
R = TypeVar("R")

RETRY_STARTS = 16
"""Number of starts of a sub-problem that was not solved from the designs of the neighbours and a few starts."""

_SLACK = 1e-9
"""Relative slack of a limit that keeps an objective at its best value while the next objective is minimised.

The recheck of constraints tolerates this slack.
"""
_BOUND_DISTANCE = 1e-6  # largest distance of an active bound, as a fraction of its range: IPOPT keeps such a distance
_WORSE_SIDE = 1e-6  # a side of the box is skipped if its optimum is worse by more than this relative difference
_MIN_GAIN = 1e-4
"""Smallest relative gain. Smaller gains may come from the slack, which gives sqrt(1e-9) = 3e-5 at a smooth optimum."""


@dataclass(frozen=True)
class FrontSolver:
    """The data that all sub-problems of one front share.

    Attributes:
        problem: a problem with `pareto`.
        options: options of each solve; its new starts find branches that starts from the neighbours do not reach.
        ranges: ranges of the objectives over the front, once its ends are known.
        ends: the ends of the front, once known.
        single_optima: index of an objective → its optimum without limits on the others. No sub-problem has a better
            value of this objective.
    """

    problem: Posed
    options: Options
    ranges: tuple[float, ...] = ()
    ends: tuple[FrontPoint, ...] = ()
    single_optima: Mapping[int, Solution] = field(default_factory=dict)

    def solve(
        self, problem: Posed, starts: int, near: Sequence[Solution] = (), without_sample: bool = False
    ) -> Solution:
        """Solve a sub-problem from nearby designs and new starts; return the rechecked solution, of any status."""
        free = problem.free.items()
        nearby_starts = [{n: min(max(design.parameters[n], lo), hi) for n, (lo, hi) in free} for design in near]
        options = replace(self.options, starts=starts + len(nearby_starts) + bool(problem.start))
        return solve_any_status(problem, options, nearby_starts, without_sample, self._worse_sides(problem, near))

    def _worse_sides(self, problem: Posed, near: Sequence[Solution]) -> frozenset[str]:
        """Sides of the box on which the optimum of an objective is worse than its limit, or than a known point."""
        names = limit_names(self)
        limits = {k: problem.constraints[n] for k, n in enumerate(names) if n in problem.constraints}
        max_values = {k: float(text.rpartition("<=")[2]) for k, text in limits.items()}
        worse_sides = set[str]()
        for k, optimum in self.single_optima.items():
            if not optimum.sides:
                continue
            if problem.minimize == self.texts[k] and problem.free == self.problem.free:  # known values are upper bounds
                known_values = [*(p.objectives for p in self.ends), *(objective_values(self, n) for n in near)]
                reached_values = [
                    values[k] for values in known_values if all(values[j] <= limit for j, limit in max_values.items())
                ]
                max_values = {**max_values, k: min(reached_values, default=math.inf)}
            limit = max_values.get(k, math.inf)
            worse_sides |= {n for n, value in optimum.sides.items() if value > limit + _WORSE_SIDE * (1 + abs(limit))}
        all_sides = {n for optimum in self.single_optima.values() for n in optimum.sides}
        return frozenset(worse_sides if worse_sides < all_sides else ())

    def reseed(self, count: int) -> "FrontSolver":
        """The same solver with other random starts."""
        return replace(self, options=replace(self.options, seed=self.options.seed + count))

    @property
    def texts(self) -> tuple[str, ...]:
        """Texts of the objectives."""
        return tuple(self.problem.pareto)


def minimise_without_limits(solver: FrontSolver, k: int) -> Solution:
    """Minimise objective `k` without limits on the others; return a solution of any status."""
    return solver.solve(build_subproblem(solver, k, {}), STARTS)


def solve_end(solver: FrontSolver, best_objective: int) -> Solution:
    """An end of the front: minimise one objective, then the others in turn while earlier ones keep their values."""
    count = len(solver.texts)
    design, value_limits = solver.single_optima[best_objective], dict[int, float]()
    for held_objective, k in pairwise((best_objective + j) % count for j in range(count)):
        values = objective_values(solver, design)
        value_limits[held_objective] = values[held_objective] + _SLACK * (1 + abs(values[held_objective]))
        better_design = minimise_limited(solver, k, value_limits, [design], fixed_objective=best_objective)
        if better_design is None:
            continue
        # A parameter that `minimise_limited` fixed has no slack.
        without_slack = len(value_limits) == 1 and len(better_design.problem.free) < len(solver.problem.free)
        gain = values[k] - objective_values(solver, better_design)[k]
        if gain >= 0 if without_slack else gain > _MIN_GAIN * (1 + abs(values[k])):
            design = better_design
    return design


def minimise_limited(
    solver: FrontSolver,
    k: int,
    limits: Mapping[int, float],
    near: Sequence[Solution],
    nearby_only: bool = False,
    fixed_objective: int | None = None,
) -> Solution | None:
    """Minimise objective `k` with limits on others, from nearby designs and, unless `nearby_only`, new starts.

    Args:
        k: index of the minimised objective.
        limits: index of another objective → its limit.
        fixed_objective: an objective at its best value; if this value is a bound of a parameter, the parameter is
            fixed there.

    Returns:
        The best optimal solution, or None.
    """
    problem = build_subproblem(solver, k, limits)
    if fixed_objective is not None:
        problem = _fix_at_bound(solver, problem, fixed_objective, near[0])
    starts = RETRY_STARTS if not near else 0 if nearby_only else solver.options.starts
    results = [solver.solve(problem, starts, near, without_sample=nearby_only)]
    if not nearby_only and all(s.status != "optimal" for s in results):
        results.append(solver.reseed(1).solve(problem, RETRY_STARTS))
    best = min((s for s in results if s.status == "optimal"), key=lambda s: s.value, default=None)
    return best if best is None or not solver.ranges else _improve_inactive(solver, k, limits, best)


def build_subproblem(solver: FrontSolver, k: int, limits: Mapping[int, float]) -> Posed:
    """The problem that minimises objective `k` with limits on others."""
    names = limit_names(solver)
    eps = {names[j]: f"({solver.texts[j]}) <= {float(value)!r}" for j, value in limits.items()}
    constraints = {**solver.problem.constraints, **eps}
    return solver.problem.derive(pareto=(), minimize=solver.texts[k], constraints=constraints)


def limit_names(solver: FrontSolver) -> tuple[str, ...]:
    """A name for the limit of each objective that differs from the names of the user's constraints."""
    names = []
    for text in solver.texts:
        name = f"{text} <= eps"
        while name in solver.problem.constraints:
            name += "'"
        names.append(name)
    return tuple(names)


def objective_values(solver: FrontSolver, solution: Solution) -> tuple[float, ...]:
    """Values of all objectives from the parameters; each is the worst over the cases (scenarios, tolerances)."""
    problem = solver.problem
    if not (problem.scenarios or problem.tolerances or solution.problem.posed.asks_radius):
        values = problem.values(solution.parameters)
        known_values = {**solution.quantities, "abscissa": solution.abscissa}  # certified values
        objectives = ((expression, expression.text.strip()) for expression in problem.objectives)
        return tuple(
            known_values[text] if text in known_values else float(expression(values)) for expression, text in objectives
        )
    cases = (*problem.cases, *([solution.worst] if solution.worst else []))
    case_parameters = {n for case in cases for table in (case.at, case.offset, case.direction) for n in table}
    known_values = {n: x for n, x in solution.parameters.items() if n not in case_parameters}  # the same in every case
    if solution.problem.minimize and not math.isnan(solution.value):
        known_values[solution.problem.minimize] = solution.value
    single_problems = (problem.derive(pareto=(), minimize=text) for text in solver.texts if text not in known_values)
    known_values |= {
        single.minimize or "": recheck(single, solution.parameters, cases).objective for single in single_problems
    }
    return tuple(known_values[text] for text in solver.texts)


def front_point(solver: FrontSolver, solution: Solution) -> FrontPoint:
    """A point of the front from a solution."""
    active_names = [n for n in solution.active if n in solver.problem.constraints]
    for name, (low, high) in solver.problem.free.items():
        bounds = (("min", low), ("max", high))
        active_names += [
            f"{name}.{end}"
            for end, bound in bounds
            if abs(solution.parameters[name] - bound) <= _BOUND_DISTANCE * (high - low)
        ]
    return FrontPoint(objective_values(solver, solution), solution, tuple(active_names))


def _improve_inactive(solver: FrontSolver, k: int, limits: Mapping[int, float], design: Solution) -> Solution:
    """A design that is as good in objective `k` and better in objectives with inactive limits; or the same design."""
    names = limit_names(solver)
    inactive_objectives = [j for j in limits if names[j] not in design.active and solver.ranges[j] > 0]
    if not inactive_objectives:
        return design
    values = objective_values(solver, design)
    value_limits = {**limits, k: values[k] + _SLACK * (1 + abs(values[k]))}
    scaled_sum = " + ".join(f"({solver.texts[j]}) / {solver.ranges[j]!r}" for j in inactive_objectives)
    problem = _fix_at_bound(solver, build_subproblem(solver, k, value_limits).derive(minimize=scaled_sum), k, design)
    better_design = solver.solve(problem, solver.options.starts, [design])
    gain = sum(
        (values[j] - b) / solver.ranges[j]
        for j, b in enumerate(objective_values(solver, better_design))
        if j in inactive_objectives
    )
    return better_design if better_design.status == "optimal" and gain > _MIN_GAIN else design


def _fix_at_bound(solver: FrontSolver, problem: Posed, k: int, best: Solution) -> Posed:
    """Fix the parameter at its bound instead of limiting objective `k`, if that objective is ± this parameter."""
    name = solver.texts[k].strip().removeprefix("-").strip()
    if name not in problem.free or best.parameters[name] not in problem.free[name]:
        return problem
    fixed = {**problem.fixed, name: best.parameters[name]}
    free = {n: ends for n, ends in problem.free.items() if n != name}
    constraints = {n: text for n, text in problem.constraints.items() if n != limit_names(solver)[k]}
    start = {n: v for n, v in problem.start.items() if n in free}
    return problem.derive(fixed=fixed, free=free, constraints=constraints, start=start)


def map_items(
    executor: Executor, function: Callable[[FrontSolver, T], R], solver: FrontSolver, items: Sequence[T]
) -> Iterator[tuple[int, R]]:
    """Yield the index of each item with its result, in the order in which they finish.

    Raises:
        EngineError: if every process that works on an item crashes.
    """
    with closing(executor.map(partial(function, solver), items)) as results:
        for index, result in results:
            if isinstance(result, Crash):
                raise EngineError(f"a sub-problem of the front ends its process ({result.cause})")
            yield index, result


def can_pickle(value: Any) -> bool:
    """Whether an object can be sent to another process; a user's model may not."""
    import cloudpickle

    try:
        cloudpickle.dumps(value)
    except Exception:
        return False
    return True
