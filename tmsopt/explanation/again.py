"""A problem with one limit moved, solved again from the optimum: what several of them share is built and seen once."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tmsopt.design.expression import written_sides
from tmsopt.design.limit import limit_of, with_limit
from tmsopt.design.problem import Problem
from tmsopt.design.solution import Solution
from tmsopt.formulation.formulate import LIMIT
from tmsopt.formulation.nlp import objective_size
from tmsopt.formulation.options import DEFAULTS
from tmsopt.records import Array
from tmsopt.solver.sample import Sampler
from tmsopt.solver.solve import solved
from tmsopt.solver.workspace import Family, workspace

_LOST = 1e-7  # relative difference of the objective that makes a design better
_REACHES = (0.03, 8e-3, 2e-3, 4e-4)  # of the box, about the best designs that were seen without the move


@dataclass(frozen=True)
class Again:
    """Solves again from an optimum.

    Attributes:
        steps: limit → by how much it is to be moved.
    """

    solution: Solution
    steps: Mapping[str, float]

    def solved(self, asked: Problem, name: str, starts: int) -> Solution:
        """The solution of the problem with the limit of that name moved.

        From the optimum alone the box need not be looked at anew: unless one of the best designs that were seen of it,
        improved under the limits as they are now, is better than what is found.
        """
        free = {n: self.solution.parameters[n] for n in asked.free}
        options = replace(DEFAULTS, starts=starts, near=free)
        part = _part(asked, free)
        if starts == 1 and part and self._seen and self.solution.stable:
            found = solved(asked, options, self._family if name in self._shared else None, blind=True, bound=False)
            if found.status == "optimal" and found.stable and not self._outdone(part, found):
                return found
        return solved(asked, options, bound=False)

    @cached_property
    def _shared(self) -> list[str]:
        """Limits that are numbers of the same NLP: ends of ranges, and what constraints compare with."""
        limits = self.solution.problem.constraints
        return [name for name in self.steps if name not in limits or _number(limits[name]) is not None]

    @cached_property
    def _family(self) -> Family:
        problem = self.solution.problem
        every = [moved(problem, n, self.steps[n]).free for n in self._shared]
        box = {n: (min(f[n][0] for f in every), max(f[n][1] for f in every)) for n in problem.free}
        return Family([n + LIMIT for n in self._shared if n in problem.constraints], box=box)

    @cached_property
    def _seen(self) -> tuple[list[dict[str, float]], Array] | None:
        """The best designs of the box far from each other, and the scales of limits; None where arrays cannot tell."""
        problem = self.solution.problem
        part = _part(problem, self.solution.parameters)
        sampler = workspace(part).sampler if part else None
        if sampler is None:
            return None
        refined = sampler.sample().refined
        return [sampler.design(refined, k) for k in range(len(refined))], sampler.scales

    def _outdone(self, part: Problem, found: Solution) -> bool:
        """Whether a design that was looked at is better than what was found."""
        assert self._seen
        sampler, (designs, scales) = Sampler(part, DEFAULTS.seed), self._seen
        sampler.scales = scales
        start = sampler.look(np.array([sampler.space.points(design) for design in designs]))
        looked = sampler.refined(start, _REACHES).joined(sampler.around(found.parameters))
        worth = part.sign * found.value
        least = worth - _LOST * (objective_size(part) + abs(worth))
        return bool(np.any((looked.violation == 0) & (looked.worth < least)))


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
