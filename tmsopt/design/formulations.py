"""From a problem to plain NLP data, by factors of the characteristic polynomial; no eigenvalue, no division.

``abscissa`` lifts root quantities into factor coefficients; ``matching`` equates the coefficients with those of a
pattern. Both share how parameters, quantities and constraints become variables and rows.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.design.problem import Problem
from tmsopt.design.quantities import ROOT_QUANTITIES
from tmsopt.models import Quantity, Values
from tmsopt.roots import Pattern, product, shift
from tmsopt.roots.patterns import Roots

Guess = Callable[[Values, Roots], list[list[float]]]
"""Starting values of lifted variables for a numeric design and its roots; several where there is a choice."""


@dataclass(frozen=True)
class Lift:
    """Variables that the formulation adds to the parameters, and how to start them."""

    name: str
    size: int
    guess: Guess


@dataclass(frozen=True)
class NLP:
    """minimise f(x) subject to lower ≤ x ≤ upper and row_lower ≤ g(x) ≤ row_upper.

    Attributes:
        formulation: ``abscissa`` or ``matching``.
        variables: names; the free parameters come first, each as itself or as its tangent.
        functions: CasADi function x → (f, g).
        rows: name of each row of g: a constraint's name, or the equation it belongs to.
        lifts: the variables after the free parameters, in order.
    """

    formulation: str
    variables: tuple[str, ...]
    functions: ca.Function = field(repr=False)
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    rows: tuple[str, ...]
    row_lower: tuple[float, ...]
    row_upper: tuple[float, ...]
    lifts: tuple[Lift, ...] = field(repr=False, default=())

    @property
    def equations(self) -> int:
        """Number of equality rows."""
        return sum(lo == hi for lo, hi in zip(self.row_lower, self.row_upper, strict=True))


@dataclass(frozen=True)
class Freedom:
    """Counting of a pattern problem before it is solved.

    Attributes:
        free: free parameters.
        conditions: codimension of the pattern plus the equality constraints.
    """

    free: int
    conditions: int

    @property
    def count(self) -> int:
        """Degrees of freedom left; negative when there are more conditions than parameters."""
        return self.free - self.conditions

    @property
    def kind(self) -> str:
        """``square``, ``under-determined`` or ``over-determined``."""
        return "square" if self.count == 0 else "under-determined" if self.count > 0 else "over-determined"


def freedom(problem: Problem) -> Freedom:
    """Degrees of freedom of a problem: free parameters against pattern conditions and equality constraints."""
    equalities = sum(c.comparison == "==" for c in problem.conditions.values())
    return Freedom(len(problem.free), (problem.pattern.codimension if problem.pattern else 0) + equalities)


def formulate(problem: Problem) -> NLP:
    """The formulation that the problem asks for: ``matching`` for a pattern, else ``abscissa``."""
    return matching(problem) if problem.pattern else abscissa(problem)


def abscissa(problem: Problem) -> NLP:
    """Optimise the objective with every root quantity carried by factors.

    For ``abscissa`` γ: coefficients of p(t + γ) = a0 ∏ (t² + βᵢ t + κᵢ) with βᵢ, κᵢ ≥ 0, which holds exactly for
    γ at or right of the rightmost root.
    """
    build = _Builder(problem)
    build.constraints()
    build.optimise(problem)
    return build.finish("abscissa")


def matching(problem: Problem, pattern: Pattern | None = None) -> NLP:
    """Match coefficients with a pattern: a_k = a0 · c_k(unknowns).

    Square: the equations alone. Under-determined: the objective, or the distance to the start relative to the box.
    Over-determined: least squares of the equations.
    """
    pattern = pattern or problem.pattern
    if pattern is None:
        raise ValueError("matching needs a pattern; give the problem locate = 'EP4' or another")
    build = _Builder(problem)
    build.pattern(pattern)
    build.constraints()
    left = freedom(problem).count
    if problem.objective is not None and left >= 0:
        build.optimise(problem)
    elif left > 0:
        build.nearest_to(middle(problem))
    return build.finish("matching")


def variables_of(problem: Problem, design: Mapping[str, float]) -> list[float]:
    """The NLP's first variables for free parameters."""
    of = problem.parameter_set
    return [float(np.tan(design[n])) if of[n].tangent else float(design[n]) for n in problem.free]


def design_of(problem: Problem, x: Sequence[float]) -> dict[str, float]:
    """The free parameters for variables of the NLP, inside their ranges."""
    of = problem.parameter_set
    plain = {n: float(np.arctan(v)) if of[n].tangent else float(v) for n, v in zip(problem.free, x, strict=False)}
    return {n: min(max(v, problem.free[n][0]), problem.free[n][1]) for n, v in plain.items()}


def middle(problem: Problem) -> dict[str, float]:
    """The start of each free parameter, or the middle of its range."""
    return {n: problem.start.get(n, (lo + hi) / 2) for n, (lo, hi) in problem.free.items()}


class _Builder:
    """Collects variables and rows; discarded once the NLP is finished."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.names: list[str] = []
        self.x: list[Any] = []
        self.bounds: list[tuple[float, float]] = []
        self.rows: list[tuple[str, Any, float, float]] = []
        self.lifts: list[Lift] = []
        self.objective: Any = ca.SX(0)
        free = {name: self.parameter(name, *ends) for name, ends in problem.free.items()}
        self.design = free
        self.values = Values(
            problem.model,
            problem.parameter_set,
            problem.ordered(free),
            extra=ROOT_QUANTITIES,
            lift=self._lift,
        )
        self.a = self.values.coefficients

    def variable(self, name: str, lower: float = -np.inf, upper: float = np.inf) -> Any:
        symbol = ca.SX.sym(name)
        self.names.append(name)
        self.x.append(symbol)
        self.bounds.append((lower, upper))
        return symbol

    def parameter(self, name: str, lower: float, upper: float) -> Any:
        """A free parameter, as a variable or as the arctangent of one."""
        if self.problem.parameter_set[name].tangent:
            return ca.atan(self.variable(f"tan({name})", np.tan(lower), np.tan(upper)))
        return self.variable(name, lower, upper)

    def row(self, name: str, expression: Any, lower: float, upper: float) -> None:
        self.rows.append((name, ca.SX(expression), lower, upper))

    def equal(self, name: str, left: Sequence[Any], right: Sequence[Any]) -> None:
        """Equations between coefficient lists; the leading ones agree by construction."""
        for a, b in zip(left[1:], right[1:], strict=True):
            self.row(name, a - b, 0.0, 0.0)

    def constraints(self) -> None:
        ends = {"<=": (-np.inf, 0.0), ">=": (0.0, np.inf), "==": (0.0, 0.0)}
        for name, condition in self.problem.conditions.items():
            self.row(name, condition.symbolic(self.values), *ends[condition.comparison])

    def optimise(self, problem: Problem) -> None:
        expression = problem.objective
        if expression is not None:
            sign = -1 if problem.sense == "maximize" else 1
            self.objective = sign * expression.symbolic(self.values)

    def pattern(self, pattern: Pattern) -> None:
        unknowns = [self.variable(f"{pattern.name}.{u}") for u in pattern.unknowns]
        self.lifts.append(Lift(pattern.name, len(unknowns), lambda v, z: pattern.guesses(z)))
        if pattern.abscissa is not None:
            self.values.define("abscissa", pattern.abscissa(unknowns))
        matched = [self.a[0] * c for c in pattern.monic(unknowns)]
        if freedom(self.problem).count >= 0:
            self.equal(pattern.name, self.a, matched)
        else:
            self.objective = sum((a - b) ** 2 for a, b in zip(self.a, matched, strict=True))
        for expression in pattern.nonnegative(unknowns):
            self.row(pattern.name, expression, 0.0, np.inf)

    def nearest_to(self, design: Mapping[str, float]) -> None:
        for name, symbol in self.design.items():
            lower, upper = self.problem.free[name]
            self.objective += ((symbol - design[name]) / (upper - lower)) ** 2

    def finish(self, formulation: str) -> NLP:
        g = ca.vertcat(*[r[1] for r in self.rows]) if self.rows else ca.SX(0, 1)
        functions = ca.Function(
            "nlp", [ca.vertcat(*self.x)], [ca.densify(self.objective), ca.densify(g)], ["x"], ["f", "g"]
        )
        return NLP(
            formulation=formulation,
            variables=tuple(self.names),
            functions=functions,
            lower=tuple(lo for lo, _ in self.bounds),
            upper=tuple(hi for _, hi in self.bounds),
            rows=tuple(r[0] for r in self.rows),
            row_lower=tuple(r[2] for r in self.rows),
            row_upper=tuple(r[3] for r in self.rows),
            lifts=tuple(self.lifts),
        )

    def _lift(self, quantity: Quantity, values: Values) -> Any:
        """A quantity as a variable, bound by factors or by its division-free equation."""
        if quantity.name == "abscissa":
            return self._abscissa()
        if quantity.name == "damping_ratio":
            return self._damping_ratio()
        if quantity.equation is None:
            return None
        symbol = self.variable(quantity.name, quantity.range.lower, quantity.range.upper)
        self.lifts.append(Lift(quantity.name, 1, lambda v, z: [[_finite(v[quantity.name])]]))
        self.row(quantity.name, quantity.equation(values, symbol), 0.0, 0.0)
        return symbol

    def _abscissa(self) -> Any:
        gamma = self.variable("abscissa")
        pairs = self._factors("abscissa", ("beta", "kappa"))
        self.lifts.append(Lift("abscissa", 1 + 2 * len(pairs), _abscissa_guess))
        self.equal("abscissa", shift(self.a, gamma), [self.a[0] * c for c in product(*([1, *p] for p in pairs))])
        return gamma

    def _damping_ratio(self) -> Any:
        """ζ with p = a0 ∏ (s² + pᵢ s + qᵢ), pᵢ, qᵢ ≥ 0, pᵢ² ≥ 4 ζ² qᵢ: at or below the least damping ratio."""
        zeta = self.variable("damping_ratio", 0.0, 1.0)
        pairs = self._factors("damping_ratio", ("p", "q"))
        self.lifts.append(Lift("damping_ratio", 1 + 2 * len(pairs), _damping_guess))
        self.equal("damping_ratio", self.a, [self.a[0] * c for c in product(*([1, *p] for p in pairs))])
        for p, q in pairs:
            self.row("damping_ratio", p * p - 4 * zeta * zeta * q, 0.0, np.inf)
        return zeta

    def _factors(self, name: str, symbols: tuple[str, str]) -> list[tuple[Any, Any]]:
        half = range(1, self.problem.model.degree // 2 + 1)
        return [(self.variable(f"{symbols[0]}{k}", 0.0), self.variable(f"{symbols[1]}{k}", 0.0)) for k in half]


def _finite(value: Any) -> float:
    return float(value) if np.isfinite(value) else 1.0


def _paired(z: Roots) -> list[Roots]:
    """Roots two by two, conjugates together, as `roots` orders them."""
    return [z[k : k + 2] for k in range(0, len(z), 2)]


def _abscissa_guess(values: Values, z: Roots) -> list[list[float]]:
    """γ a little right of the rightmost root and the factors of the shifted polynomial: feasible exactly."""
    gamma = float(z.real.max()) + 0.05 * float(np.abs(z).mean()) + 1e-3
    factors = [(-(pair - gamma).sum().real, (pair - gamma).prod().real) for pair in _paired(z)]
    return [[gamma, *(float(c) for f in factors for c in f)]]


def _damping_guess(values: Values, z: Roots) -> list[list[float]]:
    ratio = float(np.min(-z.real / (np.abs(z) + 1e-300)))
    factors = [(abs(pair.sum().real), abs(pair.prod().real)) for pair in _paired(z)]
    return [[min(max(0.9 * ratio, 0.01), 0.99), *(float(c) for f in factors for c in f)]]
