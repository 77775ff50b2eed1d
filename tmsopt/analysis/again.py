"""A problem with one limit moved, solved again from the optimum: what several of them share is built and seen once."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tmsopt.problem.expression import written_sides
from tmsopt.problem.limit import limit_of, with_limit
from tmsopt.problem.problem import Problem
from tmsopt.problem.solution import Solution
from tmsopt.program.formulate import LIMIT
from tmsopt.program.judgement import Judged
from tmsopt.program.nlp import objective_size
from tmsopt.program.options import DEFAULTS
from tmsopt.records import Array, Truth
from tmsopt.search.basins import Looked, apart
from tmsopt.search.sample import Remembered, Sampler
from tmsopt.search.solve import solve_any_status
from tmsopt.search.workspace import Family, workspace

_LOST = 1e-7  # relative difference of the objective that makes a design better
_ENTERED = 8  # designs far from each other that a move lets in
_MET = 1e-10  # of its scale: excess up to which a limit counts as met
_REACHES = (0.03, 8e-3, 2e-3, 4e-4)  # of the box, about the best designs that were seen without the move


@dataclass(frozen=True)
class LimitResolver:
    """Solves again from an optimum.

    Attributes:
        steps: limit → by how much it is to be moved.
    """

    solution: Solution
    steps: Mapping[str, float]

    def solved(self, asked: Problem, name: str, starts: int) -> Solution:
        """The solution of the problem with the limit of that name moved.

        From the optimum alone the box need not be looked at anew: unless one of the best designs that were seen of it,
        or that the move lets in, improved under the limits as they are now, is better than what is found.
        """
        free = {n: self.solution.parameters[n] for n in asked.free}
        options = replace(DEFAULTS, starts=starts, near=free)
        part = _part(asked, free)
        if starts == 1 and part and self._seen and self.solution.stable:
            found = solve_any_status(
                asked, options, self._family if name in self._shared else None, without_sample=True, bound=False
            )
            if found.status == "optimal" and found.stable and not self._outdone(part, name, found):
                return found
        return solve_any_status(asked, options, bound=False)

    @cached_property
    def _shared(self) -> list[str]:
        """Limits that are numbers of the same NLP: ends of ranges, and what constraints compare with."""
        limits = self.solution.problem.constraints
        return [name for name in self.steps if name not in limits or _number(limits[name]) is not None]

    @cached_property
    def _box(self) -> dict[str, tuple[float, float]]:
        """The box with all its ends moved."""
        problem = self.solution.problem
        for name, step in self.steps.items():
            problem = problem if name in problem.constraints else moved(problem, name, step)
        return dict(problem.free)

    @cached_property
    def _family(self) -> Family:
        limits = self.solution.problem.constraints
        return Family([n + LIMIT for n in self._shared if n in limits], box=self._box)

    @cached_property
    def _seen(self) -> "_Seen | None":
        """A look at that box; None where arrays cannot tell."""
        part = _part(replace(self.solution.problem, free=self._box), self.solution.parameters)
        told = workspace(part).sampler if part else None
        if part is None or told is None:
            return None
        sampler = Sampler(part, DEFAULTS.seed, memory := Remembered())
        refined = sampler.sample().refined
        u, found = sampler.recalled(memory)
        best = [sampler.design(refined, k) for k in range(len(refined))]
        return _Seen(best, u, sampler.space.designs(u), found, sampler.scales)

    def _outdone(self, part: Problem, name: str, found: Solution) -> bool:
        """Whether a design that was looked at is better than what was found."""
        problem, seen = self.solution.problem, self._seen
        assert seen
        sampler = Sampler(part, DEFAULTS.seed)
        sampler.scales = seen.scales
        shift = np.array([c.sign * self.steps[name] if n == name else 0.0 for n, c in problem.conditions.items()])
        let_in = seen.met(part, shift) & ~seen.met(problem, 0 * shift)
        rows = np.flatnonzero(let_in)
        rows = rows[np.argsort(seen.worth[rows], kind="stable")]
        entered = Looked(seen.u[rows], seen.worth[rows], np.zeros(len(rows)))
        more = [{n: float(x[k]) for n, x in seen.columns.items()} for k in rows[apart(entered, _ENTERED)]]
        start = sampler.look(np.array([sampler.space.points(design) for design in (*seen.best, *more)]))
        looked = sampler.refined(start, _REACHES).joined(sampler.around(found.parameters))
        worth = part.sign * found.value
        least = worth - _LOST * (objective_size(part) + abs(worth))
        return bool(np.any((looked.violation == 0) & (looked.worth < least)))


@dataclass(frozen=True)
class _Seen:
    """Designs of the box with all its ends moved, under the other limits as they were.

    Attributes:
        best: the best far from each other, refined.
        u, columns, judged: the sample that these are of, as points, as parameters, and what is said of it.
        scales: of the limits.
    """

    best: list[dict[str, float]]
    u: Array
    columns: Mapping[str, Array]
    judged: Judged
    scales: Array

    @property
    def worth(self) -> Array:
        """Of the sample; larger is worse."""
        return np.zeros(len(self.u)) if self.judged.worth is None else self.judged.worth

    def met(self, problem: Problem, shift: Array) -> Truth:
        """Which of the sample are in a box and meet limits that are moved."""
        excess = replace(self.judged, beyond=self.judged.beyond - shift[:, None]).excess
        inside = [(lo <= self.columns[n]) & (self.columns[n] <= hi) for n, (lo, hi) in problem.free.items()]
        return np.asarray(np.logical_and.reduce([*inside, *(excess <= _MET * self.scales[:, None])]))


def moved(problem: Problem, name: str, step: float) -> Problem:
    """The problem with one limit changed by a step: a bound, or the right-hand side of a constraint."""
    if name in problem.constraints:
        text = problem.constraints[name]
        left, sign, right = written_sides(text)
        number = _number(text)
        if number is None:
            text = f"({left}) {sign} ({right}) {'+' if step > 0 else '-'} {abs(step)!r}"
        else:
            text = with_limit(text, number + step)
        return replace(problem, constraints={**problem.constraints, name: text})
    parameter, end = name.rsplit(".", 1)
    lower, upper = problem.free[parameter]
    ends = (lower, upper + step) if end == "max" else (lower + step, upper)
    return replace(problem, free={**problem.free, parameter: ends})


def _number(text: str) -> float | None:
    """The number that is the right-hand side of a constraint, if one is, and none stands left."""
    left, sign, right = written_sides(text)
    return limit_of(f"{right} {sign} x") if limit_of(f"{left} {sign} x") is None else None


def _part(problem: Problem, design: Mapping[str, float]) -> Problem | None:
    """The part of the box that a design is on; None where it is on two."""
    parts = workspace(problem).parts(design)
    return parts[0].part if len(parts) == 1 else None
