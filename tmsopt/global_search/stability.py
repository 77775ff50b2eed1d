"""Decides in a few seconds by branch and bound whether any design of a box is stable, after a search found none."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.evaluation.recheck import Evaluation, recheck
from tmsopt.global_search.answer import Answer, Clock, answer_question, find_exclusion, is_excluded_by_solver
from tmsopt.global_search.question import Question, typical_size
from tmsopt.global_search.race import SolverPool
from tmsopt.global_search.scip import SCIP
from tmsopt.global_search.signs import has_no_stable_design
from tmsopt.global_search.tasks import FOUND, INFEASIBLE, SolverFailed
from tmsopt.problem.problem import Posed
from tmsopt.program.formulate import default_start
from tmsopt.progress import ReportCount

SOLVER = SCIP
"""The global solver in use, here and in `certify`."""

_MARGIN = 1e-3  # relative to the typical size of the roots: decay that the second question requires
_PROOF_SHARE = 0.7  # share of the time for the first question, the proof
_ACCEPT_ANY = partial(Answer, FOUND, None)  # accepts every point that the solver finds


@dataclass(frozen=True)
class Stability:
    """Whether any design is stable.

    Attributes:
        exists: True if a recheck confirms that `design` is stable, False if it is proved that no design is, else None.
        design: free parameters of a stable design; it may violate a limit by the solver's tolerance.
        proof: the kind of proof, in words.
        failure: the error of the solver, or empty.
    """

    exists: bool | None = None
    design: Mapping[str, float] | None = None
    proof: str = ""
    failure: str = ""


def find_stable_design(
    problem: Posed,
    seconds: float,
    known_design: Mapping[str, float] | None = None,
    progress: ReportCount | None = None,
) -> Stability:
    """Decide whether any design of the box has all roots left of the axis in every case listed.

    The design must satisfy the pattern and all constraints except those on the roots. The proof must also exclude roots
    on the axis, so nothing is decided if the best designs have such roots. The proof is in floating-point arithmetic,
    to the solver's tolerance.

    Args:
        seconds: time limit of the solver; the start of its processes does not count.
        known_design: parameters of the best known design; a question that excludes this design proves nothing.
        progress: called with the seconds used and the seconds granted.

    Raises:
        KeyboardInterrupt: if the user presses Ctrl-C.
    """
    if has_no_stable_design(problem):
        return Stability(False, proof="by signs of coefficients, in interval arithmetic")
    if not SOLVER.is_available or not problem.free:
        return Stability()
    constraints = {n: text for n, text in problem.constraints.items() if n not in problem.asked_of_roots}
    relaxation = problem.derive(minimize="abscissa", maximize=None, pareto=(), constraints=constraints)
    evaluation = _recheck_point(
        relaxation, {n: known_design[n] for n in problem.free} if known_design else default_start(problem)
    )
    unit = typical_size(evaluation.structure.roots)
    axis_question = Question(relaxation, relaxation.cases, 0.0, unit)
    with SolverPool(SOLVER) as pool:
        clock = Clock(seconds, pool, progress)
        try:
            answer = answer_question(axis_question, clock, _PROOF_SHARE, _ACCEPT_ANY)
            is_proved = answer.verdict == INFEASIBLE
            if is_proved and known_design is not None and not evaluation.violations:
                is_proved = _is_admitted(axis_question, evaluation, known_design, clock)
            # A point with roots on the axis does not decide the question.
            if answer.verdict == FOUND and _judge_point(relaxation, answer.point).design is None:
                answer = answer_question(replace(axis_question, limit=-_MARGIN * unit), clock, 1.0, _ACCEPT_ANY)
        except UnsupportedOperation:
            return Stability()
        except SolverFailed as error:
            return Stability(failure=f"{SOLVER.name} failed: {error}")
    if clock.interrupted:
        raise KeyboardInterrupt
    method_text = f"in floating-point arithmetic, by {SOLVER.name}, feasibility tolerance {SOLVER.tolerance:.0e}"
    return Stability(False, proof=method_text) if is_proved else _judge_point(relaxation, answer.point)


def _recheck_point(problem: Posed, design: Mapping[str, float]) -> Evaluation:
    return recheck(problem, problem.ordered(design))


def _judge_point(problem: Posed, design: Mapping[str, float] | None) -> Stability:
    """Decide by a recheck whether a point that the solver found is stable."""
    if design is not None:
        evaluation = _recheck_point(problem, design)
        if max(evaluation.structure.abscissa, evaluation.abscissa_realised) < 0:
            return Stability(None if evaluation.violations else True, design)
    return Stability()


def _is_admitted(question: Question, evaluation: Evaluation, known_design: Mapping[str, float], clock: Clock) -> bool:
    """Whether the question and the solver admit a known design, for a line just right of its roots."""
    design = {n: known_design[n] for n in question.problem.free}
    wider_question = replace(question, limit=evaluation.structure.abscissa + _MARGIN * question.unit)
    return not find_exclusion(wider_question, design) and not is_excluded_by_solver(wider_question, design, clock)
