"""A pattern as equations in the parameters and few unknowns, all of these bounded: designs at infinity are none.

Only the roots that the pattern ties are unknown; the others drop out where p is divided by their factors. Roots s of
at most a unit of size are unknown as themselves, larger ones as 1/s in the reversed polynomial: every unknown has a
range, whatever the leading coefficient does, and no equation has a quotient.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise, product
from typing import Any

import numpy as np

from tmsopt.algebra.formula import Formula, formula, symbol
from tmsopt.algebra.intervals import ranges, round_outwards
from tmsopt.algebra.kinds import atan, quotient
from tmsopt.models import Quantity, Values
from tmsopt.models.expression import Expression
from tmsopt.models.stated.pairs import Pair
from tmsopt.problem.problem import Posed
from tmsopt.program.nlp import Scale
from tmsopt.roots import product as multiplied
from tmsopt.roots.patterns.components import Component, parse_components
from tmsopt.roots.polynomial import characteristic_polynomial

Ends = tuple[float, float]

_ROUNDED = 1e-9  # relative: more than the roundings of a few sums
_AWAY = Fraction(3, 4)  # factors of one kind are told apart by b + 3c/4, which is rarely the same of two


@dataclass(frozen=True)
class Piece:
    """A factor of a pattern, to a power.

    Attributes:
        kind: ``root``, ``pair``, ``meeting`` (two real roots), ``axis`` or ``zero``; of a complex H ``point``, or
            ``line`` for one on the imaginary axis.
        order: the power.
        outer: whether the unknowns are those of 1/s.
        first: number of its first unknown.
    """

    kind: str
    order: int
    outer: bool
    first: int

    @property
    def ranges(self) -> tuple[Ends, ...]:
        """Of each unknown, where no root is larger than 1."""
        return {
            "root": ((-1.0, 1.0),),
            "pair": ((-2.0, 2.0), (0.0, 1.0)),
            "meeting": ((-2.0, 2.0), (-1.0, 1.0)),
            "axis": ((0.0, 1.0),),
            "zero": (),
            "point": ((-1.0, 1.0), (-1.0, 1.0)),
            "line": ((-1.0, 1.0),),
        }[self.kind]

    def own(self, unknowns: Sequence[Any]) -> Sequence[Any]:
        """Its unknowns among all."""
        return unknowns[self.first : self.first + len(self.ranges)]

    def factor(self, unknowns: Sequence[Any]) -> list[Any]:
        """Monic, in s or in 1/s."""
        u = self.own(unknowns)
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

    def place(self, unknowns: Sequence[Any]) -> Any:
        """What ascends among factors that may change places."""
        u = self.own(unknowns)
        return u[0] if len(u) == 1 else u[0] + _AWAY * u[1]

    def nonnegative(self, unknowns: Sequence[Any]) -> list[Any]:
        """What must be ≥ 0 beside the ranges."""
        u = self.own(unknowns)
        if self.kind == "pair":
            return [4 * u[1] - u[0] * u[0]]
        if self.kind == "meeting":
            return [u[0] * u[0] - 4 * u[1], 1 + u[0] + u[1], 1 - u[0] + u[1]]
        return []


def sheets(name: str, of_h: bool) -> Iterator[tuple[Piece, ...]]:
    """The ways in which the roots of a pattern may be small or large.

    Args:
        of_h: whether the unknowns are eigenvalues of a complex H, the pattern named as that of its double: all small.
    """
    for choice in product(*(list(_ways(part, of_h)) for part in parse_components(name))):
        pieces: list[Piece] = []
        for kind, order, outer in (piece for way in choice for piece in way):
            pieces.append(Piece(kind, order, outer, sum(len(p.ranges) for p in pieces)))
        yield tuple(pieces)


def _ways(part: Component, of_h: bool) -> Iterator[list[tuple[str, int, bool]]]:
    """Kind, power and place of the factors of a part."""
    if of_h:
        yield [("point", part.order, False) if part.kind == "CEP" else ("line", part.roots // 2, False)] * part.count
    elif part.kind == "capsize":
        yield [("zero", 1, False)]
    elif part.kind in ("weave", "resonance"):
        yield from ([("axis", part.order + (part.kind == "resonance"), outer)] for outer in (False, True))
    elif part.kind == "EP" and part.count == 2:
        yield [("meeting", part.order, False)]
        yield [("meeting", part.order, True)]
        yield [("root", part.order, False), ("root", part.order, True)]
    else:
        kind = "root" if part.kind == "EP" else "pair"
        for inner in range(part.count + 1):
            yield [(kind, part.order, k >= inner) for k in range(part.count)]


@dataclass(frozen=True)
class RotatingFrame:
    """Where eigenfrequencies of a complex H are unknown: as (ω − centre)/unit, which none has larger than 1."""

    centre: Fraction
    unit: Fraction


def rotating_frame(problem: Posed) -> RotatingFrame | None:
    """The frame of a complex H, by Gershgorin's discs over the box; None where these have no bound, or without H.

    Raises:
        UnsupportedOperation: for an operation that has no interval arithmetic.
    """
    if problem.model.double is None:
        return None
    names = tuple(problem.free)
    rows = _complex_matrix(problem, {**problem.as_nodes(problem.fixed), **{n: symbol(n) for n in names}})
    asked = formula((part for row in rows for x in row for part in (x.re, x.im)), names)
    found = np.array(ranges(asked, [round_outwards(*ends) for ends in problem.free.values()]))
    if not np.isfinite(found).all():
        return None
    n = len(rows)
    own = found.reshape(n, n, 2, 2)
    centre = float(-own[range(n), range(n), 1].mean())
    own[range(n), range(n), 1] += centre
    reach = np.hypot(*np.moveaxis(np.abs(own).max(axis=3), 2, 0)).sum(axis=1).max() + _ROUNDED * abs(centre)
    return RotatingFrame(Fraction(centre), Fraction(reach * (1 + _ROUNDED) or 1.0))


def _complex_matrix(problem: Posed, own: Mapping[str, Any]) -> list[list[Pair]]:
    """−i H of a model of a complex H."""
    assert problem.model.double is not None
    _, rows = problem.model.double(problem.parameter_set.native(own))  # [[−J, −R], [R, −J]] of H = R + i J
    n = len(rows) // 2
    return [[Pair(-row[j], row[n + j]) for j in range(n)] for row in rows[:n]]


def _complex_coefficients(problem: Posed, own: Mapping[str, Any], frame: RotatingFrame) -> list[Any]:
    """The polynomial of −i H in a frame."""
    rows = _complex_matrix(problem, own)
    moved = [[x + Pair(0, frame.centre) if i == j else x for j, x in enumerate(row)] for i, row in enumerate(rows)]
    return [c / frame.unit**k if k else c for k, c in enumerate(characteristic_polynomial(moved))]


def values_at(problem: Posed, lifted: Sequence[Quantity], at: Mapping[str, Any], held: Mapping[str, Any]) -> Values:
    """Everything that follows from numbers by name, angles by their tangents; `held` are parameters themselves."""
    of, known = problem.parameter_set, {q.name for q in lifted}
    own = {n: held[n] if n in held else atan(at[n]) if of[n].tangent else at[n] for n in of.names}
    return Values(problem.model, of, own, lift=lambda q, v: at[q.name] if q.name in known else None)


def others(
    values: Values, lifted: Sequence[Quantity], equalities: Sequence[Expression], at: Mapping[str, Any]
) -> list[Any]:
    """Left sides of the equations beside those of a pattern: of quantities that are unknowns, and == constraints."""
    left = [values.fold(q.left_side, {q.name: at[q.name]})[0] for q in lifted if q.equation]
    return left + [e(values) for e in equalities]


@dataclass(frozen=True)
class Sheet:
    """The equations of a pattern where some of its roots are small and the others large.

    A parameter goes by its name, an angle by its tangent; a quantity with an equation of its own by its name; the
    unknowns of the pattern by ``:0``, ``:1`` and so on.

    Attributes:
        names: all that is unknown.
        lifted: quantities among them.
        equations: left sides, as many as unknowns.
        shared: what must be 0 beside them where roots of size 1 count as small and as large.
        nonnegative: what must be ≥ 0 for the unknowns to be those of the pattern.
        ascending: what is ≥ 0 for one of the ways to call the factors of a design by number.
        leading: the leading coefficient.
        limits: of each constraint that is no equality, left minus right.
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


def sheet(
    problem: Posed, pieces: tuple[Piece, ...], scale: Scale | RotatingFrame, lifted: tuple[Quantity, ...]
) -> Sheet:
    """The sheet of some factors.

    Args:
        scale: of the roots and the coefficients; a frame for the polynomial of a complex H itself.
        lifted: quantities in == constraints that are unknowns with an equation.
    """
    unknowns = tuple(f":{k}" for k in range(sum(len(p.ranges) for p in pieces)))
    names = (*problem.free, *(q.name for q in lifted), *unknowns)
    at = {n: symbol(n) for n in names}
    u = [at[n] for n in unknowns]
    values = values_at(problem, lifted, at, problem.as_nodes(problem.fixed))
    if (abscissa := _abscissa(problem, pieces, scale, u)) is not None:
        values = values.with_known({"abscissa": abscissa})
    if isinstance(scale, RotatingFrame):
        a = _complex_coefficients(problem, values.given[2], scale)
    else:
        lead, unit = Fraction(scale.lead), Fraction(scale.unit)
        a = [c / (lead * unit**k) for k, c in enumerate(values.coefficients)]
    equalities = [c for c in problem.conditions.values() if c.equality]
    own = [x for piece in pieces for x in piece.nonnegative(u)]
    alike = [(p, q) for p, q in pairwise(pieces) if (p.kind, p.order, p.outer) == (q.kind, q.order, q.outer)]
    told = {n: c for n, c in problem.conditions.items() if not c.equality and all(name in values for name in c.names)}
    left = conditions(a, pieces, u)
    real = [part for x in left for part in ((x.re, x.im) if isinstance(x, Pair) else (x,))]
    return Sheet(
        problem,
        pieces,
        names,
        lifted,
        equations=formula([*real, *others(values, lifted, equalities, at)], names),
        shared=formula(shared(a, pieces, u), names),
        nonnegative=formula(own, names),
        ascending=formula((q.place(u) - p.place(u) for p, q in alike), names),
        leading=formula([values.coefficients[0]], names),
        limits={n: formula([c(values)], names) for n, c in told.items()},
    )


def _abscissa(problem: Posed, pieces: Sequence[Piece], scale: Scale | RotatingFrame, u: Sequence[Any]) -> Any:
    """Largest real part where the pattern makes up all roots; None elsewhere."""
    if problem.pattern is None or problem.pattern.abscissa is None:
        return None
    (piece,) = pieces
    unit, own = Fraction(scale.unit), piece.own(u)
    if piece.kind in ("root", "point"):
        return quotient(unit, own[0]) if piece.outer else unit * own[0]
    return quotient(-unit * own[0], 2 * own[1]) if piece.outer else -unit * own[0] / 2


def conditions(a: Sequence[Any], pieces: Sequence[Piece], unknowns: Sequence[Any]) -> list[Any]:
    """Expressions that are all 0 where the factors divide a polynomial, each as often as its power says.

    Where they make up all of it, its coefficients less those of the product, in fewer terms; else the remainders, of
    small and of large roots apart. See `shared`.
    """
    left: list[Any] = []
    for outer in (False, True):
        rest = a[::-1] if outer else a
        factors = [p.factor(unknowns) for p in pieces if p.outer == outer for _ in range(p.order)]
        whole = multiplied(*factors)
        if len(whole) == len(a):
            return left + [c - rest[0] * f for c, f in zip(rest[1:], whole[1:], strict=True)]
        for factor in factors:
            rest, remainder = divided(rest, factor)
            left += remainder
    return left


def shared(a: Sequence[Any], pieces: Sequence[Piece], unknowns: Sequence[Any]) -> list[Any]:
    """What `conditions` leaves out: that a small and a large root are two, though both are of size 1.

    Remainders of what the factors of small roots leave, divided by those of large ones; none where all are of a kind.
    """
    inner, outer = ([p.factor(unknowns) for p in pieces if p.outer == o for _ in range(p.order)] for o in (False, True))
    left: list[Any] = []
    if inner and outer:
        for factor in inner:
            a, _ = divided(a, factor)
        a = a[::-1]
        for factor in outer:
            a, remainder = divided(a, factor)
            left += remainder
    return left


def divided(a: Sequence[Any], monic: Sequence[Any]) -> tuple[list[Any], list[Any]]:
    """Quotient and remainder of polynomials, descending."""
    rest = list(a)
    count = len(a) - len(monic) + 1
    for k in range(count):
        for j, f in enumerate(monic[1:], start=1):
            if not (isinstance(f, int) and f == 0):
                rest[k + j] = rest[k + j] - rest[k] * f
    return rest[:count], rest[count:]
