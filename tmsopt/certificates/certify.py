"""How good a design is at best: bounds proved by spatial branch and bound, and better designs where it finds them."""

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from tmsopt.arithmetic.walk import NotAccepted
from tmsopt.branch_and_bound.answer import Answer, Clock, SecondsPassed, answer, contradicted, doubt
from tmsopt.branch_and_bound.half_planes import over
from tmsopt.branch_and_bound.question import Question, unit_of
from tmsopt.branch_and_bound.race import Crew
from tmsopt.branch_and_bound.stability import SOLVER
from tmsopt.branch_and_bound.tasks import FOUND, INFEASIBLE, UNDECIDED
from tmsopt.checks.bound import instant_bound
from tmsopt.checks.recheck import recheck
from tmsopt.design.cases import Case
from tmsopt.design.files import Given, question_of
from tmsopt.design.problem import Problem
from tmsopt.design.quantities import ROOT_NAMES
from tmsopt.design.solution import Bound, Solution
from tmsopt.errors import Fault, InputError
from tmsopt.formulation.formulate import Builder
from tmsopt.solver.solve import solve, solved

SECONDS = 60.0
"""Time for a proof, by default."""

PROVEN = 1e-4
"""Gap, relative to the objective or to 0.1, below which branch and bound counts as a proof of global optimality."""

_FINER = 1e-6  # proved next: closer to SCIP's own tolerance a smaller gap would be an illusion
_COARSER = (1e-2, 1e-1, 1.0, 10.0)  # proved where the first cannot be
_FLOOR = 0.1
_CLOSE = 1.5  # ratio of a gap proved and one not proved that is not worth narrowing
_SHARE = 0.6  # of the time that is left, for a gap that is not the last one to be tried
_BETTER = 1e-9  # relative gain that counts as one
_REPLACED = 5  # times that a design is replaced by a better one
_STARTS = 4  # from the design that the solver found, and others
_NEARLY = 1e-3  # violation and loss beyond which a design that the solver found is none


def certify(design: Given, *, seconds: float = SECONDS, progress: SecondsPassed | None = None) -> Solution:
    """The same design with a bound that no design of the box can beat; or a better design, where one is found.

    SCIP is asked whether any design does better than this one by a gap; the answer no is the bound. It is a proof in
    floating-point arithmetic, to its feasibility tolerance. Of an infeasible problem, it is a proof that it is.

    Args:
        design: what `solve` found, with throw=False where that is no optimum; or a problem or its file, solved first.
        seconds: for the whole proof.
        progress: called with the seconds that passed and those there are.

    Raises:
        InputError: where SCIP is not installed, for a time that is not positive, or for a problem that asks nothing.
    """
    check_installed()
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0 < seconds < math.inf:
        raise InputError([Fault(f"found {seconds!r}; accepted: a positive number of seconds", ("seconds",))])
    found = solved(design)
    problem = question_of(found)
    if not problem.free:
        return _noted(found, "nothing is free, so there is nothing to bound")
    if problem.objective is None and found.status == "optimal":
        return _noted(found, "nothing is minimised or maximised, so there is nothing to bound")
    with Crew(SOLVER) as crew:
        clock = Clock(seconds, crew, progress)
        try:
            for _ in range(_REPLACED):
                found, replaced = (_bounded if found.status == "optimal" else _excluded)(found, clock)
                if not replaced:
                    break
        except NotAccepted as error:
            return _noted(found, f"branch and bound cannot take {error}, so there is no bound")
        return _noted(found, "the proof was interrupted") if clock.interrupted else found


def check_installed() -> None:
    """Refuse where the global solver is missing.

    Raises:
        InputError: with what to install.
    """
    if not SOLVER.available:
        raise InputError([Fault(SOLVER.missing, ("certify",))])


def _bounded(design: Solution, clock: Clock) -> tuple[Solution, bool]:
    """An optimum with the smallest gap that can be proved, or a better one in its place."""
    known = _known(design)
    if known.proven:
        return replace(design, bound=known), False
    admitted = _question(design, -PROVEN)
    if words := doubt(admitted, _free(design)):
        return _noted(design, f"no bound: {words}"), False
    if contradicted(admitted, _free(design), clock):
        return _noted(design, f"no bound: {SOLVER.name}'s relaxation excludes the design that was found"), False
    proved, failed = math.inf, 0.0
    while (level := _next(proved, failed)) is not None and clock.left > 0:
        share = 1.0 if level in (_FINER, _COARSER[-1]) else _SHARE
        answered = answer(_question(design, level), clock, share, partial(_from, design))
        if answered.better is not None:
            return answered.better, True
        if answered.other is not None:
            design = _beaten(design, answered.other)
        if answered.verdict == INFEASIBLE:
            proved = level
        else:
            failed = level
    return replace(design, bound=_stronger(design, known, _bound(design, proved, clock))), False


def _next(proved: float, failed: float) -> float | None:
    """The gap to try after the least one proved and the last one not proved; None when that is enough."""
    if proved == math.inf:
        return next((level for level in (PROVEN, *_COARSER) if level > failed), None)
    if failed == 0:
        return _FINER if proved > _FINER else None
    if proved <= PROVEN or proved < _CLOSE * failed:
        return None
    return max(PROVEN, math.sqrt(proved * failed))


def _excluded(design: Solution, clock: Clock) -> tuple[Solution, bool]:
    """No design was found: the proof that there is none, or one after all."""
    anything = Question(design.problem, _cases(design), None, unit_of(design.roots))
    answered = answer(anything, clock, 1.0, partial(_from, design))
    if answered.better is not None:
        return answered.better, True
    if answered.verdict == INFEASIBLE:
        if not recheck(design.problem, design.parameters, _cases(design)).violations:
            words = f"no proof: {SOLVER.name}'s relaxation excludes the feasible design that was found"
            return _noted(design, words), False
        none = -math.inf if design.problem.sense == "maximize" else math.inf
        bound = _searched(none, 0.0, True, clock)
        return replace(design, status="infeasible", bound=bound), False
    words = "branch and bound did not decide in time whether any design is feasible"
    left = replace(design, bound=_bound(design, math.inf, clock))
    return _beaten(left, answered.other) if answered.other else _noted(left, words), False


def _known(design: Solution) -> Bound:
    """The bound there is without a search, found anew; a damping ratio is at most 1."""
    if design.problem.sense == "maximize" and (design.problem.maximize or "").strip() == "damping_ratio":
        gap = max(1.0 - design.value, 0.0)
        return Bound(1.0, gap, gap == 0, "definition")
    bound = instant_bound(design.problem, design.value)
    return bound if math.isfinite(bound.value) else _over_the_box(design)


def _over_the_box(design: Solution) -> Bound:
    """The range of an objective that is none of the roots, by interval arithmetic."""
    problem = design.problem
    if problem.objective is None or set(problem.objective.names) & set(ROOT_NAMES) or not math.isfinite(design.value):
        return Bound()
    build = Builder(problem, _cases(design))
    build.optimise()
    lower, upper = over(build, [build.objective])[0]  # of the negative, where it is maximised
    sense = problem.sign
    gap = max(sense * design.value - lower, 0.0)
    return Bound(sense * lower, gap, gap == 0, "interval") if math.isfinite(lower) and upper >= lower else Bound()


def _question(design: Solution, level: float) -> Question:
    """Whether any design is better by a gap of some level."""
    limit = design.value - design.problem.sign * _gap(design.value, level)
    return Question(design.problem, _cases(design), limit, unit_of(design.roots))


def _bound(design: Solution, level: float, clock: Clock) -> Bound:
    """What has been proved."""
    gap = _gap(design.value, level) if math.isfinite(level) else math.inf
    value = design.value - design.problem.sign * gap if math.isfinite(gap) else -design.problem.sign * math.inf
    return _searched(value, gap, level <= PROVEN, clock)


def _searched(value: float, gap: float, proven: bool, clock: Clock) -> Bound:
    method, took = SOLVER.name.lower(), (clock.used, clock.nodes)
    return Bound(value, gap, proven, method, *took, tolerance=SOLVER.tolerance, solver=SOLVER.name)


def _stronger(design: Solution, known: Bound, searched: Bound) -> Bound:
    """The better of two bounds, with what the search took."""
    if searched.gap <= known.gap or not math.isfinite(known.value):
        return searched
    proven = known.gap <= _gap(design.value, PROVEN)
    return replace(searched, value=known.value, gap=known.gap, proven=proven, method=known.method)


def _from(design: Solution, start: Mapping[str, float]) -> Answer:
    """What a design that was found leads to: a better optimum, or itself, if it is feasible and better at all."""
    problem = design.problem
    known = design.value if not design.violations and problem.objective is not None else None
    seen = recheck(problem, problem.ordered(start), _cases(design))
    gain = _gain(problem, known, seen.objective)
    if max(seen.violations.values(), default=0.0) > _NEARLY or gain < -_NEARLY:
        return Answer(UNDECIDED)  # what the solver's tolerance made of it
    found = solve(replace(problem, start=start), starts=_STARTS, throw=False, stability=0.0)
    if found.status == "optimal" and _gain(problem, known, found.value) > _BETTER:
        before = "" if known is None else f": {known:.9g} before"
        words = f"branch and bound found a better design than the search from many starts{before}"
        return Answer(FOUND, better=_noted(replace(found, problem=problem), words))
    if not seen.violations and gain > _BETTER:
        return Answer(FOUND, other={**start, "objective": seen.objective})
    return Answer(UNDECIDED)


def _beaten(design: Solution, other: Mapping[str, float]) -> Solution:
    """The design, with the words that it is not the best one."""
    of = ", ".join(f"{name} = {value:.9g}" for name, value in other.items())
    words = f"not the best: branch and bound found {of}, from which the solver did not converge; start it from there"
    kept = tuple(note for note in design.notes if not note.startswith("not the best"))
    return replace(design, notes=(*kept, words))


def _gain(problem: Problem, known: float | None, value: float) -> float:
    """Relative improvement of the objective; inf where none is known, −inf for a value that does not exist."""
    if known is None or not math.isfinite(known):
        return math.inf
    if not math.isfinite(value):
        return -math.inf
    return problem.sign * (known - value) / max(_FLOOR, abs(known))


def _gap(value: float, level: float) -> float:
    return level * max(_FLOOR, abs(value))


def _free(design: Solution) -> dict[str, float]:
    return {name: design.parameters[name] for name in design.problem.free}


def _cases(design: Solution) -> tuple[Case, ...]:
    """The cases listed, and those found to be the worst ones between them."""
    listed = design.problem.cases
    worst = [case for case in (design.worst, design.least_damped) if case is not None and case not in listed]
    return (*listed, *dict.fromkeys(worst)) if listed else ()


def _noted(design: Solution, words: str) -> Solution:
    return replace(design, notes=(*design.notes, words))
