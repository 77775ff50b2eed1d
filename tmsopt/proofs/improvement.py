"""What becomes of a design that branch and bound found: the answer, where it is feasible and better at all."""

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

FLOOR = 0.1
"""Of an objective: it is compared in units of its own size or of this."""

_BETTER = 1e-7  # relative gain that counts as one: a tenth of the least that is asked for
_SURE = 1e-2  # gain that no violation of 1e-9 explains: of a fourth-order root it makes 0.006
_STARTS = 4  # from the design that the solver found, and others
_NEARLY = 1e-3  # violation and loss beyond which a design that the solver found is none


def feasible(design: Solution) -> bool:
    """Whether a solution is a design that does all that is asked, an optimum or not."""
    valued = design.problem.posed.objective is None or math.isfinite(design.value)
    return design.status == "optimal" or (design.status == "not_converged" and not design.violations and valued)


def confirmed(design: Solution, cases: Sequence[Case], point: Mapping[str, float]) -> Answer:
    """What a point that branch and bound found leads to: a better design than the one at hand, or nothing.

    It is solved from there. Where that ends no better, the feasible design nearest to the point is one, not converged.
    What is better only while it violates a limit, if by no more than the solver's tolerance, or while cases between
    those of the question are left out, is none: then the question is answered, and of no use.
    """
    problem = design.problem.posed
    known = design.value if feasible(design) and problem.objective is not None else None
    seen = recheck(problem, problem.ordered(point), cases)
    gain = gained(problem, known, seen.objective)
    if max(seen.violations.values(), default=0.0) > _NEARLY or gain < -_NEARLY:
        return Answer(UNDECIDED)  # what the solver's tolerance made of it
    exact = problem.pattern is None and not any(measure_excesses(problem, problem.ordered(point), cases).values())
    for found in _reached(problem, known, point, known is None or gain > _SURE or exact):
        if feasible(found) and gained(problem, known, found.value) > _BETTER:
            words = "branch and bound found a feasible design that the search from many starts did not"
            if known is not None:
                before = unit_of(problem, problem.minimize or problem.maximize or "").show(known, 9)
                words = f"branch and bound found a better design than the search from many starts: {before} before"
            words = next((note for note in design.notes if note.startswith("branch and bound found a ")), words)
            notes = (*found.notes, words)
            kept = replace(found, problem=problem.problem, notes=notes, stable_elsewhere=design.stable_elsewhere)
            return Answer(FOUND, better=kept)
    return Answer(FOUND if known is not None and gain > _BETTER and not seen.violations else UNDECIDED)


def _reached(problem: Posed, known: float | None, point: Mapping[str, float], trusted: bool) -> Iterator[Solution]:
    """Designs to which a point leads: optima, the feasible one nearest to it, or itself if it is trusted."""
    yield _solved(problem, near=point)
    note = "the solver does not converge from the design that branch and bound found, or to a worse one"
    itself = evaluate_design(problem, point, note)
    if gained(problem, known, itself.value) <= _BETTER:  # in its own worst case
        return
    yield _solved(problem.derive(start=point))
    ranges = [f"(({n} - ({point[n]!r})) / {hi - lo!r})**2" for n, (lo, hi) in problem.free.items()]
    nearest = problem.derive(minimize=" + ".join(ranges), maximize=None, start={})
    moved = _solved(nearest, starts=1, near=point)
    if moved.status == "optimal":
        yield evaluate_design(problem, {n: moved.parameters[n] for n in problem.free}, note)
    elif trusted:
        yield itself


def _solved(problem: Posed, starts: int = _STARTS, near: Mapping[str, float] | None = None) -> Solution:
    return solve(problem, starts=starts, near=near, throw=False, alone=False, stability=0.0, interruptible=False)


def gained(problem: Posed, known: float | None, value: float) -> float:
    """Relative improvement of the objective; inf where none is known, −inf for a value that does not exist."""
    if known is None or not math.isfinite(known):
        return math.inf
    if not math.isfinite(value):
        return -math.inf
    return problem.sign * (known - value) / max(FLOOR, abs(known))
