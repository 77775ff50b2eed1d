"""The instant bound of a relation: where the coefficients satisfy Σ b_k a_k = 0, whatever the free parameters.

Where no root is right of γ, no coefficient of p(t + γ) has another sign than a0. With
h(z) = Σ b_k C(n, k) z^k, a relation weighs that of t^(n−i) by (n − i)! h⁽ⁱ⁾(−γ), so it cannot hold for a γ at which
h and all its derivatives have one sign: the abscissa is at least −z, with z the largest real zero of any of them. If z
is one of h itself, (s + z)ⁿ satisfies the relation, and the bound is reached where the parameters give that polynomial
(Blondel, Gürbüzbalaban, Megretski and Overton 2012, theorem 7). ω0 is the bound of aₙ = c a0, the mean of the roots
that of a1 = c a0.
"""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import casadi as ca
import flint

from tmsopt.design.problem import Problem
from tmsopt.design.walk import Arithmetic, NotAccepted, walk
from tmsopt.models import Model, ParameterSet
from tmsopt.roots.elementary import exact, sqrt

_BITS = 212  # zeros of h by isolation; far beyond the answer, which is a double
_TERMS = 20_000  # of a product, before they are gathered
_POWER = 24  # exponent up to which a power is taken


def relation_bound(problem: Problem) -> float:
    """The greatest of the bounds on the abscissa by relations of the coefficients; −inf without any.

    Constraints and the ranges of the free parameters play no role. A relation is an identity of polynomials, found and
    held without rounding; only numbers that are fractions are looked at, so no angle that is fixed.
    """
    coefficients = _polynomials(problem)
    if coefficients is None:
        return -math.inf
    with flint.ctx.workprec(_BITS):
        return max((_bound(relation) for relation in relations(coefficients)), default=-math.inf)


def relations(coefficients: Sequence[Mapping[Any, Any]]) -> list[list[Any]]:
    """Independent b with Σ b_k a_k = 0 for coefficients a_k given as monomial → fraction; the simplest that there are.

    Each is reduced: from the leading coefficient on, and from the last one.
    """
    monomials = sorted({m for a in coefficients for m in a})
    rows = [[a.get(m, flint.fmpq(0)) for a in coefficients] for m in monomials]
    forward = _null_space(rows)
    backward = [relation[::-1] for relation in _null_space([row[::-1] for row in rows])]
    return forward + [b for b in backward if b not in forward]


def _null_space(rows: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """Reduced basis of the vectors that every row is orthogonal to."""
    width = len(rows[0]) if rows else 0
    if not rows:
        return []
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
        zeros += [z.real.upper() for z, _ in _integral(h).complex_roots() if z.imag == 0]
        h = h.derivative()
    bound = -float(max(zeros, key=lambda z: z))
    return math.nextafter(bound, -math.inf)


def _integral(h: Any) -> Any:
    """The same polynomial times a whole number."""
    return flint.fmpz_poly([int(c) for c in (h * h.denom()).coeffs()])


def _polynomials(problem: Problem) -> list[dict[Any, Any]] | None:
    """Each coefficient as monomial of the free parameters (tangents of angles) → fraction; None where it is no polynomial."""
    of = problem.parameter_set
    context = flint.fmpq_mpoly_ctx.get(tuple(problem.free) or ("nothing",), "lex")
    free = dict(zip(problem.free, context.gens(), strict=False))
    arguments = []
    for name in of.names:
        value = free.get(name)
        if value is None:
            if of[name].tangent and problem.fixed[name] != 0:
                return None
            value = context.constant(exact(problem.fixed[name]))
        arguments.append(value)
    try:
        (row,) = walk(_function(problem.model, of), arguments, _arithmetic(context))
    except NotAccepted:
        return None
    return [dict(a.to_dict()) for a in row]


@lru_cache(maxsize=64)
def _function(model: Model, of: ParameterSet) -> ca.Function:
    """The coefficients as a function of the parameters of a set, angles by their tangent."""
    symbols = {n: ca.SX.sym(n) for n in of.names}
    own = {n: ca.atan(s) if of[n].tangent else s for n, s in symbols.items()}
    a = ca.vertcat(*map(ca.SX, model.coefficients(own, of)))
    return ca.Function("coefficients", [ca.vertcat(*symbols.values())], [ca.densify(a)])


def _arithmetic(context: Any) -> Arithmetic:
    """CasADi's operations on polynomials without rounding; of others, only those on numbers that stay fractions."""

    def number(x: float) -> Any:
        if not math.isfinite(x):
            raise NotAccepted("a number that is not finite")
        return context.constant(exact(x))

    def times(a: Any, b: Any) -> Any:
        if len(a) * len(b) > _TERMS:
            raise NotAccepted("a product of so many terms")
        return a * b

    def inverse(a: Any) -> Any:
        if not a.is_constant() or a == 0:
            raise NotAccepted("a quotient")
        return context.constant(1 / _constant(a))

    def power(a: Any, b: Any) -> Any:
        exponent = _constant(b) if b.is_constant() else None
        if exponent is None or exponent.q != 1 or not 0 <= exponent <= _POWER:
            raise NotAccepted("a power")
        return a ** int(exponent.p)

    def root(a: Any) -> Any:
        found = sqrt(_constant(a)) if a.is_constant() else None
        if not isinstance(found, flint.fmpq):
            raise NotAccepted("a square root")
        return context.constant(found)

    return {
        ca.OP_CONST: number,
        ca.OP_ADD: lambda a, b: a + b,
        ca.OP_SUB: lambda a, b: a - b,
        ca.OP_NEG: lambda a: -a,
        ca.OP_TWICE: lambda a: 2 * a,
        ca.OP_MUL: times,
        ca.OP_SQ: lambda a: times(a, a),
        ca.OP_INV: inverse,
        ca.OP_DIV: lambda a, b: a * inverse(b),
        ca.OP_POW: power,
        ca.OP_CONSTPOW: power,
        ca.OP_SQRT: root,
    }


def _constant(a: Any) -> Any:
    """The fraction that a constant polynomial is."""
    return next(iter(a.to_dict().values()), flint.fmpq(0))
