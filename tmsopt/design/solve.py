"""The solution of a design problem, rechecked before it is believed."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass

from tmsopt.design.bound import omega0_bound
from tmsopt.design.branches import other_branches
from tmsopt.design.elastic import least_violating
from tmsopt.design.errors import InputError
from tmsopt.design.formulations import design_of, formulate, freedom
from tmsopt.design.frozen import Table
from tmsopt.design.nlp import NLP
from tmsopt.design.polish import Point, polisher
from tmsopt.design.problem import Problem, unasked
from tmsopt.design.recheck import Checked, recheck
from tmsopt.design.search import STARTS, Candidate, Progress, follow, same, search
from tmsopt.design.solution import Bound, Branch, NotSolved, Solution, Starts

_STATIONARY = 1e-6  # gradient of the Lagrangian at which a point counts as converged whatever IPOPT says
_ALIKE = 3  # candidates of one objective looked at closely
_CONVERGED = ("Solve_Succeeded", "Solved_To_Acceptable_Level", "Feasible_Point_Found")
_SPURIOUS = 1e-3  # violation that no lack of digits explains: equations met only because all coefficients vanish
_MULTIPLIER = 1e-9  # below it a limit does not bind


def solve(
    problem: Problem,
    *,
    starts: int = STARTS,
    seed: int = 0,
    exhaustive: bool = False,
    linear_solver: str = "mumps",
    throw: bool = True,
    progress: Progress | None = None,
) -> Solution:
    """Find the best design, from several starts, and check it independently of the solver.

    Args:
        starts: starts tried at most; the search ends early when several agree or optimality is proven.
        seed: of the quasi-random starting designs.
        exhaustive: try all the starts, even when several agree.
        linear_solver: ``mumps`` or ``spral``.
        throw: raise NotSolved unless the status is ``optimal``; otherwise return the best point with its status.
        progress: called with (starts done, starts at most).

    Raises:
        NotSolved: carrying the best point found, when `throw`.
        InputError: when parameters are free and nothing is asked of them.
        ValueError: for another linear solver or fewer than one start.
    """
    if faults := unasked(problem):
        raise InputError(faults)
    if starts < 1:
        raise ValueError(f"starts = {starts}; accepted: 1 or more")
    began = time.perf_counter()
    if problem.free:
        nlp = formulate(problem)
        candidates = search(
            problem,
            nlp,
            starts=starts,
            seed=seed,
            exhaustive=exhaustive,
            linear_solver=linear_solver,
            progress=progress,
        )
        finding = _best(problem, nlp, candidates) or _without_any(problem, nlp, candidates, seed, linear_solver)
    else:
        finding = _evaluated(problem)
    solution = _assembled(problem, finding, began)
    if throw and solution.status != "optimal":
        raise NotSolved(solution)
    return solution


@dataclass(frozen=True)
class _Finding:
    """A design with its standing, ready to be reported."""

    parameters: Mapping[str, float]
    checked: Checked
    status: str
    active: Mapping[str, float]
    starts: Starts
    formulation: str
    branches: tuple[Branch, ...] = ()
    notes: tuple[str, ...] = ()


def _evaluated(problem: Problem) -> _Finding:
    """Nothing is free: the design is what it is."""
    parameters = problem.ordered({})
    checked = recheck(problem, parameters)
    return _Finding(parameters, checked, "infeasible" if checked.violations else "optimal", {}, Starts(), "none")


def _best(problem: Problem, nlp: NLP, candidates: list[Candidate]) -> _Finding | None:
    """The best feasible candidate, polished and rechecked; None if no candidate is feasible."""
    trial = _survivor(problem, nlp, candidates)
    if trial is None:
        return None
    candidate, point, checked = trial
    counted = freedom(problem)
    if sum(checked.violations.values()) > _SPURIOUS and counted.count >= 0:
        return None
    parameters = problem.ordered(design_of(problem, point.x.tolist()))
    converged = candidate.run.status in _CONVERGED or point.stationarity <= _STATIONARY
    notes: tuple[str, ...] = ()
    claimed = -point.objective if problem.sense == "maximize" else point.objective
    if problem.objective and not math.isclose(claimed, checked.objective, rel_tol=1e-6, abs_tol=1e-6):
        converged = False
        notes = (
            f"the solver's objective {claimed:.9g} is not the design's, {checked.objective:.9g}: abscissa can only be "
            "minimised or bounded above, damping_ratio only maximised or bounded below",
        )
    status = "optimal" if converged and not checked.violations else "not_converged"
    if counted.kind == "over-determined" and checked.violations:
        status = "infeasible"
        surplus = f"{counted.conditions} conditions for {counted.free} free parameters"
        notes += (f"{surplus}, and they are not consistent; free {-counted.count} more, or drop a constraint",)
    return _Finding(
        parameters,
        checked,
        status,
        _active(problem, nlp, point),
        Starts(
            tried=len(candidates),
            converged=sum(c.feasible for c in candidates),
            at_best=sum(c.feasible and same(c.objective, candidate.objective) for c in candidates),
        ),
        nlp.formulation,
        other_branches(problem, nlp, parameters) if counted.kind == "square" else (),
        notes,
    )


_Trial = tuple[Candidate, Point, Checked]


def _survivor(problem: Problem, nlp: NLP, candidates: list[Candidate]) -> _Trial | None:
    """The first of the best candidates to pass the recheck once polished, or the one that fails it least."""
    polish = polisher(nlp)
    kept: _Trial | None = None
    tried: list[float] = []
    for candidate in sorted((c for c in candidates if c.feasible), key=lambda c: c.objective):
        alike = sum(same(candidate.objective, value) for value in tried)
        if kept and not kept[2].violations and not alike:
            break
        if alike >= _ALIKE:
            continue
        tried.append(candidate.objective)
        point = polish(candidate.run)
        checked = recheck(problem, problem.ordered(design_of(problem, point.x.tolist())))
        trial = (candidate, point, checked)
        if kept is None or _rank(problem, trial) < _rank(problem, kept):
            kept = trial
        if not checked.violations and point.stationarity <= _STATIONARY:
            break
    return kept


def _rank(problem: Problem, trial: _Trial) -> tuple[float, float]:
    """Violation first, then the objective that the recheck found."""
    _, point, checked = trial
    value = point.objective if math.isnan(checked.objective) else checked.objective
    return sum(checked.violations.values()), -value if problem.sense == "maximize" else value


def _active(problem: Problem, nlp: NLP, point: Point) -> dict[str, float]:
    """Gain of the objective per unit by which a named constraint or a bound is relaxed.

    For an equality constraint, the change of the objective per unit added to its right-hand side.
    """
    active: dict[str, float] = {}
    if problem.objective is None:
        return active
    sign = -1.0 if problem.sense == "maximize" else 1.0
    rows = zip(nlp.rows, point.row_multipliers.tolist(), nlp.row_lower, nlp.row_upper, strict=True)
    for row, multiplier, lower, upper in rows:
        if row in problem.constraints and abs(multiplier) > _MULTIPLIER:
            active[row] = -sign * multiplier if lower == upper else abs(multiplier)
    of = problem.parameter_set
    for k, name in enumerate(problem.free):
        multiplier, x = float(point.bound_multipliers[k]), float(point.x[k])
        if abs(multiplier) > _MULTIPLIER and x in (nlp.lower[k], nlp.upper[k]):
            slope = 1 + x * x if of[name].tangent else 1.0  # d tan λ / dλ
            active[f"{name}.{'max' if multiplier > 0 else 'min'}"] = abs(multiplier) * slope
    return active


def _without_any(problem: Problem, nlp: NLP, candidates: list[Candidate], seed: int, linear_solver: str) -> _Finding:
    """No start ended feasible: the least-violating design, and what can be reached from it if it violates nothing."""
    design = least_violating(problem, nlp, seed, linear_solver)
    parameters = problem.ordered(design)
    checked = recheck(problem, parameters)
    tried = f"of {len(candidates)} starts, none"
    if checked.violations:
        status, note = "infeasible", f"{tried} satisfies all constraints; relax one of those violated"
    else:
        ended = [follow(problem, nlp, design, linear_solver, near) for near in (True, False)]
        candidates = [*candidates, *ended]
        if finding := _best(problem, nlp, candidates):
            return finding
        advice = "try more starts, give one, or keep a0 away from 0 (for tms, nu_H >= 0.02)"
        status, note = "not_converged", f"feasible designs exist, but {tried} converged; {advice}"
    return _Finding(parameters, checked, status, {}, Starts(tried=len(candidates)), nlp.formulation, notes=(note,))


def _assembled(problem: Problem, finding: _Finding, began: float) -> Solution:
    checked, optimal = finding.checked, finding.status == "optimal"
    return Solution(
        problem=problem,
        status=finding.status,
        value=checked.objective,
        parameters=Table(finding.parameters),
        abscissa=checked.structure.abscissa,
        abscissa_realised=checked.realised,
        roots=checked.structure.roots,
        structure=checked.structure.name,
        active=Table(finding.active),
        violations=checked.violations,
        bound=omega0_bound(problem, checked.objective) if optimal else Bound(),
        starts=finding.starts,
        seconds=time.perf_counter() - began,
        quantities=checked.quantities,
        dimensionless=checked.dimensionless,
        formulation=finding.formulation,
        freedom=freedom(problem),
        branches=finding.branches,
        notes=(*finding.notes, *_stability_note(problem, checked, optimal)),
    )


def _stability_note(problem: Problem, checked: Checked, optimal: bool) -> tuple[str, ...]:
    if "a0" in checked.violations:
        return ("the mass matrix is singular (a0 = 0), so a root is at infinity; keep nu_H and zeta_B away from 0",)
    if not optimal or checked.structure.abscissa < 0:
        return ()
    if problem.free and (problem.minimize or "").strip() == "abscissa":
        return ("no stable design was found in the box; this is the least unstable one",)
    return ("the design is not stable: abscissa >= 0",)
