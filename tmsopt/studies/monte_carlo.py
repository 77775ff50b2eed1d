"""Monte Carlo studies: random designs within the tolerances of a nominal design."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import Fault, InputError, count_faults, is_number, limit_advice, short, suggest, text_faults
from tmsopt.problem.files import ProblemSource, pose
from tmsopt.problem.freedom import find_objective_faults
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.solution import Solution
from tmsopt.problem.verdict.status import NotSolved
from tmsopt.program.options import STARTS
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Column, Table
from tmsopt.search.solve import solve, solve_if_needed
from tmsopt.studies.sampling import MAX_ROWS
from tmsopt.studies.store import check_same_study, view_store
from tmsopt.studies.study import Study, common_faults

DISTRIBUTIONS = ("uniform", "normal")
"""Distributions of an error: uniform within ± tolerance, or normal with a third of the tolerance as standard deviation.
The normal one is truncated at ± tolerance; 0.27 % of the errors would exceed it."""

_DEVIATIONS_PER_TOLERANCE = 3  # a tolerance is this many standard deviations of the normal distribution


@dataclass(frozen=True)
class Sampling:
    """A Monte Carlo study whose nominal design is not known yet; `run_study` computes it first.

    Attributes:
        problem: its optimum is the nominal design, and its tolerances are used if `tolerances` is empty.
        rows: number of designs to draw.
        seed: seed of the draws; the nominal design is solved with seed 0.
        distribution: ``uniform``, or ``normal`` with a third of the tolerance as standard deviation, truncated.
        tolerances: parameter → largest error in either direction.
        title: one line for reports.
        starts: largest number of starts in the search for the nominal design.
        report: expressions recorded for every row.

    Raises:
        InputError: listing all faults that can be found before the nominal design is solved.

    Example:
        >>> sampling = tmsopt.load_study("problems/study_built.toml")
        >>> sampling.rows, sampling.distribution
        (500, 'normal')

    More: docs/tutorials/study.md
    """

    problem: Problem
    rows: int
    seed: int = 0
    distribution: str = "uniform"
    tolerances: Mapping[str, float] = Table()
    title: str = ""
    starts: int = STARTS
    report: Sequence[str] = ()

    def __post_init__(self) -> None:
        posed = pose(self.problem)
        tolerances = self.tolerances or posed.tolerances
        faults = [*find_objective_faults(posed), *_tolerance_faults(posed, tolerances)]
        faults += [*common_faults(posed, self.seed, self.starts, self.report), *text_faults(self.title, "title")]
        faults += count_faults("rows", self.rows, 1, MAX_ROWS)
        if self.distribution not in DISTRIBUTIONS:
            message = f"found {short(self.distribution)}; {suggest(self.distribution, DISTRIBUTIONS)}"
            faults.append(Fault(message, ("distribution",)))
        if faults:
            raise InputError(faults)
        vars(self).update(problem=posed.problem, tolerances=Table({n: float(t) for n, t in tolerances.items()}))


def prepare_study(request: Study | Sampling, progress: Listener | None = None, store: Path | None = None) -> Study:
    """The study with all its rows; the nominal design of a Monte Carlo study is solved first.

    Args:
        store: the store for the rows; if it exists, it must belong to this study.

    Raises:
        NotSolved: if the nominal design is not found.
        InputError: if a tolerance exceeds the physical range of a parameter, or the store belongs to another study.
    """
    if isinstance(request, Study):
        return request
    if store is not None and store.exists():
        _check_store_matches(request, store)
    solution = solve(request.problem, starts=request.starts, progress=progress, interruptible=False)
    return _draw_around_optimum(request, solution, progress)


def monte_carlo(
    design: ProblemSource,
    rows: int,
    seed: int = 0,
    distribution: str = "uniform",
    tolerances: Mapping[str, float] | None = None,
    *,
    title: str = "",
    report: Sequence[str] = (),
    progress: Listener | None = None,
) -> Study:
    """A study of `rows` random designs around a nominal design; all parameters of each row are fixed.

    Each parameter with a tolerance is drawn independently; the others keep their values. Scenarios and inequalities are
    kept, and a row that violates an inequality is infeasible. Equalities and the pattern to locate are left out,
    because no random design satisfies them. With the same seed, a longer study begins with the rows of a shorter one.

    Args:
        design: a solution, or a problem or its file, which is solved first.
        tolerances: parameter → largest error in either direction; by default those of the design's problem.
        progress: called from time to time with a `tmsopt.Progress`.

    Raises:
        NotSolved: if the nominal design is not optimal.
        InputError: listing all faults.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> built = tmsopt.monte_carlo(tmsopt.Problem(swing, fixed={"c": 2.0, "k": 1.0}), 100, tolerances={"c": 0.1})
        >>> sorted(built.columns), len(built.columns["c"]), max(abs(c - 2) for c in built.columns["c"]) <= 0.1
        (['c'], 100, True)

    More: docs/tutorials/study.md
    """
    solution = solve_if_needed(design, progress)
    request = Sampling(solution.problem, rows, seed, distribution, tolerances or {}, title, report=report)
    return _draw_around_optimum(request, solution, progress)


def _draw_around_optimum(request: Sampling, solution: Solution, progress: Listener | None) -> Study:
    start_steps(progress, "drawing designs")
    if solution.status != "optimal":
        raise NotSolved(solution)
    return _draw_study(request, solution.parameters)


def _draw_study(request: Sampling, design: Mapping[str, float]) -> Study:
    """The study of designs drawn around a nominal design, without equalities and without a pattern.

    Raises:
        InputError: if a tolerance exceeds the physical range of a parameter.
    """
    problem, faults = request.problem, list[Fault]()
    equalities = [name for name, condition in problem.posed.conditions.items() if condition.equality]
    inequalities = {n: text for n, text in problem.constraints.items() if n not in equalities}
    nominal = replace(problem, fixed=design, free={}, start={}, tolerances={}, locate=None, constraints=inequalities)
    for name, value in request.tolerances.items():
        try:
            replace(nominal, tolerances={name: value})
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    errors = _draw_errors(len(request.tolerances), request.rows, request.seed, request.distribution)
    draws = zip(request.tolerances.items(), errors, strict=True)
    omissions = ", ".join([*equalities, *([f"the pattern {problem.locate}"] if problem.locate else [])])
    return Study(
        problem=nominal,
        columns={name: Column(nominal.fixed[name] + tolerance * error) for (name, tolerance), error in draws},
        title=request.title or problem.title,
        seed=request.seed,
        report=request.report,
        method="monte_carlo",
        notes=[f"left out, because no drawn design satisfies it exactly: {omissions}"] if omissions else [],
    )


def _check_store_matches(request: Sampling, store: Path) -> None:
    """Check, before the nominal design is solved, that the store belongs to this Monte Carlo study.

    This check uses the nominal design that is saved in the store. If that design has changed, this check passes.

    Raises:
        InputError: with the differences; also if the file is not a store, or damaged.
    """
    with view_store(store) as content:
        definition = content.about()["definition"]
    try:
        design = {n: float(definition["problem"]["fixed"][n]) for n in request.problem.posed.parameter_set.names}
        study = _draw_study(request, {**design, **request.problem.fixed})
    except (InputError, KeyError, TypeError, ValueError):  # the store is of another model; `open_store` reports this
        return
    check_same_study(store, study)


def _tolerance_faults(problem: Posed, tolerances: Any) -> list[Fault]:
    """Faults of the tolerances, an argument that is not checked yet and may have any type."""
    if not isinstance(tolerances, Mapping) or not tolerances:
        found = f"found {short(tolerances)}" if tolerances else "no tolerances"
        accepted = "parameters with their largest error, such as lambda_s = 0.01"
        return [Fault(f"{found}; accepted: {accepted}", ("tolerances",))]
    names = problem.parameter_set.names
    faults, advice = [], limit_advice(suggest)
    for name, value in tolerances.items():
        key = ("tolerances", str(name))
        if name not in names:
            faults.append(Fault(f"unknown parameter {short(name)}; {advice(str(name), names)}", key))
        elif name in problem.scenarios:
            message = f"{name} has a scenario, so its tolerance has no effect; remove one of the two"
            faults.append(Fault(message, key))
        elif not is_number(value) or value <= 0:
            faults.append(Fault(f"found {short(value)}; accepted: a finite number greater than 0", key))
    return faults


def _draw_errors(parameter_count: int, row_count: int, seed: int, distribution: str) -> NDArray[np.float64]:
    """Errors relative to the tolerances, from −1 to 1, shape (parameter_count, row_count)."""
    uniform = np.random.default_rng(seed).random((row_count, parameter_count)).T
    if distribution == "uniform":
        return np.asarray(2 * uniform - 1)
    from scipy.special import ndtr, ndtri

    tail = ndtr(-_DEVIATIONS_PER_TOLERANCE)  # probability of an error below −tolerance
    return np.clip(ndtri(tail + uniform * (1 - 2 * tail)) / _DEVIATIONS_PER_TOLERANCE, -1, 1)
