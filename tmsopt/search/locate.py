"""Locate a pattern in a system of matrices by its Jordan chains, from many starts."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice

import numpy as np

from tmsopt.chains import (
    ExceptionalPoint,
    Family,
    Target,
    family_of,
    find_point,
    has_regular_lead,
    measure_point,
    nearest_crossing,
    refine_near,
    targets_of,
)
from tmsopt.evaluation.recheck import recheck
from tmsopt.problem import Posed, Starts, degrees_of_freedom
from tmsopt.problem.solution import OtherBranch
from tmsopt.problem.symmetry import find_symmetry
from tmsopt.program import Options
from tmsopt.program.chains import formulate_chains
from tmsopt.program.formulate import default_start
from tmsopt.program.ipopt import make_ipopt, make_polisher
from tmsopt.program.starts import sample_box
from tmsopt.program.subspaces import default_count
from tmsopt.progress import begin
from tmsopt.records import Array, Table
from tmsopt.search.outcome import Outcome, assess_design, find_active_limits

REACH_OF_CROSSING = 0.02
"""Greatest distance, as a share of the box, from where a start ends to a point at which eigenvectors do not meet."""

_MIN_STARTS = 12  # starts that look for other solutions
_SAME_POINT = 1e-7  # relative to each range: points that differ less are one solution
_ROUNDINGS = 8  # units in the last place by which a parameter may change to become a short decimal
_ZERO = 2.0**-52
_STARTS_TO_OPTIMISE = 40  # starts that look for points from which the objective is optimised
_MAX_OPTIMISED = 40  # these points at most; a fifth of them for many eigenvalues
_FEW_EIGENVALUES = 12
_EXTRA_EIGENVALUES = (0, 4, 8)  # in the subspaces of the abscissa
_CLAIM = 1e-6  # relative difference between the objective of the program and that of the recheck
_STATIONARY = 1e-7  # largest gradient of the Lagrangian, and largest violation of a row, of an optimum
_MAX_OVERSHOOT = 1e-9  # relative to a range: a point this far outside it still counts as inside


@dataclass(frozen=True)
class _Found:
    """A solution of the pattern's equations.

    Attributes:
        violated: names of the limits that it violates.
    """

    point: ExceptionalPoint
    parameters: Mapping[str, float]
    violated: tuple[str, ...]
    hits: int = 1


def has_chains(problem: Posed) -> bool:
    """Whether a problem asks for a pattern of the user's matrices, and for nothing else if they have a polynomial."""
    model = problem.model
    if not (model.statement is not None and model.pencil is not None and problem.locate and problem.free):
        return False
    is_sole_task = problem.objective is None and not has_equalities(problem)
    if model.polynomial is None:
        return not problem.asks_radius
    return is_sole_task and not problem.cases


def has_equalities(problem: Posed) -> bool:
    """Whether a constraint is an equality."""
    return any(condition.equality for condition in problem.conditions.values())


def locate_by_chains(
    problem: Posed, options: Options, extra_starts: Sequence[Mapping[str, float]] = ()
) -> Outcome | None:
    """The best solution, or without an objective the one nearest to the start; None if none is found."""
    assert problem.pattern is not None
    family, targets = family_of(problem), targets_of(problem.pattern.name, problem.model.is_complex)
    first, rng = (
        _vector(problem, {**default_start(problem), **(options.near or {})}),
        np.random.default_rng(options.seed),
    )
    further = (
        {**default_start(problem), **design}
        for design in (*extra_starts, *islice(sample_box(problem, options.seed), options.starts))
    )
    if problem.model.polynomial is not None and not has_regular_lead(problem, default_start(problem)):
        return None
    if problem.model.is_complex and find_symmetry(problem).is_hermitian:  # then a few starts show where roots cross
        options = replace(options, starts=min(options.starts, _MIN_STARTS))
    has_choice = problem.objective is not None and degrees_of_freedom(problem).count > 0
    is_thorough = has_choice and problem.model.degree <= _FEW_EIGENVALUES
    least_starts = _STARTS_TO_OPTIMISE if is_thorough else _MIN_STARTS
    begin(options.progress, "searching", "start")
    found, start_count, end = list[_Found](), 0, None
    for start in chain([first], (_vector(problem, design) for design in further)):
        choice = rng if start_count % 2 else None  # every second start chooses freely which eigenvalues shall meet
        point = find_point(family, targets, start, choice, is_patient=start_count < _MIN_STARTS)
        start_count += 1
        end = end if point is None else np.clip(point.p, *family.box.T)
        if point is not None and point.is_found:
            found = _add(problem, family, found, _shorten(family, targets, point))
        if options.progress:
            options.progress(start_count, options.starts)
        if start_count >= options.starts or (
            start_count >= min(least_starts, options.starts) and any(not f.violated for f in found)
        ):
            break
    found.sort(key=lambda f: float(np.linalg.norm((f.point.p - first) / family.widths)))
    has_active_limit = bool(found and found[0].violated) and degrees_of_freedom(problem).count > 0
    if found and (problem.objective or has_equalities(problem) or has_active_limit):
        return _optimise(problem, family, targets, found, options, start_count)
    feasible = [f for f in found if not f.violated]
    if not feasible:
        return _fail(problem, first if end is None else end, start_count, found)
    best, others = feasible[0], [f for f in found if f is not feasible[0]]
    is_square = degrees_of_freedom(problem).count <= 0
    checked = recheck(problem, best.parameters)
    if checked.violations:
        return _fail(problem, best.point.p, start_count, found)
    return Outcome(
        parameters=best.parameters,
        checked=checked,
        status="optimal",
        active_gains={},
        starts=Starts(start_count, sum(f.hits for f in found), best.hits, optima=len(found), runs=start_count),
        formulation="chains",
        branches=tuple(
            OtherBranch(Table(f.parameters), f.violated) for f in sorted(others, key=lambda f: len(f.violated))
        )
        if is_square
        else (),
    )


def _optimise(
    problem: Posed,
    family: Family,
    targets: Sequence[Target],
    found: Sequence[_Found],
    options: Options,
    start_count: int,
) -> Outcome | None:
    """The best end of IPOPT from points with the pattern; None if none is an optimum and the factors can follow."""
    most = _MAX_OPTIMISED if problem.model.degree <= _FEW_EIGENVALUES else _MAX_OPTIMISED // 5
    ranked = sorted(found, key=lambda f: (len(f.violated), _sum_violations(problem, f.parameters)))
    starts = Starts(start_count, len(found), 1, runs=start_count)
    ends = (_optimise_from(problem, family, targets, known.point, options) for known in ranked[:most])
    outcomes = [replace(end, starts=starts) for end in ends]
    best = min(
        outcomes, key=lambda o: (o.status != "optimal", sum(o.checked.violations.values()), _rank_objective(problem, o))
    )
    agreeing = [o for o in outcomes if o.status == "optimal" and _is_same_objective(problem, o, best)]
    notes = (_describe_violations(best.checked.violations),) if best.checked.violations else ()
    best = replace(best, starts=replace(best.starts, at_best=len(agreeing)), notes=notes)
    return best if best.status == "optimal" or problem.model.polynomial is None else None


def _optimise_from(
    problem: Posed, family: Family, targets: Sequence[Target], start: ExceptionalPoint, options: Options
) -> Outcome:
    """The end of IPOPT from one point; with larger subspaces if an eigenvalue outside crosses the line Re s = γ."""
    outcomes = list[Outcome]()
    for extra in _EXTRA_EIGENVALUES:
        nlp, x = formulate_chains(problem, targets, start, extra)
        point = make_polisher(nlp)(make_ipopt(nlp, options, "near")(x), nlp)
        p = np.clip(point.x[: len(problem.free)], *family.box.T)
        exact = refine_near(family, targets, p)
        if exact is not None and np.all(np.abs(exact.p - p) <= _SAME_POINT * family.widths):
            p = np.clip(exact.p, *family.box.T)
        parameters = problem.ordered(dict(zip(problem.free, p.tolist(), strict=True)))
        checked = recheck(problem, parameters)
        is_stationary = max(point.stationarity, point.violation) <= _STATIONARY
        claim = problem.sign * point.objective if problem.objective else checked.objective
        is_claimed = not problem.objective or math.isclose(claim, checked.objective, rel_tol=_CLAIM, abs_tol=_CLAIM)
        status = "optimal" if is_stationary and is_claimed and not checked.violations else "not_converged"
        gains = find_active_limits(problem, nlp, point)
        outcomes.append(Outcome(parameters, checked, status, gains, Starts(), "chains"))
        is_whole = default_count(problem.model.degree) + extra >= problem.model.degree
        if is_whole or (is_claimed and not set(checked.violations) & set(problem.asked_of_roots)):
            break
    return min(outcomes, key=lambda outcome: outcome.status != "optimal")


def _describe_violations(names: Iterable[str]) -> str:
    return f"the points with the pattern that were found violate {' or '.join(dict.fromkeys(names))}"


def _sum_violations(problem: Posed, parameters: Mapping[str, float]) -> float:
    values = problem.values(parameters)
    return sum(float(condition.violation(values)) for condition in problem.conditions.values())


def _rank_objective(problem: Posed, outcome: Outcome) -> float:
    value = problem.sign * outcome.checked.objective
    return value if np.isfinite(value) else 0.0


def _is_same_objective(problem: Posed, outcome: Outcome, best: Outcome) -> bool:
    a, b = (_rank_objective(problem, o) for o in (outcome, best))
    return abs(a - b) <= _SAME_POINT * max(1.0, abs(b))


def _fail(problem: Posed, p: Array, start_count: int, found: Sequence[_Found]) -> Outcome | None:
    """The outcome if no start leads to a solution within the limits; None if the search by factors can follow."""
    if problem.model.polynomial is not None and not find_symmetry(problem).is_hermitian:
        return None
    assert problem.pattern is not None
    inside = [f for f in found if not any(n.rpartition(".")[0] in problem.free for n in f.violated)]
    if inside:
        best = min(inside, key=lambda f: _sum_violations(problem, f.parameters))
        words = _describe_violations(n for f in inside for n in f.violated)
        outcome = assess_design(problem, best.parameters, words)
        return replace(outcome, status="not_converged", starts=Starts(start_count, runs=start_count))
    design = problem.ordered(dict(zip(problem.free, p.tolist(), strict=True)))
    outcome = assess_design(problem, nearest_crossing(problem, problem.pattern, design, REACH_OF_CROSSING))
    words = "roots meet with more than one eigenvector" if outcome.checked.is_crossing else "try more starts"
    note = f"none of {start_count} starts ended at an exceptional point within the limits: {words}"
    return replace(outcome, status="not_converged", starts=Starts(start_count, runs=start_count), notes=(note,))


def _shorten(family: Family, targets: Sequence[Target], point: ExceptionalPoint) -> ExceptionalPoint:
    """The point, with parameters replaced by decimals of 12 digits where these satisfy the equations as well."""
    short = np.array([float(f"{x:.12g}") for x in point.p])
    is_near = np.abs(short - point.p) <= _ROUNDINGS * np.spacing(np.abs(point.p)) + _ZERO * family.widths
    p = np.where(is_near, short, point.p)
    measured = None if np.array_equal(p, point.p) else measure_point(family, targets, p)
    is_as_good = measured is not None and measured.is_found and measured.backward_error <= point.backward_error + _ZERO
    return replace(measured, p=p) if measured is not None and is_as_good else point


def _vector(problem: Posed, design: Mapping[str, float]) -> Array:
    return np.array([design[n] for n in problem.free])


def _add(problem: Posed, family: Family, found: list[_Found], point: ExceptionalPoint) -> list[_Found]:
    """The solutions with one more, unless it is known already."""
    for k, known in enumerate(found):
        if np.all(np.abs(known.point.p - point.p) <= _SAME_POINT * family.widths):
            return [*found[:k], replace(known, hits=known.hits + 1), *found[k + 1 :]]
    excess = np.maximum(family.box[:, 0] - point.p, point.p - family.box[:, 1]) / family.widths
    names = [
        f"{n}.{'min' if x < low else 'max'}"
        for n, x, (low, _), e in zip(problem.free, point.p, family.box, excess, strict=True)
        if e > _MAX_OVERSHOOT
    ]
    p = point.p if names else np.clip(point.p, *family.box.T)
    parameters = problem.ordered(dict(zip(problem.free, p.tolist(), strict=True)))
    values = problem.values(parameters)
    names += [n for n, condition in problem.conditions.items() if not condition.violation(values) <= 0]
    return [*found, _Found(replace(point, p=p), parameters, tuple(names))]
