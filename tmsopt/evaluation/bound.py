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
from functools import lru_cache
from typing import Any

import flint
import numpy as np

from tmsopt.algebra.balls import Tilt, as_ball, exact
from tmsopt.algebra.formula import CONSTANT, INPUT, Formula, made, trace
from tmsopt.algebra.kinds import quotient
from tmsopt.models import Model, ParameterSet
from tmsopt.problem.problem import Posed
from tmsopt.problem.solution import Bound
from tmsopt.program.nlp import objective_size
from tmsopt.records import Array

PROVEN = 1e-9
"""Gap, relative to the size of the roots and of the bound, below which a design counts as proven optimal."""

ROUNDING = 1e-15  # of the quotient to a double, and of its root
_NODES = np.linspace(-1, 1, 9)
_BITS = 212  # the parameters of a set are doubles, so exact; what follows from them is right far beyond the answer
_DEGREE = 4  # in any one parameter; nine nodes fit it
_CORNERS = 12  # free parameters, beyond which their ranges have too many
_FIT = np.linalg.pinv(np.vander(_NODES, _DEGREE + 1))

_MORE = 8  # designs at which a relation is tried beyond those that determine it
_FINENESS = 2**40  # steps of a range, one of which an exact design takes at random

_RATIONAL = {INPUT, CONSTANT, "add", "sub", "neg", "mul", "square", "div", "quotient", "ratio"}
"""Operations that make rational functions, beside whole powers."""

Box = Mapping[str, tuple[float, float]]
Exact = Mapping[str, Any]
Known = Mapping[tuple[str, float], Any]


def bounded(problem: Posed) -> bool:
    """Whether the bound speaks of the problem: it asks for the least abscissa."""
    return problem.sense == "minimize" and (problem.minimize or "").strip() == "abscissa"


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
    if len(problem.free) > _CORNERS or not is_rational(problem.model, problem.model.sets[0]):
        return _enclosed_product(problem)
    model, (box, known) = problem.model, _algebraic_box(problem)
    inside = [_point_of(box, part) for part in (Fraction(1, 2), Fraction(2, 3))]
    constant = [n for n, (lo, hi) in box.items() if lo == hi or _plays_no_role(model, n, inside)]
    varying = [n for n in box if n not in constant]
    curved = [n for n in varying if not _has_degree(model, n, inside, 1)]
    if len(curved) > 1 or not all(_has_degree(model, n, inside, _DEGREE) for n in curved):
        return _enclosed_product(problem)
    ends = [box[n] if n in varying and n not in curved else ((box[n][0] + box[n][1]) / 2,) for n in box]
    corners = dict(zip(box, np.array(list(itertools.product(*ends))).T, strict=True))
    quotients, signs = _along(model, corners, curved[0], box, known) if curved else _at(model, corners, known)
    if len(signs) != 1:
        return math.inf
    return float(quotients.max())


def _enclosed_product(problem: Posed) -> float:
    """An upper end of |aₙ/a0| over the box, by balls; inf where they contain a0 = 0."""
    of = problem.parameter_set
    with flint.ctx.workprec(_BITS):
        ends = {n: (exact(lo), exact(hi)) for n, (lo, hi) in problem.free.items()}
        box = {n: as_ball(lo).union(as_ball(hi)) for n, (lo, hi) in ends.items()}
        a = problem.model.coefficients(problem.ordered({n: exact(v) for n, v in problem.fixed.items()} | box), of)
        upper = as_ball(abs(quotient(as_ball(a[-1]), as_ball(a[0])))).upper()
        return float(upper) if upper.is_finite() else math.inf


def _at(model: Model, points: Mapping[str, Array], known: Known) -> tuple[Array, set[bool]]:
    """|aₙ/a0| at points, and the signs of a0. Where both vanish the quotient is constant along the edges that end.

    The largest are upper ends of balls: a small a0 is a difference, of which doubles lose as many digits as cancel.
    """
    a = model.polynomial(**points)
    last, first, *_ = np.broadcast_arrays(*map(np.asarray, (a[-1], a[0], *points.values())))
    both = (last == 0) & (first == 0)
    if np.any((first == 0) & ~both) or np.all(both):
        return np.array([math.inf]), set()
    with np.errstate(over="ignore"):
        quotients = np.where(both, 0.0, np.abs(last / np.where(both, 1.0, first)))
    with flint.ctx.workprec(_BITS):
        for k in np.flatnonzero(quotients >= quotients.max() / 2):
            at = {n: float(np.broadcast_to(column, last.shape)[k]) for n, column in points.items()}
            a = model.polynomial(**{n: known.get((n, v), exact(v)) for n, v in at.items()})
            upper = as_ball(abs(quotient(a[-1], a[0]))).upper()
            quotients[k] = float(upper) if upper.is_finite() else math.inf
    return quotients[~both], set((first[~both] > 0).tolist())


def _along(model: Model, corners: Mapping[str, Array], name: str, box: Box, known: Known) -> tuple[Array, set[bool]]:
    """The same at the ends and stationary points of the one curved parameter; no sign at all if it has a pole."""
    lower, upper = box[name]
    y = (lower + upper) / 2 + (upper - lower) / 2 * _NODES
    grid: dict[str, Any] = {n: column[:, None] for n, column in corners.items()} | {name: y[None, :]}
    a = model.polynomial(**grid)
    shape = (len(corners[name]), len(y))
    tops, bottoms = (np.broadcast_to(c, shape) @ _FIT.T for c in (a[-1], a[0]))
    points: list[dict[str, float]] = []
    for k, (top, bottom) in enumerate(zip(tops, bottoms, strict=True)):
        if _inside(bottom).size:
            return np.array([math.inf]), set()
        turning = np.convolve(np.polyder(top), bottom) - np.convolve(top, np.polyder(bottom))
        at = {n: float(column[k]) for n, column in corners.items()}
        for u in (-1.0, 1.0, *_inside(turning)):
            points.append({**at, name: (lower + upper) / 2 + (upper - lower) / 2 * float(u)})
    return _at(model, {n: np.array([p[n] for p in points]) for n in corners}, known)


def _inside(polynomial: Array) -> Array:
    """Real roots in [-1, 1] of a fitted polynomial, with a margin for rounding."""
    size = np.abs(polynomial)
    if size[-1] > 1.001 * size[:-1].sum():  # the constant term outweighs the others
        return np.empty(0)
    clean = np.where(size > 1e-13 * size.max(), polynomial, 0.0)
    found = np.roots(clean)
    close = (np.abs(found.imag) < 1e-6) & (np.abs(found.real) <= 1 + 1e-6)
    return np.asarray(np.clip(found.real[close], -1.0, 1.0))


def _algebraic_box(problem: Posed) -> tuple[dict[str, tuple[float, float]], Known]:
    """Range of each algebraic parameter as doubles, and the balls that their ends are rounded from.

    They are monotone in every parameter of a set, so corners suffice; √(1 + T²) is on either side of an upright axis.
    """
    of = problem.parameter_set
    ends = {p.name: problem.free.get(p.name) or (problem.fixed[p.name],) for p in of.parameters}
    ends |= {p.name: (*e, 0.0) for p in of.parameters if p.tangent and min(e := ends[p.name]) < 0 < max(e)}
    corners = np.array(list(itertools.product(*(ends[n] for n in of.names))))
    values = problem.model.algebraic(of.native(dict(zip(of.names, corners.T, strict=True))))
    box, known, balls = {}, {}, dict[int, dict[str, Any]]()
    for n, given in values.items():
        column = np.broadcast_to(np.asarray(given, dtype=float), len(corners))
        for k in (extremes := [int(column.argmin()), int(column.argmax())]):
            if k not in balls:
                with flint.ctx.workprec(_BITS):
                    design = {m: exact(float(v)) for m, v in zip(of.names, corners[k], strict=True)}
                    balls[k] = problem.model.algebraic(of.native(design))
            known[n, float(column[k])] = balls[k][n]
        box[n] = (float(column[extremes[0]]), float(column[extremes[1]]))
    return box, known


def _plays_no_role(model: Model, name: str, inside: Sequence[Exact]) -> bool:
    """Whether aₙ/a0 is free of a parameter: exact arithmetic at points where a difference would show.

    A quotient that does not exist is a ball nan, which equals nothing.
    """
    each = (_exact(model, name, others, [Fraction(3, 7), Fraction(11, 5)]) for others in inside)
    return all(last * other == another * first for (last, first), (another, other) in each)


def _has_degree(model: Model, name: str, inside: Sequence[Exact], degree: int) -> bool:
    """Whether aₙ and a0 are of a degree in a parameter at most, by exact differences where a higher one would show."""
    for others in inside:
        at = _exact(model, name, others, [Fraction(1, 3) + k for k in range(degree + 3)])
        for row in zip(*at, strict=True):
            differences = list(row)
            for _ in range(degree + 1):
                differences = [b - a for a, b in itertools.pairwise(differences)]
            if not all(difference == 0 for difference in differences):
                return False
    return True


def _point_of(box: Box, part: Fraction) -> Exact:
    """Exact values somewhere in a box."""
    return {
        n: exact(lo) if lo == hi else exact(lo + (hi - lo) * float(part * Fraction(k, 13)))
        for k, (n, (lo, hi)) in enumerate(box.items(), start=3)
    }


def _exact(model: Model, name: str, others: Exact, at: Sequence[Fraction]) -> list[tuple[Any, Any]]:
    """aₙ and a0 for exact values of one parameter, the others fixed."""
    rows = [model.polynomial(**{**others, name: exact(x)}) for x in at]
    return [(a[-1], a[0]) for a in rows]


@lru_cache(maxsize=64)
def relation_bound(problem: Posed) -> float:
    """The greatest of the bounds on the abscissa by relations of the coefficients; −inf without any.

    Constraints and the ranges of the free parameters play no role. Relations are looked for only among coefficients
    that are rational functions of the free parameters (tangents of angles) with fractions for coefficients, and
    without rounding: they hold at designs drawn at random, more of them than they are determined by.
    """
    rows = _exact_rows(problem) if is_rational(problem.model, problem.parameter_set) else None
    with flint.ctx.workprec(_BITS):
        return max(map(_bound_of, relations(rows) if rows else []), default=-math.inf)


@lru_cache(maxsize=64)
def is_rational(model: Model, of: ParameterSet) -> bool:
    """Whether the coefficients are rational functions of the parameters of a set, or of the tangents of angles."""
    tangents = {p.name for p in of.parameters if p.tangent}
    coefficients = trace(
        lambda x: model.coefficients({n: made("atan", s) if n in tangents else s for n, s in x.items()}, of), of.names
    )
    wholes = {k for k, s in enumerate(coefficients.steps) if isinstance(s.value, Fraction) and s.value.denominator == 1}
    powers = [s for s in coefficients.steps if s.op == "pow" and s.operands[1] in wholes]
    rational = [s for s in coefficients.steps if s.op in _RATIONAL and not isinstance(s.value, Formula)]
    return len(powers) + len(rational) == len(coefficients.steps)


def relations(rows: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """Independent b with Σ b_k a_k = 0 for every row a of fractions.

    Each is reduced: from the leading coefficient on, and from the last one.
    """
    forward = _null_space(rows)
    backward = [relation[::-1] for relation in _null_space([row[::-1] for row in rows])]
    return forward + [b for b in backward if b not in forward]


def _null_space(rows: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """Reduced basis of the vectors that every row is orthogonal to."""
    width = len(rows[0])
    reduced, rank = flint.fmpq_mat([list(row) for row in rows]).rref()
    pivots = [next(j for j in range(width) if reduced[i, j] != 0) for i in range(rank)]
    basis = []
    for free in (j for j in range(width) if j not in pivots):
        vector = [flint.fmpq(int(j == free)) for j in range(width)]
        for i, pivot in enumerate(pivots):
            vector[pivot] = -reduced[i, free]
        basis.append(vector)
    return basis


def _bound_of(relation: Sequence[Any]) -> float:
    """−z, with z the largest real zero of h or a derivative; −inf for a relation of a0 alone, which is 0 then."""
    n = len(relation) - 1
    h = flint.fmpq_poly([b * math.comb(n, k) for k, b in enumerate(relation)])
    if h.degree() < 1:
        return -math.inf
    zeros = []
    while h.degree() > 0:
        integral: Any = flint.fmpz_poly([int(c) for c in (h * h.denom()).coeffs()])
        zeros += [float(z.real.upper()) for z, _ in integral.complex_roots() if z.imag == 0]
        h = h.derivative()
    return math.nextafter(-max(zeros), -math.inf) if max(zeros) else 0.0


def _exact_rows(problem: Posed) -> list[list[Any]] | None:
    """Coefficients at random designs of the box; None where one is no fraction."""
    of, rng = problem.parameter_set, np.random.default_rng(0)
    fixed = {n: exact(v) for n, v in problem.fixed.items()}
    if any(of[n].tangent and v != 0 for n, v in problem.fixed.items()):
        return None
    rows = []
    for _ in range(problem.model.degree + 1 + _MORE):
        drawn: dict[str, Any] = {n: Tilt(flint.fmpq(0)) if of[n].tangent else v for n, v in fixed.items()}
        for n, ends in problem.free.items():
            lower, upper = (exact(math.tan(e)) if of[n].tangent else exact(e) for e in ends)
            at = lower + (upper - lower) * flint.fmpq(int(rng.integers(_FINENESS)), _FINENESS)
            drawn[n] = Tilt(at) if of[n].tangent else at
        row = problem.model.coefficients({n: drawn[n] for n in of.names}, of)
        if not all(isinstance(c, int | flint.fmpq) for c in row):
            return None
        rows.append([flint.fmpq(c) if isinstance(c, int) else c for c in row])
    return rows
