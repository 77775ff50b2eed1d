"""A problem as questions for branch and bound: is there any design that does as well as a limit?

With the abscissa the objective, the limit is a vertical line that is known, and the question is one about the
coefficients alone. If the answer is no, the limit is a bound on what any design of the box can reach.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from tmsopt.algebra.formula import UnsupportedOperation, formula, symbol
from tmsopt.algebra.identity import is_linear
from tmsopt.global_search.half_planes import Frame, bound_unknowns, compact, half_planes, sectors
from tmsopt.models.expression import Expression
from tmsopt.problem.cases import Case
from tmsopt.problem.dependence import rewards_change_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY
from tmsopt.program.formulate import Builder, LiftFunction
from tmsopt.program.nlp import NLP
from tmsopt.roots import Root

_SMALL = 1e-6  # of roots at 0 or at infinity, which say nothing of the others

_WORSE = {"abscissa": 1.0, "damping_ratio": -1.0}
"""Direction in which a root quantity gets worse."""


@dataclass(frozen=True)
class Question:
    """Whether any design reaches a limit.

    Attributes:
        cases: what the design must stand up to; fewer ask for less, and bound what more of them can reach.
        limit: value of the objective to reach; None asks for any feasible design.
        unit: usual size of the roots, a power of two.
        compact: put squared frequencies on a finite range; slower, but nothing grows with them.
    """

    problem: Posed
    cases: tuple[Case, ...] = ()
    limit: float | None = None
    unit: float = 1.0
    compact: bool = False

    def signs(self) -> dict[int, dict[int, int]]:
        """Each sign that a0 can have in the box, with that of every case where it is known then."""
        build = Builder(self.problem, self.cases)
        leading = [compact(self.problem.model, values)[0] for values in build.values]
        can = [(upper > 0, lower < 0) for lower, upper in build.enclose(leading)]
        first = build.covered_cases[0]
        known = {k: 1 if positive else -1 for k, (positive, negative) in enumerate(can) if positive != negative}
        alike = [k for k, a in enumerate(leading) if formula([a]) == formula([leading[first]])]
        possible = [sign for sign, some in zip((1, -1), can[first], strict=True) if some]
        return {sign: known | dict.fromkeys(alike, sign) for sign in possible}

    def leading(self, sign: int) -> NLP | None:
        """The least leading coefficient under the constraints; None where the box alone keeps it away from 0."""
        build = Builder(self.problem, self.cases)
        first = build.covered_cases[0]
        build.objective = sign * compact(self.problem.model, build.values[first])[0]
        if build.enclose([build.objective])[0][0] > 0:
            return None
        build.add_constraints(without=self.problem.asked_of_roots)
        return build.finish("leading")

    def program(self, sign: int, least: float = 0.0) -> NLP:
        """The question as data, for one sign of a0, which is not below `least` in size."""
        problem, signs = self.problem, self.signs()[sign]
        if problem.asks(ANGULAR_FREQUENCY):
            raise UnsupportedOperation(ANGULAR_FREQUENCY)
        frame = Frame(problem.model, signs, self.unit, rewards_change_of(problem, "abscissa"), self.compact, least)
        carried = {"abscissa": partial(half_planes, frame), "damping_ratio": partial(sectors, frame)}
        lifts: Mapping[str, LiftFunction] = carried
        build = Builder(problem, self.cases, lifts)
        first = build.covered_cases[0]
        build.row("a0", frame.coefficients(build.values, first)[0], 0.0, np.inf)
        if problem.pattern is not None:
            build.add_pattern(problem.pattern)
            bound_unknowns(frame, build, problem.pattern)
        for name, lift in carried.items():
            value = self._known(name)
            if value is not None and name not in build.quantities:
                build.fix_quantity(name, value)
                build.lifts.append(lift(build, value).lift)
        build.add_constraints()
        if self.limit is not None:
            build.add_objective()
            sense = problem.sign
            build.row("limit", build.objective, -np.inf, sense * self.limit)
        build.objective = 0
        return build.finish("bound")

    def _known(self, name: str) -> float | None:
        """The value that a root quantity must reach, where nothing else is asked of it; None where it must be found."""
        problem, worse = self.problem, _WORSE[name]
        reach: list[float | None] = []
        if self.limit is not None and problem.objective is not None and name in problem.objective.names:
            alone = problem.objective.text.strip() == name and not rewards_change_of(problem, name, worse)
            reach.append(self.limit if alone else None)
        reach += [_threshold(c, name, worse) for c in problem.conditions.values() if name in c.names]
        found = [value for value in reach if value is not None]
        if not reach or len(found) < len(reach):
            return None
        return min(found) if worse > 0 else max(found)


def _threshold(condition: Expression, name: str, worse: float) -> float | None:
    """The value that a comparison allows a quantity at worst, where it is linear in that and nothing else."""
    if condition.names != (name,) or condition.equality:
        return None
    if not is_linear(formula([condition({name: symbol(name)})], [name])):  # |ζ| ≥ 1/2 looks linear from 0 to 1
        return None
    at = [float(condition({name: value})) for value in (0.0, 1.0)]
    slope = at[1] - at[0]
    return -at[0] / slope if slope * condition.sign * worse > 0 else None


def unit_of(roots: Iterable[Root]) -> float:
    """Geometric mean of the sizes of roots, as a power of two."""
    sizes = [r.size for r in roots for _ in range(r.multiplicity)]
    known = [math.log2(size) for size in sizes if _SMALL < size < 1 / _SMALL]
    return float(2.0 ** round(sum(known) / len(known))) if known else 1.0
