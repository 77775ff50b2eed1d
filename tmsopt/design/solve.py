"""Multi-start solution of a design problem, rechecked before it is believed."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tmsopt.design.bound import omega0_bound
from tmsopt.design.branches import other_branches
from tmsopt.design.elastic import least_violating
from tmsopt.design.formulations import NLP, design_of, formulate, freedom
from tmsopt.design.frozen import Table
from tmsopt.design.ipopt import Run, ipopt
from tmsopt.design.polish import Point, polisher
from tmsopt.design.problem import Problem
from tmsopt.design.recheck import Checked, recheck
from tmsopt.design.solution import Bound, Branch, NotSolved, Solution, Starts
from tmsopt.design.starts import complete, designs

STARTS = 32
"""Starts tried at most, unless fewer agree earlier."""

_ENOUGH = 8  # starts tried before agreement counts
_AGREE = 5  # starts at the best value that end the search
_SAME = 1e-7  # relative difference of objectives that counts as the same
_STATIONARY = 1e-6
_FEASIBLE = 1e-8  # of the rows, before polishing; the recheck has the last word
_POLISHED = 4  # candidates looked at closely

_CONVERGED = ("Solve_Succeeded", "Solved_To_Acceptable_Level", "Feasible_Point_Found")

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class _Candidate:
    run: Run
    objective: float
    feasible: bool


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
        ValueError: for another linear solver or fewer than one start.
    """
    if starts < 1:
        raise ValueError(f"starts = {starts}; accepted: 1 or more")
    began = time.perf_counter()
    if problem.free:
        solution = _searched(problem, starts, seed, exhaustive, linear_solver, progress, began)
    else:
        solution = _evaluated(problem, began)
    if throw and solution.status != "optimal":
        raise NotSolved(solution)
    return solution


def _evaluated(problem: Problem, began: float) -> Solution:
    """Nothing is free: the design is what it is."""
    parameters = problem.ordered({})
    checked = recheck(problem, parameters)
    status = "infeasible" if checked.violations else "optimal"
    return _solution(problem, parameters, checked, status, began)


def _searched(
    problem: Problem,
    starts: int,
    seed: int,
    exhaustive: bool,
    linear_solver: str,
    progress: Progress | None,
    began: float,
) -> Solution:
    nlp = formulate(problem)
    run = ipopt(nlp, linear_solver)
    polish = polisher(nlp)
    candidates: list[_Candidate] = []
    starting = designs(problem, seed, starts)
    for design in starting:
        candidates.append(_candidate(nlp, run(complete(nlp, problem, design))))
        if progress:
            progress(len(candidates), starts)
        if not exhaustive and _settled(problem, candidates):
            break
    best, point, checked = _best(problem, nlp, candidates, polish)
    if best is None or point is None or checked is None:
        return _unsolved(problem, nlp, linear_solver, candidates, starting, began)
    parameters = problem.ordered(design_of(problem, point.x.tolist()))
    converged = best.run.status in _CONVERGED or point.stationarity <= _STATIONARY
    claimed = -point.objective if problem.sense == "maximize" else point.objective
    notes: list[str] = []
    if problem.objective and not math.isclose(claimed, checked.objective, rel_tol=1e-6, abs_tol=1e-6):
        converged = False
        notes.append(
            f"the solver's objective {claimed:.9g} is not the design's, {checked.objective:.9g}: abscissa can only be "
            "minimised or bounded above, damping_ratio only maximised or bounded below"
        )
    at_best = sum(c.feasible and _close(c.objective, best.objective) for c in candidates)
    return _solution(
        problem,
        parameters,
        checked,
        "optimal" if converged and not checked.violations else "not_converged",
        began,
        active=_active(problem, nlp, point),
        starts=Starts(len(candidates), sum(c.feasible for c in candidates), at_best),
        formulation=nlp.formulation,
        branches=other_branches(problem, nlp, starting, parameters) if freedom(problem).kind == "square" else (),
        notes=tuple(notes),
    )


def _candidate(nlp: NLP, run: Run) -> _Candidate:
    f, g = nlp.functions(run.x)
    rows = np.array(g).ravel()
    if not (np.all(np.isfinite(rows)) and np.all(np.isfinite(run.x))):
        return _Candidate(run, math.inf, False)
    outside = np.concatenate([np.array(nlp.row_lower) - rows, rows - np.array(nlp.row_upper), [0.0]])
    feasible = bool(outside.max() <= _FEASIBLE) and run.status != "Infeasible_Problem_Detected"
    return _Candidate(run, float(f), feasible)


def _close(a: float, b: float) -> bool:
    return abs(a - b) <= _SAME * (1 + abs(b))


def _settled(problem: Problem, candidates: list[_Candidate]) -> bool:
    """Whether more starts would be waste: the bound is reached, or enough of them agree on the best."""
    feasible = [c for c in candidates if c.feasible]
    if not feasible:
        return False
    best = min(c.objective for c in feasible)
    if feasible[-1].objective == best and omega0_bound(problem, best).gap <= 1e-8:
        return True
    agreeing = sum(_close(c.objective, best) for c in feasible)
    if problem.objective is None:  # a located point is as good as another
        return agreeing >= 1 if freedom(problem).count <= 0 else agreeing >= _AGREE
    return len(candidates) >= _ENOUGH and agreeing >= _AGREE


def _best(
    problem: Problem, nlp: NLP, candidates: list[_Candidate], polish: Callable[[Run], Point]
) -> tuple[_Candidate | None, Point | None, Checked | None]:
    """The best candidate that survives polishing and the recheck; ties go to the smaller violation."""
    ranked = sorted((c for c in candidates if c.feasible), key=lambda c: c.objective)
    kept: tuple[_Candidate, Point, Checked] | None = None
    for candidate in ranked[:_POLISHED]:
        if kept and not kept[2].violations and not _close(candidate.objective, kept[0].objective):
            break
        point = polish(candidate.run)
        checked = recheck(problem, problem.ordered(design_of(problem, point.x.tolist())))
        trial = (candidate, point, checked)
        if kept is None or _rank(problem, trial) < _rank(problem, kept):
            kept = trial
        if not checked.violations and point.stationarity <= _STATIONARY:
            break
    return kept or (None, None, None)


def _rank(problem: Problem, trial: tuple[_Candidate, Point, Checked]) -> tuple[float, float]:
    value = trial[2].objective
    objective = trial[1].objective if math.isnan(value) else -value if problem.sense == "maximize" else value
    return (sum(trial[2].violations.values()), objective)


def _active(problem: Problem, nlp: NLP, point: Point) -> dict[str, float]:
    """Gain of the objective per unit by which a named constraint or a bound is relaxed.

    For an equality constraint, the change of the objective per unit added to its right-hand side.
    """
    active: dict[str, float] = {}
    if problem.objective is None:
        return active
    for row, multiplier, lower, upper in zip(
        nlp.rows, point.row_multipliers, nlp.row_lower, nlp.row_upper, strict=True
    ):
        if row in problem.constraints and abs(multiplier) > 1e-9:
            active[row] = float(-multiplier if lower == upper else abs(multiplier))
    of = problem.parameter_set
    for k, name in enumerate(problem.free):
        multiplier, x = float(point.bound_multipliers[k]), float(point.x[k])
        if abs(multiplier) > 1e-9 and x in (nlp.lower[k], nlp.upper[k]):
            slope = 1 + x * x if of[name].tangent else 1.0  # d tan λ / dλ
            active[f"{name}.{'max' if multiplier > 0 else 'min'}"] = abs(multiplier) * slope
    return active


def _unsolved(
    problem: Problem,
    nlp: NLP,
    linear_solver: str,
    candidates: list[_Candidate],
    starting: list[dict[str, float]],
    began: float,
) -> Solution:
    """No start ended feasible: the least-violating point, and whether feasible ones exist at all."""
    design = least_violating(problem, nlp, linear_solver, starting)
    parameters = problem.ordered(design)
    checked = recheck(problem, parameters)
    if checked.violations:
        status, note = (
            "infeasible",
            f"none of {len(candidates)} starts can satisfy all constraints; relax one of those named",
        )
    else:
        status, note = (
            "not_converged",
            "feasible designs exist, but no start converged; try more starts or give one",
        )
    return _solution(
        problem,
        parameters,
        checked,
        status,
        began,
        starts=Starts(len(candidates), 0, 0),
        formulation=nlp.formulation,
        notes=(note,),
    )


def _solution(
    problem: Problem,
    parameters: Mapping[str, float],
    checked: Checked,
    status: str,
    began: float,
    *,
    active: Mapping[str, float] | None = None,
    starts: Starts | None = None,
    formulation: str = "none",
    branches: tuple[Branch, ...] = (),
    notes: tuple[str, ...] = (),
) -> Solution:
    feasible = status == "optimal"
    return Solution(
        problem=problem,
        status=status,
        value=checked.objective,
        parameters=Table(parameters),
        abscissa=checked.structure.abscissa,
        abscissa_realised=checked.realised,
        roots=checked.structure.roots,
        structure=checked.structure.name,
        active=Table(active or {}),
        violations=checked.violations,
        bound=omega0_bound(problem, checked.objective) if feasible else Bound(),
        starts=starts or Starts(),
        seconds=time.perf_counter() - began,
        quantities=checked.quantities,
        dimensionless=checked.dimensionless,
        formulation=formulation,
        freedom=freedom(problem),
        branches=branches,
        notes=(*notes, *_remarks(problem, checked, feasible)),
    )


def _remarks(problem: Problem, checked: Checked, feasible: bool) -> list[str]:
    remarks = []
    if feasible and checked.structure.abscissa >= 0 and problem.sense in ("minimize", "evaluate"):
        asked = (problem.minimize or "").strip() == "abscissa" and problem.free
        remarks.append(
            "no stable design was found in the box; this is the least unstable one"
            if asked
            else "the design is unstable"
        )
    return remarks
