"""From a problem to plain NLP data, by factors of the characteristic polynomial; no eigenvalue, no division.

``abscissa`` lifts root quantities into factor coefficients; ``matching`` equates the coefficients with those of a
pattern. Both share how parameters, quantities and constraints become variables and rows. Every case that the design
must stand up to has factors of its own, and shares the design and the root quantities with the others.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from tmsopt.algebra.formula import constant, depends_on, fold, formula, make_node, symbol
from tmsopt.algebra.intervals import Interval, ball, interval
from tmsopt.algebra.kinds import INTERVALS
from tmsopt.models import Quantity, Values, decimal
from tmsopt.models.expression import Expression
from tmsopt.problem.cases import Case
from tmsopt.problem.dependence import demands_heavy_damping, depends_on_case, needs_two_sided_bounds, rewards_change_of
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.problem.limit import limit_value
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY, NO_RADIUS, RADIUS, ROOT_QUANTITIES
from tmsopt.program.boundary_points import lift_displacements, lift_feet
from tmsopt.program.kinks import epigraph_form
from tmsopt.program.lifts import (
    Lifted,
    lift_abscissa,
    lift_damping_ratio,
    lift_positive_root,
    lift_quantity,
    lift_radius,
    lift_real_roots,
    worst_guess,
)
from tmsopt.program.nlp import (
    NLP,
    AddedVariable,
    Contact,
    Factor,
    name_of,
    objective_size,
    objective_unit,
    scale_of,
    units_of,
)
from tmsopt.program.strips import lift_angular_frequency
from tmsopt.records import Table
from tmsopt.roots import Pattern

Lifting = Callable[["Builder"], Lifted]
"""Variables and rows for a root quantity in the covered ones of all cases."""

LIMIT = ".limit"
"""Ending of the name of the number that a constraint compares with."""

_LEEWAY = 1e-9  # below a constant that a quantity is never less than


def formulate(
    problem: Posed,
    cases: Sequence[Case] = (),
    elastic: bool = False,
    damping_ratio: float | None = None,
    lead: int = 0,
) -> NLP:
    """The formulation that the problem asks for: ``matching`` for a pattern, else ``abscissa``; its kinks as variables.

    Args:
        cases: what the design must stand up to; the nominal design alone, without any.
        elastic: leave every constraint a row that can be relaxed.
        damping_ratio: take this for it: 1, by real roots, or −1, and leave it to the recheck whether it is.
        lead: sign of a0, where the NLP is to go as far as a0 = 0.
    """
    located = matching(problem, cases=cases) if problem.pattern else None
    nlp = located or abscissa(problem, cases, elastic, damping_ratio, lead)
    return epigraph_form(nlp, needs_two_sided_bounds(problem))


def abscissa(
    problem: Posed,
    cases: Sequence[Case] = (),
    elastic: bool = False,
    damping_ratio: float | None = None,
    lead: int = 0,
) -> NLP:
    """Optimise the objective with every root quantity carried by factors, in every case; real ones if all must be."""
    build = Builder(problem, cases, lead=lead)
    if damping_ratio == 1 or (damping_ratio is None and not elastic and demands_heavy_damping(problem)):
        build.real_roots()
    elif damping_ratio is not None:
        build.take("damping_ratio", damping_ratio)
        if len(build.covered) == 1 and rewards_change_of(problem, "damping_ratio", worse=-1.0):
            build.lifts.append(lift_positive_root(build))
    build.constraints()
    build.optimise()
    return build.finish("abscissa")


def matching(problem: Posed, pattern: Pattern | None = None, cases: Sequence[Case] = ()) -> NLP:
    """Match coefficients with a pattern: a_k = a0 · c_k(unknowns).

    Square: the equations alone. Under-determined: the objective, or the distance to the start relative to the box.
    Over-determined: least squares of the equations.
    """
    pattern = pattern or problem.pattern
    if pattern is None:
        raise ValueError("matching needs a pattern; give the problem locate = 'EP4' or another")
    build = Builder(problem, cases)
    build.pattern(pattern)
    build.constraints()
    left = degrees_of_freedom(problem).count
    if problem.objective is not None and left >= 0:
        build.optimise()
    elif left > 0:
        build.nearest_to(middle(problem))
    return build.finish("matching")


def variables_of(problem: Posed, design: Mapping[str, float]) -> list[float]:
    """The NLP's first variables for free parameters."""
    of = problem.parameter_set
    return [float(np.tan(design[n])) if of[n].tangent else float(design[n]) for n in problem.free]


def design_of(problem: Posed, x: Sequence[float]) -> dict[str, float]:
    """The free parameters for variables of the NLP, inside their ranges."""
    of = problem.parameter_set
    plain = {n: float(np.arctan(v)) if of[n].tangent else float(v) for n, v in zip(problem.free, x, strict=False)}
    return {n: min(max(v, problem.free[n][0]), problem.free[n][1]) for n, v in plain.items()}


def middle(problem: Posed) -> dict[str, float]:
    """The start of each free parameter, or the middle of its range."""
    return {n: problem.start.get(n, (lo + hi) / 2) for n, (lo, hi) in problem.free.items()}


class Builder:
    """Collects variables and rows; discarded once the NLP is finished.

    Args:
        lifts: root quantity → how it is carried by variables; by default by factors.
        lead: sign of a0 in an NLP that goes as far as a0 = 0.
    """

    def __init__(
        self,
        problem: Posed,
        cases: Sequence[Case],
        lifts: Mapping[str, Lifting] | None = None,
        lead: int = 0,
    ) -> None:
        self.problem, self.lead = problem, lead
        self.numbers = numbers_of(problem)
        self.lifting = _LIFTED if lifts is None else lifts
        self.cases = tuple(cases)
        self.names: list[str] = []
        self.x: list[Any] = []
        self.bounds: list[tuple[float, float]] = []
        self.rows: list[tuple[str, Any, float, float]] = []
        self.lifts: list[AddedVariable] = []
        self.touches: dict[str, tuple[Contact, ...]] = {}
        self.products: list[tuple[Factor, ...]] = []
        self.shared: dict[str, Any] = {}
        self.taken: set[str] = set()
        self.objective: Any = 0
        self.design = {name: self.parameter(name, *ends) for name, ends in problem.free.items()}
        nominal = problem.ordered({**self.design, **{n: symbol(n) for n in problem.fixed if n in self.numbers}})
        directed = [k for k, case in enumerate(self.cases, start=1) if case.direction]
        radius = self.variable(RADIUS, 0.0) if directed else constant(0)
        edges = {k: case.edge for k, case in enumerate(self.cases, start=1) if case.edge}
        feet = {k: {n: self.variable(f"{n}.{k}") for n in self.cases[k - 1].direction} for k in edges}
        moved = [replace(case, direction=feet.get(k, case.direction)) for k, case in enumerate(self.cases, start=1)]
        varied = [case.applied(nominal, radius, problem.weights) for case in moved]
        self.values = [self.derived(k, parameters) for k, parameters in enumerate([nominal, *varied])]
        self.scale = scale_of(problem)
        self.a = self.polynomial(0)
        self.covered = [k for k, case in enumerate(self.cases, start=1) if not case.direction] or [0]
        if directed:
            self.lifts.append(lift_displacements(problem.weights, feet))
            self.lifts.append(lift_radius(self, [k for k in directed if k not in feet]))
            self.shared[RADIUS] = radius
        if feet:
            known = partial(_known, problem)
            self.lifts.append(lift_feet(self, radius, feet, edges, known, problem.weights))

    @property
    def unit(self) -> float:
        return self.scale.unit

    @property
    def leading_unit(self) -> float:
        return self.scale.lead

    def polynomial(self, case: int) -> list[Any]:
        """Coefficients in one case, near 1 as roots and mass matrices go."""
        return self.scale.scaled(self.values[case].coefficients)

    @property
    def size(self) -> tuple[int, int]:
        return len(self.x), len(self.rows)

    def derived(self, case: int, parameters: Mapping[str, Any]) -> Values:
        """Everything derived from the design in one case."""
        of = self.problem.parameter_set
        lift = partial(self._lift, case)
        return Values(self.problem.model, of, parameters, extra=(*ROOT_QUANTITIES, NO_RADIUS), lift=lift)

    def variable(self, name: str, lower: float = -np.inf, upper: float = np.inf) -> Any:
        self.names.append(name)
        self.x.append(symbol(name_of(len(self.x))))
        self.bounds.append((lower, upper))
        return self.x[-1]

    def parameter(self, name: str, lower: float, upper: float) -> Any:
        """A free parameter, as a variable or as the arctangent of one."""
        if self.problem.parameter_set[name].tangent:
            return make_node("atan", self.variable(f"tan({name})", np.tan(lower), np.tan(upper)))
        return self.variable(name, lower, upper)

    def row(self, name: str, expression: Any, lower: float, upper: float) -> None:
        self.rows.append((name, constant(expression), lower, upper))

    def equal(self, name: str, left: Sequence[Any], right: Sequence[Any]) -> None:
        """Equations between coefficient lists; the leading ones agree by construction."""
        for a, b in zip(left[1:], right[1:], strict=True):
            self.row(name, a - b, 0.0, 0.0)

    def real_roots(self) -> None:
        """Every case heavily damped."""
        asked = (self.problem.objective, *self.problem.conditions.values())
        line = any("abscissa" in expression.names for expression in asked if expression)
        lifted = lift_real_roots(self, line)
        self.lifts.append(lifted.lift)
        self.take("damping_ratio", 1.0)
        self.take(ANGULAR_FREQUENCY, 0.0)
        if line:
            self.touches["abscissa"] = lifted.touches
            self.shared["abscissa"] = lifted.symbol

    def take(self, name: str, value: float) -> None:
        """A number for a root quantity; limits on it alone hold by the form of the factors, or the recheck tells."""
        self.shared[name] = constant(value)
        self.taken.add(name)

    def constraints(self, without: Collection[str] = ()) -> None:
        """A row for each constraint in each case that it differs in."""
        for name, condition in self.problem.conditions.items():
            if name in without:
                continue
            if len(condition.names) == 1 and condition.names[0] in self.taken:
                continue
            limit = symbol(name + LIMIT) if name + LIMIT in self.numbers else None
            for value in self.in_each_case(condition, limit):
                self.row(name, value, *condition.allowed)

    def optimise(self) -> None:
        """The objective: where it differs between cases, the worst of them."""
        expression = self.problem.objective
        if expression is None:
            return
        sign = self.problem.sign
        values = [sign * value for value in self.in_each_case(expression)]
        self.objective = values[0]
        if len(values) > 1:
            self.objective = self.variable("objective")
            worst = partial(worst_guess, sign, expression, tuple(self.covered))
            self.lifts.append(AddedVariable("objective", 1, worst))
            for value in values:
                self.row("objective", value - self.objective, -np.inf, 0.0)

    def in_each_case(self, expression: Expression, limit: Any = None) -> list[Any]:
        """The expression's value in every case that it differs in, or the nominal one; see `Expression.difference`."""
        covered = self.covered if depends_on_case(self.problem, expression, self.cases) else [0]
        each = [self.values[k] for k in covered]
        return [expression(v) if limit is None else expression.difference(v, limit) for v in each]

    def pattern(self, pattern: Pattern) -> None:
        unknowns = [self.variable(f"{pattern.name}.{u}") for u in pattern.unknowns]
        self.lifts.append(AddedVariable(pattern.name, len(unknowns), lambda v, z: pattern.guesses(z[0])))
        if pattern.abscissa is not None and self.covered == [0]:
            self.shared["abscissa"] = self.unit * pattern.abscissa(unknowns)
        matched = [self.a[0] * c for c in pattern.monic(unknowns)]
        if degrees_of_freedom(self.problem).count >= 0:
            self.equal(pattern.name, self.a, matched)
        else:
            self.objective = sum((a - b) ** 2 for a, b in zip(self.a, matched, strict=True))
        for expression in pattern.nonnegative(unknowns):
            self.row(pattern.name, expression, 0.0, np.inf)

    def nearest_to(self, design: Mapping[str, float]) -> None:
        for name, variable in self.design.items():
            lower, upper = self.problem.free[name]
            self.objective += ((variable - design[name]) / (upper - lower)) ** 2

    def finish(self, formulation: str) -> NLP:
        names = (*map(name_of, range(len(self.x))), *self.numbers)
        names_of_rows, expressions, row_lower, row_upper = zip(*self.rows, strict=True) if self.rows else ((),) * 4
        lower, upper = zip(*self.bounds, strict=True) if self.bounds else ((),) * 2
        return NLP(
            formulation=formulation,
            variables=tuple(self.names),
            formula=formula([self.objective, *expressions], names),
            numbers=self.numbers,
            lower=lower,
            upper=upper,
            rows=names_of_rows,
            row_lower=row_lower,
            row_upper=row_upper,
            lifts=tuple(self.lifts),
            cases=self.cases,
            touches=self.touches,
            products=tuple(self.products),
            exact=bool(self.products) and formulation == "abscissa",
            unit=self.unit,
            size=objective_size(self.problem),
            units=units_of(self.problem),
            objective_unit=objective_unit(self.problem),
        )

    def over(self, expressions: Sequence[Any]) -> list[Interval]:
        """Ranges of expressions over the variables so far, by interval arithmetic.

        Raises:
            UnsupportedOperation: for an operation that has none.
        """
        over = {name_of(k): ball(ends) for k, ends in enumerate(self.bounds)}
        numbers = {n: INTERVALS.constant(decimal(x)) for n, x in self.numbers.items()}
        return [interval(x) for x in fold(formula(expressions), over | numbers, INTERVALS)]

    def _lift(self, case: int, quantity: Quantity, values: Values) -> Any:
        """A quantity as a variable, bound by factors or by its division-free equation."""
        name = quantity.name
        if name in self.shared:
            return self.shared[name]
        if name in self.lifting:
            lifted = self.lifting[name](self)
            self.lifts.append(lifted.lift)
            self.touches[name] = lifted.touches
            self.products += lifted.products
            self.shared[name] = lifted.symbol
            return lifted.symbol
        if quantity.equation is None and (not quantity.pieces or rewards_change_of(self.problem, name)):
            return None
        ends = (-np.inf, np.inf) if quantity.pieces else (quantity.range.lower, quantity.range.upper)
        variable, lift = lift_quantity(self, name, case, ends)
        self.lifts.append(lift)
        if quantity.equation is not None:
            self.row(name, values.fold(quantity.left_side, {name: variable})[0], 0.0, 0.0)
        for piece in values.fold(quantity.each_piece):
            # A limit that equals a constant piece would share its multiplier with it.
            varies_with_design = depends_on(piece, {x.value for x in self.x})
            self.row(name, variable - piece, 0.0 if varies_with_design else -_LEEWAY, np.inf)
        return variable


_LIFTED: Mapping[str, Lifting] = {
    "abscissa": lift_abscissa,
    "damping_ratio": lift_damping_ratio,
    ANGULAR_FREQUENCY: lift_angular_frequency,
}


def _known(problem: Posed, values: Values) -> dict[str, float]:
    """The first variables of a numeric design and the numbers, by their names in formulas."""
    own = {name_of(k): x for k, x in enumerate(variables_of(problem, values))}
    return {**own, **{n: float(values[n]) for n in problem.fixed}}


def numbers_of(problem: Posed) -> Mapping[str, float]:
    """Numbers that a program takes as parameters: fixed values and limits; one that is 0 shapes it instead."""
    limits = {name + LIMIT: limit_value(text) for name, text in problem.constraints.items()}
    every = {**problem.fixed, **limits}
    return Table({name: float(x) for name, x in every.items() if x})
