"""A question for branch and bound: does any design of the box reach a limit of the objective?

If the abscissa is the objective, the limit is a fixed vertical line, and the question is about the coefficients alone.
The answer "no" makes the limit a bound for all designs of the box.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from tmsopt.algebra.formula import UnsupportedOperation, formula, symbol
from tmsopt.algebra.identity import is_linear
from tmsopt.global_search.half_planes import Frame, add_half_planes, add_sectors, bound_unknowns, compact_coefficients
from tmsopt.models.expression import Expression
from tmsopt.problem.cases import Case
from tmsopt.problem.dependence import rewards_change_of
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY
from tmsopt.program.formulate import Builder, LiftFunction
from tmsopt.program.nlp import NLP
from tmsopt.roots import Root

_NEGLIGIBLE = 1e-6  # roots below this, or above its inverse, count as 0 or infinite

_WORSE_DIRECTION = {"abscissa": 1.0, "damping_ratio": -1.0}
"""Direction in which a root quantity gets worse."""


@dataclass(frozen=True)
class Question:
    """Whether any design reaches a limit.

    Attributes:
        cases: cases in which the limits must hold; a bound for fewer cases holds for more.
        limit: value of the objective to reach; None asks for any feasible design.
        unit: typical size of the roots, a power of two.
        compact: map squared frequencies to a finite range; slower, but no variable grows with them.
    """

    problem: Posed
    cases: tuple[Case, ...] = ()
    limit: float | None = None
    unit: float = 1.0
    compact: bool = False

    def possible_signs(self) -> dict[int, dict[int, int]]:
        """Each sign that a0 can have in the first case → the signs of a0 in the cases that it determines."""
        build = Builder(self.problem, self.cases)
        leading = [compact_coefficients(self.problem.model, values)[0] for values in build.values]
        can = [(upper > 0, lower < 0) for lower, upper in build.enclose(leading)]
        first = build.covered_cases[0]
        known = {k: 1 if positive else -1 for k, (positive, negative) in enumerate(can) if positive != negative}
        alike = [k for k, a in enumerate(leading) if formula([a]) == formula([leading[first]])]
        possible = [sign for sign, some in zip((1, -1), can[first], strict=True) if some]
        return {sign: known | dict.fromkeys(alike, sign) for sign in possible}

    def leading_program(self, sign: int) -> NLP | None:
        """NLP for the least leading coefficient under the constraints; None if the box alone keeps it from 0."""
        build = Builder(self.problem, self.cases)
        first = build.covered_cases[0]
        build.objective = sign * compact_coefficients(self.problem.model, build.values[first])[0]
        if build.enclose([build.objective])[0][0] > 0:
            return None
        build.add_constraints(without=self.problem.asked_of_roots)
        return build.finish("leading")

    def program(self, sign: int, least: float = 0.0) -> NLP:
        """The question as an NLP, for one sign of a0 with |a0| ≥ `least`."""
        problem, signs = self.problem, self.possible_signs()[sign]
        if problem.asks(ANGULAR_FREQUENCY):
            raise UnsupportedOperation(ANGULAR_FREQUENCY)
        frame = Frame(problem.model, signs, self.unit, rewards_change_of(problem, "abscissa"), self.compact, least)
        carried = {"abscissa": partial(add_half_planes, frame), "damping_ratio": partial(add_sectors, frame)}
        lifts: Mapping[str, LiftFunction] = carried
        build = Builder(problem, self.cases, lifts)
        first = build.covered_cases[0]
        build.row("a0", frame.coefficients(build.values, first)[0], 0.0, np.inf)
        if problem.pattern is not None:
            build.add_pattern(problem.pattern)
            bound_unknowns(frame, build, problem.pattern)
        for name, lift in carried.items():
            value = self._required_value(name)
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

    def _required_value(self, name: str) -> float | None:
        """The value that a root quantity must reach; None if it is unused, or used in any other way."""
        problem, worse = self.problem, _WORSE_DIRECTION[name]
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
    """The worst value of a quantity that a comparison allows; None unless it is linear in that quantity alone."""
    if condition.names != (name,) or condition.equality:
        return None
    if not is_linear(formula([condition({name: symbol(name)})], [name])):  # |ζ| ≥ 1/2 looks linear from 0 to 1
        return None
    at = [float(condition({name: value})) for value in (0.0, 1.0)]
    slope = at[1] - at[0]
    return -at[0] / slope if slope * condition.sign * worse > 0 else None


def typical_size(roots: Iterable[Root]) -> float:
    """Geometric mean of the sizes of the roots, rounded to a power of two."""
    sizes = [r.size for r in roots for _ in range(r.multiplicity)]
    known = [math.log2(size) for size in sizes if _NEGLIGIBLE < size < 1 / _NEGLIGIBLE]
    return float(2.0 ** round(sum(known) / len(known))) if known else 1.0
