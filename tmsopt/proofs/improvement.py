"""Checks a point that branch and bound found, and improves it if it is feasible and better."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from tmsopt.evaluation.recheck import measure_excesses, recheck
from tmsopt.global_search.answer import Answer
from tmsopt.global_search.tasks import FOUND, UNDECIDED
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Solution
from tmsopt.problem.unit_system import unit_of
from tmsopt.search.solve import evaluate_design, solve

MIN_SIZE = 0.1
"""Gains are relative to the size of the objective, or to this number if the objective is smaller."""

_MIN_GAIN = 1e-7  # relative gain of a better design: a tenth of the smallest gap that `certify` tries
_CERTAIN_GAIN = 1e-2  # a larger relative gain is real: a violation of 1e-9 gains at most 0.006, at a 4-fold root
_STARTS = 4  # starts of the solver: the point and three others
_MAX_VIOLATION = 1e-3  # a point with a larger violation, or a larger relative loss, is rejected


def is_feasible(design: Solution) -> bool:
    """Whether a solution meets all constraints, optimal or not."""
    has_value = design.problem.posed.objective is None or math.isfinite(design.value)
    return design.status == "optimal" or (design.status == "not_converged" and not design.violations and has_value)


def confirm_point(design: Solution, cases: Sequence[Case], point: Mapping[str, float]) -> Answer:
    """Solve from a point that branch and bound found, for a better design than the known one.

    If the solver does not converge, the feasible design nearest to the point may still be better. There is no better
    design if the point only gains by violating a limit within the solver's tolerance, or by ignoring cases.
    """
    problem = design.problem.posed
    known_value = design.value if is_feasible(design) and problem.objective is not None else None
    evaluation = recheck(problem, problem.ordered(point), cases)
    gain = relative_gain(problem, known_value, evaluation.objective)
    if max(evaluation.violations.values(), default=0.0) > _MAX_VIOLATION or gain < -_MAX_VIOLATION:
        return Answer(UNDECIDED)  # the point is feasible only within the solver's tolerance
    is_exact = problem.pattern is None and not any(measure_excesses(problem, problem.ordered(point), cases).values())
    for candidate in _improve_point(
        problem, known_value, point, known_value is None or gain > _CERTAIN_GAIN or is_exact
    ):
        if is_feasible(candidate) and relative_gain(problem, known_value, candidate.value) > _MIN_GAIN:
            note = "branch and bound found a feasible design that the search from many starts missed"
            if known_value is not None:
                old_value = unit_of(problem, problem.goal).show(known_value, 9)
                note = f"branch and bound found a better design than the search from many starts: {old_value} before"
            note = next(
                (old_note for old_note in design.notes if old_note.startswith("branch and bound found a ")), note
            )
            notes = (*candidate.notes, note)
            better = replace(candidate, problem=problem.problem, notes=notes, stable_elsewhere=design.stable_elsewhere)
            return Answer(FOUND, better_solution=better)
    return Answer(FOUND if known_value is not None and gain > _MIN_GAIN and not evaluation.violations else UNDECIDED)


def _improve_point(
    problem: Posed, known_value: float | None, point: Mapping[str, float], is_trusted: bool
) -> Iterator[Solution]:
    """Yield designs reached from a point: optima, the nearest feasible one, or the point itself if it is trusted."""
    yield _solve(problem, near=point)
    note = "the solver does not converge from the design that branch and bound found, or converges to a worse one"
    point_design = evaluate_design(problem, point, note)
    if relative_gain(problem, known_value, point_design.value) <= _MIN_GAIN:  # this value includes the worst cases
        return
    yield _solve(problem.derive(start=point))
    ranges = [f"(({n} - ({point[n]!r})) / {hi - lo!r})**2" for n, (lo, hi) in problem.free.items()]
    nearest_problem = problem.derive(minimize=" + ".join(ranges), maximize=None, start={})
    nearest = _solve(nearest_problem, starts=1, near=point)
    if nearest.status == "optimal":
        yield evaluate_design(problem, {n: nearest.parameters[n] for n in problem.free}, note)
    elif is_trusted:
        yield point_design


def _solve(problem: Posed, starts: int = _STARTS, near: Mapping[str, float] | None = None) -> Solution:
    return solve(problem, starts=starts, near=near, throw=False, alone=False, stability=0.0, interruptible=False)


def relative_gain(problem: Posed, known_value: float | None, value: float) -> float:
    """Relative improvement of the objective; inf without a known value, −inf for a value that is not finite."""
    if known_value is None or not math.isfinite(known_value):
        return math.inf
    if not math.isfinite(value):
        return -math.inf
    return problem.sign * (known_value - value) / max(MIN_SIZE, abs(known_value))
