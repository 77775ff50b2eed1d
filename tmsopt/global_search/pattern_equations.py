"""The equations of a pattern in the parameters and a few bounded unknowns, so that no solution lies at infinity.

Only the roots that the pattern ties together are unknowns; division of p by their factors eliminates the others. A root
s with |s| ≤ 1 unit is an unknown itself; for a larger root, 1/s is an unknown, as a root of the reversed polynomial. So
each unknown has a finite range, whatever the leading coefficient, and no equation has a quotient.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise, product
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Formula, formula, symbol
from tmsopt.algebra.intervals import ranges, round_outwards
from tmsopt.algebra.kinds import atan, quotient_or_nan
from tmsopt.models import Quantity, Values
from tmsopt.models.expression import Expression
from tmsopt.models.stated.pairs import Pair, pair
from tmsopt.problem.problem import Posed
from tmsopt.program.nlp import Scale
from tmsopt.roots import product as polynomial_product
from tmsopt.roots.patterns.components import Component, parse_components
from tmsopt.roots.polynomial import characteristic_polynomial

Ends = tuple[float, float]

_ROUNDING = 1e-9  # relative: more than the roundings of a few sums
_ORDER_WEIGHT = Fraction(3, 4)  # factors of one kind are ordered by b + 3c/4, which two factors rarely share


@dataclass(frozen=True)
class Piece:
    """A power of one factor of a pattern.

    Attributes:
        kind: ``root``, ``pair``, ``meeting`` (two real roots), ``axis`` or ``zero``; for a complex H ``point``, or
            ``line`` for a root on the imaginary axis.
        order: the power.
        is_outer: whether its roots are large, so that the factor is a polynomial in 1/s.
        first_index: index of its first unknown among all unknowns.
    """

    kind: str
    order: int
    is_outer: bool
    first_index: int

    @property
    def ranges(self) -> tuple[Ends, ...]:
        """Range of each unknown; no root s (or 1/s) is larger than 1."""
        return {
            "root": ((-1.0, 1.0),),
            "pair": ((-2.0, 2.0), (0.0, 1.0)),
            "meeting": ((-2.0, 2.0), (-1.0, 1.0)),
            "axis": ((0.0, 1.0),),
            "zero": (),
            "point": ((-1.0, 1.0), (-1.0, 1.0)),
            "line": ((-1.0, 1.0),),
        }[self.kind]

    def own_unknowns(self, unknowns: Sequence[Any]) -> Sequence[Any]:
        """The unknowns of this piece among all unknowns."""
        return unknowns[self.first_index : self.first_index + len(self.ranges)]

    def monic(self, unknowns: Sequence[Any]) -> list[Any]:
        """Coefficients of the monic factor, in s or 1/s, descending."""
        u = self.own_unknowns(unknowns)
        match self.kind:
            case "root":
                return [1, -u[0]]
            case "axis":
                return [1, 0, u[0]]
            case "zero":
                return [1, 0]
            case "point" | "line":
                return [1, -Pair(*u) if len(u) == 2 else Pair(0, -u[0])]
        return [1, *u]

    def order_key(self, unknowns: Sequence[Any]) -> Any:
        """The number by which interchangeable factors are ordered."""
        u = self.own_unknowns(unknowns)
        return u[0] if len(u) == 1 else u[0] + _ORDER_WEIGHT * u[1]

    def nonnegative(self, unknowns: Sequence[Any]) -> list[Any]:
        """Expressions that must be ≥ 0, so that the roots are of this kind."""
        u = self.own_unknowns(unknowns)
        if self.kind == "pair":
            return [4 * u[1] - u[0] * u[0]]
        if self.kind == "meeting":
            return [u[0] * u[0] - 4 * u[1], 1 + u[0] + u[1], 1 - u[0] + u[1]]
        return []


def enumerate_pieces(name: str, is_complex: bool) -> Iterator[tuple[Piece, ...]]:
    """Yield all choices of small and large roots of a pattern.

    Args:
        is_complex: whether the roots are those of a complex H, which are all small; `name` is then the pattern of the
            real matrix of twice the size.
    """
    for choice in product(*(list(_part_pieces(part, is_complex)) for part in parse_components(name))):
        pieces: list[Piece] = []
        for kind, order, is_outer in (piece for part_pieces in choice for piece in part_pieces):
            pieces.append(Piece(kind, order, is_outer, sum(len(p.ranges) for p in pieces)))
        yield tuple(pieces)


def _part_pieces(part: Component, is_complex: bool) -> Iterator[list[tuple[str, int, bool]]]:
    """Yield each choice for one part of a pattern: (kind, order, is_outer) for each of its factors."""
    if is_complex:
        piece = ("point", part.order, False) if part.kind == "CEP" else ("line", part.root_count // 2, False)
        yield [piece] * part.count
    elif part.kind == "capsize":
        yield [("zero", 1, False)]
    elif part.kind in ("weave", "resonance"):
        yield from ([("axis", part.order + (part.kind == "resonance"), is_outer)] for is_outer in (False, True))
    elif part.kind == "EP" and part.count == 2:
        yield [("meeting", part.order, False)]
        yield [("meeting", part.order, True)]
        yield [("root", part.order, False), ("root", part.order, True)]
    else:
        kind = "root" if part.kind == "EP" else "pair"
        for inner_count in range(part.count + 1):
            yield [(kind, part.order, k >= inner_count) for k in range(part.count)]


@dataclass(frozen=True)
class RotatingFrame:
    """Maps eigenfrequencies of a complex H to (ω − centre)/unit, at most 1 in size."""

    centre: Fraction
    unit: Fraction


def find_rotating_frame(problem: Posed) -> RotatingFrame | None:
    """Find the frame of a complex H by Gershgorin discs over the box; None for a real model or unbounded discs.

    Raises:
        UnsupportedOperation: for an operation without interval arithmetic.
    """
    if not problem.model.is_complex:
        return None
    names = tuple(problem.free)
    rows = _complex_matrix(problem, {**problem.as_nodes(problem.fixed), **{n: symbol(n) for n in names}})
    entries = formula((part for row in rows for x in row for part in (x.re, x.im)), names)
    entry_ranges = np.array(ranges(entries, [round_outwards(*ends) for ends in problem.free.values()]))
    if not np.isfinite(entry_ranges).all():
        return None
    n = len(rows)
    intervals = entry_ranges.reshape(n, n, 2, 2)
    centre = float(-intervals[range(n), range(n), 1].mean())
    intervals[range(n), range(n), 1] += centre
    radius = np.hypot(*np.moveaxis(np.abs(intervals).max(axis=3), 2, 0)).sum(axis=1).max() + _ROUNDING * abs(centre)
    return RotatingFrame(Fraction(centre), Fraction(radius * (1 + _ROUNDING) or 1.0))


def _complex_matrix(problem: Posed, parameters: Mapping[str, Any]) -> list[list[Pair]]:
    """The matrix −i H of a model with a complex H."""
    assert problem.model.pencil is not None
    _, rows = problem.model.pencil(problem.parameter_set.native(parameters))
    return [[-x for x in row] for row in rows]


def _complex_coefficients(problem: Posed, parameters: Mapping[str, Any], frame: RotatingFrame) -> list[Any]:
    """Coefficients of the characteristic polynomial of −i H in a frame."""
    rows = _complex_matrix(problem, parameters)
    shifted_rows = [
        [x + Pair(0, frame.centre) if i == j else x for j, x in enumerate(row)] for i, row in enumerate(rows)
    ]
    return [c / frame.unit**k if k else c for k, c in enumerate(characteristic_polynomial(shifted_rows))]


def values_at(
    problem: Posed, lifted: Sequence[Quantity], point: Mapping[str, Any], constants: Mapping[str, Any]
) -> Values:
    """Values of a model at a point.

    Args:
        lifted: quantities that are unknowns with an equation of their own.
        point: name of a parameter or lifted quantity → value; for an angle, the value of its tangent.
        constants: parameter → value, for an angle the angle itself; they take precedence over `point`.
    """
    parameter_set, lifted_names = problem.parameter_set, {q.name for q in lifted}
    parameters = {
        n: constants[n] if n in constants else atan(point[n]) if parameter_set[n].tangent else point[n]
        for n in parameter_set.names
    }
    return Values(
        problem.model, parameter_set, parameters, lift=lambda q, v: point[q.name] if q.name in lifted_names else None
    )


def extra_equations(
    values: Values, lifted: Sequence[Quantity], equalities: Sequence[Expression], point: Mapping[str, Any]
) -> list[Any]:
    """Left sides of the equations that do not come from the pattern: for lifted quantities and == constraints."""
    left_sides = [values.fold(q.left_side, {q.name: point[q.name]})[0] for q in lifted if q.equation]
    return left_sides + [e(values) for e in equalities]


@dataclass(frozen=True)
class PatternSystem:
    """The equations of a pattern for one choice of small and large roots.

    Parameters and lifted quantities keep their names, but the number for an angle is its tangent. The unknowns of the
    pattern are ``:0``, ``:1`` and so on. A lifted quantity is an unknown with an equation of its own.

    Attributes:
        names: all unknowns.
        lifted: the quantities among them.
        equations: left sides, as many as unknowns.
        shared: left sides of more equations; without them, one root of size 1 could count as a small and a large root.
        nonnegative: expressions that must be ≥ 0, so that the unknowns fit the pattern.
        ascending: expressions that must be ≥ 0; they fix the order of interchangeable factors.
        leading: the leading coefficient.
        limits: left minus right side of each inequality.
    """

    problem: Posed
    pieces: tuple[Piece, ...]
    names: tuple[str, ...]
    lifted: tuple[Quantity, ...]
    equations: Formula
    shared: Formula
    nonnegative: Formula
    ascending: Formula
    leading: Formula
    limits: Mapping[str, Formula]


def build_system(
    problem: Posed, pieces: tuple[Piece, ...], scale: Scale | RotatingFrame, lifted: tuple[Quantity, ...]
) -> PatternSystem:
    """Build the system of equations for these factors.

    Args:
        scale: scale of roots and coefficients, or the frame of a complex H.
        lifted: quantities in == constraints that are unknowns with an equation.
    """
    unknowns = tuple(f":{k}" for k in range(sum(len(p.ranges) for p in pieces)))
    names = (*problem.free, *(q.name for q in lifted), *unknowns)
    point = {n: symbol(n) for n in names}
    pattern_unknowns = [point[n] for n in unknowns]
    values = values_at(problem, lifted, point, problem.as_nodes(problem.fixed))
    if (abscissa := _abscissa(problem, pieces, scale, pattern_unknowns)) is not None:
        values = values.with_known({"abscissa": abscissa})
    if isinstance(scale, RotatingFrame):
        *_, parameters = values.given
        a = _complex_coefficients(problem, parameters, scale)
    else:
        a0_unit, unit = Fraction(scale.a0_unit), Fraction(scale.unit)
        a = [c / (a0_unit * unit**k) for k, c in enumerate(values.coefficients)]
    equalities = [c for c in problem.conditions.values() if c.equality]
    nonnegative = [x for piece in pieces for x in piece.nonnegative(pattern_unknowns)]
    interchangeable = [
        (p, q) for p, q in pairwise(pieces) if (p.kind, p.order, p.is_outer) == (q.kind, q.order, q.is_outer)
    ]
    limits = {n: c for n, c in problem.conditions.items() if not c.equality and all(name in values for name in c.names)}
    conditions = divisibility_conditions(a, pieces, pattern_unknowns)
    real_conditions = [part for x in conditions for part in ((x.re, x.im) if isinstance(x, Pair) else (x,))]
    return PatternSystem(
        problem,
        pieces,
        names,
        lifted,
        equations=formula([*real_conditions, *extra_equations(values, lifted, equalities, point)], names),
        shared=formula(shared_conditions(a, pieces, pattern_unknowns), names),
        nonnegative=formula(nonnegative, names),
        ascending=formula(
            (q.order_key(pattern_unknowns) - p.order_key(pattern_unknowns) for p, q in interchangeable), names
        ),
        leading=formula([pair(a[0]).re], names),
        limits={n: formula([c(values)], names) for n, c in limits.items()},
    )


def _abscissa(problem: Posed, pieces: Sequence[Piece], scale: Scale | RotatingFrame, u: Sequence[Any]) -> Any:
    """The largest real part, if the pattern fixes all roots; otherwise None."""
    if problem.pattern is None or problem.pattern.abscissa is None:
        return None
    (piece,) = pieces
    unit, own_unknowns = Fraction(scale.unit), piece.own_unknowns(u)
    if piece.kind in ("root", "point"):
        return quotient_or_nan(unit, own_unknowns[0]) if piece.is_outer else unit * own_unknowns[0]
    numerator = -unit * own_unknowns[0]
    return quotient_or_nan(numerator, 2 * own_unknowns[1]) if piece.is_outer else numerator / 2


def divisibility_conditions(a: Sequence[Any], pieces: Sequence[Piece], unknowns: Sequence[Any]) -> list[Any]:
    """Expressions that vanish exactly if the powers of the factors divide a polynomial.

    If the factors make up the whole polynomial, these are its coefficients minus those of the product, which have fewer
    terms. Otherwise they are the remainders, for small and for large roots separately; see `shared_conditions`.
    """
    conditions: list[Any] = []
    for is_outer in (False, True):
        dividend = a[::-1] if is_outer else a
        factors = [p.monic(unknowns) for p in pieces if p.is_outer == is_outer for _ in range(p.order)]
        factor_product = polynomial_product(*factors)
        if len(factor_product) == len(a):
            return conditions + [c - dividend[0] * f for c, f in zip(dividend[1:], factor_product[1:], strict=True)]
        for factor in factors:
            dividend, remainder = divide(dividend, factor)
            conditions += remainder
    return conditions


def shared_conditions(a: Sequence[Any], pieces: Sequence[Piece], unknowns: Sequence[Any]) -> list[Any]:
    """The conditions that `divisibility_conditions` omits: a small and a large root of size 1 are two roots.

    The polynomial is divided by the factors of small roots, and the quotient by the factors of large roots. The
    remainders of the second division must be 0. There are none if all roots are small or all are large.
    """
    inner_factors, outer_factors = (
        [p.monic(unknowns) for p in pieces if p.is_outer == is_outer for _ in range(p.order)]
        for is_outer in (False, True)
    )
    conditions: list[Any] = []
    if inner_factors and outer_factors:
        for factor in inner_factors:
            a, _ = divide(a, factor)
        a = a[::-1]
        for factor in outer_factors:
            a, remainder = divide(a, factor)
            conditions += remainder
    return conditions


def divide(a: Sequence[Any], monic: Sequence[Any]) -> tuple[list[Any], list[Any]]:
    """Quotient and remainder by a monic polynomial, coefficients descending."""
    dividend = list(a)
    count = len(a) - len(monic) + 1
    for k in range(count):
        for j, f in enumerate(monic[1:], start=1):
            if not (isinstance(f, int) and f == 0):
                dividend[k + j] = dividend[k + j] - dividend[k] * f
    return dividend[:count], dividend[count:]
