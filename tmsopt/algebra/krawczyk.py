"""Existence and uniqueness of a solution of a square system, by Krawczyk's operator in balls.

With m near a solution, Y near the inverse of the Jacobian and a box X around m,

    K(X) = m − Y f(m) + (I − Y J(X)) (X − m)

in the interior of X proves that X holds exactly one solution, and that it lies in K(X).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import flint

from tmsopt.algebra.balls import lower
from tmsopt.records import Table

System = Callable[[Mapping[str, Any]], list[Any]]
"""Left sides of equations for balls or series by name."""

_STEPS = 60
_TENTHS = 80  # powers of ten down which a box is looked for
_FINER = 4  # boxes tried between a power of ten and the next


class ProofFailed(ArithmeticError):
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


def jacobian(system: System, at: Mapping[str, Any], names: Sequence[str]) -> Any:
    """Jacobian of a system with respect to some of its names: by series of first order, a column each."""
    columns = [system({**at, n: flint.arb_series([at[n], 1], prec=2)}) for n in names]
    rows = zip(*columns, strict=True)
    return flint.arb_mat([[v[1] if isinstance(v, flint.arb_series) else flint.arb(0) for v in row] for row in rows])


def refine_solution(
    system: System, start: Mapping[str, Any], names: Sequence[str], digits: int, units: Mapping[str, float] = Table()
) -> dict[str, Any]:
    """The solution near a start as exact middles, by Newton's method at the working precision.

    Args:
        units: of unknowns that are not of the size of 1.

    Raises:
        ProofFailed: where it is not found.
    """
    at = dict(start)
    small = flint.arb(10) ** -digits
    for _ in range(_STEPS):
        move = _solved(jacobian(system, at, names), flint.arb_mat([[r.mid()] for r in system(at)]))
        size = [(abs(move[k, 0]).mid() / (units.get(n, 1) + abs(at[n]))).mid() for k, n in enumerate(names)]
        for k, n in enumerate(names):
            at[n] = (at[n] - move[k, 0]).mid()
        if not all(at[n].is_finite() for n in names):
            break
        if all(s < small for s in size):
            return at
    raise ProofFailed(
        "Newton's method finds no solution beside the design: the equations are singular there, or it is none"
    )


def _solved(jacobian: Any, right: Any) -> Any:
    try:
        return jacobian.mid().solve(right).mid()
    except ZeroDivisionError:
        raise ProofFailed("the Jacobian of the equations is singular there: the solution is not isolated") from None


def enclose_solution(
    system: System, middle: Mapping[str, Any], names: Sequence[str], digits: int, units: Mapping[str, float] = Table()
) -> Enclosure:
    """The solution beside a middle that is right to `digits`, in the smallest and the largest box that prove it.

    Args:
        units: see `refine_solution`.

    Raises:
        ProofFailed: where no box does.
    """
    count = len(names)
    unit = flint.arb_mat(count, count, 1)
    inverse = _solved(jacobian(system, middle, names), unit)
    step = inverse * flint.arb_mat([[r] for r in system(middle)])

    def mapped(radii: Sequence[Any]) -> dict[str, Any] | None:
        """K(X) for the box of these radii, if it is in its interior."""
        around = [flint.arb(0, r.upper()) for r in radii]
        box = {n: middle[n] + a for n, a in zip(names, around, strict=True)}  # or wider, by rounding
        contraction = unit - inverse * jacobian(system, {**middle, **box}, names)
        moves = (contraction * flint.arb_mat([[a] for a in around]) - step).entries()
        if not all(a.contains_interior(move) for a, move in zip(around, moves, strict=True)):
            return None
        return {n: middle[n] + move for n, move in zip(names, moves, strict=True)}

    sizes = [flint.arb(units.get(n, 1)) for n in names]
    inner = mapped([flint.arb(10) ** -digits * (u + abs(middle[n])) for n, u in zip(names, sizes, strict=True)])
    if inner is None:
        raise ProofFailed(
            "the Krawczyk test fails: the Jacobian of the equations is singular at the solution, or nearly so"
        )
    shares = ((1 - flint.arb(k) / _FINER) / 10**tenth for tenth in range(_TENTHS) for k in range(_FINER))
    radius = next((r for r in map(flint.arb.mid, shares) if mapped([r * u for u in sizes])), flint.arb(0))
    off = {n: inner[n].rad() + abs(inner[n] - middle[n]).upper() for n in names}
    smallest = max(off[n] / u for n, u in zip(names, sizes, strict=True))
    if not radius > smallest:
        raise ProofFailed("the Krawczyk test fails in every box but the smallest: the solution is hardly isolated")
    return Enclosure(inner, lower(radius))
