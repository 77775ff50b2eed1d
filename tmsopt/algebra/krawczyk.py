"""Proves that a square system has exactly one solution in a box, by Krawczyk's operator in balls.

Let m be near a solution, Y near the inverse of the Jacobian, and X a box around m. If

    K(X) = m − Y f(m) + (I − Y J(X)) (X − m)

lies in the interior of X, then X contains exactly one solution, and K(X) contains it.
"""

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import flint

from tmsopt.algebra.balls import lower_bound
from tmsopt.records import Table

System = Callable[[Mapping[str, Any]], list[Any]]
"""Left-hand sides of the equations, as a function of balls or series by name."""

_MAX_STEPS = 60  # steps of Newton's method
_DECADES = 80  # the radii of the boxes that are tried go from 1 down to 10^−80
_BOXES_PER_DECADE = 4  # boxes that are tried for each power of ten


class ProofFailed(ArithmeticError):
    """A proof fails; the message gives the reason and what to do."""


@dataclass(frozen=True)
class Enclosure:
    """A proved solution.

    Attributes:
        balls: unknown → ball that contains the solution.
        uniqueness: distance, in the unit of each unknown, within which there is no other solution.
    """

    balls: Mapping[str, Any]
    uniqueness: float


def jacobian(system: System, point: Mapping[str, Any], names: Sequence[str]) -> Any:
    """Jacobian of a system, with one column for each of `names`: its own, or by power series of first order."""
    if own_jacobian := getattr(system, "jacobian", None):
        return own_jacobian(point, names)
    columns = [system({**point, n: flint.arb_series([point[n], 1], prec=2)}) for n in names]
    rows = zip(*columns, strict=True)
    return flint.arb_mat([[v[1] if isinstance(v, flint.arb_series) else flint.arb(0) for v in row] for row in rows])


def refine_solution(
    system: System, start: Mapping[str, Any], names: Sequence[str], digits: int, units: Mapping[str, float] = Table()
) -> dict[str, Any]:
    """Find the solution near a start by Newton's method at the working precision; the results are balls of radius 0.

    Args:
        digits: relative accuracy at which the iteration stops, in decimal digits.
        units: sizes of the unknowns whose size is not about 1.

    Raises:
        ProofFailed: if Newton's method does not converge.
    """
    point = dict(start)
    tolerance = flint.arb(10) ** -digits
    for _ in range(_MAX_STEPS):
        step = _solve_linear(jacobian(system, point, names), flint.arb_mat([[r.mid()] for r in system(point)]))
        sizes = [(abs(step[k, 0]).mid() / (units.get(n, 1) + abs(point[n]))).mid() for k, n in enumerate(names)]
        for k, n in enumerate(names):
            point[n] = (point[n] - step[k, 0]).mid()
        if not all(point[n].is_finite() for n in names):
            break
        if all(s < tolerance for s in sizes):
            return point
    raise ProofFailed(
        "Newton's method finds no solution near the design: the equations are singular there, or no solution is near"
    )


def _solve_linear(matrix: Any, right_side: Any) -> Any:
    try:
        return matrix.mid().solve(right_side).mid()
    except ZeroDivisionError:
        raise ProofFailed("the Jacobian of the equations is singular there: the solution is not isolated") from None


def enclose_solution(
    system: System, middle: Mapping[str, Any], names: Sequence[str], digits: int, units: Mapping[str, float] = Table()
) -> Enclosure:
    """Enclose the solution near a midpoint that is correct to `digits` digits.

    The smallest box that proves the solution gives the balls, and the largest box gives `uniqueness`.

    Args:
        units: see `refine_solution`.

    Raises:
        ProofFailed: if no box proves the solution.
    """
    identity = flint.arb_mat(len(names), len(names), 1)
    inverse = _solve_linear(jacobian(system, middle, names), identity)
    step = inverse * flint.arb_mat([[r] for r in system(middle)])

    def apply_krawczyk(radii: Sequence[Any]) -> dict[str, Any] | None:
        """K(X) for the box of these radii, if it lies in the interior of the box."""
        offsets = [flint.arb(0, r.upper()) for r in radii]
        box = {n: middle[n] + a for n, a in zip(names, offsets, strict=True)}  # rounding makes it no smaller
        try:
            contraction = identity - inverse * jacobian(system, {**middle, **box}, names)
        except ProofFailed:  # the equations have no derivatives somewhere in the box
            return None
        images = (contraction * flint.arb_mat([[a] for a in offsets]) - step).entries()
        if not all(a.contains_interior(image) for a, image in zip(offsets, images, strict=True)):
            return None
        return {n: middle[n] + image for n, image in zip(names, images, strict=True)}

    sizes = [flint.arb(units.get(n, 1)) for n in names]
    enclosure = apply_krawczyk(
        [flint.arb(10) ** -digits * (u + abs(middle[n])) for n, u in zip(names, sizes, strict=True)]
    )
    if enclosure is None:
        raise ProofFailed(
            "the Krawczyk test fails: the Jacobian of the equations is singular at the solution, or nearly so"
        )
    distances = [enclosure[n].rad() + abs(enclosure[n] - middle[n]).upper() for n in names]
    least_radius = max((distance / u).upper() for distance, u in zip(distances, sizes, strict=True))
    radii = [
        radius
        for decade in range(_DECADES)
        for k in range(_BOXES_PER_DECADE)
        if (radius := ((1 - flint.arb(k) / _BOXES_PER_DECADE) / 10**decade).mid()) > least_radius
    ]
    # the test holds in all boxes up to a size, so halving finds the largest one; the proof does not rest on that
    largest = bisect_left(radii, True, key=lambda r: apply_krawczyk([r * u for u in sizes]) is not None)
    if largest == len(radii):
        raise ProofFailed("the Krawczyk test fails in every box except the smallest: the solution is hardly isolated")
    return Enclosure(enclosure, lower_bound(radii[largest]))
