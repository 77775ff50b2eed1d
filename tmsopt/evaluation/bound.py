"""Bounds that need no search: by the geometric mean of the roots, and by relations of the coefficients.

The product of the roots is aₙ/a0, so the abscissa is at least ω0 = −|aₙ/a0|^(1/n), whatever the other coefficients.

A relation Σ b_k a_k = 0 that holds whatever the free parameters is a bound too. Where no root is right of γ, no
coefficient of p(t + γ) has another sign than a0. With h(z) = Σ b_k C(n, k) z^k, a relation weighs that of t^(n−i) by
(n − i)! h⁽ⁱ⁾(−γ), so it cannot hold for a γ at which h and all its derivatives have one sign: the abscissa is at least
−z, with z the largest real zero of any of them. If z is one of h itself, (s + z)ⁿ satisfies the relation, and the bound
is reached where the parameters give that polynomial (Blondel, Gürbüzbalaban, Megretski and Overton 2012, theorem 7).
ω0 is the bound of aₙ = c a0, the mean of the roots that of a1 = c a0.
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
from tmsopt.algebra.formula import CONSTANT, INPUT, Formula, fold, make_node, trace
from tmsopt.algebra.intervals import ball
from tmsopt.algebra.kinds import BALLS, quotient, values
from tmsopt.models import Model, ParameterSet
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Bound
from tmsopt.program.nlp import objective_size
from tmsopt.records import Array

PROVEN = 1e-9
"""Gap, relative to the size of the roots and of the bound, below which a design counts as proven optimal."""

ROUNDING = 1e-15  # of the quotient to a double, and of its root
_BITS = 212  # the parameters of a set are doubles, so exact; what follows from them is right far beyond the answer
_CORNERS = 12  # free parameters, beyond which their ranges have too many

_MORE = 8  # designs at which a relation is tried beyond those that determine it
_FINENESS = 2**40  # steps of a range, one of which an exact design takes at random

_RATIONAL = {INPUT, CONSTANT, "add", "sub", "neg", "mul", "square", "div", "quotient", "ratio"}
"""Operations that make rational functions, beside whole powers."""

Known = Mapping[tuple[str, float], Any]


def bounded(problem: Posed) -> bool:
    """Whether the bound speaks of the problem: it asks for the least abscissa."""
    return problem.sense == "minimize" and problem.goal == "abscissa"


def instant_bound(problem: Posed, value: float) -> Bound:
    """The better one of `omega0_bound` and, where that leaves a gap, the bound by relations of the coefficients."""
    known = omega0_bound(problem, value)
    if known.proven or not bounded(problem):
        return known
    other = _bound(relation_bound(_one_case(problem)), value, "relation", objective_size(problem))
    return other if other.value > known.value else known


def omega0_bound(problem: Posed, value: float) -> Bound:
    """Lower bound on the abscissa over the whole box, constraints ignored, and the gap of a value to it.

    With scenarios, that of the first of them: the worst is no better.
    """
    largest = _largest_product(_one_case(problem)) if bounded(problem) else math.inf
    return _bound(-(largest ** (1 / problem.model.degree)) * (1 + ROUNDING), value, "omega0", objective_size(problem))


def _one_case(problem: Posed) -> Posed:
    """The problem at the first of its scenarios."""
    if not problem.scenarios:
        return problem
    return problem.nominal.derive(fixed={**problem.fixed, **problem.cases[0].at})


def _bound(bound: float, value: float, method: str, size: float) -> Bound:
    """A bound and the gap of a value to it; none where it is infinite, or a feasible design contradicts it."""
    if not math.isfinite(bound) or value < bound - PROVEN * (size + abs(bound)):
        return Bound()
    gap = max(value - bound, 0.0)
    return Bound(bound, gap, closed(gap, bound, size), method)


def closed(gap: float, bound: float, size: float = 1.0) -> bool:
    """Whether a gap is closed, for roots of this size or larger."""
    return gap <= PROVEN * (size + abs(bound))


def _largest_product(problem: Posed) -> float:
    """Greatest |aₙ/a0| over the box; inf where a0 may vanish or the maximum cannot be enclosed.

    Along a parameter in which aₙ and a0 are linear the quotient is monotone, so its extremes are at the ends. One
    further parameter may enter otherwise; along it the stationary points are polynomial roots.
    """
    model = problem.model
    if len(problem.free) > _CORNERS or not is_rational(model, model.sets[0]):
        return _enclosed_product(problem)
    box, known = _algebraic_box(problem)
    outer = _outer(model, tuple(box))
    shares = np.random.default_rng(0).random(len(box)).tolist()  # of the ranges: a point at which every power shows
    inside = [lo + (hi - lo) * share for (lo, hi), share in zip(box.values(), shares, strict=True)]
    try:
        through = {n: _through(outer, inside, n) for n, (lo, hi) in box.items() if lo < hi}
    except (DomainError, TypeError):  # a parameter divides, or what is fixed leaves no number
        return _enclosed_product(problem)
    varying = {n: max(a.degree() for a in ends) for n, (*ends, turning) in through.items() if turning}
    curved = [n for n, degree in varying.items() if degree > 1]
    if len(curved) > 1:
        return _enclosed_product(problem)
    at = [ends if varying.get(n) == 1 else (sum(ends) / 2,) for n, ends in box.items()]
    points = [*itertools.product(*at)]
    for name in curved:
        along = [_along(outer, corner, name, *box[name]) for corner in points]
        if not all(along):
            return math.inf
        points = [*itertools.chain(*along)]
    return _largest(outer, dict(zip(box, np.array(points).T, strict=True)), known)


@lru_cache(maxsize=64)
def _outer(model: Model, names: tuple[str, ...]) -> Formula:
    """a0 and aₙ in the algebraic parameters."""
    return trace(lambda x: model.polynomial(**x)[:: model.degree], names)


def _enclosed_product(problem: Posed) -> float:
    """An upper end of |aₙ/a0| over the box, by balls; inf where they contain a0 = 0."""
    with flint.ctx.workprec(_BITS):
        box = {n: ball(ends) for n, ends in problem.free.items()}
        given = problem.ordered({n: exact(v) for n, v in problem.fixed.items()} | box)
        return _upper(problem.model.coefficients(given, problem.parameter_set))


def _upper(a: Sequence[Any]) -> float:
    """An upper end of |aₙ/a0|; inf where that may not exist."""
    upper = as_ball(abs(quotient(as_ball(a[-1]), as_ball(a[0])))).upper()
    return float(upper) if upper.is_finite() else math.inf


def _largest(outer: Formula, points: Mapping[str, Array], known: Known) -> float:
    """Greatest |aₙ/a0| at points; inf unless a0 has one sign there.

    Where both vanish the quotient is constant along the edges that end. The largest are upper ends of balls: a small
    a0 is a difference, of which doubles lose as many digits as cancel.
    """
    first, last, *_ = np.broadcast_arrays(*values(outer, points), *points.values())
    both = (last == 0) & (first == 0)
    if set(np.sign(first[~both]).tolist()) not in ({-1.0}, {1.0}):
        return math.inf
    with np.errstate(over="ignore"):
        quotients = np.where(both, 0.0, np.abs(last / np.where(both, 1.0, first)))
    with flint.ctx.workprec(_BITS):
        for k in np.flatnonzero(quotients >= quotients.max() / 2):
            at = {n: float(column[k]) for n, column in points.items()}
            quotients[k] = _upper(values(outer, {n: known.get((n, x), exact(x)) for n, x in at.items()}))
    return float(quotients.max())


def _through(outer: Formula, point: Sequence[float], name: str) -> tuple[Any, Any, Any]:
    """a0 and aₙ as polynomials in one parameter, the others as at a point, and what vanishes where aₙ/a0 turns."""
    at = dict(zip(outer.names, map(exact, point), strict=True)) | {name: flint.fmpq_poly([0, 1])}
    first, last = (flint.fmpq_poly([1]) * a for a in fold(outer, at, BALLS))
    return first, last, last.derivative() * first - last * first.derivative()


def _along(outer: Formula, corner: Sequence[float], name: str, *ends: float) -> list[tuple[float, ...]]:
    """A corner moved to the ends and stationary points along the one curved parameter; nowhere if it has a pole."""
    first, _, turning = _through(outer, corner, name)
    poles, inside = (
        [z.real for z, _ in p.complex_roots() if z.imag == 0 and not (z.real < ends[0] or z.real > ends[1])]
        for p in (first, turning)
    )
    if poles:
        return []
    places = (*ends, *(min(max(float(x), ends[0]), ends[1]) for x in inside))
    return [tuple(x if n == name else c for n, c in zip(outer.names, corner, strict=True)) for x in places]


def _algebraic_box(problem: Posed) -> tuple[dict[str, tuple[float, float]], Known]:
    """Range of each algebraic parameter as doubles, and the balls that their ends are rounded from.

    They are monotone in every parameter of a set, so corners suffice; √(1 + T²) is on either side of an upright axis.
    """
    of = problem.parameter_set
    ends = {p.name: problem.free.get(p.name) or (problem.fixed[p.name],) for p in of.parameters}
    ends |= {p.name: (*e, 0.0) for p in of.parameters if p.tangent and min(e := ends[p.name]) < 0 < max(e)}
    corners = np.array(list(itertools.product(*(ends[n] for n in of.names))))
    doubles = problem.model.algebraic(of.native(dict(zip(of.names, corners.T, strict=True))))

    @cache
    def balls(k: int) -> dict[str, Any]:
        """The algebraic parameters at a corner."""
        with flint.ctx.workprec(_BITS):
            return problem.model.algebraic(of.native(dict(zip(of.names, map(exact, corners[k].tolist()), strict=True))))

    box, known = {}, dict[tuple[str, float], Any]()
    for n, given in doubles.items():
        column = np.broadcast_to(np.asarray(given, dtype=float), len(corners))
        least, greatest = int(column.argmin()), int(column.argmax())
        box[n] = float(column[least]), float(column[greatest])
        known |= {(n, box[n][0]): balls(least)[n], (n, box[n][1]): balls(greatest)[n]}
    return box, known


@lru_cache(maxsize=64)
def relation_bound(problem: Posed) -> float:
    """The greatest of the bounds on the abscissa by relations of the coefficients; −inf without any.

    Constraints and the ranges of the free parameters play no role. Relations are looked for only among coefficients
    that are rational functions of the free parameters (tangents of angles) with fractions for coefficients, and
    without rounding: they hold at designs drawn at random, more of them than they are determined by.
    """
    rows = _exact_rows(problem) if is_rational(problem.model, problem.parameter_set) else None
    if not rows:
        return -math.inf
    # Independent b with Σ b_k a_k = 0, reduced from the leading coefficient on, and from the last one.
    reduced = [*_null_space(rows), *(b[::-1] for b in _null_space([row[::-1] for row in rows]))]
    with flint.ctx.workprec(_BITS):
        return max(map(_bound_of, reduced), default=-math.inf)


@lru_cache(maxsize=64)
def is_rational(model: Model, of: ParameterSet) -> bool:
    """Whether the coefficients are rational functions of the parameters of a set, or of the tangents of angles."""
    tangents = {p.name for p in of.parameters if p.tangent}
    coefficients = trace(
        lambda x: model.coefficients({n: make_node("atan", s) if n in tangents else s for n, s in x.items()}, of),
        of.names,
    )
    wholes = {k for k, s in enumerate(coefficients.steps) if isinstance(s.value, Fraction) and s.value.denominator == 1}
    powers = [s for s in coefficients.steps if s.op == "pow" and s.operands[1] in wholes]
    rational = [s for s in coefficients.steps if s.op in _RATIONAL and not isinstance(s.value, Formula)]
    return len(powers) + len(rational) == len(coefficients.steps)


def _null_space(rows: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """Reduced basis of the vectors that every row is orthogonal to."""
    reduced, rank = flint.fmpq_mat([list(row) for row in rows]).rref()
    width = range(len(rows[0]))
    pivots = {next(j for j in width if reduced[i, j] != 0): i for i in range(rank)}
    return [
        [-reduced[pivots[j], free] if j in pivots else flint.fmpq(j == free) for j in width]
        for free in width
        if free not in pivots
    ]


def _bound_of(relation: Sequence[Any]) -> float:
    """−z, with z the largest real zero of h or a derivative; −inf for a relation of a0 alone, which is 0 then."""
    n = len(relation) - 1
    h: Any = flint.fmpq_poly([b * math.comb(n, k) for k, b in enumerate(relation)])
    zeros: list[float] = []
    while h.degree() > 0:
        zeros += [float(z.real.upper()) for z, _ in h.complex_roots() if z.imag == 0]
        h = h.derivative()
    largest = max(zeros, default=math.inf)
    return math.nextafter(-largest, -math.inf) if largest else 0.0


def _exact_rows(problem: Posed) -> list[list[Any]] | None:
    """Coefficients at random designs of the box; None where one is no fraction."""
    of, rng, rows = problem.parameter_set, np.random.default_rng(0), []
    if any(of[n].tangent and v != 0 for n, v in problem.fixed.items()):
        return None
    for _ in range(problem.model.degree + 1 + _MORE):
        drawn: dict[str, Any] = {}
        for n, ends in problem.ordered({**{n: (v, v) for n, v in problem.fixed.items()}, **problem.free}).items():
            lower, upper = (exact(math.tan(e)) if of[n].tangent else exact(e) for e in ends)
            at = lower + (upper - lower) * flint.fmpq(int(rng.integers(_FINENESS)), _FINENESS)
            drawn[n] = Tilt(at) if of[n].tangent else at
        row = problem.model.coefficients(drawn, of)
        if not all(isinstance(c, flint.fmpq) for c in row):
            return None
        rows.append(row)
    return rows
