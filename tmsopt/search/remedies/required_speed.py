"""The lowest or highest speed that a design takes where the limits on the roots cannot be met."""

import math
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from tmsopt.problem import Posed, Solution, unit_of
from tmsopt.problem.advice.remedies import DIGITS, RequiredValue, round_outwards
from tmsopt.problem.dependence import STABLE
from tmsopt.program import Options
from tmsopt.progress import begin
from tmsopt.records import Table
from tmsopt.search.remedies.changed_problem import OutOfTime, limit_time, solve_again
from tmsopt.search.remedies.conflict import STARTS, search_briefly
from tmsopt.search.state import begin_search

_FASTEST, _TIMES = 10.0, 4.0  # highest speed searched: in √(g w), or in the problem's own highest speed if that is more
_SECONDS = 0.5  # no second range is searched after this time
_AT_END = 1e-6  # relative: a speed this close to an end of its range is at that end


def add_required_speed(solution: Solution, options: Options) -> Solution:
    """Add the lowest or highest speed at which a design exists, if the present one violates the limits on the roots.

    The problem is solved again at the rounded speed that the report shows.
    """
    problem = solution.problem.posed
    name = _find_speed(problem)
    if not name or problem.cases or not problem.free or not _can_speed_help(solution):
        return solution
    limits = {} if problem.asked_of_roots or problem.pattern else {STABLE: "abscissa <= 0"}
    few = replace(options, starts=STARTS, progress=None, near=None)
    began, searched = time.perf_counter(), list[float]()
    begin(options.progress, f"searching for the {name} that makes it feasible")
    for highest, ends in _list_ranges(problem, name):
        goal = {"maximize": name, "minimize": None} if highest else {"minimize": name, "maximize": None}
        asked = _set_range(problem, name, ends).derive(constraints={**problem.constraints, **limits}, **goal)
        searched += ends
        trials = [search_briefly(state) for state in begin_search(asked, few)]
        found = [t.parameters for t in trials if t and not t.checked.violations]
        if found:
            design = (max if highest else min)(found, key=lambda p: p[name])
            if name in problem.free and math.isclose(design[name], ends[highest], rel_tol=_AT_END):
                return solution  # the box has such a design itself, so no other speed is required
            short, one = limit_time(options), unit_of(problem, name).one
            rounded = [round_outwards(design[name] / one, not highest, digits) * one for digits in (DIGITS, 4, 2)]
            with suppress(OutOfTime):
                for shown in dict.fromkeys(rounded):
                    fixed = _set_range(problem, name, (shown, shown))
                    if solve_again(fixed, short, problem, thorough=True):
                        need = RequiredValue(name, design[name], highest, ends, Table(design), shown)
                        return replace(solution, need=need)
            return solution
        if time.perf_counter() - began > _SECONDS:
            break
    if searched:
        solution = replace(solution, need=RequiredValue(name, math.nan, False, (min(searched), max(searched))))
    return solution


def _set_range(problem: Posed, name: str, ends: tuple[float, float]) -> Posed:
    """The problem with another range of a parameter; with equal ends, the parameter is fixed."""
    free, fixed = {**problem.free, name: ends}, {n: x for n, x in problem.fixed.items() if n != name}
    return problem.derive(fixed=fixed, free={n: free[n] for n in problem.parameter_set.names if n in free}, start={})


def _can_speed_help(solution: Solution) -> bool:
    """Whether another speed may help: the violated limits are on the roots."""
    problem = solution.problem.posed
    about = {*problem.asked_of_roots, *([problem.pattern.name] if problem.pattern else [])}
    if solution.status == "infeasible":
        return bool(about & set(solution.violations))
    return solution.stable is False and not solution.any_stable and solution.stability_sought


def _find_speed(problem: Posed) -> str:
    """Name of the speed parameter; empty if a constraint on it already limits it."""
    of = problem.parameter_set
    name = next((p.name for p in of.parameters if p.unit == "m/s" or p.name == "Fr"), "")
    return "" if any(name in c.names for c in problem.conditions.values()) else name


def _list_ranges(problem: Posed, name: str) -> Iterator[tuple[bool, tuple[float, float]]]:
    """Ranges to search: above the allowed speeds, then below them; False, True: whether to maximise the speed."""
    low, high = problem.free.get(name, (problem.fixed.get(name, math.nan),) * 2)
    middle = {**problem.fixed, **{n: sum(ends) / 2 for n, ends in problem.free.items()}}
    unit = math.sqrt(middle["g"] * middle["w"]) if {"g", "w"} <= middle.keys() else 1.0
    top = min(max(_FASTEST * unit, _TIMES * high), problem.parameter_set[name].range.upper)
    if high < top:
        yield False, (high, top)
    bottom = max(problem.parameter_set[name].range.lower, 0.0)
    if bottom < low:
        yield True, (bottom, low)
