"""From where the starts ended to one design with its standing: polished, rechecked, ranked."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tmsopt.evaluation.bound import bounded, instant_bound
from tmsopt.evaluation.recheck import Evaluation, recheck
from tmsopt.evaluation.stored import multiple_roots_exist
from tmsopt.evaluation.worst_case import Worst, worst_cases
from tmsopt.problem.advice.remedies import Relaxation
from tmsopt.problem.cases import Case
from tmsopt.problem.problem import Posed
from tmsopt.problem.searches import Starts
from tmsopt.problem.solution import OtherBranch
from tmsopt.program.formulate import abscissa, design_of, matching
from tmsopt.program.ipopt import Point, gains, polisher
from tmsopt.program.nlp import NLP
from tmsopt.program.starts import designs, initial_point
from tmsopt.records import Array, Table
from tmsopt.search.multistart import optima, same_objective
from tmsopt.search.newton import solutions
from tmsopt.search.rescues import rescued_by
from tmsopt.search.workspace import LocalEnd, Workspace

_STATIONARY = 1e-6  # gradient of the Lagrangian at which a point counts as converged whatever IPOPT says
_MERGED = 1e-3  # of the objective: what a multiple root that is there for rounding alone may seem to gain
_ALIKE = 3  # candidates of one objective looked at closely
_EXACT, _POLISHED = 1e-8, 1e-9  # violation of rows and gradient, one of which a polished end is below
_CONVERGED = ("Solve_Succeeded", "Solved_To_Acceptable_Level", "Feasible_Point_Found")
_SPURIOUS = 1e-3  # violation that no lack of digits explains: equations met only because all coefficients vanish
_MULTIPLIER = 1e-9  # below it a limit does not bind
_TOUCHES = 1e-10  # of a range: distance that IPOPT may leave to an end that binds
_BRANCH_STARTS = 12
_OUTSIDE = 1e-9  # of a limit, beyond which it excludes a solution
_SAME_BRANCH = 1e-6  # relative difference of parameters
_DOUBT = 100.0  # roots that rounding parts are off alike in the NLP and in the recheck
_STORED = 1e-8  # relative: what rounding of steep parameters may leave of a coefficient, and so of an m-fold root
_ZERO = 1e-14  # of the largest root: below it one is 0 but for rounding
UNCLEAR = "rounding leaves too little of the coefficients to tell the roots apart; keep a0 and the roots away from 0"
_CLAIMED = 1e-6  # relative difference of the claimed objective from the design's own


@dataclass(frozen=True)
class Outcome:
    """A design with its standing, ready to be reported.

    Attributes:
        cases: the cases that it was checked in.
        without_best: whether the search went on to better and better ones without an end.
    """

    parameters: Mapping[str, float]
    checked: Evaluation
    status: str
    active: Mapping[str, float]
    starts: Starts
    formulation: str
    cases: tuple[Case, ...] = ()
    branches: tuple[OtherBranch, ...] = ()
    notes: tuple[str, ...] = ()
    relaxation: Relaxation | None = None
    without_best: bool = False


@dataclass(frozen=True)
class CheckedEnd:
    """A candidate, polished and rechecked."""

    candidate: LocalEnd
    point: Point
    parameters: Mapping[str, float]
    checked: Evaluation


def evaluated(problem: Posed, cases: Sequence[Case]) -> Outcome:
    """Nothing is free: the design is what it is."""
    parameters = problem.ordered({})
    checked = recheck(problem, parameters, cases)
    status = "infeasible" if checked.violations else "optimal"
    return Outcome(parameters, checked, status, {}, Starts(), "none", tuple(cases))


def found(
    work: Workspace, nlp: NLP, trial: CheckedEnd | None, starts: Starts, cases: Sequence[Case] | None = None
) -> Outcome | None:
    """A trial as a finding, in the given cases, by default those of the NLP; None where it is not feasible at all."""
    if trial is None:
        return None
    problem, point, parameters = work.problem, trial.point, trial.parameters
    checked = trial.checked if cases is None else work.recheck(parameters, cases)
    counted = work.freedom
    if sum(checked.violations.values()) > _SPURIOUS and counted.count >= 0:
        return None
    ended = converged(trial)
    notes: tuple[str, ...] = ()
    if not claim_matches(work, trial):
        ended = False
        claimed = problem.sign * trial.candidate.objective
        notes = (f"the solver's objective {claimed:.9g} is not the design's, {checked.objective:.9g}",)
    if problem.objective is not None and not math.isfinite(checked.objective):
        ended = False
        notes = ("the objective does not exist at the design where the search ended; constrain what it divides by",)
    if unclear(problem, checked):
        ended = False
        notes = (UNCLEAR,)
    flat = not ended and not notes and not checked.violations and bounded(problem)  # a flat stretch has no gradient
    ended = ended or (flat and instant_bound(problem, checked.objective).proven)
    status = "optimal" if ended and not checked.violations else "not_converged"
    if status != "optimal" and not notes and not checked.violations:
        notes = ("feasible, but the solver did not converge here: a better design may be close",)
    if counted.kind == "over-determined" and checked.violations:
        status = "infeasible"
        surplus = f"{counted.conditions} conditions for {counted.free} free parameters"
        notes += (f"{surplus}, and they are not consistent{_fewer_conditions(problem, -counted.count)}",)
    active, looked = _active(problem, nlp, point), tuple(nlp.cases if cases is None else cases)
    branches: tuple[OtherBranch, ...] = ()
    if counted.kind == "square":
        equations = nlp if not nlp.kinks else matching(problem) if problem.pattern else abscissa(problem)
        branches = _other_branches(problem, equations, parameters)
    return Outcome(parameters, checked, status, active, starts, nlp.formulation, looked, branches, notes)


def converged(trial: CheckedEnd) -> bool:
    """Whether the solver stopped at an optimum of its own, by its word or by the gradient, and on the rows."""
    ended = trial.candidate.run.status in _CONVERGED or trial.point.stationarity <= _STATIONARY
    exact = trial.point.violation <= _EXACT or trial.point.stationarity <= _POLISHED
    return ended and exact  # its word is one on rows as it scales them


def _fewer_conditions(problem: Posed, short: int) -> str:
    """How there could be as many free parameters as conditions, where there is something to free or to drop."""
    ways = [f"free {short} more"] if len(problem.fixed) >= short else []
    ways += ["drop a constraint"] if any(c.equality for c in problem.conditions.values()) else []
    return f"; {', or '.join(ways)}" if ways else ""


def mass_advice(problem: Posed) -> str:
    """How to keep the mass matrix from being singular, in the names of a model."""
    known = {"tms": "nu_H and zeta_B", "whipple": "mass_margin"}
    return f"keep {known.get(problem.model.name, 'a0')} away from 0 by a constraint"


def counted(candidates: Sequence[LocalEnd], at_best: float) -> Starts:
    """How the starts of a search ended."""
    return Starts(
        tried=len(candidates),
        converged=sum(c.feasible for c in candidates),
        at_best=sum(c.feasible and same_objective(c.objective, at_best, c.nlp.size) for c in candidates),
        optima=optima(candidates),
    )


def best_checked(work: Workspace, nlp: NLP, candidates: Sequence[LocalEnd]) -> CheckedEnd | None:
    """The first of the best candidates to pass the recheck once polished, or the one that fails it least."""
    polish, problem = polisher(nlp), work.problem
    kept: CheckedEnd | None = None
    tried: list[float] = []
    for candidate in sorted((c for c in candidates if c.feasible), key=lambda c: c.objective):
        alike = sum(same_objective(candidate.objective, value, nlp.size) for value in tried)
        if kept and not kept.checked.violations and claim_matches(work, kept) and not _flattered(kept) and not alike:
            break
        if alike >= _ALIKE:
            continue
        tried.append(candidate.objective)
        point = polish(candidate.run, candidate.nlp)
        parameters = problem.ordered(design_of(problem, point.x.tolist()))
        checked = work.recheck(parameters, nlp.cases)
        trial = CheckedEnd(candidate, point, parameters, checked)
        if kept is None or is_better(work, trial, kept):
            kept = trial
        if not trial.checked.violations and point.stationarity <= _STATIONARY and claim_matches(work, trial):
            break
    return kept


def attained(work: Workspace, nlp: NLP, candidates: Sequence[LocalEnd], trial: CheckedEnd) -> CheckedEnd:
    """A trial, or the next one, where it is ahead of that only by a multiple root that no design near it has.

    Equations that are all but singular hold to rounding far from where they hold exactly.
    """
    best = trial.candidate.objective
    most = best + _MERGED * (nlp.size + abs(best))
    ours = [c for c in candidates if c.feasible and (c.nlp.variables, c.nlp.rows) == (nlp.variables, nlp.rows)]
    worse = [c for c in ours if best < c.objective <= most and not same_objective(c.objective, best, nlp.size)]
    if not worse or nlp.cases or trial.checked.violations or multiple_roots_exist(work.problem, trial.parameters):
        return trial
    if not rescued_by("attained"):
        return trial
    other = best_checked(work, nlp, worse)
    fit = other is not None and converged(other) and claim_matches(work, other) and not other.checked.violations
    return other if other is not None and fit else trial


def claim_matches(work: Workspace, trial: CheckedEnd) -> bool:
    """Whether the objective that the solver claims is the design's own."""
    if work.problem.objective is None:
        return True
    claimed = work.problem.sign * trial.point.objective
    return math.isclose(claimed, trial.checked.objective, rel_tol=_CLAIMED, abs_tol=_CLAIMED)


def better(problem: Posed, one: Outcome, other: Outcome) -> bool:
    """Whether one finding beats another: feasible before not, then by objective, then optimal before not."""
    values = [problem.sign * f.checked.objective for f in (one, other)]
    doubtful = [bool(f.checked.violations) or math.isinf(v) for f, v in zip((one, other), values, strict=True)]
    if not any(doubtful) and all(map(math.isfinite, values)) and not math.isclose(*values, rel_tol=_CLAIMED):
        return values[0] < values[1]
    finite = [v if math.isfinite(v) else 0.0 for v in values]
    return (doubtful[0], one.status != "optimal", finite[0]) < (doubtful[1], other.status != "optimal", finite[1])


def is_better(work: Workspace, one: CheckedEnd, other: CheckedEnd) -> bool:
    """Whether one trial beats another: by violation first, then by the objective that the recheck found.

    Where that is not the solver's, what lies between them is weighed against it.
    """
    ranks = []
    for trial in (one, other):
        claimed, own = trial.point.objective, work.problem.sign * trial.checked.objective
        doubt = 0.0 if claim_matches(work, trial) else _DOUBT * abs(claimed - own)
        violation = sum(trial.checked.violations.values())
        ranks.append((violation, _flattered(trial), claimed if math.isnan(own) else own + doubt))
    return ranks[0] < ranks[1]


def unclear(problem: Posed, checked: Evaluation) -> bool:
    """Whether the roots as stored are farther from the multiple ones that they count as than an m-th root explains.

    Several that are 0 but for rounding have no damping ratio to speak of.
    """
    roots = checked.structure.roots
    if not roots or not math.isfinite(checked.realised):
        return False
    sizes = sorted(math.hypot(r.re, r.im) for r in roots)
    asked = any("damping_ratio" in e.names for e in (problem.objective, *problem.conditions.values()) if e)
    if asked and any(r.multiplicity > 1 and 0 < math.hypot(r.re, r.im) < _ZERO * sizes[-1] for r in roots):
        return True
    each = (math.hypot(r.re, r.im) * _STORED ** (1 / r.multiplicity) for r in roots)
    scatter = max(each) + _ZERO * sizes[-1]
    return bool(abs(checked.structure.abscissa - checked.realised) > scatter)


def _flattered(trial: CheckedEnd) -> bool:
    """Whether an end that is no optimum owes its standing to a multiple root that it only comes close to."""
    ideal, stored = trial.checked.structure.abscissa, trial.checked.realised
    return not converged(trial) and not math.isclose(ideal, stored, rel_tol=_CLAIMED, abs_tol=_CLAIMED)


def _active(problem: Posed, nlp: NLP, point: Point) -> dict[str, float]:
    """Gain of the objective per unit by which a named constraint or a bound is relaxed.

    For an equality constraint, the change of the objective per unit added to its right-hand side; for one that holds
    in several cases, the gain of relaxing it in all of them.
    """
    active: dict[str, float] = {}
    if problem.objective is None:
        return active
    sign, gain = problem.sign, gains(nlp, point)
    rows = zip(nlp.rows, point.row_multipliers.tolist(), nlp.row_lower, nlp.row_upper, strict=True)
    inequalities: dict[str, list[int]] = {}
    for k, (row, multiplier, lower, upper) in enumerate(rows):
        if row in problem.constraints and abs(multiplier) > _MULTIPLIER:
            if lower == upper:
                active[row] = active.get(row, 0.0) - sign * multiplier
            else:
                inequalities.setdefault(row, []).append(k)
    active |= {name: gain(limits) for name, limits in inequalities.items()}
    of = problem.parameter_set
    for k, name in enumerate(problem.free):
        multiplier, x = float(point.bound_multipliers[k]), float(point.x[k])
        ends = [float(np.tan(e)) if of[name].tangent else e for e in problem.free[name]]
        apart = _TOUCHES * (ends[1] - ends[0])
        at_end = min(abs(x - e) for e in ends) <= apart  # not where two sides of the box meet
        if abs(multiplier) > _MULTIPLIER and at_end:
            slope = 1 + x * x if of[name].tangent else 1.0  # d tan λ / dλ
            end = "max" if abs(x - ends[1]) < abs(x - ends[0]) else "min"
            active[f"{name}.{end}"] = gain([len(nlp.rows) + k]) * slope
    return active


def _other_branches(problem: Posed, nlp: NLP, found: Mapping[str, float]) -> tuple[OtherBranch, ...]:
    """Solutions of the equations other than the one found, each with the bounds and rows that it violates."""
    of = problem.parameter_set
    branches: list[OtherBranch] = []
    known = [np.array([found[n] for n in problem.free])]
    starts = (initial_point(nlp, problem, start) for start in designs(problem, 0, _BRANCH_STARTS))
    for x in solutions(nlp, starts, len(problem.free)):
        values = np.array([np.arctan(v) if of[n].tangent else v for n, v in zip(problem.free, x, strict=False)])
        if any(np.abs(values - k).max() <= _SAME_BRANCH * (1 + np.abs(k).max()) for k in known):
            continue
        known.append(values)
        parameters = problem.ordered(dict(zip(problem.free, values.tolist(), strict=True)))
        branches.append(OtherBranch(Table(parameters), _excluded(problem, nlp, x)))
    return tuple(sorted(branches, key=lambda b: len(b.excluded_by)))


def _excluded(problem: Posed, nlp: NLP, x: Array) -> tuple[str, ...]:
    """Names of the bounds and inequality rows that a solution violates."""
    values = (*x, *nlp.at(x)[1])
    lower, upper = (*nlp.lower, *nlp.row_lower), (*nlp.upper, *nlp.row_upper)
    names: dict[str, None] = {}
    for k, name in enumerate((*problem.free, *nlp.variables[len(problem.free) :], *nlp.rows)):
        below, above = values[k] < lower[k] - _OUTSIDE, values[k] > upper[k] + _OUTSIDE
        if below or above:
            names[name if k >= len(problem.free) else f"{name}.{'min' if below else 'max'}"] = None
    return tuple(names)


def evaluated_cases(problem: Posed, parameters: Mapping[str, float]) -> tuple[Case, ...]:
    """The listed cases of a design and the worst ones between them."""
    return listed_cases(problem, worst_cases(problem, parameters) if problem.cases else {})


def listed_cases(problem: Posed, worst: Mapping[str, Worst]) -> tuple[Case, ...]:
    """The listed cases, and the worst ones that were found."""
    return (*problem.cases, *(w.case for w in worst.values())) if problem.cases else ()
