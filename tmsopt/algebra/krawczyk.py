"""Existence and uniqueness of a solution of a square system, by Krawczyk's operator in balls.

With m near a solution, Y near the inverse of the Jacobian and a box X around m,

    K(X) = m − Y f(m) + (I − Y J(X)) (X − m)

in the interior of X proves that X holds exactly one solution, and that it lies in K(X).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import flint

from tmsopt.algebra.balls import lower

System = Callable[[Mapping[str, Any]], list[Any]]
"""Left sides of equations for balls or series by name."""

_NO_UNITS: Mapping[str, float] = MappingProxyType({})
_STEPS = 60
_WIDEST = 1.0
_TENTHS = 80  # powers of ten down which a box is looked for
_FINER = 4  # boxes tried between a power of ten and the next


class Refused(ArithmeticError):
    """A proof that does not succeed, with the reason and what to do."""


@dataclass(frozen=True)
class Enclosure:
    """A solution that is proved.

    Attributes:
        balls: unknown → ball that holds the solution.
        uniqueness: it is the only one this near, in every unknown, each in its unit.
    """

    balls: Mapping[str, Any]
    uniqueness: float


def slopes(system: System, at: Mapping[str, Any], names: Sequence[str]) -> Any:
    """Jacobian of a system with respect to some of its names: by series of first order, a column each."""
    columns = [[_slope(v) for v in system({**at, n: flint.arb_series([at[n], 1], prec=2)})] for n in names]
    return flint.arb_mat([list(row) for row in zip(*columns, strict=True)])


def refined(
    system: System, start: Mapping[str, Any], names: Sequence[str], digits: int, units: Mapping[str, float] = _NO_UNITS
) -> dict[str, Any]:
    """The solution near a start as exact middles, by Newton's method at the working precision.

    Args:
        units: of unknowns that are not of the size of 1.

    Raises:
        Refused: where it is not found.
    """
    at = dict(start)
    small = flint.arb(10) ** -digits
    for _ in range(_STEPS):
        move = _solved(slopes(system, at, names), system(at))
        size = [(abs(move[k, 0]).mid() / (units.get(n, 1) + abs(at[n]))).mid() for k, n in enumerate(names)]
        for k, n in enumerate(names):
            at[n] = (at[n] - move[k, 0]).mid()
        if not all(at[n].is_finite() for n in names):
            break
        if all(s < small for s in size):
            return at
    raise Refused(
        "Newton's method finds no solution beside the design: the equations are singular there, or it is none"
    )


def _solved(jacobian: Any, residual: Sequence[Any]) -> Any:
    try:
        return jacobian.mid().solve(flint.arb_mat([[r.mid()] for r in residual])).mid()
    except ZeroDivisionError:
        raise Refused("the Jacobian of the equations is singular there: the solution is not isolated") from None


def enclosed(
    system: System, middle: Mapping[str, Any], names: Sequence[str], digits: int, units: Mapping[str, float] = _NO_UNITS
) -> Enclosure:
    """The solution beside a middle that is right to `digits`, in the smallest and the largest box that prove it.

    Args:
        units: see `refined`.

    Raises:
        Refused: where no box does.
    """
    try:
        inverse = slopes(system, middle, names).mid().inv().mid()
    except ZeroDivisionError:
        raise Refused("the Jacobian of the equations is singular there: the solution is not isolated") from None
    step = inverse * flint.arb_mat([[r] for r in system(middle)])
    test = _Test(system, middle, names, inverse, [step[k, 0] for k in range(len(names))])
    sizes = [flint.arb(units.get(n, 1)) for n in names]
    inner = test([flint.arb(10) ** -digits * (u + abs(middle[n])) for n, u in zip(names, sizes, strict=True)])
    if inner is None:
        raise Refused(
            "the Krawczyk test fails: the Jacobian of the equations is singular at the solution, or nearly so"
        )
    radius = flint.arb(0)
    for tenth in range(_TENTHS):
        if found := next((r for r in _radii(tenth) if test([r * u for u in sizes])), None):
            radius = found
            break
    off = {n: inner[n].rad() + abs(inner[n] - middle[n]).upper() for n in names}
    smallest = max(off[n] / u for n, u in zip(names, sizes, strict=True))
    if not radius > smallest:
        raise Refused("the Krawczyk test fails in every box but the smallest: the solution is hardly isolated")
    return Enclosure(inner, lower(radius))


def _radii(tenth: int) -> list[Any]:
    top = flint.arb(10) ** -tenth * _WIDEST
    return [(top * (1 - flint.arb(k) / _FINER)).mid() for k in range(_FINER)]


@dataclass(frozen=True)
class _Test:
    """Krawczyk's operator around one middle."""

    system: System
    middle: Mapping[str, Any]
    names: Sequence[str]
    inverse: Any
    step: Sequence[Any]

    def __call__(self, radii: Sequence[Any]) -> dict[str, Any] | None:
        """K(X) for the box of these radii, if it is in its interior."""
        count = len(self.names)
        around = [flint.arb(0, r.upper()) for r in radii]
        box = {n: self.middle[n] + a for n, a in zip(self.names, around, strict=True)}  # or wider, by rounding
        contraction = flint.arb_mat(count, count, [int(i == j) for i in range(count) for j in range(count)])
        contraction = contraction - self.inverse * slopes(self.system, {**self.middle, **box}, self.names)
        spread = contraction * flint.arb_mat([[a] for a in around])
        moves = [spread[k, 0] - self.step[k] for k in range(count)]
        if not all(a.contains_interior(move) for a, move in zip(around, moves, strict=True)):
            return None
        return {n: self.middle[n] + move for n, move in zip(self.names, moves, strict=True)}


def _slope(value: Any) -> Any:
    return value[1] if isinstance(value, flint.arb_series) else flint.arb(0)
