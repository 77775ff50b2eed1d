"""Proves bounds on the optimum by spatial branch and bound, and improves the design if it finds a better one."""

import math
from dataclasses import replace
from functools import partial

from tmsopt.algebra.formula import UnsupportedOperation
from tmsopt.errors import Fault, InputError
from tmsopt.evaluation.bound import instant_bound
from tmsopt.evaluation.recheck import recheck
from tmsopt.global_search.answer import Clock, answer_question, find_exclusion, is_excluded_by_solver
from tmsopt.global_search.question import Question, typical_size
from tmsopt.global_search.race import SolverPool
from tmsopt.global_search.stability import SOLVER
from tmsopt.global_search.tasks import INFEASIBLE, SolverFailed
from tmsopt.problem.cases import Case
from tmsopt.problem.files import ProblemSource, as_solvable
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, RADIUS, ROOT_NAMES
from tmsopt.problem.real_form import real_form
from tmsopt.problem.solution import Bound, Solution
from tmsopt.program.formulate import Builder
from tmsopt.progress import Listener, begin, steps_for
from tmsopt.proofs.improvement import MIN_SIZE, confirm_point, is_feasible
from tmsopt.search.solve import solve_if_needed

SECONDS = 60.0
"""Default time limit of a proof."""

PROVEN = 1e-4
"""Gap, relative to the objective or to 0.1, up to which a bound counts as a proof of global optimality."""

_FINE_LEVEL = 1e-6  # gap tried after PROVEN; a smaller gap would be within SCIP's tolerance
_COARSE_LEVELS = (1e-2, 1e-1, 1.0, 10.0)  # gaps tried if PROVEN fails
_FIRST_LEVELS = (1.0, 0.1, 1e-2, 1e-3, PROVEN)  # gaps tried first for a design that did not converge
_MIN_RATIO = 1.5  # if smallest gap proved / largest gap not proved is less, no gap between them is worth the time
_TIME_SHARE = 0.6  # share of the time left that a gap gets, unless it is the last gap to try


def certify(design: ProblemSource, *, seconds: float = SECONDS, progress: Listener | None = None) -> Solution:
    """Prove a bound on the objective of every design in the box; return the design with this bound.

    SCIP decides whether any design is better than this one by more than a gap. If none is, the gap gives the bound. If
    SCIP finds a better design, the result is that design. The proof is in floating-point arithmetic, to SCIP's
    feasibility tolerance. For an infeasible problem, it is a proof that no design is feasible. The robustness radius is
    not supported.

    Args:
        design: a result of `solve`, which need not be optimal (throw=False); or a problem or its file, solved first.
        seconds: time limit of the whole proof.
        progress: called with a `tmsopt.Progress` now and then; its note has the best value and the proved gap.

    Raises:
        InputError: if SCIP is not installed, the time is not positive, or the problem has no objective or pattern.

    Example:
        >>> bound = tmsopt.certify("problems/ziegler.toml").bound  # Ziegler (1952): 41/28 + 0.1²/2 = 1.469286
        >>> bound.proven, bound.method, 1.469285 < bound.value < 1.4695
        (True, 'scip', True)

    More: docs/how_to/certify.md
    """
    check_installed()
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not 0 < seconds < math.inf:
        raise InputError([Fault(f"found {seconds!r}; accepted: a positive number of seconds", ("seconds",))])
    solution = solve_if_needed(design, progress)
    problem = as_solvable(solution)
    if not problem.free:
        return _add_note(solution, "nothing is free, so there is nothing to bound")
    if problem.objective is None and is_feasible(solution):
        return _add_note(solution, "nothing is minimised or maximised, so there is nothing to bound")
    if problem.asks_radius:
        return _add_note(solution, f"no bound: branch and bound does not support {RADIUS}")
    form = real_form(problem)
    return form.to_user(_prove_bound(form.to_real(solution), seconds, progress), problem)


def _prove_bound(solution: Solution, seconds: float, progress: Listener | None) -> Solution:
    """The solution of a problem with a polynomial, with the bound that can be proved in the time."""
    problem = solution.problem.posed
    with SolverPool(SOLVER) as pool:
        steps = steps_for(progress)
        clock = Clock(seconds, pool, steps)
        try:
            begin(steps, "bounding the optimum", "s")
            is_improved = True
            while is_improved and not (problem.objective is None and is_feasible(solution)):
                take_step = _bound_feasible if is_feasible(solution) else _prove_infeasible
                solution, is_improved = take_step(solution, clock)
        except UnsupportedOperation as error:
            return _note_failure(solution, f"no bound: branch and bound does not support {error}")
        except SolverFailed as error:
            return _note_failure(solution, f"{SOLVER.name} failed: {error}; there is no bound")
        except KeyboardInterrupt:
            clock.interrupted = True
        if clock.interrupted:
            solution = replace(_add_note(solution, "the proof was interrupted"), interrupted=True)
        return solution


def check_installed() -> None:
    """Check that the global solver is installed.

    Raises:
        InputError: if it is not; the message says what to install.
    """
    if not SOLVER.is_available:
        raise InputError([Fault(SOLVER.install_message, ("certify",))])


def _bound_feasible(design: Solution, clock: Clock) -> tuple[Solution, bool]:
    """Prove the smallest gap of a feasible design. Return (the design, False), or (a better design, True)."""
    known_bound = _instant_bound(design)
    if known_bound.proven:
        return replace(design, bound=known_bound), False
    question, point = _pose_question(design, -PROVEN), {name: design.parameters[name] for name in design.problem.free}
    if reason := find_exclusion(question, point):
        return _note_failure(design, f"no bound: {reason}"), False
    if is_excluded_by_solver(question, point, clock):
        return _note_failure(design, f"no bound: {SOLVER.name}'s relaxation excludes the known design"), False
    proved_level, failed_level = math.inf, 0.0
    has_converged = design.status == "optimal"
    while (level := _next_level(proved_level, failed_level, has_converged)) is not None and clock.seconds_left > 0:
        share = 1.0 if level in (_FINE_LEVEL, _COARSE_LEVELS[-1]) else _TIME_SHARE
        clock.note = _progress_note(design, min(known_bound.gap, _gap(design.value, proved_level)), level)
        confirm = partial(confirm_point, design, _cases(design))
        answer = answer_question(_pose_question(design, level), clock, share, confirm)
        if answer.better_solution is not None:
            return answer.better_solution, True
        if answer.verdict == INFEASIBLE:
            proved_level = level
        else:
            failed_level = level
    bound = _stronger_bound(design, known_bound, _proved_bound(design, proved_level, clock))
    return replace(design, bound=bound), False


def _progress_note(design: Solution, gap: float, level: float) -> str:
    """Write the progress note: the gap proved, the bound, the best value and the gap tried next."""
    bound = design.value - design.problem.posed.sign * gap
    bound_text = f"gap {gap:.2g}, bound {bound:.6g}" if math.isfinite(gap) else "no bound"
    return f"{bound_text}, best {design.value:.6g}; trying gap {_gap(design.value, level):.2g}"


def _next_level(proved_level: float, failed_level: float, has_converged: bool) -> float | None:
    """Choose the next level (relative gap) from the least level proved and the last one that failed; None to stop.

    A design that did not converge starts with large gaps, since each step is likely to lead to a better design.
    """
    if not has_converged and failed_level == 0:
        return next((level for level in _FIRST_LEVELS if level < proved_level), None)
    if proved_level == math.inf:
        return next((level for level in (PROVEN, *_COARSE_LEVELS) if level > failed_level), None)
    if failed_level == 0:
        return _FINE_LEVEL if proved_level > _FINE_LEVEL else None
    if proved_level <= PROVEN or proved_level < _MIN_RATIO * failed_level:
        return None
    return max(PROVEN, math.sqrt(proved_level * failed_level))


def _prove_infeasible(design: Solution, clock: Clock) -> tuple[Solution, bool]:
    """Prove that no design is feasible. Return (the infeasible design, False), or (a feasible design, True)."""
    if design.bound.proven:
        return design, False
    clock.note = "looking for a feasible design"
    problem, cases = design.problem.posed, _cases(design)
    answer = answer_question(_pose_question(design, None), clock, 1.0, partial(confirm_point, design, cases))
    if answer.better_solution is not None:
        return answer.better_solution, True
    if answer.verdict == INFEASIBLE:
        if not recheck(problem, design.parameters, cases).violations:
            reason = f"no proof: {SOLVER.name}'s relaxation excludes a known feasible design"
            return _note_failure(design, reason), False
        bound = _search_bound(problem.sign * math.inf, 0.0, True, clock)
        return replace(design, status="infeasible", bound=bound), False
    note = "branch and bound did not decide in time whether any design is feasible"
    return _add_note(replace(design, bound=_proved_bound(design, math.inf, clock)), note), False


def _instant_bound(design: Solution) -> Bound:
    """Return the best bound that needs no search; a damping ratio is at most 1, a frequency at least 0."""
    problem, value = design.problem.posed, design.value
    if problem.sign < 0 and problem.goal == "damping_ratio":
        gap = max(1.0 - value, 0.0)
        return Bound(1.0, gap, gap == 0, "definition")
    is_frequency = problem.sign > 0 and problem.goal in (ANGULAR_FREQUENCY, "frequency")
    # A model may have a parameter called frequency.
    if is_frequency and problem.objective and ANGULAR_FREQUENCY in problem.objective.names:
        return Bound(0.0, value, value == 0, "definition")
    bound = instant_bound(problem, value)
    return bound if math.isfinite(bound.value) else _interval_bound(design)


def _interval_bound(design: Solution) -> Bound:
    """Bound an objective that does not depend on the roots by interval arithmetic."""
    problem = design.problem.posed
    if problem.objective is None or set(problem.objective.names) & set(ROOT_NAMES) or not math.isfinite(design.value):
        return Bound()
    build = Builder(problem, _cases(design))
    build.add_objective()
    lower, upper = build.enclose([build.objective])[0]  # of minus the objective if it is maximised
    gap = max(problem.sign * design.value - lower, 0.0)
    return (
        Bound(problem.sign * lower, gap, gap == 0, "interval") if math.isfinite(lower) and upper >= lower else Bound()
    )


def _pose_question(design: Solution, level: float | None) -> Question:
    """Ask whether any design is better by a gap of this level; None asks whether any design is feasible."""
    problem = design.problem.posed
    limit = None if level is None else design.value - problem.sign * _gap(design.value, level)
    return Question(problem, _cases(design), limit, typical_size(design.roots))


def _proved_bound(design: Solution, level: float, clock: Clock) -> Bound:
    """The bound of a proved level."""
    gap = _gap(design.value, level)
    sign = design.problem.posed.sign
    value = design.value - sign * gap if math.isfinite(gap) else -sign * math.inf
    return _search_bound(value, gap, level <= PROVEN, clock)


def _search_bound(value: float, gap: float, proven: bool, clock: Clock) -> Bound:
    """Make a bound with the name of the solver, its time and its nodes."""
    name = SOLVER.name
    return Bound(value, gap, proven, name.lower(), clock.seconds_used, clock.nodes, SOLVER.tolerance, name)


def _stronger_bound(design: Solution, known_bound: Bound, search_bound: Bound) -> Bound:
    """The better of two bounds, with the time and nodes of the search."""
    if search_bound.gap <= known_bound.gap or not math.isfinite(known_bound.value):
        return search_bound
    proven = known_bound.gap <= _gap(design.value, PROVEN)
    return replace(search_bound, value=known_bound.value, gap=known_bound.gap, proven=proven, method=known_bound.method)


def _gap(value: float, level: float) -> float:
    """The absolute gap of a level."""
    return level * max(MIN_SIZE, abs(value))


def _cases(design: Solution) -> tuple[Case, ...]:
    """The listed cases, and the worst cases found between them."""
    listed_cases = design.problem.posed.cases
    worst_cases = [
        case for case in (design.worst, design.least_damped) if case is not None and case not in listed_cases
    ]
    return (*listed_cases, *dict.fromkeys(worst_cases)) if listed_cases else ()


def _note_failure(design: Solution, text: str) -> Solution:
    """Add a note on why there is no proof, and add the solver's name to the bound; more time would not help."""
    return replace(_add_note(design, text), bound=replace(design.bound, solver=SOLVER.name))


def _add_note(design: Solution, text: str) -> Solution:
    return replace(design, notes=(*design.notes, text))
