"""The solution of a design problem, rechecked before it is believed."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from tmsopt.checks.bound import instant_bound
from tmsopt.checks.coverage import cover
from tmsopt.checks.digits import certified
from tmsopt.checks.recheck import Checked
from tmsopt.design.files import Given, question_of
from tmsopt.design.problem import Problem, freedom
from tmsopt.design.solution import Bound, NotSolved, Solution, Starts
from tmsopt.records import Progress, Table
from tmsopt.solver.box import sides
from tmsopt.solver.multistart import STARTS
from tmsopt.solver.outcome import Finding, better, evaluated
from tmsopt.solver.search import Explored, Options, evaluated_cases, explore, without_any
from tmsopt.solver.workspace import Family


def solve(
    problem: Given,
    *,
    starts: int = STARTS,
    seed: int = 0,
    exhaustive: bool = False,
    linear_solver: str = "mumps",
    throw: bool = True,
    progress: Progress | None = None,
    near: Mapping[str, float] | None = None,
    family: Family | None = None,
    alone: bool = True,
) -> Solution:
    """Find the best design, from several starts, and check it independently of the solver.

    Args:
        problem: or the path of its file.
        starts: starts tried at most; the search ends early when several agree or optimality is proven.
        seed: of the quasi-random starting designs.
        exhaustive: try all the starts, even when several agree.
        linear_solver: ``mumps`` or ``spral``.
        throw: raise NotSolved unless the status is ``optimal``; otherwise return the best point with its status.
        progress: called with (starts done, starts at most).
        near: a design that may be close to the optimum, tried first; where both signs of a parameter are searched,
            only its own is.
        family: what was built for other problems that differ in numbers alone, to be used again.
        alone: of an infeasible problem, also find how far each limit in conflict would have to give alone.

    Raises:
        NotSolved: carrying the best point found, when `throw`.
        InputError: when parameters are free and nothing is asked of them.
        ValueError: for another linear solver or fewer than one start.
    """
    problem = question_of(problem)
    if starts < 1:
        raise ValueError(f"starts = {starts}; accepted: 1 or more")
    began = time.perf_counter()
    notes: tuple[str, ...] = ()
    values: dict[str, float] = {}
    if problem.free:
        family = family or Family()
        near = near and {n: min(max(near[n], lo), hi) for n, (lo, hi) in problem.free.items()}
        options = Options(starts, seed, exhaustive, linear_solver, progress, near, family, alone)
        explored = [explore(problem, side, options) for side in sides(problem) if near is None or side.holds(near)]
        finding = _winner(problem, explored) or without_any(problem, explored, options)
        notes = _sides_note(problem, explored, finding)
        values = _side_values(explored)
    else:
        finding = evaluated(problem, evaluated_cases(problem, problem.ordered({})))
    solution = _assembled(problem, finding, notes, values, began)
    if throw and solution.status != "optimal":
        raise NotSolved(solution)
    return solution


def solved(design: Given, **options: Any) -> Solution:
    """A solution as it is; of a problem, or of a file, what `solve` ends with under these options."""
    return design if isinstance(design, Solution) else solve(design, throw=False, **options)


def _winner(problem: Problem, explored: Sequence[Explored]) -> Finding | None:
    """The best of the findings of all parts of the box, with the starts of all of them."""
    best: Finding | None = None
    for part in explored:
        if part.finding is not None and (best is None or better(problem, part.finding, best)):
            best = part.finding
    if best is None or len(explored) == 1:
        return best
    every = [c for part in explored for c in part.candidates]
    return replace(best, starts=Starts(len(every), sum(c.feasible for c in every), best.starts.at_best))


def _side_values(explored: Sequence[Explored]) -> dict[str, float]:
    """The best objective of each part of the box; nan where it has no optimal design."""
    return {
        part.side.name: part.finding.checked.objective
        if part.finding is not None and part.finding.status == "optimal"
        else math.nan
        for part in explored
        if part.side.name
    }


def _sides_note(problem: Problem, explored: Sequence[Explored], finding: Finding) -> tuple[str, ...]:
    """Which part of the box the best design is in, and what the other one offers."""
    won = next((part for part in explored if part.finding and part.finding.parameters == finding.parameters), None)
    if len(explored) == 1 or won is None or finding.status != "optimal":
        return ()
    sentences = [f"both signs were searched: {won.side.name} wins"]
    for part in explored:
        if part is not won:
            if part.finding is None or part.finding.status != "optimal":
                sentences.append(f"with {part.side.name} nothing feasible was found")
            elif problem.objective is not None:
                sentences.append(f"the best with {part.side.name} is {part.finding.checked.objective:.9g}")
            else:
                sentences.append(f"there is one with {part.side.name} too")
    return ("; ".join(sentences),)


def _assembled(
    problem: Problem, finding: Finding, notes: tuple[str, ...], sides: dict[str, float], began: float
) -> Solution:
    checked, optimal = finding.checked, finding.status == "optimal"
    numbers = certified(problem, finding.parameters, checked, finding.cases)
    listed = bool(problem.variations or problem.tolerances)
    covered = cover(problem, finding.parameters, numbers.abscissa) if listed and optimal else None
    return Solution(
        problem=problem,
        status=finding.status,
        value=numbers.value,
        parameters=Table(finding.parameters),
        abscissa=numbers.abscissa,
        abscissa_realised=numbers.realised,
        roots=numbers.roots,
        structure=checked.structure.name,
        active=Table(finding.active),
        violations=checked.violations,
        bound=instant_bound(problem, numbers.value) if optimal else Bound(),
        starts=finding.starts,
        seconds=time.perf_counter() - began,
        quantities=numbers.quantities,
        dimensionless=numbers.dimensionless,
        formulation=finding.formulation,
        freedom=freedom(problem),
        branches=finding.branches,
        notes=(*finding.notes, *notes, *_stability_note(problem, checked, optimal)),
        worst=checked.worst if listed else None,
        least_damped=checked.least_damped if listed else None,
        cover=covered,
        sides=Table(sides),
        relaxation=finding.relaxation,
        si=numbers.si,
    )


def _stability_note(problem: Problem, checked: Checked, optimal: bool) -> tuple[str, ...]:
    if "coefficients" in checked.violations:
        return ("a coefficient has no value at this design; keep away from what divides by 0, or has no root",)
    if "a0" in checked.violations:
        known = {"tms": "nu_H and zeta_B", "whipple": "mass_margin"}
        keep = known.get(problem.model.name, "a0")
        return (f"the mass matrix is singular (a0 = 0), so a root is at infinity; keep {keep} away from 0",)
    asked = [n for n, c in problem.conditions.items() if n in checked.violations and "abscissa" in c.names]
    if asked and checked.structure.abscissa >= 0:
        return ("no stable design was found that meets the other limits; this is the least unstable one",)
    if not optimal or checked.structure.abscissa < 0:
        return ()
    if problem.free and (problem.minimize or "").strip() == "abscissa":
        return ("no stable design was found in the box; this is the least unstable one",)
    return ("the design is not stable: abscissa >= 0",)
