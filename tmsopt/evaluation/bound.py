"""Lower bounds on the abscissa without a search: geometric mean of the roots, and linear relations of coefficients.

The product of the roots is ±aₙ/a0. So the abscissa is at least ω0 = −|aₙ/a0|^(1/n), for any other coefficients.

A relation Σ b_k a_k = 0 that holds for all free parameters also gives a bound. If no root is right of γ, the
coefficients of p(t + γ) all have the sign of a0 or are 0. With h(z) = Σ b_k C(n, k) z^k, the relation multiplies the
coefficient of t^(n−i) by (n − i)! h⁽ⁱ⁾(−γ). The relation cannot hold if h and all its derivatives have the same sign at
−γ. So the abscissa is at least −z, where z is the largest real zero of h and its derivatives. If z is a zero of h
itself, (s + z)ⁿ satisfies the relation, and parameters that give this polynomial attain the bound (Blondel,
Gürbüzbalaban, Megretski and Overton 2012, theorem 7). The relation aₙ = c a0 gives ω0, and the relation a1 = c a0 gives
the arithmetic mean of the roots.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache, lru_cache
from typing import Any

import flint
import numpy as np
from flint.utils.flint_exceptions import DomainError

from tmsopt.algebra.balls import Tilt, as_ball, exact
from tmsopt.algebra.formula import (
    CONSTANT,
    INPUT,
    Formula,
    UnsupportedOperation,
    constant,
    fold,
    formula,
    make_node,
    symbol,
    trace,
)
from tmsopt.algebra.identity import multiply_out
from tmsopt.algebra.intervals import ball, ranges
from tmsopt.algebra.kinds import BALLS, NODES, gradients, quotient_or_nan, values
from tmsopt.models import Model, ParameterSet
from tmsopt.models.stated.pairs import list_parts
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Bound
from tmsopt.program.nlp import objective_size
from tmsopt.records import Array

PROOF_TOLERANCE = 1e-9
"""A design is proven optimal if its gap is below this share of the size of the roots plus the size of the bound."""

ROUNDING = 1e-15  # relative rounding error of the quotient aₙ/a0 and of its n-th root
_BITS = 212  # working precision: 64 digits for parameters that are exact doubles
_MAX_FREE_COUNT = 12  # greatest number of free parameters; their box has 4096 corners

_EXTRA_DESIGNS = 8  # designs that check a relation, in addition to those that determine it
_GRID_STEPS = 2**40  # steps of a range, from which random exact designs are chosen

_QUOTIENTS = {"div", "quotient_or_nan", "quotient_or_zero"}
_RATIONAL_OPERATIONS = {INPUT, CONSTANT, "add", "sub", "neg", "mul", "square"} | _QUOTIENTS
"""Operations of rational functions; integer powers are also allowed."""

_ExactEnds = Mapping[tuple[str, float], Any]
"""(parameter, end of its range as a double) → interval of the exact end."""


def minimizes_abscissa(problem: Posed) -> bool:
    """Whether the abscissa is the objective to minimise."""
    return problem.sense == "minimize" and problem.goal == "abscissa"


def instant_bound(problem: Posed, value: float) -> Bound:
    """The bound by ω0; if ω0 leaves a gap, the bound by relations of the coefficients if it is better."""
    if problem.model.polynomial is None:
        return _trace_bound(problem, value) if minimizes_abscissa(problem) else Bound()
    product_bound = omega0_bound(problem, value)
    if product_bound.proven or not minimizes_abscissa(problem):
        return product_bound
    linear_bound = _compare_with_bound(
        relation_bound(_select_first_case(problem)), value, "relation", objective_size(problem)
    )
    return linear_bound if linear_bound.value > product_bound.value else product_bound


def _trace_bound(problem: Posed, value: float) -> Bound:
    """The least mean of the real parts of the roots over the box, for matrices with a constant leading matrix."""
    first_case = _select_first_case(problem)
    mean = _mean_formula(problem.model, first_case)
    if mean is None:
        return Bound()
    (slopes,) = gradients([fold(mean, symbols := {n: symbol(n) for n in mean.names}, NODES)[0]], [*symbols.values()])
    box = [*first_case.free.values()]
    try:
        signs = ranges(formula(slopes, mean.names), box)
        corner = [(a, a) if s >= 0 else (b, b) if t <= 0 else (a, b) for (s, t), (a, b) in zip(signs, box, strict=True)]
        ((low, _),) = ranges(mean, corner)
    except UnsupportedOperation:
        return Bound()
    return _compare_with_bound(low, value, "relation", objective_size(problem))


@lru_cache(maxsize=64)
def _mean_formula(model: Model, problem: Posed) -> Formula | None:
    """Re tr(−P₀⁻¹ P₁)/N in the free parameters; None if P₀ varies or is no matrix of fractions, or is singular."""
    assert model.pencil is not None
    parameters = {**problem.as_nodes(problem.fixed), **{n: symbol(n) for n in problem.free}}
    leading, second, *_ = model.pencil(problem.parameter_set.native(problem.ordered(parameters)))
    parts = [constant(x).fraction for x in list_parts([leading])]
    if any(x is None for x in parts) or any(parts[1::2]):
        return None
    n, real_parts = len(leading), list_parts([second])[::2]
    try:
        inverse = flint.fmpq_mat(
            n, n, [flint.fmpq(x.numerator, x.denominator) for x in parts[::2] if x is not None]
        ).inv()
        entries = ((i, j, inverse[i, j]) for i in range(n) for j in range(n) if inverse[i, j] != 0)
        total = sum(real_parts[j * n + i] * constant(Fraction(int(x.p), int(x.q))) for i, j, x in entries)
        return multiply_out(formula([-total / model.degree], tuple(problem.free)))
    except (ZeroDivisionError, UnsupportedOperation):
        return None


def omega0_bound(problem: Posed, value: float) -> Bound:
    """Lower bound ω0 on the abscissa over the box, without constraints, and the gap between a value and this bound.

    With scenarios, it is the bound of the first scenario, because the worst case is never better than this case.
    """
    largest = _bound_product(_select_first_case(problem)) if minimizes_abscissa(problem) else math.inf
    return _compare_with_bound(
        -(largest ** (1 / problem.model.degree)) * (1 + ROUNDING), value, "omega0", objective_size(problem)
    )


def _select_first_case(problem: Posed) -> Posed:
    """The problem at its first scenario."""
    if not problem.scenarios:
        return problem
    return problem.nominal.derive(fixed={**problem.fixed, **problem.cases[0].at})


def _compare_with_bound(bound: float, value: float, method: str, size: float) -> Bound:
    """A bound and its gap; an empty bound if it is infinite or a feasible design contradicts it."""
    if not math.isfinite(bound) or value < bound - PROOF_TOLERANCE * (size + abs(bound)):
        return Bound()
    gap = max(value - bound, 0.0)
    return Bound(bound, gap, is_gap_closed(gap, bound, size), method)


def is_gap_closed(gap: float, bound: float, size: float = 1.0) -> bool:
    """Whether a gap is closed, for roots of this size."""
    return gap <= PROOF_TOLERANCE * (size + abs(bound))


def _bound_product(problem: Posed) -> float:
    """Greatest |aₙ/a0| over the box; inf if a0 may vanish or the maximum cannot be enclosed.

    If aₙ and a0 are linear in a parameter, their quotient is monotone in it, so its extremes are at the ends. At most
    one parameter may be nonlinear; the stationary points along it are roots of a polynomial.
    """
    model = problem.model
    if len(problem.free) > _MAX_FREE_COUNT or not is_rational(model, model.sets[0]):
        return _enclose_product(problem)
    box, exact_ends = _build_algebraic_box(problem)
    outer = _trace_outer_coefficients(model, tuple(box))
    shares = np.random.default_rng(0).random(len(box)).tolist()  # a generic point, where no power vanishes
    inner_point = [lo + (hi - lo) * share for (lo, hi), share in zip(box.values(), shares, strict=True)]
    try:
        lines = {n: _restrict_to_line(outer, inner_point, n) for n, (lo, hi) in box.items() if lo < hi}
    except (DomainError, TypeError):  # division by a parameter, or by 0 for the fixed parameters
        return _enclose_product(problem)
    degrees = {n: max(a0.degree(), an.degree()) for n, (a0, an, slope) in lines.items() if slope}
    nonlinear_names = [n for n, degree in degrees.items() if degree > 1]
    if len(nonlinear_names) > 1:
        return _enclose_product(problem)
    coordinates = [ends if degrees.get(n) == 1 else (sum(ends) / 2,) for n, ends in box.items()]
    points = [*itertools.product(*coordinates)]
    for name in nonlinear_names:
        extremes = [_find_extremes(outer, corner, name, *box[name]) for corner in points]
        if not all(extremes):
            return math.inf
        points = [*itertools.chain(*extremes)]
    return _find_largest_ratio(outer, dict(zip(box, np.array(points).T, strict=True)), exact_ends)


@lru_cache(maxsize=64)
def _trace_outer_coefficients(model: Model, names: tuple[str, ...]) -> Formula:
    """a0 and aₙ in the algebraic parameters."""
    return trace(lambda x: model.evaluate_polynomial(x)[:: model.degree], names)


def _enclose_product(problem: Posed) -> float:
    """Upper bound of |aₙ/a0| over the box in interval arithmetic; inf if the interval of a0 contains 0."""
    with flint.ctx.workprec(_BITS):
        box = {n: ball(ends) for n, ends in problem.free.items()}
        parameters = problem.ordered({n: exact(v) for n, v in problem.fixed.items()} | box)
        return _bound_ratio(problem.model.coefficients(parameters, problem.parameter_set))


def _bound_ratio(a: Sequence[Any]) -> float:
    """Upper end of the interval of |aₙ/a0|; inf if the quotient may not exist."""
    upper = as_ball(abs(quotient_or_nan(as_ball(a[-1]), as_ball(a[0])))).upper()
    return float(upper) if upper.is_finite() else math.inf


def _find_largest_ratio(outer: Formula, points: Mapping[str, Array], exact_ends: _ExactEnds) -> float:
    """Greatest |aₙ/a0| over the points; inf unless a0 has the same sign at all points.

    Where both coefficients are 0, the quotient is constant along the adjacent edges. The largest quotients are computed
    again in interval arithmetic, because in doubles a small a0 loses digits by cancellation.
    """
    a0, an, *_ = np.broadcast_arrays(*values(outer, points), *points.values())
    are_zero = (an == 0) & (a0 == 0)
    if set(np.sign(a0[~are_zero]).tolist()) not in ({-1.0}, {1.0}):
        return math.inf
    with np.errstate(over="ignore"):
        quotients = np.where(are_zero, 0.0, np.abs(an / np.where(are_zero, 1.0, a0)))
    with flint.ctx.workprec(_BITS):
        for k in np.flatnonzero(quotients >= quotients.max() / 2):
            point = {n: float(column[k]) for n, column in points.items()}
            quotients[k] = _bound_ratio(values(outer, {n: exact_ends.get((n, x), exact(x)) for n, x in point.items()}))
    return float(quotients.max())


def _restrict_to_line(outer: Formula, point: Sequence[float], name: str) -> tuple[Any, Any, Any]:
    """a0, aₙ and the numerator of (aₙ/a0)′ as polynomials in one parameter; the others are fixed at a point."""
    arguments = dict(zip(outer.names, map(exact, point), strict=True)) | {name: flint.fmpq_poly([0, 1])}
    a0, an = (flint.fmpq_poly([1]) * a for a in fold(outer, arguments, BALLS))
    return a0, an, an.derivative() * a0 - an * a0.derivative()


def _find_extremes(outer: Formula, corner: Sequence[float], name: str, *ends: float) -> list[tuple[float, ...]]:
    """The ends and stationary points along the nonlinear parameter from a corner; empty if the line has a pole."""
    a0, _, slope = _restrict_to_line(outer, corner, name)
    poles, turning_points = (
        [z.real for z, _ in p.complex_roots() if z.imag == 0 and not (z.real < ends[0] or z.real > ends[1])]
        for p in (a0, slope)
    )
    if poles:
        return []
    extremes = (*ends, *(min(max(float(x), ends[0]), ends[1]) for x in turning_points))
    return [tuple(x if n == name else c for n, c in zip(outer.names, corner, strict=True)) for x in extremes]


def _build_algebraic_box(problem: Posed) -> tuple[dict[str, tuple[float, float]], _ExactEnds]:
    """Range of each algebraic parameter in doubles, and the exact intervals of its ends.

    Algebraic parameters are monotone in each parameter of a set, so the corners of the box are enough. √(1 + T²) is
    monotone only on each side of an upright axis, so the upright axis is also a corner.
    """
    parameter_set = problem.parameter_set
    ends = {p.name: problem.free.get(p.name) or (problem.fixed[p.name],) for p in parameter_set.parameters}
    ends |= {p.name: (*e, 0.0) for p in parameter_set.parameters if p.tangent and min(e := ends[p.name]) < 0 < max(e)}
    corners = np.array(list(itertools.product(*(ends[n] for n in parameter_set.names))))
    doubles = problem.model.algebraic(parameter_set.native(dict(zip(parameter_set.names, corners.T, strict=True))))

    @cache
    def exact_corner(k: int) -> dict[str, Any]:
        with flint.ctx.workprec(_BITS):
            return problem.model.algebraic(
                parameter_set.native(dict(zip(parameter_set.names, map(exact, corners[k].tolist()), strict=True)))
            )

    box, exact_ends = {}, dict[tuple[str, float], Any]()
    for n, corner_values in doubles.items():
        column = np.broadcast_to(np.asarray(corner_values, dtype=float), len(corners))
        indices = int(column.argmin()), int(column.argmax())
        box[n] = float(column[indices[0]]), float(column[indices[1]])
        exact_ends |= {(n, end): exact_corner(k)[n] for end, k in zip(box[n], indices, strict=True)}
    return box, exact_ends


@lru_cache(maxsize=64)
def relation_bound(problem: Posed) -> float:
    """The greatest lower bound on the abscissa by linear relations of the coefficients; −inf without relations.

    The bound ignores constraints and the ranges of the free parameters. The coefficients must be rational functions of
    the free parameters (for angles, of their tangents). Relations are found in exact arithmetic at random designs, and
    they must also hold at further random designs.
    """
    rows = _sample_exact_rows(problem) if is_rational(problem.model, problem.parameter_set) else None
    if not rows:
        return -math.inf
    # Two bases of the relations Σ b_k a_k = 0, reduced from the leading and from the last coefficient.
    relations = [*_compute_null_space(rows), *(b[::-1] for b in _compute_null_space([row[::-1] for row in rows]))]
    with flint.ctx.workprec(_BITS):
        return max(map(_bound_by_relation, relations), default=-math.inf)


@lru_cache(maxsize=64)
def is_rational(model: Model, parameter_set: ParameterSet) -> bool:
    """Whether the coefficients are rational functions of the parameters (for angles, of their tangents)."""
    tangents = {p.name for p in parameter_set.parameters if p.tangent}
    coefficients = trace(
        lambda x: model.coefficients(
            {n: make_node("atan", s) if n in tangents else s for n, s in x.items()}, parameter_set
        ),
        parameter_set.names,
    )
    integers = {
        k for k, s in enumerate(coefficients.steps) if isinstance(s.value, Fraction) and s.value.denominator == 1
    }
    powers = [s for s in coefficients.steps if s.op == "pow" and s.operands[1] in integers]
    rational = [s for s in coefficients.steps if s.op in _RATIONAL_OPERATIONS and not isinstance(s.value, Formula)]
    return len(powers) + len(rational) == len(coefficients.steps)


def _compute_null_space(rows: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """Reduced basis of the null space of the rows."""
    reduced, rank = flint.fmpq_mat([list(row) for row in rows]).rref()
    columns = range(len(rows[0]))
    pivots = {next(j for j in columns if reduced[i, j] != 0): i for i in range(rank)}
    return [
        [-reduced[pivots[j], free] if j in pivots else flint.fmpq(j == free) for j in columns]
        for free in columns
        if free not in pivots
    ]


def _bound_by_relation(relation: Sequence[Any]) -> float:
    """−z, where z is the largest real zero of h and its derivatives; −inf for the relation a0 = 0."""
    n = len(relation) - 1
    h: Any = flint.fmpq_poly([b * math.comb(n, k) for k, b in enumerate(relation)])
    zeros: list[float] = []
    while h.degree() > 0:
        zeros += [float(z.real.upper()) for z, _ in h.complex_roots() if z.imag == 0]
        h = h.derivative()
    largest = max(zeros, default=math.inf)
    return math.nextafter(-largest, -math.inf) if largest else 0.0


def _sample_exact_rows(problem: Posed) -> list[list[Any]] | None:
    """Coefficients at random designs of the box; None if a coefficient is not a fraction."""
    parameter_set, rng, rows = problem.parameter_set, np.random.default_rng(0), []
    if any(parameter_set[n].tangent and v != 0 for n, v in problem.fixed.items()):
        return None
    for _ in range(problem.model.degree + 1 + _EXTRA_DESIGNS):
        design: dict[str, Any] = {}
        for n, ends in problem.ordered({**{n: (v, v) for n, v in problem.fixed.items()}, **problem.free}).items():
            lower, upper = (exact(math.tan(e)) if parameter_set[n].tangent else exact(e) for e in ends)
            value = lower + (upper - lower) * flint.fmpq(int(rng.integers(_GRID_STEPS)), _GRID_STEPS)
            design[n] = Tilt(value) if parameter_set[n].tangent else value
        row = problem.model.coefficients(design, parameter_set)
        if not all(isinstance(c, flint.fmpq) for c in row):
            return None
        rows.append(row)
    return rows
