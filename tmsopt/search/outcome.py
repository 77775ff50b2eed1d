"""From the best end of a search to a design with its status."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tmsopt.evaluation.bound import bounded, instant_bound
from tmsopt.evaluation.recheck import Evaluation, recheck
from tmsopt.evaluation.worst_case import Worst, worst_cases
from tmsopt.problem.advice.remedies import Relaxation
from tmsopt.problem.cases import Case
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.problem.problem import Posed
from tmsopt.problem.searches import Starts
from tmsopt.problem.solution import OtherBranch
from tmsopt.program.formulate import formulate_abscissa, formulate_matching
from tmsopt.program.ipopt import Point, relaxation_gain
from tmsopt.program.nlp import NLP
from tmsopt.program.starts import choose_starts, initial_point
from tmsopt.records import Array, Table
from tmsopt.roots import Root
from tmsopt.search.accept import check_again, claim_matches, has_converged
from tmsopt.search.newton import solutions
from tmsopt.search.state import CheckedEnd, SearchState
from tmsopt.search.tuning import Tuning

_MULTIPLIER = 1e-9  # below it a limit does not bind
_TOUCHES = 1e-10  # of a range: distance that IPOPT may leave to an end that binds
_BRANCH_STARTS = 12
_OUTSIDE = 1e-9  # of a limit, beyond which it excludes a solution
_SAME_BRANCH = 1e-6  # relative difference of parameters
_STORED = 1e-8  # relative: what rounding of steep parameters may leave of a coefficient, and so of an m-fold root
_ZERO = 1e-14  # of the largest root: below it one is 0 but for rounding
_SHARE = 1e-3  # of a range, by which a parameter is moved to see whether a0 depends on it

UNCLEAR = "rounding leaves too little of the coefficients to tell the roots apart; keep a0 and the roots away from 0"
UNBOUNDED = "unbounded, as far as was looked: what this design reaches is far below all else; limit what it divides by"
BEATEN = "where a start of the solver ended: not known to be an optimum, but better than those that are"
KEPT = "the best design that was looked at; no start of the solver ended as good"


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


def evaluated(problem: Posed, cases: Sequence[Case]) -> Outcome:
    """Nothing is free: the design is what it is."""
    parameters = problem.ordered({})
    checked = recheck(problem, parameters, cases)
    status = "infeasible" if checked.violations else "optimal"
    return Outcome(parameters, checked, status, {}, Starts(), "none", tuple(cases))


def found(state: SearchState, starts: Starts, cases: Sequence[Case] | None = None) -> Outcome | None:
    """The best of a search with its status, in the given cases or those of its program; None without a feasible one."""
    if state.best is None:
        return None
    problem, trial = state.problem, check_again(state, state.best)
    parameters, nlp = trial.parameters, trial.end.nlp
    checked = trial.checked if cases is None else recheck(problem, parameters, cases)
    counted = degrees_of_freedom(problem)
    if sum(checked.violations.values()) > state.tuning.spurious and counted.count >= 0:
        return None
    notes = _doubts(problem, trial, checked)
    ended = has_converged(trial) and not notes
    if not (ended or notes or checked.violations) and bounded(problem):  # a flat stretch has no gradient
        ended = instant_bound(problem, checked.objective).proven
    status = "optimal" if ended and not checked.violations else "not_converged"
    if status != "optimal" and not notes and not checked.violations:
        notes = ("feasible, but the solver did not converge here: a better design may be close",)
    if counted.kind == "over-determined" and checked.violations:
        status = "infeasible"
        surplus = f"{counted.conditions} conditions for {counted.free} free parameters"
        notes += (f"{surplus}, and they are not consistent{_fewer_conditions(problem, -counted.count)}",)
    branches: tuple[OtherBranch, ...] = ()
    if counted.kind == "square":
        equations = (
            nlp if not nlp.kinks else formulate_matching(problem) if problem.pattern else formulate_abscissa(problem)
        )
        branches = _other_branches(problem, equations, parameters)
    active, looked = _active(problem, nlp, trial.point), tuple(nlp.cases if cases is None else cases)
    return Outcome(parameters, checked, status, active, starts, nlp.formulation, looked, branches, notes)


def _doubts(problem: Posed, trial: CheckedEnd, checked: Evaluation) -> tuple[str, ...]:
    """Why a design is no optimum, whatever the solver says of it."""
    if is_unclear(problem, checked):
        return (UNCLEAR,)
    if problem.objective is not None and not math.isfinite(checked.objective):
        return ("the objective does not exist at the design where the search ended; constrain what it divides by",)
    if claim_matches(problem, trial):
        return ()
    claimed = problem.sign * trial.end.objective
    return (f"the solver's objective {claimed:.9g} is not the design's, {checked.objective:.9g}",)


def as_it_is(problem: Posed, design: Mapping[str, float], note: str = "") -> Outcome:
    """A design that is known to be no optimum: ``not_converged``, or ``infeasible`` where it violates something."""
    parameters = problem.ordered(design)
    cases = evaluated_cases(problem, parameters)
    checked = recheck(problem, parameters, cases)
    status = "infeasible" if checked.violations else "not_converged"
    return Outcome(parameters, checked, status, {}, Starts(), "none", cases, notes=(note,) if note else ())


def _fewer_conditions(problem: Posed, short: int) -> str:
    """How there could be as many free parameters as conditions, where there is something to free or to drop."""
    ways = [f"free {short} more"] if len(problem.fixed) >= short else []
    ways += ["drop a constraint"] if any(c.equality for c in problem.conditions.values()) else []
    return f"; {', or '.join(ways)}" if ways else ""


def mass_advice(problem: Posed) -> str:
    """How to keep the mass matrix from being singular, in the names of a model."""
    known = {"tms": "nu_H and zeta_B", "whipple": "mass_margin"}
    return f"keep {known.get(problem.model.name, 'a0')} away from 0 by a constraint"


def beats(problem: Posed, one: Outcome, other: Outcome, tuning: Tuning) -> bool:
    """Whether one outcome beats another: feasible before not, then by objective, then optimal before not."""
    values = [problem.sign * o.checked.objective for o in (one, other)]
    doubtful = [bool(o.checked.violations) or math.isinf(v) for o, v in zip((one, other), values, strict=True)]
    close = math.isclose(*values, rel_tol=tuning.claimed)
    if not any(doubtful) and all(map(math.isfinite, values)) and not close:
        return values[0] < values[1]
    finite = [v if math.isfinite(v) else 0.0 for v in values]
    return (doubtful[0], one.status != "optimal", finite[0]) < (doubtful[1], other.status != "optimal", finite[1])


def is_unclear(problem: Posed, checked: Evaluation) -> bool:
    """Whether the roots as stored are farther from the multiple ones that they count as than an m-th root explains.

    Several that are 0 but for rounding have no damping ratio to speak of.
    """
    roots = checked.structure.roots
    if not roots or not math.isfinite(checked.realised):
        return False
    sizes = sorted(r.size for r in roots)
    asked = any("damping_ratio" in e.names for e in (problem.objective, *problem.conditions.values()) if e)
    if asked and any(r.multiplicity > 1 and 0 < r.size < _ZERO * sizes[-1] for r in roots):
        return True
    each = (r.size * _STORED ** (1 / r.multiplicity) for r in roots)
    scatter = max(each) + _ZERO * sizes[-1]
    return bool(abs(checked.structure.abscissa - checked.realised) > scatter)


def _active(problem: Posed, nlp: NLP, point: Point) -> dict[str, float]:
    """Gain of the objective per unit by which a named constraint or a bound is relaxed.

    For an equality constraint, the change of the objective per unit added to its right-hand side; for one that holds
    in several cases, the gain of relaxing it in all of them.
    """
    active: dict[str, float] = {}
    if problem.objective is None:
        return active
    sign, gain = problem.sign, relaxation_gain(nlp, point)
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
    starts = (initial_point(nlp, problem, start) for start in choose_starts(problem, 0, _BRANCH_STARTS))
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
    values = (*x, *nlp.evaluate(x)[1])
    lower, upper = (*nlp.lower, *nlp.row_lower), (*nlp.upper, *nlp.row_upper)
    names: dict[str, None] = {}
    for k, name in enumerate((*problem.free, *nlp.variables[len(problem.free) :], *nlp.rows)):
        below, above = values[k] < lower[k] - _OUTSIDE, values[k] > upper[k] + _OUTSIDE
        if below or above:
            names[name if k >= len(problem.free) else f"{name}.{'min' if below else 'max'}"] = None
    return tuple(names)


def demote(state: SearchState, outcome: Outcome) -> Outcome:
    """An optimum, unless it has a root all but at infinity that no active limit holds, or has no lower bound."""
    problem, value = state.problem, state.problem.sign * outcome.checked.objective
    words = ""
    if problem.objective is None or outcome.checked.violations:
        return outcome
    if state.sample and math.isfinite(value) and value < -state.tuning.endless * state.sample.spread < 0:
        if outcome.status != "optimal":
            return replace(outcome, without_best=True, notes=(UNBOUNDED,))
    elif (
        outcome.status == "optimal"
        and runs_away(outcome.checked.structure.roots, state.tuning.runaway)
        and not _held_off(problem, outcome)
    ):
        words = f"no best design: it improves towards a singular mass matrix (a0 = 0); {mass_advice(problem)}"
    if not words:
        return outcome
    return replace(outcome, status="not_converged", without_best=True, notes=(*outcome.notes, words))


def demote_if_beaten(state: SearchState, outcome: Outcome) -> Outcome:
    """An optimum, or the design at an end that beats it, which is known to be none: in its own worst cases too."""
    problem, tuning = state.problem, state.tuning
    if outcome.status != "optimal" or state.sample is None or problem.objective is None:
        return outcome
    box, worth = state.sample.box, problem.sign * outcome.checked.objective
    least = worth - tuning.lost * (state.nlp.size + abs(worth))
    own = box.space.points(outcome.parameters)
    points = [box.space.points(design) for design in state.designs]
    apart = [u for u in points if np.abs(u - own).max() > tuning.same_design]
    for design in box.designs(
        box.look(np.array(apart).reshape(-1, box.space.size)).better(least).best(tuning.rivals_seen)
    ):
        other = as_it_is(problem, design, BEATEN)
        merged = abs(other.checked.structure.abscissa - other.checked.realised)  # what merging roots may gain
        sound = not other.checked.violations and not is_unclear(problem, other.checked)
        if sound and problem.sign * other.checked.objective < least - merged:
            return replace(other, starts=outcome.starts, formulation=outcome.formulation)
    return outcome


def runs_away(roots: Sequence[Root], ratio: float) -> bool:
    """Whether a root is so far away from others that a0 is all but 0; from those that are 0 any other is."""
    sizes = sorted(size for r in roots if (size := r.size))
    return bool(sizes) and sizes[-1] > ratio * sizes[(len(sizes) - 1) // 2]


def _held_off(problem: Posed, outcome: Outcome) -> bool:
    """Whether no parameter moves a0, or a limit that binds is about one that does."""
    about: set[str] = set()
    for name in outcome.active:
        condition = problem.conditions.get(name)
        about |= set(condition.names) if condition else {name.rpartition(".")[0]}
    own = float(problem.values(outcome.parameters).coefficients[0])
    moving = set[str]()
    for name, (low, high) in problem.free.items():
        moved = {**outcome.parameters, name: outcome.parameters[name] + _SHARE * (high - low)}
        if float(problem.values(moved).coefficients[0]) != own:
            moving.add(name)
    return not moving or bool(about & moving or about - set(problem.free))  # of a quantity, which may depend on all


def evaluated_cases(problem: Posed, parameters: Mapping[str, float]) -> tuple[Case, ...]:
    """The listed cases of a design and the worst ones between them."""
    return listed_cases(problem, worst_cases(problem, parameters) if problem.cases else {})


def listed_cases(problem: Posed, worst: Mapping[str, Worst]) -> tuple[Case, ...]:
    """The listed cases, and the worst ones that were found."""
    return (*problem.cases, *(w.case for w in worst.values())) if problem.cases else ()
