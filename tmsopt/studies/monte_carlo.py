"""Monte Carlo over tolerances: a design built many times, each time a little off."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.errors import Fault, InputError, count_faults, is_number, limit_advice, short, suggest, text_faults
from tmsopt.files import as_path
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
"""Of an error: uniform within ± tolerance; or normal, its standard deviation a third of the tolerance, cut off at
± tolerance, as if the 0.27 % beyond were sorted out."""

_DEVIATIONS = 3  # standard deviations in a tolerance


@dataclass(frozen=True)
class Sampling:
    """A Monte Carlo study whose design has yet to be found; `run_study` finds it first.

    Attributes:
        problem: its optimum is the design; its tolerances are drawn from, unless `tolerances` are given.
        rows: designs drawn.
        seed: of the draws; the nominal design is solved from the starts of seed 0.
        distribution: uniform, or normal with a third of the tolerance as its standard deviation, cut off there.
        starts: of the nominal design, at most.

    Raises:
        InputError: listing everything that is wrong, as far as it shows before the design is known.

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
    tolerances: Mapping[str, float] = field(default_factory=dict)
    title: str = ""
    starts: int = STARTS
    report: Sequence[str] = ()

    def __post_init__(self) -> None:
        problem = pose(self.problem)
        object.__setattr__(self, "problem", problem.problem)
        if not self.tolerances:
            object.__setattr__(self, "tolerances", problem.tolerances)
        found = [*find_question_faults(problem), *_tolerance_faults(problem, self.tolerances)]
        found += [*common_faults(problem, self.seed, self.starts, self.report), *text_faults(self.title, "title")]
        found += count_faults("rows", self.rows, 1, MOST_ROWS)
        if self.distribution not in DISTRIBUTIONS:
            message = f"found {short(self.distribution)}; {suggest(self.distribution, DISTRIBUTIONS)}"
            found.append(Fault(message, ("distribution",)))
        if found:
            raise InputError(found)
        object.__setattr__(self, "tolerances", Table({n: float(t) for n, t in self.tolerances.items()}))


def planned(asked: Study | Sampling, progress: Listener | None = None) -> Study:
    """The study with all its rows: of a Monte Carlo study, once its nominal design is solved.

    Raises:
        NotSolved: when there is no design to draw around.
        InputError: when the design cannot be drawn around.
    """
    if isinstance(asked, Study):
        return asked
    return _around(asked, solve(asked.problem, starts=asked.starts, progress=progress, interruptible=False), progress)


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
    """The study of `rows` designs drawn around one, in which nothing is free.

    Each parameter with a tolerance is drawn on its own; the others stay as they are. Inequalities and scenarios stay,
    so that a row is infeasible where one is violated. Equalities and a pattern to locate are left out: no drawn design
    meets them. The first rows of a longer study are those of a shorter one.

    Args:
        design: a solution; or a problem or its file, solved first.
        tolerances: parameter → how far it may be off either way; those of the design's problem where None.
        progress: called with a `tmsopt.Progress` now and then.

    Raises:
        NotSolved: for a design that is not optimal.
        InputError: listing everything else that is wrong.

    Example:
        >>> swing = tmsopt.models.from_coefficients([1, "c", "k"])
        >>> built = tmsopt.monte_carlo(tmsopt.Problem(swing, fixed={"c": 2.0, "k": 1.0}), 100, tolerances={"c": 0.1})
        >>> sorted(built.columns), len(built.columns["c"]), max(abs(c - 2) for c in built.columns["c"]) <= 0.1
        (['c'], 100, True)

    More: docs/tutorials/study.md
    """
    solution = solve_if_needed(design, progress)
    asked = Sampling(solution.problem, rows, seed, distribution, tolerances or {}, title, report=report)
    return _around(asked, solution, progress)


def _around(asked: Sampling, solution: Solution, progress: Listener | None) -> Study:
    start_steps(progress, "drawing designs")
    if solution.status != "optimal":
        raise NotSolved(solution)
    return _drawn(asked, solution.parameters)


def _drawn(asked: Sampling, design: Mapping[str, float]) -> Study:
    """The study around any design, in which nothing is asked that no product can meet.

    Raises:
        InputError: for tolerances that take the design out of its physical range.
    """
    problem = asked.problem
    equal = [name for name, condition in problem.posed.conditions.items() if condition.equality]
    left_out = equal + ([f"the pattern {problem.locate}"] if problem.locate else [])
    kept = {n: text for n, text in problem.constraints.items() if n not in equal}
    stated: dict[str, Any] = {"free": {}, "start": {}, "tolerances": {}, "locate": None, "constraints": kept}
    built, faults = replace(problem, fixed=dict(design), **stated), list[Fault]()
    for name, value in asked.tolerances.items():
        try:
            replace(built, tolerances={name: value})
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    errors = _errors(len(asked.tolerances), asked.rows, asked.seed, asked.distribution)
    each = zip(asked.tolerances.items(), errors, strict=True)
    return Study(
        problem=built,
        columns={name: Column(built.fixed[name] + tolerance * error) for (name, tolerance), error in each},
        title=asked.title or problem.title,
        seed=asked.seed,
        report=asked.report,
        method="monte_carlo",
        notes=[f"left out, for no drawn design meets it exactly: {', '.join(left_out)}"] if left_out else [],
    )


def check_unchanged(study: Study | Sampling, store: str | PathLike[str]) -> None:
    """Refuse the store of another Monte Carlo study before its design is found, if no design would make it the same.

    That is so where it is another one around the design of the store, too.

    Raises:
        InputError: with the differences; where the store is none, or damaged.
    """
    path = as_path(store, "an SQLite file")
    if not isinstance(study, Sampling) or not path.exists():
        return
    with view_store(path) as opened:
        known = opened.about()["definition"]
    try:
        design = {n: float(known["problem"]["fixed"][n]) for n in study.problem.posed.parameter_set.names}
        drawn = _drawn(study, {**design, **study.problem.fixed})
    except (InputError, KeyError, TypeError, ValueError):  # of another model, or a design that cannot be drawn around
        return
    check_same(path, drawn)


def _tolerance_faults(problem: Posed, tolerances: Any) -> list[Fault]:
    """What is wrong with tolerances to draw from."""
    if not isinstance(tolerances, Mapping) or not tolerances:
        found = f"found {short(tolerances)}" if tolerances else "no tolerances"
        accepted = "parameters and how far each may be off, such as lambda_s = 0.01"
        return [Fault(f"{found}; accepted: {accepted}", ("tolerances",))]
    names = problem.parameter_set.names
    faults, advice = [], limit_advice(suggest)
    for name, value in tolerances.items():
        key = ("tolerances", str(name))
        if name not in names:
            faults.append(Fault(f"unknown parameter {short(name)}; {advice(str(name), names)}", key))
        elif name in problem.scenarios:
            message = f"{name} has a scenario, which a drawn value would not change; leave out one of the two"
            faults.append(Fault(message, key))
        elif not is_number(value) or value <= 0:
            faults.append(Fault(f"found {short(value)}; accepted: a finite number greater than 0", key))
    return faults


def _errors(parameters: int, rows: int, seed: int, distribution: str) -> NDArray[np.float64]:
    """Errors in tolerances, from −1 to 1: (parameters, rows)."""
    shares = np.random.default_rng(seed).random((rows, parameters)).T
    if distribution == "uniform":
        return np.asarray(2 * shares - 1)
    from scipy.special import ndtr, ndtri

    low = ndtr(-_DEVIATIONS)
    return np.clip(ndtri(low + shares * (1 - 2 * low)) / _DEVIATIONS, -1, 1)
