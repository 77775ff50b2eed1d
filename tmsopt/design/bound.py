"""The instant bound: no root configuration is left of ω0, the geometric mean of the roots.

The product of the roots is aₙ/a0, so the abscissa is at least −|aₙ/a0|^(1/n), whatever the other coefficients.
"""

import itertools
import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tmsopt.design.problem import Problem
from tmsopt.design.solution import Bound
from tmsopt.models import Model

PROVEN = 1e-9
"""Gap, relative to 1 + |bound|, below which a design counts as proven optimal."""

_ROUNDING = 1e-15  # of the two coefficients, their quotient and its root


def omega0_bound(problem: Problem, value: float) -> Bound:
    """Lower bound on the abscissa over the whole box, constraints ignored, and the gap of a value to it."""
    if problem.sense != "minimize" or (problem.minimize or "").strip() != "abscissa":
        return Bound()
    largest = _largest_product(problem)
    if not math.isfinite(largest):
        return Bound()
    bound = -(largest ** (1 / problem.model.degree)) * (1 + _ROUNDING)
    gap = max(value - bound, 0.0)
    return Bound(bound, gap, gap <= PROVEN * (1 + abs(bound)), "omega0")


def _largest_product(problem: Problem) -> float:
    """Greatest |aₙ/a0| over the box; inf where a0 may vanish or the maximum cannot be enclosed.

    Along a parameter in which aₙ and a0 are linear the quotient is monotone, so its extremes are at the ends. One
    further parameter may enter otherwise; along it the stationary points are polynomial roots.
    """
    model = problem.model
    box = _algebraic_box(problem)
    constant = {n for n, (lo, hi) in box.items() if lo == hi or _plays_no_role(model, n, box)}
    curved = [n for n in box if n not in constant and not _linear(model, n, box)]
    if len(curved) > 1:
        return math.inf
    middles = {n: (lo + hi) / 2 for n, (lo, hi) in box.items()}
    vertices = [n for n in box if n not in constant and n not in curved]
    largest, signs = 0.0, set()
    for corner in itertools.product(*(box[n] for n in vertices)):
        at = middles | dict(zip(vertices, corner, strict=True))
        points = _critical(model, at, curved, box)
        if points is None:
            return math.inf
        for point in points:
            a = model.polynomial(**point)
            if a[0] == 0 and a[-1] == 0:
                continue  # the quotient is constant along the edges that end here
            if a[0] == 0:
                return math.inf
            signs.add(a[0] > 0)
            largest = max(largest, abs(a[-1] / a[0]))
    return largest if len(signs) == 1 else math.inf


def _algebraic_box(problem: Problem) -> dict[str, tuple[float, float]]:
    """Range of each algebraic parameter: they are monotone in every parameter of a set, so corners suffice."""
    ends = [problem.free.get(n) or (problem.fixed[n],) for n in problem.parameter_set.names]
    corners = [
        problem.model.algebraic(problem.parameter_set.native(dict(zip(problem.parameter_set.names, c, strict=True))))
        for c in itertools.product(*ends)
    ]
    return {n: (float(min(c[n] for c in corners)), float(max(c[n] for c in corners))) for n in corners[0]}


def _plays_no_role(model: Model, name: str, box: Mapping[str, tuple[float, float]]) -> bool:
    """Whether aₙ/a0 is free of a parameter: exact arithmetic at points where a difference would show."""

    def ends(numbers: tuple[Fraction, Fraction], part: Fraction) -> tuple[Any, Any]:
        at = {
            n: Fraction(lo) if lo == hi else Fraction(lo) + (Fraction(hi) - Fraction(lo)) * part * Fraction(k, 13)
            for k, (n, (lo, hi)) in enumerate(box.items(), start=3)
        }
        first, second = (model.polynomial(**{**at, name: x}) for x in numbers)
        return first[-1] * second[0], second[-1] * first[0]

    pairs = [
        ((Fraction(3, 7), Fraction(11, 5)), Fraction(1, 2)),
        ((Fraction(-2, 3), Fraction(17, 4)), Fraction(2, 3)),
    ]
    return all(left == right for left, right in (ends(*pair) for pair in pairs))


def _linear(model: Model, name: str, box: Mapping[str, tuple[float, float]]) -> bool:
    symbols: dict[str, Any] = {n: lo if lo == hi else ca.SX.sym(n) for n, (lo, hi) in box.items()}
    a = model.polynomial(**symbols)
    return all(bool(ca.is_linear(ca.SX(c), symbols[name])) for c in (a[0], a[-1]))


def _critical(
    model: Model, at: Mapping[str, float], curved: list[str], box: Mapping[str, tuple[float, float]]
) -> list[dict[str, float]] | None:
    """The ends and stationary points of aₙ/a0 along the curved parameter, if there is one; None at a pole."""
    if not curved:
        return [dict(at)]
    name = curved[0]
    lower, upper = box[name]
    y = np.linspace(lower, upper, 9)
    rows = [model.polynomial(**{**at, name: float(v)}) for v in y]
    u = np.linspace(-1, 1, 9)  # nine points fit degree 4, more than any parameter has in a0 or aₙ
    top = np.polynomial.Polynomial.fit(u, [r[-1] for r in rows], 4).convert().trim(1e-13)
    bottom = np.polynomial.Polynomial.fit(u, [r[0] for r in rows], 4).convert().trim(1e-13)
    if _inside(bottom.roots()).size:
        return None
    stationary = _inside((top.deriv() * bottom - top * bottom.deriv()).roots())
    points = [lower, upper, *(lower + (upper - lower) * (stationary + 1) / 2)]
    return [{**at, name: float(v)} for v in points]


def _inside(found: NDArray[Any]) -> NDArray[np.float64]:
    """The real ones among roots that lie in [-1, 1], with a margin for rounding."""
    close = (np.abs(found.imag) < 1e-6) & (np.abs(found.real) <= 1 + 1e-6)
    return np.asarray(np.clip(found.real[close], -1.0, 1.0))
