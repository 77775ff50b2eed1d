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
"""Most sub-problems at a time, for any number of processes, since the next ones depend on all results."""

T = TypeVar("T")
R = TypeVar("R")

RETRY = 16
"""Starts of a sub-problem that the neighbours' designs and a few starts did not solve."""

_SLACK = 1e-9  # relative, on a best value held while the next is minimised; the recheck of a constraint forgives it
_AT_BOUND = 1e-6  # of a range: IPOPT stays this far inside, and polishing may keep that at degenerate limits
_WORSE = 1e-6  # relative: a side of the box is skipped only if its optimum is worse by more
_MIN_GAIN = 1e-4  # a gain beyond that of the slack, which is sqrt(1e-9) = 3e-5 at a smooth optimum


@dataclass(frozen=True)
class FrontSolver:
    """The data that all sub-problems of one front share.

    Attributes:
        problem: with `pareto`.
        options: options of each solve; its new starts find branches that the neighbours do not lead to.
        ranges: ranges of the objectives over the front, once its ends are known.
        ends: the ends of the front, once known.
        single_optima: the optimum of each objective alone, as far as known; no sub-problem has a better one.
    """

    problem: Posed
    options: Options
    ranges: tuple[float, ...] = ()
    ends: tuple[FrontPoint, ...] = ()
    single_optima: Mapping[int, Solution] = field(default_factory=dict)

    def solve(
        self, problem: Posed, starts: int, near: Sequence[Solution] = (), without_sample: bool = False
    ) -> Solution:
        """Solve a sub-problem from nearby designs and new starts; returns the rechecked solution of any status."""
        free = problem.free.items()
        nearby_starts = [{n: min(max(design.parameters[n], lo), hi) for n, (lo, hi) in free} for design in near]
        options = replace(self.options, starts=starts + len(nearby_starts) + bool(problem.start))
        return solve_any_status(problem, options, nearby_starts, without_sample, self._worse_sides(problem, near))

    def _worse_sides(self, problem: Posed, near: Sequence[Solution]) -> frozenset[str]:
        """Sides of the box whose optimum in an objective is worse than its limit, or than a point found."""
        names = limit_names(self)
        limits = {k: problem.constraints[n] for k, n in enumerate(names) if n in problem.constraints}
        most = {k: float(text.rpartition("<=")[2]) for k, text in limits.items()}
        worse_sides = set[str]()
        for k, best in self.single_optima.items():
            if not best.sides:
                continue
            if problem.minimize == self.texts[k] and problem.free == self.problem.free:  # points found bound it
                known = [*(p.objectives for p in self.ends), *(objective_values(self, n) for n in near)]
                reached = [values[k] for values in known if all(values[j] <= limit for j, limit in most.items())]
                most = {**most, k: min(reached, default=math.inf)}
            limit = most.get(k, math.inf)
            worse_sides |= {n for n, value in best.sides.items() if value > limit + _WORSE * (1 + abs(limit))}
        every_side = {n for best in self.single_optima.values() for n in best.sides}
        return frozenset(worse_sides if worse_sides < every_side else ())

    def reseed(self, count: int) -> "FrontSolver":
        """The same solver with other random starts."""
        return replace(self, options=replace(self.options, seed=self.options.seed + count))

    @property
    def texts(self) -> tuple[str, ...]:
        """Texts of the objectives."""
        return tuple(self.problem.pareto)


def minimise_alone(solver: FrontSolver, k: int) -> Solution:
    """Minimise objective `k` without limits on the others; returns a solution of any status."""
    return solver.solve(build_subproblem(solver, k, {}), STARTS)


def solve_end(solver: FrontSolver, first: int) -> Solution:
    """An end of the front: minimise one objective, then each other one in turn with the earlier values held."""
    count = len(solver.texts)
    found, held = solver.single_optima[first], dict[int, float]()
    for done, k in pairwise((first + j) % count for j in range(count)):
        values = objective_values(solver, found)
        held[done] = values[done] + _SLACK * (1 + abs(values[done]))
        better = minimise_limited(solver, k, held, [found], pin=first)
        if better is None:
            continue
        exact = len(held) == 1 and len(better.problem.free) < len(solver.problem.free)  # fixed, so without slack
        gain = values[k] - objective_values(solver, better)[k]
        if gain >= 0 if exact else gain > _MIN_GAIN * (1 + abs(values[k])):
            found = better
    return found


def minimise_limited(
    solver: FrontSolver,
    k: int,
    limits: Mapping[int, float],
    near: Sequence[Solution],
    few: bool = False,
    pin: int | None = None,
) -> Solution | None:
    """Minimise objective `k` with limits on others, from nearby designs and, unless `few`, from new starts.

    Args:
        pin: an objective at its best value; if that is a bound of a parameter, the parameter is fixed there.

    Returns:
        The best optimal solution, or None.
    """
    problem = build_subproblem(solver, k, limits)
    if pin is not None:
        problem = _fix_at_bound(solver, problem, pin, near[0])
    ended = [solver.solve(problem, (0 if few else solver.options.starts) if near else RETRY, near, without_sample=few)]
    if not few and all(s.status != "optimal" for s in ended):
        ended.append(solver.reseed(1).solve(problem, RETRY))
    found = min((s for s in ended if s.status == "optimal"), key=lambda s: s.value, default=None)
    return found if found is None or not solver.ranges else _improve_loose(solver, k, limits, found)


def build_subproblem(solver: FrontSolver, k: int, limits: Mapping[int, float]) -> Posed:
    """The problem that minimises objective `k` with limits on others."""
    names = limit_names(solver)
    eps = {names[j]: f"({solver.texts[j]}) <= {float(value)!r}" for j, value in limits.items()}
    constraints = {**solver.problem.constraints, **eps}
    return solver.problem.derive(pareto=(), minimize=solver.texts[k], constraints=constraints)


def limit_names(solver: FrontSolver) -> tuple[str, ...]:
    """A constraint name per objective that the user does not use."""
    names = []
    for text in solver.texts:
        name = f"{text} <= eps"
        while name in solver.problem.constraints:
            name += "'"
        names.append(name)
    return tuple(names)


def objective_values(solver: FrontSolver, solution: Solution) -> tuple[float, ...]:
    """Values of all objectives from the parameters alone; the worst over the cases of the solution."""
    problem = solver.problem
    if not (problem.scenarios or problem.tolerances or solution.problem.posed.asks_radius):
        values = problem.values(solution.parameters)
        known = {**solution.quantities, "abscissa": solution.abscissa}  # certified values
        found = ((expression, expression.text.strip()) for expression in problem.objectives)
        return tuple(known[text] if text in known else float(expression(values)) for expression, text in found)
    cases = (*problem.cases, *([solution.worst] if solution.worst else []))
    moved = {n for case in cases for table in (case.at, case.offset, case.direction) for n in table}
    known = {n: x for n, x in solution.parameters.items() if n not in moved}  # the same in every case
    if solution.problem.minimize and not math.isnan(solution.value):
        known[solution.problem.minimize] = solution.value
    singles = (problem.derive(pareto=(), minimize=text) for text in solver.texts if text not in known)
    known |= {one.minimize or "": recheck(one, solution.parameters, cases).objective for one in singles}
    return tuple(known[text] for text in solver.texts)


def front_point(solver: FrontSolver, solution: Solution) -> FrontPoint:
    """A point of the front from a solution."""
    active = [n for n in solution.active if n in solver.problem.constraints]
    for name, (low, high) in solver.problem.free.items():
        near = (("min", low), ("max", high))
        active += [
            f"{name}.{end}" for end, at in near if abs(solution.parameters[name] - at) <= _AT_BOUND * (high - low)
        ]
    return FrontPoint(objective_values(solver, solution), solution, tuple(active))


def _improve_loose(solver: FrontSolver, k: int, limits: Mapping[int, float], found: Solution) -> Solution:
    """A design as good in objective `k` and better in those whose limits are inactive, or the same design."""
    names = limit_names(solver)
    loose = [j for j in limits if names[j] not in found.active and solver.ranges[j] > 0]
    if not loose:
        return found
    values = objective_values(solver, found)
    held = {**limits, k: values[k] + _SLACK * (1 + abs(values[k]))}
    rest = " + ".join(f"({solver.texts[j]}) / {solver.ranges[j]!r}" for j in loose)
    problem = _fix_at_bound(solver, build_subproblem(solver, k, held).derive(minimize=rest), k, found)
    better = solver.solve(problem, solver.options.starts, [found])
    gain = sum((values[j] - b) / solver.ranges[j] for j, b in enumerate(objective_values(solver, better)) if j in loose)
    return better if better.status == "optimal" and gain > _MIN_GAIN else found


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
    """Yield the index of each item with its result, as they finish; the same for any number of workers.

    Raises:
        EngineError: if an item ends every process that tries it.
    """
    with closing(executor.map(partial(function, solver), items)) as answers:
        for place, answer in answers:
            if isinstance(answer, Crash):
                raise EngineError(f"a sub-problem of the front ends its process ({answer.cause})")
            yield place, answer


def can_pickle(thing: Any) -> bool:
    """Whether an object can be sent to another process; a user's model may not."""
    import cloudpickle

    try:
        cloudpickle.dumps(thing)
    except Exception:
        return False
    return True
