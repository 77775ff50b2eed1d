"""How good a design is at best: bounds proved by spatial branch and bound, and better designs where it finds them."""

import math
from dataclasses import replace
from functools import partial

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.errors import Fault, InputError
from tmsopt.evaluation.bound import instant_bound
from tmsopt.evaluation.recheck import recheck
from tmsopt.global_search.answer import Clock, answer, contradicted, doubt
from tmsopt.global_search.question import Question, unit_of
from tmsopt.global_search.race import SolverPool
from tmsopt.global_search.stability import SOLVER
from tmsopt.global_search.tasks import INFEASIBLE, Failed
from tmsopt.problem.cases import Case
from tmsopt.problem.files import Given, as_solvable
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, ROOT_NAMES
from tmsopt.problem.solution import Bound, Solution
from tmsopt.program.formulate import Builder
from tmsopt.progress import Listener, begin, steps_for
from tmsopt.proofs.improvement import FLOOR, confirmed, feasible
from tmsopt.search.solve import solve_if_needed

SECONDS = 60.0
"""Time for a proof, by default."""

PROVEN = 1e-4
"""Gap, relative to the objective or to 0.1, below which branch and bound counts as a proof of global optimality."""

_FINER = 1e-6  # proved next: closer to SCIP's own tolerance a smaller gap would be an illusion
_COARSER = (1e-2, 1e-1, 1.0, 10.0)  # proved where the first cannot be
_STEPS = (1.0, 0.1, 1e-2, 1e-3, PROVEN)
_CLOSE = 1.5  # ratio of a gap proved and one not proved that is not worth narrowing
_SHARE = 0.6  # of the time that is left, for a gap that is not the last one to be tried


def certify(design: Given, *, seconds: float = SECONDS, progress: Listener | None = None) -> Solution:
    """The same design with a bound that no design of the box can beat; or a better design, where one is found.

    SCIP is asked whether any design does better than this one by a gap; the answer no is the bound. It is a proof in
    floating-point arithmetic, to its feasibility tolerance. Of an infeasible problem, it is a proof that it is. Of the
    robustness radius there is none.

    Args:
        design: what `solve` found, with throw=False where that is no optimum; or a problem or its file, solved first.
        seconds: for the whole proof.
        progress: called with a `tmsopt.Progress` now and then, its note the best value and the gap that is proved.

    Raises:
        InputError: where SCIP is not installed, for a time that is not positive, or for a problem that asks nothing.

    Example:
        >>> bound = tmsopt.certify("problems/ziegler.toml").bound  # Ziegler (1952): 41/28 + 0.1²/2 = 1.469286
        >>> bound.proven, bound.method, 1.469285 < bound.value < 1.4695
        (True, 'scip', True)

    More: docs/how_to/certify.md
    """
    check_installed()
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0 < seconds < math.inf:
        raise InputError([Fault(f"found {seconds!r}; accepted: a positive number of seconds", ("seconds",))])
    found = solve_if_needed(design, progress)
    problem = as_solvable(found)
    if not problem.free:
        return _noted(found, "nothing is free, so there is nothing to bound")
    if problem.objective is None and feasible(found):
        return _noted(found, "nothing is minimised or maximised, so there is nothing to bound")
    if problem.asks_radius:
        return _noted(found, f"branch and bound cannot take {RADIUS}, which has a search of its own")
    with SolverPool(SOLVER) as crew:
        steps = steps_for(progress)
        clock = Clock(seconds, crew, steps)
        try:
            begin(steps, "bounding the optimum", "s")
            replaced = True
            while replaced and not (problem.objective is None and feasible(found)):
                found, replaced = (_bounded if feasible(found) else _excluded)(found, clock)
        except UnsupportedOperation as error:
            return _in_vain(found, f"branch and bound cannot take {error}, so there is no bound")
        except Failed as error:
            return _in_vain(found, f"{SOLVER.name} failed: {error}; so there is no bound")
        except KeyboardInterrupt:
            clock.interrupted = True
        return replace(_noted(found, "the proof was interrupted"), interrupted=True) if clock.interrupted else found


def check_installed() -> None:
    """Refuse where the global solver is missing.

    Raises:
        InputError: with what to install.
    """
    if not SOLVER.available:
        raise InputError([Fault(SOLVER.missing, ("certify",))])


def _bounded(design: Solution, clock: Clock) -> tuple[Solution, bool]:
    """A feasible design with the smallest gap that can be proved, or a better one in its place."""
    known = _known(design)
    if known.proven:
        return replace(design, bound=known), False
    admitted = _question(design, -PROVEN)
    if words := doubt(admitted, _free(design)):
        return _in_vain(design, f"no bound: {words}"), False
    if contradicted(admitted, _free(design), clock):
        return _in_vain(design, f"no bound: {SOLVER.name}'s relaxation excludes the design that was found"), False
    proved, failed = math.inf, 0.0
    converged = design.status == "optimal"
    while (level := _next(proved, failed, converged)) is not None and clock.left > 0:
        share = 1.0 if level in (_FINER, _COARSER[-1]) else _SHARE
        clock.note = _told(design, min(known.gap, _gap(design.value, proved)), level)
        answered = answer(_question(design, level), clock, share, partial(confirmed, design, _cases(design)))
        if answered.better is not None:
            return answered.better, True
        if answered.verdict == INFEASIBLE:
            proved = level
        else:
            failed = level
    return replace(design, bound=_stronger(design, known, _bound(design, proved, clock))), False


def _told(design: Solution, gap: float, level: float) -> str:
    """How good the design is known to be, and what is asked next."""
    bound = design.value - design.problem.posed.sign * gap
    known = f"gap {gap:.2g}, bound {bound:.6g}" if math.isfinite(gap) else "no bound"
    return f"{known}, best {design.value:.6g}; asking for {_gap(design.value, level):.2g}"


def _next(proved: float, failed: float, converged: bool) -> float | None:
    """The gap to try after the least one proved and the last one not proved; None when that is enough.

    A design that did not converge is left by large steps first, for each step leads to no more than a design.
    """
    if not converged and failed == 0:
        return next((level for level in _STEPS if level < proved), None)
    if proved == math.inf:
        return next((level for level in (PROVEN, *_COARSER) if level > failed), None)
    if failed == 0:
        return _FINER if proved > _FINER else None
    if proved <= PROVEN or proved < _CLOSE * failed:
        return None
    return max(PROVEN, math.sqrt(proved * failed))


def _excluded(design: Solution, clock: Clock) -> tuple[Solution, bool]:
    """No design was found: the proof that there is none, or one after all."""
    if design.bound.proven:
        return design, False
    clock.note = "whether there is any design"
    answered = answer(_question(design, None), clock, 1.0, partial(confirmed, design, _cases(design)))
    if answered.better is not None:
        return answered.better, True
    if answered.verdict == INFEASIBLE:
        if not recheck(design.problem.posed, design.parameters, _cases(design)).violations:
            words = f"no proof: {SOLVER.name}'s relaxation excludes the feasible design that was found"
            return _in_vain(design, words), False
        bound = _searched(design.problem.posed.sign * math.inf, 0.0, True, clock)
        return replace(design, status="infeasible", bound=bound), False
    words = "branch and bound did not decide in time whether any design is feasible"
    return _noted(replace(design, bound=_bound(design, math.inf, clock)), words), False


def _known(design: Solution) -> Bound:
    """The bound there is without a search, found anew; a damping ratio is at most 1, a frequency at least 0."""
    if design.problem.posed.sense == "maximize" and (design.problem.maximize or "").strip() == "damping_ratio":
        gap = max(1.0 - design.value, 0.0)
        return Bound(1.0, gap, gap == 0, "definition")
    found, asked = design.problem.posed.objective, (design.problem.minimize or "").strip()
    if asked in (ANGULAR_FREQUENCY, "frequency") and found and ANGULAR_FREQUENCY in found.names:  # no name of a model's
        return Bound(0.0, design.value, design.value == 0, "definition")
    bound = instant_bound(design.problem.posed, design.value)
    return bound if math.isfinite(bound.value) else _over_the_box(design)


def _over_the_box(design: Solution) -> Bound:
    """The range of an objective that is none of the roots, by interval arithmetic."""
    problem = design.problem.posed
    if problem.objective is None or set(problem.objective.names) & set(ROOT_NAMES) or not math.isfinite(design.value):
        return Bound()
    build = Builder(problem, _cases(design))
    build.add_objective()
    lower, upper = build.enclose([build.objective])[0]  # of the negative, where it is maximised
    sense = problem.sign
    gap = max(sense * design.value - lower, 0.0)
    return Bound(sense * lower, gap, gap == 0, "interval") if math.isfinite(lower) and upper >= lower else Bound()


def _question(design: Solution, level: float | None) -> Question:
    """Whether any design is better by a gap of some level; None for whether there is any."""
    limit = None if level is None else design.value - design.problem.posed.sign * _gap(design.value, level)
    return Question(design.problem.posed, _cases(design), limit, unit_of(design.of_polynomial.roots))


def _bound(design: Solution, level: float, clock: Clock) -> Bound:
    """What has been proved."""
    gap = _gap(design.value, level)
    sign = design.problem.posed.sign
    value = design.value - sign * gap if math.isfinite(gap) else -sign * math.inf
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


def _gap(value: float, level: float) -> float:
    return level * max(FLOOR, abs(value))


def _free(design: Solution) -> dict[str, float]:
    return {name: design.parameters[name] for name in design.problem.free}


def _cases(design: Solution) -> tuple[Case, ...]:
    """The cases listed, and those found to be the worst ones between them."""
    listed = design.problem.posed.cases
    worst = [case for case in (design.worst, design.least_damped) if case is not None and case not in listed]
    return (*listed, *dict.fromkeys(worst)) if listed else ()


def _in_vain(design: Solution, words: str) -> Solution:
    """Noted, with the solver's name beside the bound and no time: more of it would come to no more."""
    return replace(_noted(design, words), bound=replace(design.bound, solver=SOLVER.name))


def _noted(design: Solution, words: str) -> Solution:
    return replace(design, notes=(*design.notes, words))
