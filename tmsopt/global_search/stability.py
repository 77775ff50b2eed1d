"""Whether any design in a box is stable: asked of branch and bound in a few seconds, for a search that found none."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.evaluation.recheck import Evaluation, recheck
from tmsopt.global_search.answer import Answer, Clock, answer, contradicted, doubt
from tmsopt.global_search.question import Question, unit_of
from tmsopt.global_search.race import SolverPool
from tmsopt.global_search.scip import SCIP
from tmsopt.global_search.signs import none_stable
from tmsopt.global_search.tasks import FOUND, INFEASIBLE, Failed
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import default_start
from tmsopt.progress import Counts

SOLVER = SCIP
"""Who is asked, here and for certificates."""

_MARGIN = 1e-3  # of the roots' usual size: a design found left of it is stable for certain
_SHARE = 0.7  # of the time, for the proof
_ANY = partial(Answer, FOUND, None)  # whatever design the solver found ends the question


@dataclass(frozen=True)
class Stability:
    """Whether any design is stable.

    Attributes:
        any: True where `design` is, by a recheck; False where it is proved that none is; None where it is not known.
        design: free parameters of a stable design, to be improved: it may be off in a limit by the solver's tolerance.
        proof: of what kind, in words.
        failed: why the solver said nothing, where that is an error of its own.
    """

    any: bool | None = None
    design: Mapping[str, float] | None = None
    proof: str = ""
    failed: str = ""


def any_stable(
    problem: Posed,
    seconds: float,
    known: Mapping[str, float] | None = None,
    progress: Counts | None = None,
) -> Stability:
    """Whether any design in the box has all its roots left of the axis, in every case that the problem lists.

    Its constraints and its pattern hold, but for constraints on the roots themselves. Refuted is more than is claimed:
    that all roots may lie left of the axis or on it. Where designs on the axis are the best there are, nothing is said.
    The proof is one in floating-point arithmetic, to the solver's tolerance.

    Args:
        seconds: at most, but for those that a process takes to start; without a global solver none pass.
        known: parameters of the best design known. A question that excludes what it should admit proves nothing.
        progress: called with the seconds that passed and those there are.

    Raises:
        KeyboardInterrupt: when the user stops it.
    """
    if none_stable(problem):
        return Stability(False, proof="by signs of coefficients, in interval arithmetic")
    if not SOLVER.available or not problem.free:
        return Stability()
    kept = {n: text for n, text in problem.constraints.items() if n not in problem.asked_of_roots}
    asked = problem.derive(minimize="abscissa", maximize=None, pareto=(), constraints=kept)
    best = _checked(asked, {n: known[n] for n in problem.free} if known else default_start(problem))
    unit = unit_of(best.structure.roots)
    at_axis = Question(asked, asked.cases, 0.0, unit)
    with SolverPool(SOLVER) as crew:
        clock = Clock(seconds, crew, progress)
        try:
            told = answer(at_axis, clock, _SHARE, _ANY)
            proved = told.verdict == INFEASIBLE
            if proved and known is not None and not best.violations:
                proved = _admits(at_axis, best, known, clock)
            if told.verdict == FOUND and _judged(asked, told.other).design is None:  # it is on the axis
                told = answer(replace(at_axis, limit=-_MARGIN * unit), clock, 1.0, _ANY)
        except UnsupportedOperation:
            return Stability()
        except Failed as error:
            return Stability(failed=f"{SOLVER.name} failed: {error}")
    if clock.interrupted:
        raise KeyboardInterrupt
    by = f"in floating-point arithmetic, by {SOLVER.name}, feasibility tolerance {SOLVER.tolerance:.0e}"
    return Stability(False, proof=by) if proved else _judged(asked, told.other)


def _checked(problem: Posed, design: Mapping[str, float]) -> Evaluation:
    return recheck(problem, problem.ordered(design))


def _judged(problem: Posed, design: Mapping[str, float] | None) -> Stability:
    """What a design says that the solver found."""
    if design is None or not max((checked := _checked(problem, design)).structure.abscissa, checked.realised) < 0:
        return Stability()
    return Stability(None if checked.violations else True, design)


def _admits(question: Question, best: Evaluation, known: Mapping[str, float], clock: Clock) -> bool:
    """Whether the question for a line just right of a known design admits that design, as put and as solved."""
    design = {n: known[n] for n in question.problem.free}
    wider = replace(question, limit=best.structure.abscissa + _MARGIN * question.unit)
    return not doubt(wider, design) and not contradicted(wider, design, clock)
