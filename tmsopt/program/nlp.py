"""An NLP as plain data, the units it is written in, and what its solver needs to start."""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import combinations
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.algebra.formula import Formula, Kind, constant, fold, formula, symbol
from tmsopt.algebra.kinds import CASADI, FLOATS, NODES
from tmsopt.algebra.sequence import golden_steps
from tmsopt.models import Values
from tmsopt.problem.cases import Case
from tmsopt.problem.evaluate import coefficients_of, evaluate
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import regularise
from tmsopt.records import Array
from tmsopt.roots import roots
from tmsopt.roots.patterns.pattern import Roots

_TANGLED = 1e-3  # relative distance of roots that may be meant to be one: where two factors share it, digits are lost

_TIE = 1e-3
"""Difference of distances that are the same."""

_LARGE = 50_000
"""Operations times variables: derivatives as expressions would be too many, so that functions are differentiated."""

_KEPT = 64
"""Compiled formulas kept: where cases are added row by row, most are not met again."""

_FIRST = {"f": "grad:f:x", "g": "jac:g:x"}  # derivatives, as CasADi writes them
_DESIGNS = 33
_ORDINARY = (1e-2, 1e3)

Guess = Callable[[Sequence[Values], Sequence[Roots]], list[list[float]]]
"""Starting values of lifted variables for a numeric design and its roots, the nominal design first and then each
case; several where there is a choice."""


@dataclass(frozen=True)
class AddedVariable:
    """Variables that the formulation adds to the parameters, and how to start them.

    Attributes:
        close: how to start them beside a solution, if otherwise.
    """

    name: str
    size: int
    guess: Guess
    close: Guess | None = None


@dataclass(frozen=True)
class Contact:
    """One way in which a root can stand on the edge that a root quantity describes, or a kink on one of its pieces.

    Attributes:
        distance: how far the root is from the edge at a point of the NLP; of several ways, the least is taken. Without
            it, what the row is off 0.
        variable, row: what is held at a value.
    """

    distance: Callable[[Array], float] | None = None
    variable: int | None = None
    row: int | None = None
    value: float = 0.0


@dataclass(frozen=True)
class MaximumVariable:
    """A variable t that stands for the greatest of several pieces, and its rows t − piece ≥ 0.

    Attributes:
        quotient: it stands for a quotient instead, with one row t · denominator − numerator = 0.
    """

    variable: int
    rows: tuple[int, ...]
    quotient: bool = False


@dataclass(frozen=True)
class Factor:
    """Where an NLP keeps a factor t² + βt + κ, or s² + ps + w², or t + δ.

    Attributes:
        squared: whether the second variable is w, not its square.
        linear: whether there is no second one.
    """

    first: int
    squared: bool = False
    linear: bool = False

    def real_roots(self, x: Array) -> tuple[float, ...]:
        """Its real roots, the smaller first; none of a complex pair."""
        if self.linear:
            return (-float(x[self.first]),)
        half, q = -x[self.first] / 2, x[self.first + 1]
        rest = half * half - (q * q if self.squared else q)
        return (float(half - np.sqrt(rest)), float(half + np.sqrt(rest))) if rest >= 0 else ()


@dataclass(frozen=True)
class NLP:
    """minimise f(x) subject to lower ≤ x ≤ upper and row_lower ≤ g(x) ≤ row_upper.

    Attributes:
        formulation: ``abscissa`` or ``matching``.
        variables: names; the free parameters come first, each as itself or as its tangent.
        formula: f, then each row of g, in the variables, named by `name_of`, and in numbers of the problem.
        numbers: name → value: of fixed parameters that are not 0, and of limits such as ``trail.limit``.
        rows: name of each row of g: a constraint's name, or the equation it belongs to.
        lifts: the variables after the free parameters, in order.
        cases: the variations of the design that its rows cover.
        touches: root quantity or kink → the ways in which it is met exactly; unless one is held, the NLP only bounds
            it, which is too little for those that are listed.
        kinks: those that others are made of come first.
        products: the factors of each polynomial.
        exact: whether starts satisfy the equations of all cases.
        unit: of the roots in its variables.
        size: of the objective, as far as it is known beforehand.
        units: of the first variables, the free parameters, in which a solver of absolute tolerances moves them.
        objective_unit: likewise, of the objective where it is small.
    """

    formulation: str
    variables: tuple[str, ...]
    formula: Formula = field(repr=False)
    numbers: Mapping[str, float] = field(repr=False)
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    rows: tuple[str, ...]
    row_lower: tuple[float, ...]
    row_upper: tuple[float, ...]
    lifts: tuple[AddedVariable, ...] = field(repr=False, default=())
    cases: tuple[Case, ...] = field(repr=False, default=())
    touches: Mapping[str, tuple[Contact, ...]] = field(repr=False, default_factory=dict)
    kinks: tuple[MaximumVariable, ...] = field(repr=False, default=())
    products: tuple[tuple[Factor, ...], ...] = field(repr=False, default=())
    exact: bool = False
    unit: float = 1.0
    size: float = 1.0
    units: tuple[float, ...] = ()
    objective_unit: float = 1.0

    @property
    def inputs(self) -> tuple[str, ...]:
        """The names of the variables in the formula."""
        return tuple(map(name_of, range(len(self.variables))))

    def at(self, x: Array) -> tuple[float, Array]:
        """f and g."""
        f, g = self.compiled.function(x.tolist(), self.constants)
        return float(f), g.full().ravel()

    @cached_property
    def baked(self) -> Formula:
        """The formula with its numbers as constants."""
        numbers = {n: constant(v) for n, v in self.numbers.items()}
        return formula(fold(self.formula, {n: symbol(n) for n in self.inputs} | numbers, NODES), self.inputs)

    def fold(self, x: Sequence[Any], kind: Kind, shared: Callable[[Any], Any] | None = None) -> list[Any]:
        """f and the rows of g for variables of a kind; numbers are constants."""
        return fold(self.baked, dict(zip(self.inputs, x, strict=True)), kind, shared)

    def symbolic(self, x: Any) -> tuple[Any, Any]:
        """f and g for a vector of CasADi."""
        f, *g = self.fold(ca.vertsplit(x), CASADI)
        return ca.densify(ca.SX(f)), ca.densify(ca.vertcat(ca.SX(0, 1), *g))

    @cached_property
    def compiled(self) -> "Compiled":
        """Functions of CasADi for f and g; of each formula one in each thread."""
        return _MADE.of(self.formula, len(self.variables))

    @property
    def constants(self) -> list[float]:
        """What the functions take beside the variables: all that depends on numbers alone."""
        return _MADE.constants(self.formula, len(self.variables), tuple(self.numbers.items()))

    def touchings(self, x: Array, tie: float = _TIE) -> Iterator["NLP"]:
        """The same with everything in `touches` met exactly: in the ways that a point is closest to, then in others.

        In each of the others one way is exchanged for one that is as close, but for a `tie`.
        """
        rows = self.at(x)[1] if self.kinks else x
        ranked: list[list[Contact]] = []
        for ways in self.touches.values():
            distances = [float(rows[way.row]) if way.distance is None else way.distance(x) for way in ways]
            order = np.argsort(distances, kind="stable")
            ranked.append([ways[k] for k in order if distances[k] <= distances[order[0]] + tie or k == order[0]])
        nearest = [close[0] for close in ranked]
        yield self._held(nearest)
        for k, close in enumerate(ranked):
            for way in close[1:]:
                yield self._held([*nearest[:k], way, *nearest[k + 1 :]])

    def _held(self, ways: Sequence[Contact]) -> "NLP":
        lower, upper, row_upper = list(self.lower), list(self.upper), list(self.row_upper)
        for way in ways:
            if way.variable is not None:
                lower[way.variable] = upper[way.variable] = way.value
            if way.row is not None:
                row_upper[way.row] = way.value
        return replace(self, lower=tuple(lower), upper=tuple(upper), row_upper=tuple(row_upper))

    def filled(self, x: Array) -> Array:
        """A point with every kink the greatest of its pieces."""
        x = x.copy()
        for kink in self.kinks:
            x[kink.variable] = 0.0
            value = -float(self.at(x)[1][list(kink.rows)].min())
            if kink.quotient:
                x[kink.variable] = 1.0
                denominator = float(self.at(x)[1][kink.rows[0]]) + value
                value = value / denominator if denominator else 0.0
            x[kink.variable] = value if np.isfinite(value) else 0.0
        return x

    def tangled(self, x: Array) -> bool:
        """Whether two factors share a root that is double in neither of them.

        Such a double root cannot become a pair, so the point may be stationary for the NLP and not for the design:
        with both of it in one factor, the way is open.
        """
        for factors in self.products:
            real = [found for factor in factors if (found := factor.real_roots(x))]
            for one, other in combinations(real, 2):
                near = _TANGLED * (1 + max(map(abs, (*one, *other))))
                shared = min(abs(r - t) for r in one for t in other) <= near
                double = any(len(pair) == 2 and pair[1] - pair[0] <= near for pair in (one, other))
                if shared and not double:
                    return True
        return False


def name_of(variable: int) -> str:
    """The name of a variable in a formula, which no parameter has."""
    return f":{variable}"


@dataclass(frozen=True, eq=False)
class Compiled:
    """The functions of an NLP as CasADi compiles them, for whatever numbers: the one place where they are made.

    Attributes:
        early: what the functions take beside the variables, in numbers.
        function: (x, p) → (f, g).
    """

    early: Formula
    function: ca.Function

    @property
    def symbols(self) -> list[Any]:
        """Symbols for x, p and multipliers of the rows, of the kind that the functions are made of."""
        kind: Any = ca.MX if self.function.is_a("MXFunction") else ca.SX
        sizes = {"x": self.function.size1_in(0), "p": self.function.size1_in(1), "m": self.function.size1_out(1)}
        return [kind.sym(name, size) for name, size in sizes.items()]

    @cached_property
    def derivatives(self) -> dict[str, ca.Function]:
        """What CasADi else derives anew for every solver."""
        make = self.function.factory
        first = {of: make("d" + of, ["x", "p"], [of, d]) for of, d in _FIRST.items()}
        second = make("dd", ["x", "p", "lam:f", "lam:g"], ["triu:hess:gamma:x:x"], {"gamma": ["f", "g"]})
        return {"grad_f": first["f"], "jac_g": first["g"], "hess_lag": second}


def compile_formula(formula: Formula, count: int) -> Compiled:
    """A formula of an NLP as functions of CasADi of so many variables."""
    variables = tuple(map(name_of, range(count)))
    names, early, late = formula.split(formula.dependent_steps(variables))
    x, p = ca.SX.sym("x", count), ca.SX.sym("p", len(names))
    given = dict(zip((*variables, *names), [*ca.vertsplit(x), *ca.vertsplit(p)], strict=True))
    f, *g = fold(late, given, CASADI)
    outputs = [ca.densify(ca.SX(f)), ca.densify(ca.vertcat(ca.SX(0, 1), *g))]
    function = ca.Function("nlp", [x, p], outputs, ["x", "p"], ["f", "g"])
    if len(late.steps) * count >= _LARGE:
        inputs: list[Any] = [ca.MX.sym("x", count), ca.MX.sym("p", len(names))]
        function = ca.Function("nlp", inputs, list(function(*inputs)), ["x", "p"], ["f", "g"])
    return Compiled(early, function)


class _Formulas(threading.local):
    """Compiled formulas; those of another thread are not to be used."""

    def __init__(self) -> None:
        self.of = lru_cache(maxsize=_KEPT)(compile_formula)
        self.constants = lru_cache(maxsize=_KEPT)(self._constants)

    def _constants(self, formula: Formula, count: int, numbers: tuple[tuple[str, float], ...]) -> list[float]:
        with np.errstate(all="ignore"):
            return [float(c) for c in fold(self.of(formula, count).early, dict(numbers), FLOATS)]


_MADE = _Formulas()


def forget_formulas() -> None:
    """Compile formulas anew, in this thread."""
    for made in (_MADE.of, _MADE.constants):
        made.cache_clear()


@dataclass(frozen=True)
class Scale:
    """Powers of 2, so that scaling does not round.

    Attributes:
        unit: of the roots.
        lead: of the leading coefficient.
    """

    unit: float = 1.0
    lead: float = 1.0

    def scaled(self, coefficients: Sequence[Any]) -> list[Any]:
        """Coefficients, descending, of the polynomial in s/unit, over the unit of the leading one."""
        if self == Scale():
            return list(coefficients)
        n = len(coefficients) - 1
        return [c / (self.lead * self.unit**k) for k, c in zip(range(n + 1), coefficients, strict=True)]


def scale_of(problem: Posed) -> Scale:
    """Median sizes of roots and leading coefficients over some designs of the box.

    Every unit is as exact as another; this one makes tolerances mean the same for all equations.
    """
    if problem.model.natural:
        return Scale()
    found = coefficients_of(problem, problem.ordered(_designs(problem)))
    a = np.stack(np.broadcast_arrays(*found), axis=-1)
    a = a.reshape(-1, a.shape[-1])
    a = a[np.all(np.isfinite(a), axis=1) & np.any(a != 0, axis=1)]
    if not len(a):
        return Scale()
    a = regularise(a)
    size = np.abs(roots(a))
    size = size[(size > 0) & (size < 1e100)]
    return Scale(_power_of_two(size), _power_of_two(np.abs(a[:, 0])))


def objective_size(problem: Posed) -> float:
    """Size below which differences of the objective are none, relative: that of the roots where it is about these."""
    about = problem.objective.names if problem.objective else ()
    return min(1.0, scale_of(problem).unit) if about == ("abscissa",) else 1.0


def _designs(problem: Posed) -> dict[str, Any]:
    """Columns of designs spread over the box."""
    names = list(problem.free)
    share = (0.5 + np.arange(_DESIGNS)[:, None] * golden_steps(len(names))) % 1.0 if names else np.zeros((1, 0))
    lower, upper = (np.array([ends[k] for ends in problem.free.values()]) for k in (0, 1))
    return dict(zip(names, (lower + (upper - lower) * share).T, strict=True))


def objective_unit(problem: Posed) -> float:
    """A power of 2 near the size of a small objective: a solver brings large ones down by itself, but none up."""
    if problem.model.natural or problem.objective is None or not problem.free:
        return 1.0
    [values] = evaluate(problem, [problem.objective], problem.ordered(_designs(problem)))
    size = np.abs(np.atleast_1d(values))
    size = size[np.isfinite(size) & (size > 0)]
    return _power_of_two(size) if len(size) and np.median(size) < _ORDINARY[0] else 1.0


def units_of(problem: Posed) -> tuple[float, ...]:
    """For each free parameter a power of 2 near the size of its range, or 1 where that is near enough."""
    if problem.model.natural:
        return ()
    sizes = [max(map(abs, ends)) for ends in problem.free.values()]
    return tuple(ordinary(size) for size in sizes)


def reaches_of(problem: Posed) -> dict[str, float]:
    """For each free parameter a power of 2 near its size, or its range where it is large: what a proof moves it by."""
    units = dict(zip(problem.free, units_of(problem), strict=False))  # none of natural units
    return {n: u if u <= 1 else ordinary(problem.free[n][1] - problem.free[n][0]) for n, u in units.items()}


def ordinary(size: float) -> float:
    """A power of 2 near a size, or 1 where that is near enough, or there is none."""
    near = _ORDINARY[0] <= size <= _ORDINARY[1] or size == 0 or not np.isfinite(size)
    return 1.0 if near else _power_of_two(np.array([size]))


def _power_of_two(sizes: Any) -> float:
    return float(2.0 ** np.round(np.log2(np.median(sizes)))) if len(sizes) else 1.0
