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
"""Gains are relative to the size of the objective, or to this if that is larger."""

_MIN_GAIN = 1e-7  # relative: a tenth of the smallest gap that is tried
_CERTAIN_GAIN = 1e-2  # relative: a violation of 1e-9 gains at most 0.006, for a fourth-order root
_STARTS = 4  # the point found, and others
_MAX_VIOLATION = 1e-3  # violation or loss beyond which a point is rejected


def is_feasible(design: Solution) -> bool:
    """Whether a solution meets all constraints, optimal or not."""
    valued = design.problem.posed.objective is None or math.isfinite(design.value)
    return design.status == "optimal" or (design.status == "not_converged" and not design.violations and valued)


def confirm_point(design: Solution, cases: Sequence[Case], point: Mapping[str, float]) -> Answer:
    """Solve from a point that branch and bound found, for a better design than the known one.

    If that fails, the feasible design nearest to the point may be better, without convergence. A point that is better
    only because it violates a limit within the solver's tolerance, or because cases are left out, gives no design.
    """
    problem = design.problem.posed
    known = design.value if is_feasible(design) and problem.objective is not None else None
    evaluation = recheck(problem, problem.ordered(point), cases)
    gain = relative_gain(problem, known, evaluation.objective)
    if max(evaluation.violations.values(), default=0.0) > _MAX_VIOLATION or gain < -_MAX_VIOLATION:
        return Answer(UNDECIDED)  # feasible within the solver's tolerance only
    exact = problem.pattern is None and not any(measure_excesses(problem, problem.ordered(point), cases).values())
    for found in _improve_point(problem, known, point, known is None or gain > _CERTAIN_GAIN or exact):
        if is_feasible(found) and relative_gain(problem, known, found.value) > _MIN_GAIN:
            note = "branch and bound found a feasible design that the search from many starts missed"
            if known is not None:
                before = unit_of(problem, problem.minimize or problem.maximize or "").show(known, 9)
                note = f"branch and bound found a better design than the search from many starts: {before} before"
            note = next((old for old in design.notes if old.startswith("branch and bound found a ")), note)
            notes = (*found.notes, note)
            kept = replace(found, problem=problem.problem, notes=notes, stable_elsewhere=design.stable_elsewhere)
            return Answer(FOUND, better=kept)
    return Answer(FOUND if known is not None and gain > _MIN_GAIN and not evaluation.violations else UNDECIDED)


def _improve_point(
    problem: Posed, known: float | None, point: Mapping[str, float], trusted: bool
) -> Iterator[Solution]:
    """Yield designs reached from a point: optima, the nearest feasible one, or the point itself if it is trusted."""
    yield _solve(problem, near=point)
    note = "the solver does not converge from the design that branch and bound found, or converges to a worse one"
    itself = evaluate_design(problem, point, note)
    if relative_gain(problem, known, itself.value) <= _MIN_GAIN:  # worst cases included
        return
    yield _solve(problem.derive(start=point))
    ranges = [f"(({n} - ({point[n]!r})) / {hi - lo!r})**2" for n, (lo, hi) in problem.free.items()]
    nearest = problem.derive(minimize=" + ".join(ranges), maximize=None, start={})
    moved = _solve(nearest, starts=1, near=point)
    if moved.status == "optimal":
        yield evaluate_design(problem, {n: moved.parameters[n] for n in problem.free}, note)
    elif trusted:
        yield itself


def _solve(problem: Posed, starts: int = _STARTS, near: Mapping[str, float] | None = None) -> Solution:
    return solve(problem, starts=starts, near=near, throw=False, alone=False, stability=0.0, interruptible=False)


def relative_gain(problem: Posed, known: float | None, value: float) -> float:
    """Relative improvement of the objective; inf without a known value, −inf for a value that is not finite."""
    if known is None or not math.isfinite(known):
        return math.inf
    if not math.isfinite(value):
        return -math.inf
    return problem.sign * (known - value) / max(MIN_SIZE, abs(known))
