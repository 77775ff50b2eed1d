"""Builds the smooth program around a design: factors for the roots on the rightmost line, and all active limits.

Relative to the line Re s = γ, the polynomial is a product of factors without common roots,

    p(t + γ; θ) = a0(θ) · q₁(t) ⋯ q_k(t) · r(t),

with one factor q of degree m for each m-fold root on the line, and r for the roots left of it. The coefficients of the
factors are smooth functions of θ and γ, even if the roots are not, because the Jacobian of a product with respect to
its factors is regular as long as they have no common root. Write q = tᵐ + c₁ tᵐ⁻¹ + … + c_m for a real root. For a
complex root, write the same in t − iω with complex c (and real c₁, which fixes ω). The roots are on the line if c = 0,
and no root moves to the right of it only if

    c₁ ≥ 0 (roots move left),  Re c₂ ≥ 0 (roots split along the line),  Im c₂ = c₃ = … = 0 to first order,

because |Im c₂| ≤ c₁ √Re c₂ and c₃ ≤ c₁ c₂: a change ε of another coefficient would move a root by ε^(1/m) to the right.
For EP4 as two factors t² + βᵢ t + κᵢ we have c₁ = β₁ + β₂ and c₂ = κ₁ + κ₂ + β₁β₂. So βᵢ and κᵢ have the multipliers
of c₁ and c₂, for any division of the multiple root between the factors.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import ANGULAR_FREQUENCY
from tmsopt.problem.solution import Solution
from tmsopt.program.formulate import formulate_by_factors, variables_of
from tmsopt.program.nlp import NLP
from tmsopt.records import Array
from tmsopt.roots import Root, product, shift

_MAX_SLACK = 2e-9  # largest slack of an active constraint, relative to 1 + |limit|; twice the feasibility tolerance
_BOUND_DISTANCE = 1e-12  # largest distance of an active bound, relative to its size and the width of its range
_SAME_LINE = 1e-6  # largest relative difference of the real parts of roots on one line, for an exact structure
_REPLACED_ROWS = ("abscissa", "damping_ratio", ANGULAR_FREQUENCY)  # rows that the factors of this program replace


class NotCovered(ValueError):
    """The conditions on the factors do not cover this design; the text is the reason."""


@dataclass(frozen=True)
class ActiveRow:
    """An expression that is 0 at the design.

    Attributes:
        name: a constraint, a bound, ``roots`` for an equation of the factors, or ``c1 …`` for a coefficient.
        is_inequality: whether the expression may become positive; otherwise it stays 0.
        root_index: index of the root on the line whose factor the row belongs to; −1 for other rows.
        size: natural size of the expression.
    """

    name: str
    is_inequality: bool
    root_index: int = -1
    size: float = 1.0


@dataclass(frozen=True)
class LocalProgram:
    """Minimise f(x) subject to h(x) = 0 or ≥ 0, at a point where h = 0.

    Attributes:
        problem: the problem with the objective f.
        variables: names of the variables. The free parameters with an effect come first; angles are given by tangents.
        x: the point.
        sizes: natural size of each variable.
        rows: one for each component of h.
        functions: (x, y) → ∇f, h, ∂h/∂x and the Hessian of f − y·h.
        rightmost_roots: the real roots on the rightmost line, and the upper root of each complex pair on it.
        idle: free parameters without an effect.
    """

    problem: Posed
    variables: tuple[str, ...]
    x: Array
    sizes: Array
    rows: tuple[ActiveRow, ...]
    functions: ca.Function = field(repr=False)
    rightmost_roots: tuple[Root, ...]
    idle: tuple[str, ...]

    def evaluate(self, x: Array, y: Array | None = None) -> tuple[Array, Array, Array, Array]:
        """∇f, h, ∂h/∂x, and the Hessian of f − y·h."""
        outputs = self.functions(x, np.zeros(len(self.rows)) if y is None else y)
        gradient, h, jacobian, hessian = (part.full() for part in outputs)
        return gradient.ravel(), h.ravel(), jacobian, hessian


def build_program(problem: Posed, solution: Solution) -> LocalProgram:
    """The program of a problem at a design. It uses the roots of the structure and computes no root.

    Raises:
        NotCovered: if the damping ratio or frequency is active, or the abscissa is not.
    """
    nlp, values, free = formulate_by_factors(problem), problem.values(solution.parameters), problem.free
    values = values.with_known({"abscissa": solution.abscissa})
    units = {"abscissa": nlp.unit, ANGULAR_FREQUENCY: nlp.unit}
    value_of = dict(zip(free, variables_of(problem, solution.parameters), strict=True))
    for n in nlp.variables[len(free) :]:  # the coefficients of factors are not used here: nan
        value_of[n] = float(values[n]) / units.get(n, 1.0) if n in values else np.nan
    x = {n: ca.SX.sym(n) for n in value_of}
    all_variables = ca.vertcat(*x.values())
    f, g = nlp.symbolic(all_variables)
    row_values = nlp.evaluate(np.nan_to_num([*value_of.values()], posinf=0.0, neginf=0.0))[1]
    defining_rows = {n: _list_defining_rows(nlp, n) for n in x if n in nlp.rows and n not in _REPLACED_ROWS}
    # variables that stand for a maximum whose largest argument at this design is a constant
    constant_names = [
        n for n, rows in defining_rows.items() if all(nlp.row_upper[k] > 0 and row_values[k] > _MAX_SLACK for k in rows)
    ]
    f, g = ca.substitute([f, g], [x[n] for n in constant_names], [ca.SX(value_of[n]) for n in constant_names])
    builder = _Builder()
    for k, name in enumerate(nlp.rows):
        if name in problem.constraints and ca.depends_on(g[k], all_variables):
            builder.add_nlp_row(nlp, k, g, row_values)
    needed_names = [n for n in x if n == "abscissa"]
    for _ in nlp.lifts:
        active_functions = ca.vertcat(f, *builder.expressions)
        for n in [n for n in x if n not in free and n not in needed_names and ca.depends_on(active_functions, x[n])]:
            needed_names.append(n)
            for k in _list_defining_rows(nlp, n):
                builder.add_nlp_row(nlp, k, g, row_values)
    if active_quantities := [n.replace("_", " ") for n in ("damping_ratio", ANGULAR_FREQUENCY) if n in needed_names]:
        raise NotCovered(f"the {active_quantities[0]} is active, which the conditions on the abscissa do not cover")
    if not (needed_names and ca.depends_on(ca.vertcat(f, *builder.expressions), x["abscissa"])):
        raise NotCovered("the abscissa is not active, so this optimum does not depend on the roots")
    roots = solution.roots
    size = max(float(np.hypot(r.re, r.im)) for r in roots)
    line_width = 0.0 if solution.structure in ("pair", "real") else _SAME_LINE * size
    line_roots = [r for r in roots if r.re >= solution.abscissa - line_width]
    rightmost_roots = tuple(r for r in line_roots if r.im >= 0)
    design = {n: ca.atan(x[n]) if problem.parameter_set[n].tangent else x[n] for n in free}
    a = problem.model.coefficients(problem.ordered(design), problem.parameter_set)
    leading_size = abs(float(values.coefficients[0]))
    builder.add_factors(
        a, leading_size, size, nlp.unit * x["abscissa"], rightmost_roots, [r for r in roots if r not in line_roots]
    )
    active_functions = ca.vertcat(f, *builder.expressions)
    idle = tuple(n for n in free if not ca.depends_on(active_functions, x[n]))
    variables = []
    for n in (n for n in x if (n in free and n not in idle) or n in needed_names):
        natural_size = size / nlp.unit if n == "abscissa" else max(abs(value_of[n]), 1e-3)
        if n in free:
            low, high = (float(np.tan(e)) if problem.parameter_set[n].tangent else e for e in free[n])
            # a range wider than 1 is no measure of size
            natural_size = max(abs(value_of[n]), min(high - low, 1.0), 1e-12)
            for end, limit, sign in zip(("min", "max"), free[n], (1, -1), strict=True):
                if abs(solution.parameters[n] - limit) <= _BOUND_DISTANCE * (abs(limit) + np.ptp(free[n])):
                    builder.add_row(ActiveRow(f"{n}.{end}", True), sign * (x[n] - value_of[n]))
        variables.append((n, x[n], value_of[n], natural_size))
    names, symbols, point, sizes = zip(*variables, *builder.unknowns, strict=True)
    z, h = ca.vertcat(*symbols), ca.vertcat(*builder.expressions)
    y = ca.SX.sym("y", h.numel())
    parts = [ca.gradient(f, z), h, ca.jacobian(h, z), ca.hessian(f - ca.dot(y, h), z)[0]]
    return LocalProgram(
        problem=problem,
        variables=names,
        x=np.array(point),
        sizes=np.array(sizes),
        rows=tuple(builder.rows),
        functions=ca.Function("program", [z, y], [ca.densify(part) for part in parts]),
        rightmost_roots=rightmost_roots,
        idle=idle,
    )


def _list_defining_rows(nlp: NLP, name: str) -> list[int]:
    """Rows that define an added variable by the parameters, but not the row of a constant argument of a maximum."""
    rows = enumerate(zip(nlp.rows, nlp.row_lower, strict=True))
    return [k for k, (row, lower) in rows if row == name and row not in _REPLACED_ROWS and lower == 0]


class _Builder:
    """Collects active rows with their expressions, and the unknown coefficients: name, symbol, value and size."""

    def __init__(self) -> None:
        self.rows: list[ActiveRow] = []
        self.expressions: list[Any] = []
        self.unknowns: list[tuple[str, Any, float, float]] = []

    def add_row(self, row: ActiveRow, expression: Any) -> None:
        self.rows.append(row)
        self.expressions.append(expression)

    def add_nlp_row(self, nlp: NLP, k: int, g: Any, row_values: Array) -> None:
        """Add a row of the NLP if it is an equality or active."""
        name, lower, upper = nlp.rows[k], nlp.row_lower[k], nlp.row_upper[k]
        for limit, sign in ((lower, 1), (upper, -1)):
            if np.isfinite(limit) and (lower == upper or abs(row_values[k] - limit) <= _MAX_SLACK * (1 + abs(limit))):
                self.add_row(ActiveRow(name, lower != upper), sign * (g[k] - limit))
                return

    def add_unknown(self, name: str, value: float, size: float) -> Any:
        self.unknowns.append((name, ca.SX.sym(name), value, size))
        return self.unknowns[-1][1]

    def add_factors(
        self,
        a: Sequence[Any],
        leading_size: float,
        size: float,
        gamma: Any,
        rightmost_roots: Sequence[Root],
        other_roots: Sequence[Root],
    ) -> None:
        """Add the equations p(t + γ) = a0 · ∏ q · r; the roots give the values of the unknowns.

        Args:
            leading_size: |a0|, the size of the leading coefficient.
        """
        factors = []
        for j, root in enumerate(rightmost_roots):

            def add_coefficient(name: str, k: int, is_inequality: bool, j: int = j) -> Any:
                symbol = self.add_unknown(f"{name}.{j}", 0.0, size**k)
                self.add_row(ActiveRow(name, is_inequality, j, size**k), symbol)
                return symbol

            omega = self.add_unknown(f"omega.{j}", root.im, size) if root.im else 0
            re, im = [1], [0]
            for k in range(1, root.multiplicity + 1):  # Horner's rule in t − iω
                re, im = (
                    [x + omega * y for x, y in zip([*re, 0], [0, *im], strict=True)],
                    [y - omega * x for x, y in zip([0, *re], [*im, 0], strict=True)],
                )
                re[-1] += add_coefficient(f"c{k}", k, k <= 2)
                im[-1] += add_coefficient(f"im c{k}", k, False) if root.im and k > 1 else 0
            pair_factor = [x + y for x, y in zip(product(re, re), product(im, im), strict=True)]
            factors.append(pair_factor if root.im else re)
        left_roots = [complex(r.re, r.im) - rightmost_roots[0].re for r in other_roots for _ in range(r.multiplicity)]
        left_coefficients = np.atleast_1d(np.poly(left_roots)).real.tolist()
        factors.append(
            [1, *(self.add_unknown(f"r{k}", left_coefficients[k], size**k) for k in range(1, len(left_coefficients)))]
        )
        shifted, multiplied = shift(a, gamma), product(*factors)
        for k in range(1, len(shifted)):
            self.add_row(ActiveRow("roots", False, size=leading_size * size**k), shifted[k] - a[0] * multiplied[k])
