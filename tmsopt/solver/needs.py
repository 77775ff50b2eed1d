"""The speed that a problem without an answer takes: freed, the least is looked for at which all else holds."""

import math
import time
from collections.abc import Iterator
from dataclasses import replace

from tmsopt.design.problem import Problem
from tmsopt.design.solution import Need, Solution
from tmsopt.formulation.options import Options
from tmsopt.progress import begin
from tmsopt.records import Table
from tmsopt.solver.multistart import search
from tmsopt.solver.outcome import Trial, survivor
from tmsopt.solver.workspace import Workspace, workspace

_STABLE = "every root left of the axis"  # the name of a constraint
_FASTEST, _TIMES = 10.0, 4.0  # speeds looked through, in √(g w); in the problem's own speed, where that is more
_STARTS, _SECONDS = 6, 0.5  # what a search for it may cost; after which no other is begun


def with_need(solution: Solution, options: Options) -> Solution:
    """The same, with the least speed that a design takes, or the greatest, where the roots stand in the way."""
    name, problem = _speed(solution.problem), solution.problem
    if not name or problem.cases or not problem.free or not _asked(solution):
        return solution
    limits = {} if set(problem.asked_of_roots) or problem.pattern else {_STABLE: "abscissa <= 0"}
    few = replace(options, starts=_STARTS, stability=0.0, alone=False, progress=None, near=None)
    began, looked = time.perf_counter(), list[float]()
    begin(options.progress, f"looking for the {name} that it takes")
    for most, ends in _ranges(problem, name):
        freed = {**problem.free, name: ends}
        asked = replace(
            problem,
            fixed={n: x for n, x in problem.fixed.items() if n != name},
            free={n: freed[n] for n in problem.parameter_set.names if n in freed},
            constraints={**problem.constraints, **limits},
            minimize=None if most else name,
            maximize=name if most else None,
            start={},
        )
        looked += ends
        trials = [_best(part) for part in workspace(asked, few).parts()]
        found = [t.parameters for t in trials if t and not t.checked.violations]
        if found:
            design = (max if most else min)(found, key=lambda p: p[name])
            return replace(solution, need=Need(name, design[name], most, ends, Table(design)))
        if time.perf_counter() - began > _SECONDS:
            break
    return replace(solution, need=Need(name, math.nan, False, (min(looked), max(looked)))) if looked else solution


def _best(work: Workspace) -> Trial | None:
    nlp = work.formulate(())
    return survivor(work, nlp, search(work, nlp, _STARTS))


def _asked(solution: Solution) -> bool:
    """Whether the speed may help: what fails is about the roots."""
    problem = solution.problem
    about = {*problem.asked_of_roots, *([problem.locate] if problem.locate else [])}
    if solution.status == "infeasible":
        return bool(about & set(solution.violations))
    return solution.stable is False and solution.stability_sought


def _speed(problem: Problem) -> str:
    """The parameter that is a speed; none where a constraint is about it, which says what it may be."""
    of = problem.parameter_set
    name = next((p.name for p in of.parameters if p.unit == "m/s" or p.name == "Fr"), "")
    return "" if any(name in c.names for c in problem.conditions.values()) else name


def _ranges(problem: Problem, name: str) -> Iterator[tuple[bool, tuple[float, float]]]:
    """Above what the speed may be, then below it; not below where it is fixed or may be anything down to rest."""
    low, high = problem.free.get(name, (problem.fixed.get(name, math.nan),) * 2)
    middle = {
        n: sum(problem.free[n]) / 2 if n in problem.free else problem.fixed[n] for n in problem.parameter_set.names
    }
    unit = math.sqrt(middle["g"] * middle["w"]) if {"g", "w"} <= middle.keys() else 1.0
    top = min(max(_FASTEST * unit, _TIMES * high), problem.parameter_set[name].range.upper)
    if high < top:
        yield False, (high, top)
    bottom = max(problem.parameter_set[name].range.lower, 0.0)
    if bottom < low:
        yield True, (bottom, low)
