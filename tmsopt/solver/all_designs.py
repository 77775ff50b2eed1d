"""All designs with a pattern in a box, as far as many starts find them, with a statement of what they cover."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Unpack

import numpy as np

from tmsopt.checks.recheck import recheck
from tmsopt.design.files import Given, problem_of
from tmsopt.design.problem import Problem, freedom
from tmsopt.design.solution import Solution
from tmsopt.errors import Fault, InputError
from tmsopt.formulation.formulate import design_of, matching
from tmsopt.formulation.nlp import NLP
from tmsopt.formulation.options import Asked, Options, options_of
from tmsopt.formulation.starts import completions, spread
from tmsopt.records import Array, plain
from tmsopt.solver.multistart import Runner
from tmsopt.solver.newton import newton, square_system
from tmsopt.solver.solve import solved
from tmsopt.solver.workspace import workspace

MOST = 1024
"""Starts at most."""

_DEFAULTS = Options(starts=MOST)
_FEWEST = 48
_AGAIN = 3  # times that every solution must have been met before the search may end
_SAME = 1e-7  # of the box: distance of designs that are one solution, whatever their factors are called
_INSIDE = 1e-9  # of the box: how far outside an end counts as on it
_BY_IPOPT = 4  # every so many starts, IPOPT is asked too: it reaches what Newton's method runs away from
_DEVIATIONS = 2.0  # beyond the estimate: with `_NEVER`, 95 % for few solutions and for many, alike and unlike
_NEVER = 3.0  # −ln 5 %: what was met in none of n starts is met in fewer than 3/n of them, with 95 %


@dataclass(frozen=True)
class Coverage:
    """What a search of many starts says about what it has not found.

    Attributes:
        starts: designs that were started from, spread evenly over the box.
        hits: starts that led to each solution.
        expected: number of solutions to be expected in all, from how often each was met (Boender and Rinnooy Kan
            1987); it is an estimate, not a proof.
        chance: with 95 % confidence, the chance that one more start finds another is smaller.
        singular: starts that ended at designs with the pattern where the equations are singular, and at no other: one
            of a continuum of solutions, or one where two meet. These are not counted as solutions.
    """

    starts: int
    hits: tuple[int, ...]
    expected: float
    chance: float
    singular: int = 0

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        found = plain(self)
        expected = round(self.expected, 4) if math.isfinite(self.expected) else None
        return found | {"expected": expected, "chance": round(self.chance, 6)}


@dataclass(frozen=True)
class Every:
    """All solutions found, those met most often first."""

    solutions: tuple[Solution, ...]
    coverage: Coverage

    def to_json(self) -> dict[str, Any]:
        """Plain data for ``json.dumps``."""
        return plain(self)


def solve_all(problem: Given, **options: Unpack[Asked]) -> Every:
    """Every design in the box with the pattern that a problem locates, where that leaves no freedom.

    Newton's method runs from designs spread over the box with every way to share out their roots, and IPOPT from some
    of them, until each solution was met three times and an estimate expects no more, or after `starts`. Solutions are
    told apart by their parameters, so factors that change places are no other solution.

    Args:
        options: ``starts`` at most, `MOST` by default, ``seed``, ``linear_solver`` and ``progress``; see
            `tmsopt.Options`.

    Raises:
        InputError: for a problem that locates no pattern, leaves freedom, or constrains a quantity without a formula.
    """
    problem = problem_of(problem)
    nlp = _posed(problem)
    work = workspace(problem, options_of(options, defaults=_DEFAULTS))
    starts, progress = work.options.starts, work.options.progress
    system = square_system(nlp)
    assert system is not None  # as many conditions as parameters
    runner = Runner(work, nlp)
    width = np.array([hi - lo for lo, hi in problem.free.values()])
    found: list[Array] = []
    hits: list[int] = []
    done = singular = 0
    for design in spread(problem, work.options.seed):
        if done >= starts or _covered(done, hits):
            break
        ends = [newton(system, x) for x in completions(nlp, problem, design)]
        if done % _BY_IPOPT == 0:
            ended = runner.ended(design)
            ends.append(newton(system, ended.run.x) if ended.feasible else None)
        met: set[int] = set()
        doubtful = False
        for end in ends:
            point = None if end is None else _inside(problem, nlp, end.x)
            if end is None or point is None:
                continue
            if not end.isolated:
                doubtful = doubtful or not recheck(problem, problem.ordered(_named(problem, point))).violations
                continue
            known = next((k for k, other in enumerate(found) if np.max(np.abs(point - other) / width) <= _SAME), None)
            if known is None:
                if recheck(problem, problem.ordered(_named(problem, point))).violations:
                    continue
                known = len(found)
                found.append(point)
                hits.append(0)
            met.add(known)
        for k in met:
            hits[k] += 1
        singular += doubtful and not met
        done += 1
        if progress:
            progress(done, starts)
    order = np.argsort([-h for h in hits], kind="stable")
    solutions = [_solution(problem, _named(problem, found[k])) for k in order]
    return Every(tuple(solutions), coverage_of(done, [hits[k] for k in order], singular))


def _posed(problem: Problem) -> NLP:
    """The equations of a problem; refused where they are not those of single solutions in the parameters alone."""
    counted = freedom(problem)
    if problem.pattern is None or problem.objective is not None:
        message = "all solutions are those of a pattern; write locate = 'EP3', or another, and no minimize or maximize"
        raise InputError([Fault(message, ("objective",))])
    if counted.kind != "square" or problem.cases:
        advice = "free fewer, or add == constraints" if counted.count > 0 else "free more, or ask for less"
        free = f"{counted.free} free parameter{'' if counted.free == 1 else 's'}"
        conditions = f"{counted.conditions} condition{'' if counted.conditions == 1 else 's'}"
        message = f"{free} and {conditions} do not make single solutions; {advice}"
        raise InputError([Fault(message, ("parameters",))])
    nlp = matching(problem)
    if carried := [lift.name for lift in nlp.lifts if lift.name != problem.pattern.name]:
        found = f"the constraints use {', '.join(carried)}, which only an equation of its own or the roots define"
        accepted = "parameters, coefficients, and quantities with a formula in these"
        advice = "write them so, or ask for one design alone by solve, which names other solutions too"
        raise InputError([Fault(f"{found}; accepted: {accepted}; {advice}", ("constraints",))])
    return nlp


def _named(problem: Problem, point: Array) -> dict[str, float]:
    return dict(zip(problem.free, point.tolist(), strict=True))


def _inside(problem: Problem, nlp: NLP, x: Array) -> Array | None:
    """The free parameters of a solution in the box; None for one outside."""
    lower, upper = (np.array(ends[: len(problem.free)]) for ends in (nlp.lower, nlp.upper))
    room = _INSIDE * (upper - lower)
    own = x[: len(problem.free)]
    if np.any(own < lower - room) or np.any(own > upper + room):
        return None
    return np.array(list(design_of(problem, x.tolist()).values()))


def _covered(done: int, hits: list[int]) -> bool:
    """Whether more starts would be waste."""
    if done < _FEWEST:
        return False
    return not hits or (min(hits) >= _AGAIN and _expected(hits) <= len(hits) + 0.5)


def _expected(hits: list[int]) -> float:
    """w (n − 1)/(n − w − 2) solutions in all, for w different ones among n that were met."""
    w, n = len(hits), sum(hits)
    return w * (n - 1) / (n - w - 2) if n > w + 2 else math.inf if w else 0.0


def coverage_of(done: int, hits: list[int], singular: int = 0) -> Coverage:
    once, twice = (sum(h == k for h in hits) for k in (1, 2))
    deviation = math.sqrt(once + 2 * twice)  # of n times the chance, which Turing estimates by `once` (Good 1953)
    chance = min(1.0, (once + _DEVIATIONS * deviation + _NEVER) / max(done, 1))
    return Coverage(done, tuple(hits), _expected(hits), chance, singular)


def _solution(problem: Problem, design: Mapping[str, float]) -> Solution:
    """A design with its standing: of the same problem, where nothing is free."""
    fixed = solved(replace(problem, fixed=problem.ordered(design), free={}, start={}))
    return replace(fixed, problem=problem, freedom=freedom(problem), formulation="matching")
