"""Turn the best end of a search into a design with a status."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tmsopt.evaluation import find_worst_cases
from tmsopt.evaluation.bound import instant_bound, minimizes_abscissa
from tmsopt.evaluation.recheck import Evaluation, recheck
from tmsopt.evaluation.worst_case import WorstCase
from tmsopt.problem import Case, Posed, Relaxation, Starts, degrees_of_freedom
from tmsopt.problem.solution import OtherBranch
from tmsopt.program import NLP, choose_starts, formulate_by_factors, formulate_matching, initial_point
from tmsopt.program.ipopt import Point, relaxation_gain
from tmsopt.records import Array, Table
from tmsopt.roots import Root
from tmsopt.search.acceptance import has_converged, has_matching_claim, recheck_inside_box
from tmsopt.search.newton import find_solutions
from tmsopt.search.state import CheckedEnd, SearchState
from tmsopt.search.tuning import Tuning

_MIN_MULTIPLIER = 1e-9  # a limit with a smaller multiplier is not active
_AT_BOUND = 1e-10  # relative to a range: largest distance of an active bound from the point where IPOPT stopped
_BRANCH_STARTS = 12  # starts of the search for other solutions
_LIMIT_EXCESS = 1e-9  # excess above which a limit excludes a solution
_SAME_BRANCH = 1e-6  # relative difference of parameters up to which two solutions are the same
_COEFFICIENT_ERROR = 1e-8  # relative error of a coefficient that depends steeply on rounded parameters
_ZERO_ROOT = 1e-14  # relative to the largest root: a smaller root is 0 up to rounding
_A0_STEP = 1e-3  # relative to a range: step that tests whether a0 depends on a parameter

UNCLEAR = "rounding of the coefficients makes the roots unreliable; keep a0 and the roots away from 0 by constraints"
UNBOUNDED = (
    "the objective seems unbounded: this design is far better than all others; add a constraint on its denominators"
)
BETTER_END = "the design where one local search stopped; it may be no optimum, but it is better than the optima found"
BEST_SAMPLED = "the best design that was looked at; no local search ended at an equally good design"


@dataclass(frozen=True)
class Outcome:
    """A design with its status.

    Attributes:
        checked: the result of the recheck.
        active_gains: active limit → how much the objective improves per unit of relaxation; see `find_active_limits`.
        cases: the cases in which the design was checked.
        has_no_best_design: whether no design is the best, because designs improve without end.
    """

    parameters: Mapping[str, float]
    checked: Evaluation
    status: str
    active_gains: Mapping[str, float]
    starts: Starts
    formulation: str
    cases: tuple[Case, ...] = ()
    branches: tuple[OtherBranch, ...] = ()
    notes: tuple[str, ...] = ()
    relaxation: Relaxation | None = None
    has_no_best_design: bool = False


def assess_best(state: SearchState, starts: Starts, cases: Sequence[Case] | None = None) -> Outcome | None:
    """Return the best design of a search with its status; None if it is infeasible.

    Args:
        cases: cases in which the design is checked; by default the cases of its program.
    """
    if state.best is None:
        return None
    problem, trial = state.problem, recheck_inside_box(state, state.best)
    parameters, nlp = trial.parameters, trial.end.nlp
    checked = trial.checked if cases is None else recheck(problem, parameters, cases)
    freedom, is_violated = degrees_of_freedom(problem), bool(checked.violations)
    if sum(checked.violations.values()) > state.tuning.rounding_violation and freedom.count >= 0:
        return None
    notes, status = _find_doubts(problem, trial, checked), "not_converged"
    if not (notes or is_violated):
        # On a plateau the gradient shows no optimum, but a proven bound does.
        is_at_bound = minimizes_abscissa(problem) and instant_bound(problem, checked.objective).proven
        if has_converged(trial) or is_at_bound:
            status = "optimal"
        else:
            notes = ("feasible, but the solver did not converge: a better design may be close",)
    if freedom.kind == "over-determined" and is_violated:
        status = "infeasible"
        surplus = f"{freedom.conditions} conditions for {freedom.free} free parameters"
        notes += (f"{surplus} are inconsistent{_suggest_balance(problem, -freedom.count)}",)
    branches: tuple[OtherBranch, ...] = ()
    if freedom.kind == "square" and problem.model.polynomial is not None:
        equations = formulate_matching(problem) if problem.pattern else formulate_by_factors(problem)
        branches = _find_other_branches(problem, nlp if not nlp.kinks else equations, parameters)
    active_gains = find_active_limits(problem, nlp, trial.point)
    checked_cases = tuple(nlp.cases if cases is None else cases)
    return Outcome(parameters, checked, status, active_gains, starts, nlp.formulation, checked_cases, branches, notes)


def _find_doubts(problem: Posed, trial: CheckedEnd, checked: Evaluation) -> tuple[str, ...]:
    """Return reasons why a design does not count as an optimum, even if the solver reports one."""
    if is_unclear(problem, checked):
        return (UNCLEAR,)
    if problem.objective is not None and not math.isfinite(checked.objective):
        return (
            "the objective has no value at the design where the search ended; add a constraint on its denominators",
        )
    if has_matching_claim(problem, trial):
        return ()
    claim = problem.sign * trial.end.objective
    return (f"the solver's objective {claim:.9g} differs from the design's objective {checked.objective:.9g}",)


def assess_design(problem: Posed, design: Mapping[str, float], note: str = "", is_fixed: bool = False) -> Outcome:
    """Recheck a design that is no end of a search. Its status is ``infeasible`` or ``not_converged``.

    Args:
        is_fixed: whether no parameter is free; then the status is ``infeasible`` or ``optimal``.
    """
    parameters = problem.ordered(design)
    cases = merge_cases(problem, find_worst_cases(problem, parameters) if problem.cases else {})
    checked = recheck(problem, parameters, cases)
    status = "infeasible" if checked.violations else "optimal" if is_fixed else "not_converged"
    return Outcome(parameters, checked, status, {}, Starts(), "none", cases, notes=(note,) if note else ())


def _suggest_balance(problem: Posed, missing_count: int) -> str:
    """Suggest how to get as many free parameters as conditions; empty if no change can do that."""
    suggestions = [f"free {missing_count} more"] if len(problem.fixed) >= missing_count else []
    suggestions += ["drop a constraint"] if any(c.equality for c in problem.conditions.values()) else []
    return f"; {', or '.join(suggestions)}" if suggestions else ""


def write_mass_advice(problem: Posed) -> str:
    """Advise how to keep the mass matrix regular, in the names of the model."""
    quantities = {"tms": "nu_H and zeta_B", "whipple": "mass_margin"}
    return f"keep {quantities.get(problem.model.name, 'a0')} away from 0 by a constraint"


def choose_outcome(problem: Posed, outcomes: Sequence[Outcome | None], tuning: Tuning) -> Outcome | None:
    """Return the best outcome; None if there is none."""
    best: Outcome | None = None
    for outcome in outcomes:
        if outcome and (best is None or _is_better(problem, outcome, best, tuning)):
            best = outcome
    return best


def _is_better(problem: Posed, candidate: Outcome, other: Outcome, tuning: Tuning) -> bool:
    """Whether an outcome is better than another: by feasibility, by the objective, then by the status ``optimal``."""
    a, b = (problem.sign * outcome.checked.objective for outcome in (candidate, other))
    has_no_violations = not (candidate.checked.violations or other.checked.violations)
    if (
        has_no_violations
        and math.isfinite(a)
        and math.isfinite(b)
        and not math.isclose(a, b, rel_tol=tuning.claim_tolerance)
    ):
        return a < b

    def rank(outcome: Outcome, value: float) -> tuple[bool, bool, float]:
        is_doubtful = bool(outcome.checked.violations) or math.isinf(value)
        return is_doubtful, outcome.status != "optimal", value if math.isfinite(value) else 0.0

    return rank(candidate, a) < rank(other, b)


def is_unclear(problem: Posed, checked: Evaluation) -> bool:
    """Whether rounding makes the roots unreliable.

    This is so if the abscissa of the stored numbers differs from the abscissa of the ideal multiple roots by more than
    rounding explains: the relative error of an m-fold root may be (rounding error)^(1/m). It is also so if the problem
    uses damping ratios and several roots are 0 up to rounding, because a root 0 has no damping ratio.
    """
    roots = checked.structure.roots
    if not roots or not math.isfinite(checked.abscissa_realised):
        return False
    sizes = sorted(r.size for r in roots)
    has_damping_limits = any("damping_ratio" in e.names for e in (problem.objective, *problem.conditions.values()) if e)
    if has_damping_limits and any(r.multiplicity > 1 and 0 < r.size < _ZERO_ROOT * sizes[-1] for r in roots):
        return True
    errors = (r.size * _COEFFICIENT_ERROR ** (1 / r.multiplicity) for r in roots)
    scatter = max(errors) + _ZERO_ROOT * sizes[-1]
    return bool(abs(checked.structure.abscissa - checked.abscissa_realised) > scatter)


def find_active_limits(problem: Posed, nlp: NLP, point: Point) -> dict[str, float]:
    """Return for each active constraint or bound how much the objective improves per unit of relaxation.

    For an equality constraint, return the change of the objective per unit added to its right-hand side. A constraint
    that is active in several cases is relaxed in all of them.
    """
    if problem.objective is None:
        return {}
    gain, gains, inequalities = relaxation_gain(nlp, point), dict[str, float](), dict[str, list[int]]()
    for k, (row, multiplier) in enumerate(zip(nlp.rows, point.row_multipliers.tolist(), strict=True)):
        if row in problem.constraints and abs(multiplier) > _MIN_MULTIPLIER:
            if nlp.row_lower[k] == nlp.row_upper[k]:
                gains[row] = gains.get(row, 0.0) - problem.sign * multiplier
            else:
                inequalities.setdefault(row, []).append(k)
    gains |= {name: gain(rows) for name, rows in inequalities.items()}
    for k, (name, ends) in enumerate(problem.free.items()):
        x, tangent = float(point.x[k]), problem.parameter_set[name].tangent
        lower, upper = (float(np.tan(end)) if tangent else end for end in ends)
        lower_gap, upper_gap = abs(x - lower), abs(x - upper)
        # The end 0 of a part of the box is no bound of the problem, although it may have a multiplier.
        is_at_end = min(lower_gap, upper_gap) <= _AT_BOUND * (upper - lower)
        if abs(point.bound_multipliers[k]) > _MIN_MULTIPLIER and is_at_end:
            slope = 1 + x * x if tangent else 1.0  # d tan λ/dλ
            gains[f"{name}.{'max' if upper_gap < lower_gap else 'min'}"] = gain([len(nlp.rows) + k]) * slope
    return gains


def _find_other_branches(problem: Posed, nlp: NLP, design: Mapping[str, float]) -> tuple[OtherBranch, ...]:
    """Find other solutions of the equations, each with the limits that it violates."""
    branches, names = list[OtherBranch](), list(problem.free)
    is_tangent = [problem.parameter_set[n].tangent for n in names]
    known_branches = [np.array([design[n] for n in names])]
    starts = (initial_point(nlp, problem, start) for start in choose_starts(problem, 0, _BRANCH_STARTS))
    for x in find_solutions(nlp, starts, len(names)):
        values = np.where(is_tangent, np.arctan(x[: len(names)]), x[: len(names)])
        if all(np.abs(values - k).max() > _SAME_BRANCH * (1 + np.abs(k).max()) for k in known_branches):
            known_branches.append(values)
            parameters = problem.ordered(dict(zip(names, values.tolist(), strict=True)))
            branches.append(OtherBranch(Table(parameters), _find_violated_limits(problem, nlp, x)))
    return tuple(sorted(branches, key=lambda b: len(b.excluded_by)))


def _find_violated_limits(problem: Posed, nlp: NLP, x: Array) -> tuple[str, ...]:
    """Names of the bounds and constraints that a solution violates."""
    values, size, names = np.array([*x, *nlp.evaluate(x)[1]]), len(problem.free), dict[str, None]()
    is_below = values < np.array([*nlp.lower, *nlp.row_lower]) - _LIMIT_EXCESS
    is_outside = is_below | (values > np.array([*nlp.upper, *nlp.row_upper]) + _LIMIT_EXCESS)
    limit_names = (*problem.free, *nlp.variables[size:], *nlp.rows)
    for k in np.flatnonzero(is_outside).tolist():
        names[limit_names[k] if k >= size else f"{limit_names[k]}.{'min' if is_below[k] else 'max'}"] = None
    return tuple(names)


def demote_if_unbounded(state: SearchState, outcome: Outcome) -> Outcome:
    """Demote an optimum where the objective has no best value; otherwise return the outcome unchanged.

    The objective has no best value if a root is almost at infinity and no active limit stops it there. If the objective
    seems unbounded, an outcome that is not ``optimal`` gets the note `UNBOUNDED`.
    """
    problem, value = state.problem, state.problem.sign * outcome.checked.objective
    if problem.objective is None or outcome.checked.violations:
        return outcome
    if state.sample and math.isfinite(value) and value < -state.tuning.unbounded_spreads * state.sample.spread < 0:
        if outcome.status == "optimal":
            return outcome
        return replace(outcome, has_no_best_design=True, notes=(UNBOUNDED,))
    has_runaway = has_runaway_root(outcome.checked.structure.roots, state.tuning.infinite_root_size)
    if (
        outcome.status != "optimal"
        or not has_runaway
        or problem.model.polynomial is None
        or _is_a0_limited(problem, outcome)
    ):
        return outcome
    note = (
        f"no best design: the objective improves towards a singular mass matrix (a0 = 0); {write_mass_advice(problem)}"
    )
    return replace(outcome, status="not_converged", has_no_best_design=True, notes=(*outcome.notes, note))


def demote_if_beaten(state: SearchState, outcome: Outcome) -> Outcome:
    """Replace an optimum by the design where another start stopped, if this design is better in its own worst cases."""
    problem, tuning = state.problem, state.tuning
    if outcome.status != "optimal" or state.sample is None or problem.objective is None:
        return outcome
    box, objective = state.sample.box, problem.sign * outcome.checked.objective
    threshold = objective - tuning.better_by * (state.nlp.size + abs(objective))
    points = np.array([box.space.point(design) for design in state.designs]).reshape(-1, box.space.size)
    is_distinct = (
        np.abs(points - box.space.point(outcome.parameters)).max(axis=1, initial=0.0) > tuning.same_design_distance
    )
    rivals = box.judge_points(points[is_distinct]).select_better(threshold).take_best(tuning.rival_starts)
    for design in box.designs(rivals):
        rival = assess_design(problem, design, BETTER_END)
        checked = rival.checked
        # Counting several roots as one multiple root may improve the objective by this difference.
        merging_gain = abs(checked.structure.abscissa - checked.abscissa_realised)
        is_sound = not checked.violations and not is_unclear(problem, checked)
        if is_sound and problem.sign * checked.objective < threshold - merging_gain:
            return replace(rival, starts=outcome.starts, formulation=outcome.formulation)
    return outcome


def has_runaway_root(roots: Sequence[Root], ratio: float) -> bool:
    """Whether a nonzero root is so much larger than the others that a0 is almost 0."""
    sizes = sorted(size for r in roots if (size := r.size))
    return bool(sizes) and sizes[-1] > ratio * sizes[(len(sizes) - 1) // 2]


def _is_a0_limited(problem: Posed, outcome: Outcome) -> bool:
    """Whether no free parameter changes a0, or an active limit uses a parameter that changes a0."""
    limited_names = set[str]()
    for name in outcome.active_gains:
        condition = problem.conditions.get(name)
        limited_names |= set(condition.names) if condition else {name.rpartition(".")[0]}

    def can_move_a0(name: str) -> bool:
        low, high = problem.free[name]
        moved_design = {**outcome.parameters, name: outcome.parameters[name] + _A0_STEP * (high - low)}
        a0, moved_a0 = (float(problem.values(p).coefficients[0]) for p in (outcome.parameters, moved_design))
        return a0 != moved_a0

    a0_parameters = set(filter(can_move_a0, problem.free))
    # A quantity may depend on every parameter.
    return not a0_parameters or bool(limited_names & a0_parameters or limited_names - set(problem.free))


def merge_cases(problem: Posed, worst_cases: Mapping[str, WorstCase]) -> tuple[Case, ...]:
    """Return the listed cases and the worst cases."""
    return (*problem.cases, *(w.case for w in worst_cases.values())) if problem.cases else ()
