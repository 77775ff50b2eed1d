"""The instant bound of a relation: where the coefficients satisfy Σ b_k a_k = 0, whatever the free parameters.

Where no root is right of γ, no coefficient of p(t + γ) has another sign than a0. With
h(z) = Σ b_k C(n, k) z^k, a relation weighs that of t^(n−i) by (n − i)! h⁽ⁱ⁾(−γ), so it cannot hold for a γ at which
h and all its derivatives have one sign: the abscissa is at least −z, with z the largest real zero of any of them. If z
is one of h itself, (s + z)ⁿ satisfies the relation, and the bound is reached where the parameters give that polynomial
(Blondel, Gürbüzbalaban, Megretski and Overton 2012, theorem 7). ω0 is the bound of aₙ = c a0, the mean of the roots
that of a1 = c a0.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import casadi as ca
import flint
import numpy as np

from tmsopt.arithmetic.elementary import exact
from tmsopt.arithmetic.walk import steps
from tmsopt.design.problem import Problem
from tmsopt.models import Model, ParameterSet
from tmsopt.models.exact import Tilt

_BITS = 212  # zeros of h by isolation; far beyond the answer, which is a double
_MORE = 8  # designs at which a relation is tried beyond those that determine it
_DEPENDENT = 1e-9  # singular value of the coefficients at random designs, relative, above which there is no relation
_FINENESS = 2**40  # steps of a range, one of which an exact design takes at random

_RATIONAL = {
    *(ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_TWICE, ca.OP_MUL, ca.OP_SQ),
    *(ca.OP_DIV, ca.OP_INV),
}
"""Operations that make rational functions; CasADi writes whole powers with these."""


def relation_bound(problem: Problem) -> float:
    """The greatest of the bounds on the abscissa by relations of the coefficients; −inf without any.

    Constraints and the ranges of the free parameters play no role. Relations are looked for only among coefficients
    that are rational functions of the free parameters (tangents of angles) with fractions for coefficients, and
    without rounding: they hold at designs drawn at random, more of them than they are determined by.
    """
    if not (is_rational(problem.model, problem.parameter_set) and _dependent(problem)):
        return -math.inf
    rows = _exact_rows(problem)
    if rows is None:
        return -math.inf
    with flint.ctx.workprec(_BITS):
        return max((_bound(relation) for relation in relations(rows)), default=-math.inf)


@lru_cache(maxsize=64)
def is_rational(model: Model, of: ParameterSet) -> bool:
    """Whether the coefficients are rational functions of the parameters of a set, or of the tangents of angles."""
    symbols = {n: ca.SX.sym(n) for n in of.names}
    own = {n: ca.atan(s) if of[n].tangent else s for n, s in symbols.items()}
    column = ca.vertcat(*map(ca.SX, model.coefficients(own, of)))
    function = ca.Function("coefficients", [ca.vertcat(*symbols.values())], [ca.densify(column)])
    return all(step.operation in _RATIONAL for step in steps(function))


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


def _bound(relation: Sequence[Any]) -> float:
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
    return math.nextafter(-max(zeros), -math.inf)


def _dependent(problem: Problem) -> bool:
    """Whether the coefficients at random designs look dependent, in doubles."""
    of, rng = problem.parameter_set, np.random.default_rng(0)
    count = 2 * problem.model.degree + _MORE
    drawn = {n: rng.uniform(*ends, count) for n, ends in problem.free.items()}
    a = problem.model.coefficients(problem.ordered(drawn), of)
    columns = np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in a), np.zeros(count))[:-1], axis=1)
    if not np.all(np.isfinite(columns)):
        return False
    rows = columns / np.maximum(np.abs(columns).max(axis=1, keepdims=True), 1e-300)
    sizes = np.linalg.norm(rows, axis=0)
    if np.any(sizes == 0):
        return True
    values = np.linalg.svd(rows / sizes, compute_uv=False)
    return bool(values[-1] <= _DEPENDENT * values[0])


def _exact_rows(problem: Problem) -> list[list[Any]] | None:
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
