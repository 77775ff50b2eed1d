"""Formulates a problem as a nonlinear program (NLP) without eigenvalues and without divisions.

Root quantities (abscissa, damping ratio, angular frequency) are expressed by the coefficients of polynomial factors in
`formulate_by_factors`; `formulate_matching` equates the coefficients with those of a pattern. Both have the same
parameters, quantities and constraints. A case is one variation of the design, by a scenario or a tolerance. Each case
has its own factors; all cases share the design and the root quantities. To lift a quantity means to add variables and
rows that define it.
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
from tmsopt.program.boundary_points import lift_boundary_points, lift_displacements
from tmsopt.program.kinks import epigraph_form
from tmsopt.program.lifts import (
    LiftedQuantity,
    covered_indices,
    guess_worst_value,
    lift_abscissa,
    lift_angular_frequency,
    lift_damping_ratio,
    lift_positive_root,
    lift_quantity,
    lift_radius,
    lift_real_roots,
)
from tmsopt.program.nlp import (
    NLP,
    AddedVariable,
    Contact,
    Factor,
    objective_size,
    objective_unit,
    scale_of,
    units_of,
    variable_name,
)
from tmsopt.program.subspaces import lift_by_subspaces
from tmsopt.records import Table
from tmsopt.roots import Pattern

LiftFunction = Callable[["Builder"], LiftedQuantity]
"""Adds the variables and rows of a root quantity, the worst value over all cases except the cases of a radius."""

_LIMIT_SUFFIX = ".limit"
"""The limit of a constraint `x` is a number of the NLP with the name `x.limit`."""

_LEEWAY = 1e-9  # max(x, constant): the constant is lowered by this, because a limit may have the same value


def formulate(
    problem: Posed,
    cases: Sequence[Case] = (),
    elastic: bool = False,
    damping_ratio: float | None = None,
    a0_sign: int = 0,
    counts: Sequence[int] = (),
) -> NLP:
    """Formulate a problem by its pattern, or else by factors or subspaces. Each max, min and abs becomes a variable.

    Args:
        cases: the variations that the design must withstand; by default only the nominal design.
        elastic: keep every constraint as a row, so that it can be relaxed.
        damping_ratio: fix the damping ratio at 1 (all roots real and negative) or −1 (a positive real root). The
            recheck of the solution tests whether it has this damping ratio.
        a0_sign: +1 allows a0 >= 0, −1 allows a0 <= 0, 0 excludes a0 = 0.
        counts: without a polynomial, the sizes of the subspaces, one for each case that root quantities cover; by
            default all eigenvalues, or two if they are many.
    """
    if problem.pattern:
        nlp = formulate_matching(problem, cases=cases)
    else:
        nlp = formulate_by_factors(problem, cases, elastic, damping_ratio, a0_sign, counts)
    return epigraph_form(nlp, needs_two_sided_bounds(problem))


def formulate_by_factors(
    problem: Posed,
    cases: Sequence[Case] = (),
    elastic: bool = False,
    damping_ratio: float | None = None,
    a0_sign: int = 0,
    counts: Sequence[int] = (),
) -> NLP:
    """Optimise the objective, with every root quantity expressed by factors or subspaces in every case."""
    build = Builder(problem, cases, a0_sign=a0_sign, counts=counts)
    if damping_ratio == 1 or (damping_ratio is None and not elastic and demands_heavy_damping(problem)):
        build.require_real_roots()
    elif damping_ratio is not None:
        build.fix_quantity("damping_ratio", damping_ratio)
        if len(build.covered_cases) == 1 and rewards_change_of(problem, "damping_ratio", direction=-1.0):
            build.lifts.append(lift_positive_root(build))
    build.add_constraints()
    build.add_objective()
    return build.finish("abscissa")


def formulate_matching(problem: Posed, pattern: Pattern | None = None, cases: Sequence[Case] = ()) -> NLP:
    """Match coefficients with a pattern: a_k = a0 · c_k(unknowns).

    If there are as many equations as unknowns, the NLP has no objective. With fewer equations it minimises the
    objective of the problem. If the problem has no objective, it minimises the distance to the start, where the unit of
    each parameter is the width of its range. With more equations it minimises the sum of the squared mismatches.
    """
    pattern = pattern or problem.pattern
    if pattern is None:
        raise ValueError("no pattern to match; set locate of the problem, for example to 'EP4'")
    build = Builder(problem, cases)
    build.add_pattern(pattern)
    build.add_constraints()
    freedom = degrees_of_freedom(problem).of_equations
    if problem.objective is not None and freedom >= 0:
        build.add_objective()
    elif freedom > 0:
        build.minimise_distance(default_start(problem))
    return build.finish("matching")


def variables_of(problem: Posed, design: Mapping[str, float]) -> list[float]:
    """The values of the free parameters as the first variables of the NLP."""
    parameters = problem.parameter_set
    return [float(np.tan(design[n])) if parameters[n].tangent else float(design[n]) for n in problem.free]


def design_of(problem: Posed, x: Sequence[float]) -> dict[str, float]:
    """The free parameters from the variables of the NLP, clipped to their ranges."""
    parameters, pairs = problem.parameter_set, zip(problem.free, x, strict=False)
    values = {n: float(np.arctan(v)) if parameters[n].tangent else float(v) for n, v in pairs}
    return {n: min(max(v, problem.free[n][0]), problem.free[n][1]) for n, v in values.items()}


def default_start(problem: Posed) -> dict[str, float]:
    """The given start of each free parameter, or the middle of its range."""
    return {n: problem.start.get(n, (lo + hi) / 2) for n, (lo, hi) in problem.free.items()}


class Builder:
    """Collects the variables and rows of one NLP.

    Args:
        lift_functions: root quantity → the function that adds it to the NLP; by default as factors or subspaces.
        a0_sign: +1 allows a0 >= 0, −1 allows a0 <= 0, 0 excludes a0 = 0.
        counts: see `formulate`.
    """

    def __init__(
        self,
        problem: Posed,
        cases: Sequence[Case],
        lift_functions: Mapping[str, LiftFunction] | None = None,
        a0_sign: int = 0,
        counts: Sequence[int] = (),
    ) -> None:
        self.problem, self.a0_sign = problem, a0_sign
        self.numbers = numbers_of(problem)
        has_polynomial = problem.model.polynomial is not None
        default = _LIFT_FUNCTIONS if has_polynomial else {"abscissa": partial(lift_by_subspaces, counts)}
        self.lift_functions = default if lift_functions is None else lift_functions
        self.cases = tuple(cases)
        self.names: list[str] = []
        self.x: list[Any] = []
        self.bounds: list[tuple[float, float]] = []
        self.rows: list[tuple[str, Any, float, float]] = []
        self.lifts: list[AddedVariable] = []
        self.contacts: dict[str, tuple[Contact, ...]] = {}  # root quantity → ways in which roots can attain its value
        self.products: list[tuple[Factor, ...]] = []
        self.quantities: dict[str, Any] = {}
        self.fixed_quantities: set[str] = set()
        self.objective: Any = 0
        self.design = {name: self.add_parameter(name, *ends) for name, ends in problem.free.items()}
        nominal = problem.ordered({**self.design, **{n: symbol(n) for n in problem.fixed if n in self.numbers}})
        # Cases with a direction limit the robustness radius. If such a case has an edge, variables displace the design
        # to that edge.
        radius_cases = [k for k, case in enumerate(self.cases, start=1) if case.direction]
        radius = self.add_variable(RADIUS, 0.0) if radius_cases else constant(0)
        edges = {k: case.edge for k, case in enumerate(self.cases, start=1) if case.edge}
        displacements = {k: {n: self.add_variable(f"{n}.{k}") for n in self.cases[k - 1].direction} for k in edges}
        parameters = [nominal]
        for k, case in enumerate(self.cases, start=1):
            displaced_case = replace(case, direction=displacements.get(k, case.direction))
            parameters.append(displaced_case.applied(nominal, radius, problem.weights))
        self.values = [self.derive_values(k, case_parameters) for k, case_parameters in enumerate(parameters)]
        self.scale = scale_of(problem)
        self.a = self.polynomial(0)
        self.covered_cases = covered_indices(self.cases)
        if radius_cases:
            self.lifts.append(lift_displacements(problem.weights, displacements))
            self.lifts.append(lift_radius(self, [k for k in radius_cases if k not in displacements]))
            self.quantities[RADIUS] = radius
        if displacements:
            numeric_inputs = partial(_numeric_inputs, problem)
            self.lifts.append(lift_boundary_points(self, radius, displacements, edges, numeric_inputs, problem.weights))

    def polynomial(self, case: int) -> list[Any]:
        """Coefficients in one case, scaled so that the roots and the leading coefficient are near 1."""
        return self.scale.scale_coefficients(self.values[case].coefficients)

    @property
    def size(self) -> tuple[int, int]:
        """Number of variables and rows so far."""
        return len(self.x), len(self.rows)

    def derive_values(self, case: int, parameters: Mapping[str, Any]) -> Values:
        """The quantities of the design in one case."""
        problem, lift = self.problem, partial(self._lift, case)
        extra = (*ROOT_QUANTITIES, NO_RADIUS)
        return Values(problem.model, problem.parameter_set, parameters, extra=extra, lift=lift)

    def add_variable(self, name: str, lower: float = -np.inf, upper: float = np.inf) -> Any:
        self.names.append(name)
        self.x.append(symbol(variable_name(len(self.x))))
        self.bounds.append((lower, upper))
        return self.x[-1]

    def add_parameter(self, name: str, lower: float, upper: float) -> Any:
        """A free parameter, as a variable or as the arctangent of one."""
        if self.problem.parameter_set[name].tangent:
            return make_node("atan", self.add_variable(f"tan({name})", np.tan(lower), np.tan(upper)))
        return self.add_variable(name, lower, upper)

    def add_row(self, name: str, expression: Any, lower: float, upper: float) -> None:
        self.rows.append((name, constant(expression), lower, upper))

    def add_equations(self, name: str, left: Sequence[Any], right: Sequence[Any]) -> None:
        """Equate two lists of coefficients except the leading ones, which agree by construction."""
        for a, b in zip(left[1:], right[1:], strict=True):
            self.add_row(name, a - b, 0.0, 0.0)

    def require_real_roots(self) -> None:
        """Require real roots in every case."""
        expressions = (self.problem.objective, *self.problem.conditions.values())
        has_abscissa = any("abscissa" in expression.names for expression in expressions if expression)
        lifted = lift_real_roots(self, has_abscissa)
        self.lifts.append(lifted.lift)
        self.fix_quantity("damping_ratio", 1.0)
        self.fix_quantity(ANGULAR_FREQUENCY, 0.0)
        if has_abscissa:
            self.contacts["abscissa"] = lifted.contacts
            self.quantities["abscissa"] = lifted.symbol

    def fix_quantity(self, name: str, value: float) -> None:
        """Replace a root quantity by a number. The recheck decides constraints that use only this quantity."""
        self.quantities[name] = constant(value)
        self.fixed_quantities.add(name)

    def add_constraints(self, excluded: Collection[str] = ()) -> None:
        """Add a row for each constraint that is not excluded, or a row for each case if it depends on the case."""
        for name, condition in self.problem.conditions.items():
            if name in excluded:
                continue
            if len(condition.names) == 1 and condition.names[0] in self.fixed_quantities:
                continue
            limit = symbol(name + _LIMIT_SUFFIX) if name + _LIMIT_SUFFIX in self.numbers else None
            for value in self.evaluate_cases(condition, limit):
                self.add_row(name, value, *condition.allowed)

    def add_objective(self) -> None:
        """Add the objective; if it depends on the case, its worst value over the cases."""
        expression = self.problem.objective
        if expression is None:
            return
        sign = self.problem.sign
        values = [sign * value for value in self.evaluate_cases(expression)]
        self.objective = values[0]
        if len(values) > 1:
            self.objective = self.add_variable("objective")
            guess = partial(guess_worst_value, sign, expression, tuple(self.covered_cases))
            self.lifts.append(AddedVariable("objective", 1, guess))
            for value in values:
                self.add_row("objective", value - self.objective, -np.inf, 0.0)

    def evaluate_cases(self, expression: Expression, limit: Any = None) -> list[Any]:
        """Values of the expression minus a limit, one for each covered case, or only one if no case changes it."""
        cases = self.covered_cases if depends_on_case(self.problem, expression, self.cases) else [0]
        case_values = [self.values[k] for k in cases]
        return [expression(v) if limit is None else expression.difference(v, limit) for v in case_values]

    def add_pattern(self, pattern: Pattern) -> None:
        unknowns = [self.add_variable(f"{pattern.name}.{u}") for u in pattern.unknowns]
        self.lifts.append(AddedVariable(pattern.name, len(unknowns), lambda v, z: pattern.guesses(z[0])))
        if pattern.abscissa is not None and self.covered_cases == [0]:
            self.quantities["abscissa"] = self.scale.unit * pattern.abscissa(unknowns)
        pattern_coefficients = [self.a[0] * c for c in pattern.monic(unknowns)]
        if degrees_of_freedom(self.problem).of_equations >= 0:
            self.add_equations(pattern.name, self.a, pattern_coefficients)
        else:
            self.objective = sum((a - b) ** 2 for a, b in zip(self.a, pattern_coefficients, strict=True))
        for expression in pattern.nonnegative(unknowns):
            self.add_row(pattern.name, expression, 0.0, np.inf)

    def minimise_distance(self, design: Mapping[str, float]) -> None:
        for name, variable in self.design.items():
            lower, upper = self.problem.free[name]
            self.objective += ((variable - design[name]) / (upper - lower)) ** 2

    def finish(self, formulation: str) -> NLP:
        names = (*map(variable_name, range(len(self.x))), *self.numbers)
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
            contacts=self.contacts,
            products=tuple(self.products),
            has_exact_starts=bool(self.products) and formulation == "abscissa",
            unit=self.scale.unit,
            size=objective_size(self.problem),
            units=units_of(self.problem),
            objective_unit=objective_unit(self.problem),
        )

    def enclose(self, expressions: Sequence[Any]) -> list[Interval]:
        """Ranges of expressions over the box of the variables so far, by interval arithmetic.

        Raises:
            NotAccepted: for an operation that interval arithmetic does not have.
        """
        ranges = {variable_name(k): ball(ends) for k, ends in enumerate(self.bounds)}
        numbers = {n: INTERVALS.constant(decimal(x)) for n, x in self.numbers.items()}
        return [interval(x) for x in fold(formula(expressions), ranges | numbers, INTERVALS)]

    def _lift(self, case: int, quantity: Quantity, values: Values) -> Any:
        """A variable, if factors or an equation without division define the quantity; None to use its formula."""
        name = quantity.name
        if name in self.quantities:
            return self.quantities[name]
        if name in self.lift_functions:
            lifted = self.lift_functions[name](self)
            self.lifts.append(lifted.lift)
            self.contacts[name] = lifted.contacts
            self.products += lifted.products
            self.quantities[name] = lifted.symbol
            return lifted.symbol
        if quantity.equation is None and (not quantity.pieces or rewards_change_of(self.problem, name)):
            return None
        ends = (-np.inf, np.inf) if quantity.pieces else (quantity.range.lower, quantity.range.upper)
        variable, lift = lift_quantity(self, name, case, ends)
        self.lifts.append(lift)
        if quantity.equation is not None:
            self.add_row(name, values.fold(quantity.left_side, {name: variable})[0], 0.0, 0.0)
        for piece in values.fold(quantity.each_piece):
            varies_with_design = depends_on(piece, {x.value for x in self.x})
            self.add_row(name, variable - piece, 0.0 if varies_with_design else -_LEEWAY, np.inf)
        return variable


_LIFT_FUNCTIONS: Mapping[str, LiftFunction] = {
    "abscissa": lift_abscissa,
    "damping_ratio": lift_damping_ratio,
    ANGULAR_FREQUENCY: lift_angular_frequency,
}


def _numeric_inputs(problem: Posed, values: Values) -> dict[str, float]:
    """Values of the free and the fixed parameters by their names in formulas."""
    free = {variable_name(k): x for k, x in enumerate(variables_of(problem, values))}
    return {**free, **{n: float(values[n]) for n in problem.fixed}}


def numbers_of(problem: Posed) -> Mapping[str, float]:
    """Numbers that an NLP takes as parameters: fixed values and limits. A value 0 is written into the formulas."""
    limits = {name + _LIMIT_SUFFIX: limit_value(text) for name, text in problem.constraints.items()}
    return Table({name: float(x) for name, x in {**problem.fixed, **limits}.items() if x})
