"""Monte Carlo over tolerances: designs drawn around a nominal one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import Fault, InputError, count_faults, is_number, limit_advice, short, suggest, text_faults
from tmsopt.problem.files import Given, pose
from tmsopt.problem.freedom import find_question_faults
from tmsopt.problem.problem import Posed, Problem
from tmsopt.problem.solution import Solution
from tmsopt.problem.verdict.status import NotSolved
from tmsopt.program.options import STARTS
from tmsopt.progress import Listener, start_steps
from tmsopt.records import Column, Table
from tmsopt.search.solve import solve, solve_if_needed
from tmsopt.studies.sampling import MOST_ROWS
from tmsopt.studies.store import check_same, view_store
from tmsopt.studies.study import Study, common_faults

DISTRIBUTIONS = ("uniform", "normal")
"""Distributions of an error: uniform within ± tolerance, or normal with a standard deviation of a third of the
tolerance, truncated at ± tolerance (0.27 % would lie beyond)."""

_DEVIATIONS = 3  # standard deviations in a tolerance


@dataclass(frozen=True)
class Sampling:
    """A Monte Carlo study whose nominal design is not solved yet; `run_study` solves it first.

    Attributes:
        problem: the problem whose optimum is the nominal design, with its tolerances unless `tolerances` are given.
        rows: number of designs to draw.
        seed: seed of the draws; the nominal design is solved with seed 0.
        distribution: ``uniform``, or ``normal`` with a third of the tolerance as standard deviation, truncated.
        starts: most starts of the nominal design.

    Raises:
        InputError: listing all faults that are known before the design is solved.

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
        problem = pose(self.problem)
        tolerances = self.tolerances or problem.tolerances
        found = [*find_question_faults(problem), *_tolerance_faults(problem, tolerances)]
        found += [*common_faults(problem, self.seed, self.starts, self.report), *text_faults(self.title, "title")]
        found += count_faults("rows", self.rows, 1, MOST_ROWS)
        if self.distribution not in DISTRIBUTIONS:
            message = f"found {short(self.distribution)}; {suggest(self.distribution, DISTRIBUTIONS)}"
            found.append(Fault(message, ("distribution",)))
        if found:
            raise InputError(found)
        vars(self).update(problem=problem.problem, tolerances=Table({n: float(t) for n, t in tolerances.items()}))


def plan_study(asked: Study | Sampling, progress: Listener | None = None, store: Path | None = None) -> Study:
    """The study with all its rows; for a Monte Carlo study, its nominal design is solved first.

    Args:
        store: the store that the rows will go to, if it must not be the one of another study.

    Raises:
        NotSolved: if the nominal design is not found.
        InputError: if the tolerances take the design out of its physical range, or for the store of another study.
    """
    if isinstance(asked, Study):
        return asked
    if store is not None and store.exists():
        _check_unchanged(asked, store)
    solution = solve(asked.problem, starts=asked.starts, progress=progress, interruptible=False)
    return _draw_around(asked, solution, progress)


def monte_carlo(
    design: Given,
    rows: int,
    seed: int = 0,
    distribution: str = "uniform",
    tolerances: Mapping[str, float] | None = None,
    *,
    title: str = "",
    report: Sequence[str] = (),
    progress: Listener | None = None,
) -> Study:
    """The study of `rows` designs drawn around one, with nothing free.

    Each parameter with a tolerance is drawn independently; the others stay. Inequalities and scenarios stay too, and a
    row that violates one is infeasible. Equalities and a pattern to locate are left out, because no drawn design
    satisfies them. A longer study begins with the rows of a shorter one.

    Args:
        design: a solution, or a problem or its file, which is solved first.
        tolerances: parameter → largest error in either direction; by default those of the design's problem.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        NotSolved: for a design that is not optimal.
        InputError: listing all faults.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> built = tmsopt.monte_carlo(tmsopt.Problem(swing, fixed={"c": 2.0, "k": 1.0}), 100, tolerances={"c": 0.1})
        >>> sorted(built.columns), len(built.columns["c"]), max(abs(c - 2) for c in built.columns["c"]) <= 0.1
        (['c'], 100, True)

    More: docs/tutorials/study.md
    """
    solution = solve_if_needed(design, progress)
    asked = Sampling(solution.problem, rows, seed, distribution, tolerances or {}, title, report=report)
    return _draw_around(asked, solution, progress)


def _draw_around(asked: Sampling, solution: Solution, progress: Listener | None) -> Study:
    start_steps(progress, "drawing designs")
    if solution.status != "optimal":
        raise NotSolved(solution)
    return _draw_study(asked, solution.parameters)


def _draw_study(asked: Sampling, design: Mapping[str, float]) -> Study:
    """The study around a design, without equalities and pattern.

    Raises:
        InputError: if the tolerances take the design out of its physical range.
    """
    problem, faults = asked.problem, list[Fault]()
    equal = [name for name, condition in problem.posed.conditions.items() if condition.equality]
    kept = {n: text for n, text in problem.constraints.items() if n not in equal}
    built = replace(problem, fixed=design, free={}, start={}, tolerances={}, locate=None, constraints=kept)
    for name, value in asked.tolerances.items():
        try:
            replace(built, tolerances={name: value})
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    errors = _errors(len(asked.tolerances), asked.rows, asked.seed, asked.distribution)
    each = zip(asked.tolerances.items(), errors, strict=True)
    left_out = ", ".join([*equal, *([f"the pattern {problem.locate}"] if problem.locate else [])])
    return Study(
        problem=built,
        columns={name: Column(built.fixed[name] + tolerance * error) for (name, tolerance), error in each},
        title=asked.title or problem.title,
        seed=asked.seed,
        report=asked.report,
        method="monte_carlo",
        notes=[f"left out, because no drawn design satisfies it exactly: {left_out}"] if left_out else [],
    )


def _check_unchanged(asked: Sampling, store: Path) -> None:
    """Refuse the store of another Monte Carlo study before the nominal design is solved.

    The study is compared with the store around the design of the store, so only other differences count.

    Raises:
        InputError: with the differences; also if the file is not a store, or damaged.
    """
    with view_store(store) as opened:
        known = opened.about()["definition"]
    try:
        design = {n: float(known["problem"]["fixed"][n]) for n in asked.problem.posed.parameter_set.names}
        drawn = _draw_study(asked, {**design, **asked.problem.fixed})
    except (InputError, KeyError, TypeError, ValueError):  # of another model, or the tolerances do not fit the design
        return
    check_same(store, drawn)


def _tolerance_faults(problem: Posed, tolerances: Any) -> list[Fault]:
    """Faults of the tolerances."""
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


def _errors(parameters: int, rows: int, seed: int, distribution: str) -> NDArray[np.float64]:
    """Errors relative to the tolerances, from −1 to 1, shape (parameters, rows)."""
    shares = np.random.default_rng(seed).random((rows, parameters)).T
    if distribution == "uniform":
        return np.asarray(2 * shares - 1)
    from scipy.special import ndtr, ndtri

    low = ndtr(-_DEVIATIONS)
    return np.clip(ndtri(low + shares * (1 - 2 * low)) / _DEVIATIONS, -1, 1)
