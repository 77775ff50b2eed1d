"""Sub-problems of a Pareto front: one objective minimised, the others held below a value (eps-constraints)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

from tmsopt.evaluation.recheck import recheck
from tmsopt.fronts.front import FrontPoint
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.program.options import STARTS, Options
from tmsopt.search.solve import solve_any_status

RETRY = 16
"""Starts for a sub-problem that the neighbours' designs and a few starts did not solve."""
_SLACK = 1e-9  # of a best value held while the next is minimised: what the recheck of a constraint forgives
_AT_END = 1e-6  # of a parameter's range: IPOPT stays inside it, and where limits are degenerate polishing keeps that
_BEYOND = 1e-6  # relative: a part of the box whose best is worse by less than this is searched all the same
_WORTH = 1e-4  # gain at an end that its slack does not explain: at a smooth optimum it buys sqrt(1e-9) = 3e-5


@dataclass(frozen=True)
class FrontSolver:
    """What all sub-problems of one front share.

    Attributes:
        problem: with `pareto`.
        options: how to solve each, with so many new starts, against branches that the neighbours do not lead to.
        ranges: of the objectives over the front, once its ends are known.
        ends: the same.
        easier: the least of each objective alone, as far as known: no sub-problem has a better one.
    """

    problem: Posed
    options: Options
    ranges: tuple[float, ...] = ()
    ends: tuple[FrontPoint, ...] = ()
    easier: Mapping[int, Solution] = field(default_factory=dict)

    def solve(
        self, problem: Posed, starts: int, near: Sequence[Solution] = (), without_sample: bool = False
    ) -> Solution:
        """The rechecked solution of a sub-problem, whatever its status, from designs near by and so many new starts."""
        free = problem.free.items()
        beside = [{n: min(max(design.parameters[n], lo), hi) for n, (lo, hi) in free} for design in near]
        options = replace(self.options, starts=starts + len(beside) + bool(problem.start))
        return solve_any_status(problem, options, beside, without_sample, self._hopeless(problem, near))

    def _hopeless(self, problem: Posed, near: Sequence[Solution]) -> frozenset[str]:
        """Parts of the box whose best in an objective, without any limit, is worse than what is asked or had of it."""
        names = eps_names(self)
        limits = {k: problem.constraints[n] for k, n in enumerate(names) if n in problem.constraints}
        most = {k: float(text.rpartition("<=")[2]) for k, text in limits.items()}
        hopeless = set[str]()
        for k, best in self.easier.items():
            if not best.sides:
                continue
            if problem.minimize == self.texts[k] and problem.free == self.problem.free:  # what is near bounds it
                known = [*(p.objectives for p in self.ends), *(objectives(self, n) for n in near)]
                met = [values[k] for values in known if all(values[j] <= limit for j, limit in most.items())]
                most = {**most, k: min(met, default=math.inf)}
            worse = most.get(k, math.inf)
            hopeless |= {n for n, value in best.sides.items() if value > worse + _BEYOND * (1 + abs(worse))}
        return frozenset(hopeless if hopeless < {n for best in self.easier.values() for n in best.sides} else ())

    def later(self, count: int) -> "FrontSolver":
        """The same with other starts."""
        return replace(self, options=replace(self.options, seed=self.options.seed + count))

    @property
    def texts(self) -> tuple[str, ...]:
        """The objectives."""
        return tuple(self.problem.pareto)


def alone(ask: FrontSolver, k: int) -> Solution:
    """Objective `k` minimised alone, whatever the others are; of any status."""
    return ask.solve(subproblem(ask, k, {}), STARTS)


def best_first(ask: FrontSolver, first: int) -> Solution:
    """An end of the front: the least of the first objective, held there while the others are minimised in turn."""
    count = len(ask.texts)
    found, held = ask.easier[first], dict[int, float]()
    for done, k in pairwise((first + j) % count for j in range(count)):
        values = objectives(ask, found)
        held[done] = values[done] + _SLACK * (1 + abs(values[done]))
        better = least(ask, k, held, [found], pin=first)
        if better is None:
            continue
        exact = len(held) == 1 and len(better.problem.free) < len(ask.problem.free)  # pinned, so without slack
        gain = values[k] - objectives(ask, better)[k]
        if gain >= 0 if exact else gain > _WORTH * (1 + abs(values[k])):
            found = better
    return found


def least(
    ask: FrontSolver,
    k: int,
    limits: Mapping[int, float],
    near: Sequence[Solution],
    few: bool = False,
    pin: int | None = None,
) -> Solution | None:
    """Objective `k` minimised with others limited, from designs near by and, unless `few`, from new starts.

    Args:
        pin: an objective that has its best value: where that is the end of a parameter's range, the parameter is fixed.

    Returns: the best that is optimal, or None.
    """
    asked = subproblem(ask, k, limits)
    if pin is not None:
        asked = _pinned(ask, asked, pin, near[0])
    ended = [ask.solve(asked, (0 if few else ask.options.starts) if near else RETRY, near, without_sample=few)]
    if not few and all(s.status != "optimal" for s in ended):
        ended.append(ask.later(1).solve(asked, RETRY))
    found = min((s for s in ended if s.status == "optimal"), key=lambda s: s.value, default=None)
    return found if found is None or not ask.ranges else _tightened(ask, k, limits, found)


def subproblem(ask: FrontSolver, k: int, limits: Mapping[int, float]) -> Posed:
    """The problem that minimises objective `k`, with a limit on the value of others."""
    names = eps_names(ask)
    eps = {names[j]: f"({ask.texts[j]}) <= {float(value)!r}" for j, value in limits.items()}
    constraints = {**ask.problem.constraints, **eps}
    return ask.problem.derive(pareto=(), minimize=ask.texts[k], constraints=constraints)


def eps_names(ask: FrontSolver) -> tuple[str, ...]:
    """A constraint name per objective that is none of the user's."""
    names = []
    for text in ask.texts:
        name = f"{text} <= eps"
        while name in ask.problem.constraints:
            name += "'"
        names.append(name)
    return tuple(names)


def objectives(ask: FrontSolver, solution: Solution) -> tuple[float, ...]:
    """Values of all objectives, from the parameters alone; the worst over the cases that the design was made for."""
    problem = ask.problem
    if not (problem.scenarios or problem.tolerances or solution.problem.posed.asks_radius):
        values = problem.values(solution.parameters)
        known = {**solution.quantities, "abscissa": solution.abscissa}  # certified, where an objective is one of these
        found = ((expression, expression.text.strip()) for expression in problem.objectives)
        return tuple(known[text] if text in known else float(expression(values)) for expression, text in found)
    cases = (*problem.cases, *([solution.worst] if solution.worst else []))
    moved = {n for case in cases for table in (case.at, case.offset, case.direction) for n in table}
    known = {n: x for n, x in solution.parameters.items() if n not in moved}  # the same in every case
    if solution.problem.minimize and not math.isnan(solution.value):
        known[solution.problem.minimize] = solution.value
    alone = (problem.derive(pareto=(), minimize=text) for text in ask.texts if text not in known)
    known |= {one.minimize or "": recheck(one, solution.parameters, cases).objective for one in alone}
    return tuple(known[text] for text in ask.texts)


def point(ask: FrontSolver, solution: Solution) -> FrontPoint:
    """A design as a point of the front."""
    active = [n for n in solution.active if n in ask.problem.constraints]
    for name, (low, high) in ask.problem.free.items():
        near = (("min", low), ("max", high))
        active += [f"{name}.{end}" for end, at in near if abs(solution.parameters[name] - at) <= _AT_END * (high - low)]
    return FrontPoint(objectives(ask, solution), solution, tuple(active))


def _tightened(ask: FrontSolver, k: int, limits: Mapping[int, float], found: Solution) -> Solution:
    """A design as good in objective `k` and better in the others, if a limit that does not bind leaves one."""
    names = eps_names(ask)
    loose = [j for j in limits if names[j] not in found.active and ask.ranges[j] > 0]
    if not loose:
        return found
    values = objectives(ask, found)
    held = {**limits, k: values[k] + _SLACK * (1 + abs(values[k]))}
    rest = " + ".join(f"({ask.texts[j]}) / {ask.ranges[j]!r}" for j in loose)
    asked = _pinned(ask, subproblem(ask, k, held).derive(minimize=rest), k, found)
    better = ask.solve(asked, ask.options.starts, [found])
    gain = sum((values[j] - b) / ask.ranges[j] for j, b in enumerate(objectives(ask, better)) if j in loose)
    return better if better.status == "optimal" and gain > _WORTH else found


def _pinned(ask: FrontSolver, asked: Posed, k: int, best: Solution) -> Posed:
    """The problem without slack where objective `k` is a parameter, or minus one, that ended at its bound."""
    name = ask.texts[k].strip().removeprefix("-").strip()
    if name not in asked.free or best.parameters[name] not in asked.free[name]:
        return asked
    fixed = {**asked.fixed, name: best.parameters[name]}
    free = {n: ends for n, ends in asked.free.items() if n != name}
    constraints = {n: text for n, text in asked.constraints.items() if n != eps_names(ask)[k]}
    start = {n: v for n, v in asked.start.items() if n in free}
    return asked.derive(fixed=fixed, free=free, constraints=constraints, start=start)
