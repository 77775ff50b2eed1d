"""A nonlinear program (NLP) as plain data, its units, and the starting values of its variables."""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import combinations, product
from typing import Any

import casadi as ca
import numpy as np

from tmsopt.algebra.formula import Formula, Kind, constant, fold, formula, symbol
from tmsopt.algebra.kinds import CASADI, FLOATS, NODES
from tmsopt.algebra.sequence import golden_steps
from tmsopt.chains.family import family_of
from tmsopt.models import Values
from tmsopt.problem.cases import Case
from tmsopt.problem.evaluate import coefficients_of, evaluate
from tmsopt.problem.problem import Posed
from tmsopt.problem.quantities import regularise
from tmsopt.records import Array
from tmsopt.roots import roots
from tmsopt.roots.patterns.pattern import Roots

_SHARED_DISTANCE = 1e-3  # roots of two factors with a smaller relative distance count as shared

_EQUAL_DISTANCE = 1e-3
"""Distances of contacts that differ by less than this count as equal."""

_MAX_EXPRESSION_COST = 50_000
"""Operations times variables above which functions are differentiated instead of expressions."""

_MAX_PROGRAMS = 64
"""Compiled programs in the cache; most are used once, while cases are added one by one."""

_FIRST_DERIVATIVES = {"f": "grad:f:x", "g": "jac:g:x"}
"""Output → its derivative in the notation of CasADi."""

_SCALE_DESIGNS = 33  # number of designs from which scales are estimated
_ORDINARY_SIZES = (1e-2, 1e3)  # sizes in this range need no scaling

Guess = Callable[[Sequence[Values], Sequence[Roots]], list[list[float]]]
"""Starting values of added variables, from the quantities and roots of the nominal design and of each case.

Each list is one choice of these values."""


@dataclass(frozen=True)
class AddedVariable:
    """Variables that the formulation adds to the parameters, and their starting values.

    Attributes:
        guess_near: starting values near a solution, if they differ.
    """

    name: str
    size: int
    guess: Guess
    guess_near: Guess | None = None


@dataclass(frozen=True)
class Contact:
    """One way in which a root quantity or a kink variable attains its value.

    A root lies on the edge of the region that the quantity bounds, or one piece is equal to the kink variable.

    Attributes:
        distance: distance of the root from the edge at a point of the NLP; by default the value of the row. The nearest
            of several contacts is tried first.
        variable, row: index of the variable or of the row that is held at `value`.
    """

    distance: Callable[[Array], float] | None = None
    variable: int | None = None
    row: int | None = None
    value: float = 0.0


@dataclass(frozen=True)
class MaximumVariable:
    """A variable t that stands for the greatest of several pieces, and its rows t − piece ≥ 0.

    Attributes:
        is_quotient: whether t stands for a quotient instead, with one row t · denominator − numerator = 0.
    """

    variable: int
    rows: tuple[int, ...]
    is_quotient: bool = False


@dataclass(frozen=True)
class Factor:
    """The variables of a factor t² + βt + κ, or s² + ps + w², or t + δ.

    Attributes:
        index: index of the first variable.
        is_squared: whether the second variable is w, not its square.
        is_linear: whether there is no second variable.
    """

    index: int
    is_squared: bool = False
    is_linear: bool = False

    def real_roots(self, x: Array) -> tuple[float, ...]:
        """The real roots of the factor in ascending order; none for a complex pair."""
        if self.is_linear:
            return (-float(x[self.index]),)
        half, q = -x[self.index] / 2, x[self.index + 1]
        square = half * half - (q * q if self.is_squared else q)
        return (float(half - np.sqrt(square)), float(half + np.sqrt(square))) if square >= 0 else ()


@dataclass(frozen=True)
class NLP:
    """Minimise f(x) subject to lower ≤ x ≤ upper and row_lower ≤ g(x) ≤ row_upper.

    Attributes:
        formulation: ``abscissa`` or ``matching``.
        variables: names; the free parameters come first, each as itself or as its tangent.
        formula: f, then each row of g, in the variables (see `variable_name`) and the numbers.
        numbers: name → value, for fixed parameters that are not 0 and for limits such as ``trail.limit``.
        rows: name of each row of g: a constraint, or the equation it belongs to.
        lifts: the variables after the free parameters, in order.
        cases: the variations of the design that its rows cover.
        contacts: root quantity or kink → the ways to attain it, one of which must hold. A quantity is listed only if
            its bound is not enough.
        kinks: the variables that replace kinks; each comes after the kinks that it depends on.
        products: the factors of each polynomial.
        has_exact_starts: whether starts satisfy the equations of all cases.
        unit: unit of the roots in the variables.
        size: size of the objective, as far as it is known before the search.
        units: units of the free parameters, for a solver with absolute tolerances.
        objective_unit: unit of the objective if it is small, for the same reason.
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
    contacts: Mapping[str, tuple[Contact, ...]] = field(repr=False, default_factory=dict)
    kinks: tuple[MaximumVariable, ...] = field(repr=False, default=())
    products: tuple[tuple[Factor, ...], ...] = field(repr=False, default=())
    has_exact_starts: bool = False
    unit: float = 1.0
    size: float = 1.0
    units: tuple[float, ...] = ()
    objective_unit: float = 1.0

    @property
    def inputs(self) -> tuple[str, ...]:
        """The names of the variables in the formula."""
        return tuple(map(variable_name, range(len(self.variables))))

    def evaluate(self, x: Array) -> tuple[float, Array]:
        """f and g at a point."""
        f, g = self.program.function(x.tolist(), self.constants)
        return float(f), g.full().ravel()

    @cached_property
    def numeric_formula(self) -> Formula:
        """The formula with its numbers as constants."""
        numbers = {n: constant(v) for n, v in self.numbers.items()}
        return formula(fold(self.formula, {n: symbol(n) for n in self.inputs} | numbers, NODES), self.inputs)

    def fold(self, x: Sequence[Any], kind: Kind, shared: Callable[[Any], Any] | None = None) -> list[Any]:
        """f and the rows of g for variables of one kind of number."""
        return fold(self.numeric_formula, dict(zip(self.inputs, x, strict=True)), kind, shared)

    def symbolic(self, x: Any) -> tuple[Any, Any]:
        """f and g for a CasADi vector."""
        f, *g = self.fold(ca.vertsplit(x), CASADI)
        return ca.densify(ca.SX(f)), ca.densify(ca.vertcat(ca.SX(0, 1), *g))

    @cached_property
    def program(self) -> "CompiledProgram":
        """The compiled functions f and g, shared by NLPs with one formula in one thread."""
        program: CompiledProgram = _PROGRAMS.get(self.formula, len(self.variables))
        return program

    @property
    def constants(self) -> list[float]:
        """Inputs of the compiled functions in addition to x: every value that depends only on the numbers."""
        values: list[float] = _CONSTANTS.get(self.formula, len(self.variables), tuple(self.numbers.items()))
        return values

    def impose_contacts(self, x: Array, tolerance: float = _EQUAL_DISTANCE) -> Iterator["NLP"]:
        """The NLP with one contact held for each entry of `contacts`, first with the contacts nearest to a point.

        Each further NLP exchanges one of these contacts for another one whose distance is equal up to the tolerance.
        """
        rows = self.evaluate(x)[1] if self.kinks else x
        ranked: list[list[Contact]] = []
        for contacts in self.contacts.values():
            distances = [
                float(rows[contact.row]) if contact.distance is None else contact.distance(x) for contact in contacts
            ]
            order = np.argsort(distances, kind="stable")
            limit = distances[order[0]] + tolerance
            ranked.append([contacts[k] for k in order if distances[k] <= limit or k == order[0]])
        nearest = [nearest_contacts[0] for nearest_contacts in ranked]
        yield self._hold_contacts(nearest)
        for k, nearest_contacts in enumerate(ranked):
            for contact in nearest_contacts[1:]:
                yield self._hold_contacts([*nearest[:k], contact, *nearest[k + 1 :]])

    def _hold_contacts(self, contacts: Sequence[Contact]) -> "NLP":
        lower, upper, row_upper = list(self.lower), list(self.upper), list(self.row_upper)
        for contact in contacts:
            if contact.variable is not None:
                lower[contact.variable] = upper[contact.variable] = contact.value
            if contact.row is not None:
                row_upper[contact.row] = contact.value
        return replace(self, lower=tuple(lower), upper=tuple(upper), row_upper=tuple(row_upper))

    def set_kinks(self, x: Array) -> Array:
        """A point with every kink variable set to the greatest of its pieces."""
        x = x.copy()
        for kink in self.kinks:
            x[kink.variable] = 0.0
            value = -float(self.evaluate(x)[1][list(kink.rows)].min())
            if kink.is_quotient:
                x[kink.variable] = 1.0
                denominator = float(self.evaluate(x)[1][kink.rows[0]]) + value
                value = value / denominator if denominator else 0.0
            x[kink.variable] = value if np.isfinite(value) else 0.0
        return x

    def has_split_double_root(self, x: Array) -> bool:
        """Whether two factors share a real root that is a double root of neither factor.

        Two equal roots of different factors cannot become a complex pair, so that the point may be stationary for the
        NLP but not for the design. Two equal roots of one factor can.
        """
        for factors in self.products:
            root_sets = [real_roots for factor in factors if (real_roots := factor.real_roots(x))]
            for root_pair in combinations(root_sets, 2):
                tolerance = _SHARED_DISTANCE * (1 + max(abs(root) for roots in root_pair for root in roots))
                is_shared = min(abs(r - t) for r, t in product(*root_pair)) <= tolerance
                is_double = any(len(roots) == 2 and roots[1] - roots[0] <= tolerance for roots in root_pair)
                if is_shared and not is_double:
                    return True
        return False


def variable_name(variable: int) -> str:
    """The name of a variable in a formula; no parameter has such a name."""
    return f":{variable}"


@dataclass(frozen=True, eq=False)
class CompiledProgram:
    """The CasADi functions of an NLP, for any numbers.

    Attributes:
        number_formula: p, the inputs of the functions in addition to the variables x, as formulas of the numbers.
        function: (x, p) → (f, g).
    """

    number_formula: Formula
    function: ca.Function

    @property
    def symbols(self) -> list[Any]:
        """Symbols for x, p and the multipliers of the rows, of the functions' own kind."""
        kind: Any = ca.MX if self.function.is_a("MXFunction") else ca.SX
        sizes = {"x": self.function.size1_in(0), "p": self.function.size1_in(1), "m": self.function.size1_out(1)}
        return [kind.sym(name, size) for name, size in sizes.items()]

    @cached_property
    def derivatives(self) -> dict[str, ca.Function]:
        """The derivatives by name; without them CasADi would form them again for every solver."""
        make = self.function.factory
        first_derivatives = {
            output: make("d" + output, ["x", "p"], [output, d]) for output, d in _FIRST_DERIVATIVES.items()
        }
        hessian = make("dd", ["x", "p", "lam:f", "lam:g"], ["triu:hess:gamma:x:x"], {"gamma": ["f", "g"]})
        return {"grad_f": first_derivatives["f"], "jac_g": first_derivatives["g"], "hess_lag": hessian}


def compile_program(formula: Formula, count: int) -> CompiledProgram:
    """Compile the formula of an NLP with `count` variables to CasADi functions."""
    variables = tuple(map(variable_name, range(count)))
    names, number_formula, variable_formula = formula.split(formula.dependent_steps(variables))
    x, p = ca.SX.sym("x", count), ca.SX.sym("p", len(names))
    inputs_by_name = dict(zip((*variables, *names), [*ca.vertsplit(x), *ca.vertsplit(p)], strict=True))
    f, *g = fold(variable_formula, inputs_by_name, CASADI)
    outputs = [ca.densify(ca.SX(f)), ca.densify(ca.vertcat(ca.SX(0, 1), *g))]
    function = ca.Function("nlp", [x, p], outputs, ["x", "p"], ["f", "g"])
    if len(variable_formula.steps) * count >= _MAX_EXPRESSION_COST:
        inputs: list[Any] = [ca.MX.sym("x", count), ca.MX.sym("p", len(names))]
        function = ca.Function("nlp", inputs, list(function(*inputs)), ["x", "p"], ["f", "g"])
    return CompiledProgram(number_formula, function)


def _compute_constants(formula: Formula, count: int, numbers: tuple[tuple[str, float], ...]) -> list[float]:
    with np.errstate(all="ignore"):
        return [float(c) for c in fold(_PROGRAMS.get(formula, count).number_formula, dict(numbers), FLOATS)]


class PerThread(threading.local):
    """Caches the last results of a function for each thread: CasADi objects must not be used from two threads."""

    def __init__(self, make: Callable[..., Any], max_results: int) -> None:
        self.get = lru_cache(maxsize=max_results)(make)


_PROGRAMS, _CONSTANTS = PerThread(compile_program, _MAX_PROGRAMS), PerThread(_compute_constants, _MAX_PROGRAMS)


def forget_programs() -> None:
    """Drop the compiled programs of this thread."""
    for cache in (_PROGRAMS, _CONSTANTS):
        cache.get.cache_clear()


@dataclass(frozen=True)
class Scale:
    """Units of the roots and of the leading coefficient a0: powers of 2, so that scaling does not round."""

    unit: float = 1.0
    a0_unit: float = 1.0

    def scale_coefficients(self, coefficients: Sequence[Any]) -> list[Any]:
        """Descending coefficients of the polynomial in s/unit, divided by `a0_unit`."""
        return [c / (self.a0_unit * self.unit**k) for k, c in enumerate(coefficients)]


def scale_of(problem: Posed) -> Scale:
    """Median sizes of roots and leading coefficients over the box, so that tolerances are relative to them."""
    if problem.model.natural:
        return Scale()
    if problem.model.polynomial is None:
        size = np.array([family_of(problem).typical_size])
        return Scale(_power_of_two(size[size > 0]))
    columns = coefficients_of(problem, problem.ordered(_spread_designs(problem)))
    a = np.stack(np.broadcast_arrays(*columns), axis=-1)
    a = a.reshape(-1, a.shape[-1])
    a = a[np.all(np.isfinite(a), axis=1) & np.any(a != 0, axis=1)]
    if not len(a):
        return Scale()
    a = regularise(a)
    size = np.abs(roots(a))
    size = size[(size > 0) & (size < 1e100)]
    return Scale(_power_of_two(size), _power_of_two(np.abs(a[:, 0])))


def objective_size(problem: Posed) -> float:
    """The size of the objective, at most 1: the unit of the roots if the objective is the abscissa, else 1."""
    names = problem.objective.names if problem.objective else ()
    return min(1.0, scale_of(problem).unit) if names == ("abscissa",) else 1.0


def _spread_designs(problem: Posed) -> dict[str, Any]:
    """Free parameter → its values in designs spread over the box."""
    names = list(problem.free)
    points = (0.5 + np.arange(_SCALE_DESIGNS)[:, None] * golden_steps(len(names))) % 1.0 if names else np.zeros((1, 0))
    lower, upper = (np.array([ends[k] for ends in problem.free.values()]) for k in (0, 1))
    return dict(zip(names, (lower + (upper - lower) * points).T, strict=True))


def objective_unit(problem: Posed) -> float:
    """A power of 2 near the size of a small objective, else 1; IPOPT itself scales only large objectives."""
    if problem.model.natural or problem.objective is None or not problem.free:
        return 1.0
    [values] = evaluate(problem, [problem.objective], problem.ordered(_spread_designs(problem)))
    size = np.abs(np.atleast_1d(values))
    size = size[np.isfinite(size) & (size > 0)]
    return _power_of_two(size) if len(size) and np.median(size) < _ORDINARY_SIZES[0] else 1.0


def units_of(problem: Posed) -> tuple[float, ...]:
    """For each free parameter a power of 2 near the size of its range, or 1 if the size is ordinary."""
    if problem.model.natural:
        return ()
    sizes = [max(map(abs, ends)) for ends in problem.free.values()]
    return tuple(unit_near(size) for size in sizes)


def proof_units(problem: Posed) -> dict[str, float]:
    """The unit of each free parameter in a proof: a power of 2 near its size, or near its range for a large size."""
    units = dict(zip(problem.free, units_of(problem), strict=False))  # empty for natural units
    return {n: u if u <= 1 else unit_near(problem.free[n][1] - problem.free[n][0]) for n, u in units.items()}


def unit_near(size: float) -> float:
    """A power of 2 near a size; 1 if the size is ordinary, 0 or not finite."""
    is_ordinary = _ORDINARY_SIZES[0] <= size <= _ORDINARY_SIZES[1] or size == 0 or not np.isfinite(size)
    return 1.0 if is_ordinary else _power_of_two(np.array([size]))


def _power_of_two(sizes: Any) -> float:
    return float(2.0 ** np.round(np.log2(np.median(sizes)))) if len(sizes) else 1.0
