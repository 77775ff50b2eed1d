"""A question for branch and bound: does any design of the box reach a limit of the objective?

If the abscissa is the objective, the limit is a fixed vertical line, so the question concerns only the coefficients.
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

_NEGLIGIBLE = 1e-6  # roots smaller than this count as 0, roots larger than its inverse as infinite

_WORSE_DIRECTION = {"abscissa": 1.0, "damping_ratio": -1.0}
"""Sign of the change that makes a root quantity worse."""


@dataclass(frozen=True)
class Question:
    """Whether any design reaches a limit.

    Attributes:
        cases: cases in which the limits must hold; a bound for some of the cases holds for all.
        limit: value of the objective to reach; None asks for any feasible design.
        unit: typical size of the roots, a power of two.
        compact: whether to map squared frequencies to a finite range; this is slower, but no variable becomes huge.
    """

    problem: Posed
    cases: tuple[Case, ...] = ()
    limit: float | None = None
    unit: float = 1.0
    compact: bool = False

    def possible_signs(self) -> dict[int, dict[int, int]]:
        """Possible sign of a0 in the first case → (index of a case → sign of a0 in that case, if it is certain)."""
        build = Builder(self.problem, self.cases)
        leading = [compact_coefficients(self.problem.model, values)[0] for values in build.values]
        sign_options = [(upper > 0, lower < 0) for lower, upper in build.enclose(leading)]
        first_case = build.covered_cases[0]
        case_signs = {
            k: 1 if positive else -1 for k, (positive, negative) in enumerate(sign_options) if positive != negative
        }
        equal_cases = [k for k, a in enumerate(leading) if formula([a]) == formula([leading[first_case]])]
        signs = [sign for sign, is_possible in zip((1, -1), sign_options[first_case], strict=True) if is_possible]
        return {sign: case_signs | dict.fromkeys(equal_cases, sign) for sign in signs}

    def leading_program(self, sign: int) -> NLP | None:
        """The NLP for the least leading coefficient under the constraints; None if the box keeps it away from 0."""
        build = Builder(self.problem, self.cases)
        first_case = build.covered_cases[0]
        build.objective = sign * compact_coefficients(self.problem.model, build.values[first_case])[0]
        if build.enclose([build.objective])[0][0] > 0:
            return None
        build.add_constraints(excluded=self.problem.asked_of_roots)
        return build.finish("leading")

    def program(self, sign: int, least_lead: float = 0.0) -> NLP:
        """The question as an NLP, for one sign of a0 with |a0| ≥ `least_lead`."""
        problem, signs = self.problem, self.possible_signs()[sign]
        if problem.asks(ANGULAR_FREQUENCY):
            raise UnsupportedOperation(ANGULAR_FREQUENCY)
        frame = Frame(problem.model, signs, self.unit, rewards_change_of(problem, "abscissa"), self.compact, least_lead)
        lift_functions = {"abscissa": partial(add_half_planes, frame), "damping_ratio": partial(add_sectors, frame)}
        lifts: Mapping[str, LiftFunction] = lift_functions
        build = Builder(problem, self.cases, lifts)
        first_case = build.covered_cases[0]
        build.add_row("a0", frame.coefficients(build.values, first_case)[0], 0.0, np.inf)
        if problem.pattern is not None:
            build.add_pattern(problem.pattern)
            bound_unknowns(frame, build, problem.pattern)
        for name, lift in lift_functions.items():
            value = self._required_value(name)
            if value is not None and name not in build.quantities:
                build.fix_quantity(name, value)
                build.lifts.append(lift(build, value).lift)
        build.add_constraints()
        if self.limit is not None:
            build.add_objective()
            sense = problem.sign
            build.add_row("limit", build.objective, -np.inf, sense * self.limit)
        build.objective = 0
        return build.finish("bound")

    def _required_value(self, name: str) -> float | None:
        """The value that a root quantity must reach; None if the problem does not require a single value."""
        problem, worse_sign = self.problem, _WORSE_DIRECTION[name]
        thresholds: list[float | None] = []
        if self.limit is not None and problem.objective is not None and name in problem.objective.names:
            is_objective = problem.objective.text.strip() == name and not rewards_change_of(problem, name, worse_sign)
            thresholds.append(self.limit if is_objective else None)
        thresholds += [_threshold(c, name, worse_sign) for c in problem.conditions.values() if name in c.names]
        values = [value for value in thresholds if value is not None]
        if not thresholds or len(values) < len(thresholds):
            return None
        return min(values) if worse_sign > 0 else max(values)


def _threshold(condition: Expression, name: str, worse_sign: float) -> float | None:
    """The worst value of a quantity that a comparison allows; None unless the comparison is linear in it only."""
    if condition.names != (name,) or condition.equality:
        return None
    if not is_linear(formula([condition({name: symbol(name)})], [name])):  # |ζ| ≥ 1/2 looks linear from 0 to 1
        return None
    differences = [float(condition({name: value})) for value in (0.0, 1.0)]
    slope = differences[1] - differences[0]
    return -differences[0] / slope if slope * condition.sign * worse_sign > 0 else None


def typical_size(roots: Iterable[Root]) -> float:
    """Geometric mean of the sizes of the roots, rounded to a power of two."""
    sizes = [r.size for r in roots for _ in range(r.multiplicity)]
    exponents = [math.log2(size) for size in sizes if _NEGLIGIBLE < size < 1 / _NEGLIGIBLE]
    return float(2.0 ** round(sum(exponents) / len(exponents))) if exponents else 1.0
