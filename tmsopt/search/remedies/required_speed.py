"""Find the lowest or highest speed at which a design meets the limits on the roots, if no design in the box does."""

import math
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from tmsopt.problem import Posed, Solution, unit_of
from tmsopt.problem.advice.remedies import DIGITS, RequiredValue, round_outwards
from tmsopt.problem.dependence import STABILITY_CONSTRAINT
from tmsopt.program import Options
from tmsopt.progress import begin
from tmsopt.records import Table
from tmsopt.search.remedies.changed_problem import OutOfTime, limit_time, solve_again
from tmsopt.search.remedies.conflict import SHORT_SEARCH_STARTS, search_briefly
from tmsopt.search.state import begin_search

_MAX_SPEED = 10.0  # highest speed that is searched, in √(g w)
_MAX_SPEED_RATIO = 4.0  # the same limit, relative to the highest speed of the problem; the larger limit counts
_MAX_SECONDS = 0.5  # after this time, speeds below the allowed ones are not searched
_AT_RANGE_END = 1e-6  # relative: a speed this close to an end of its range is at that end


def add_required_speed(solution: Solution, options: Options) -> Solution:
    """Add the lowest or highest speed at which a design exists, if the present one violates the limits on the roots.

    The problem is solved again at the rounded speed that the report shows.
    """
    problem = solution.problem.posed
    name = _find_speed(problem)
    if not name or problem.cases or not problem.free or not _can_speed_help(solution):
        return solution
    limits = {} if problem.asked_of_roots or problem.pattern else {STABILITY_CONSTRAINT: "abscissa <= 0"}
    short_options = replace(options, starts=SHORT_SEARCH_STARTS, progress=None, near=None)
    began, searched_ends = time.perf_counter(), list[float]()
    begin(options.progress, f"searching for the {name} that makes it feasible")
    for is_maximum, ends in _list_ranges(problem, name):
        goal = {"maximize": name, "minimize": None} if is_maximum else {"minimize": name, "maximize": None}
        speed_problem = _set_range(problem, name, ends).derive(constraints={**problem.constraints, **limits}, **goal)
        searched_ends += ends
        trials = [search_briefly(state) for state in begin_search(speed_problem, short_options)]
        designs = [trial.parameters for trial in trials if trial and not trial.checked.violations]
        if designs:
            design = (max if is_maximum else min)(designs, key=lambda p: p[name])
            if name in problem.free and math.isclose(design[name], ends[is_maximum], rel_tol=_AT_RANGE_END):
                return solution  # a speed in the box is enough
            limited_options, unit_size = limit_time(options), unit_of(problem, name).factor
            rounded_speeds = [
                round_outwards(design[name] / unit_size, not is_maximum, digits) * unit_size
                for digits in (DIGITS, 4, 2)
            ]
            with suppress(OutOfTime):
                for value in dict.fromkeys(rounded_speeds):
                    fixed_problem = _set_range(problem, name, (value, value))
                    if solve_again(fixed_problem, limited_options, problem, is_thorough=True):
                        need = RequiredValue(name, design[name], is_maximum, ends, Table(design), value)
                        return replace(solution, need=need)
            return solution
        if time.perf_counter() - began > _MAX_SECONDS:
            break
    if searched_ends:
        solution = replace(
            solution, need=RequiredValue(name, math.nan, False, (min(searched_ends), max(searched_ends)))
        )
    return solution


def _set_range(problem: Posed, name: str, ends: tuple[float, float]) -> Posed:
    """Return the problem with another range of a parameter; if the ends are equal, the parameter is fixed."""
    free, fixed = {**problem.free, name: ends}, {n: x for n, x in problem.fixed.items() if n != name}
    return problem.derive(fixed=fixed, free={n: free[n] for n in problem.parameter_set.names if n in free}, start={})


def _can_speed_help(solution: Solution) -> bool:
    """Whether another speed may help, because the violated limits are on the roots."""
    problem = solution.problem.posed
    names = {*problem.asked_of_roots, *([problem.pattern.name] if problem.pattern else [])}
    if solution.status == "infeasible":
        return bool(names & set(solution.violations))
    return solution.stable is False and not solution.any_stable and solution.stability_sought


def _find_speed(problem: Posed) -> str:
    """Return the name of the speed parameter; empty if there is none or a constraint uses it."""
    parameter_set = problem.parameter_set
    name = next((p.name for p in parameter_set.parameters if p.unit == "m/s" or p.name == "Fr"), "")
    return "" if any(name in c.names for c in problem.conditions.values()) else name


def _list_ranges(problem: Posed, name: str) -> Iterator[tuple[bool, tuple[float, float]]]:
    """Yield (whether to maximise the speed, range): first with the range above the allowed speeds, then below."""
    low, high = problem.free.get(name, (problem.fixed.get(name, math.nan),) * 2)
    middle = {**problem.fixed, **{n: sum(ends) / 2 for n, ends in problem.free.items()}}
    unit = math.sqrt(middle["g"] * middle["w"]) if {"g", "w"} <= middle.keys() else 1.0
    top = min(max(_MAX_SPEED * unit, _MAX_SPEED_RATIO * high), problem.parameter_set[name].range.upper)
    if high < top:
        yield False, (high, top)
    bottom = max(problem.parameter_set[name].range.lower, 0.0)
    if bottom < low:
        yield True, (bottom, low)
