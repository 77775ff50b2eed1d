"""How a multiple root splits when a parameter changes: laws by Newton's polygon, each confirmed by the roots."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from tmsopt.analysis.meeting import Meeting, middle, order
from tmsopt.analysis.puiseux import Branches, branches

DEVIATION = 0.1
"""Share by which a root may be off the leading term while the law is said to hold."""

_DECADES = range(-16, 1)  # of the changes at which a law is tried
_WITHIN = (0.75, 0.5, 0.25)  # and, before the first decade at which it fails
_SCALES = 2  # decades over which a law must hold, on both sides, to count
_SLOWER = 1e-13  # of the coefficients, in the unit of a law: roots by so little are at 0 there
_STILL = (1e-2, 1e-4)  # changes at which roots that do not move are counted
_SMALL = (1e-11, 1e-8, 1e-5)  # of what moves least, or of the size of roots: what is nearer does not move
_BESIDE = (1e-3, 3e-2)  # likewise where others move
_CLEAR = 2  # times that distance: shifts that are told from it
_SCATTER = 8  # times the distance that roots keep from one another where they are met to rounding only


@dataclass(frozen=True)
class Law:
    """Roots that leave the multiple root alike when a parameter changes.

    Attributes:
        branches: tᵠ = C εᵖ for the shift t of each, to leading order.
        below, above: |ε| up to which every sampled shift is within `DEVIATION` of it, for ε < 0 and ε > 0; sampled at
            each decade from 1e-16 to 1, and four times in the last one that is reached.
        least: |ε| from which it does; 0 if at every decade. Where a root is met to rounding only, shifts below the
            distance of the roots that nearly meet are not looked at.
    """

    branches: Branches
    below: float
    above: float
    least: float


@dataclass(frozen=True)
class Response:
    """How a multiple root answers to one parameter.

    Attributes:
        relative: whether ε is relative to the parameter's value; of one that is 0, but for rounding, it is absolute.
        laws: fastest first; those alone that the roots confirm at two changes, one 100 times the other.
        unmoved: roots that stay, to the orders looked at.
        unresolved: roots of which neither was confirmed.
    """

    parameter: str
    relative: bool
    laws: tuple[Law, ...]
    unmoved: int
    unresolved: int = 0


def response(at: Meeting, name: str) -> Response:
    """How a multiple root answers to a parameter, at the precision of `many_digits`."""
    k, relative = at.multiplicity, at.relative(name)
    terms = _terms(at, name)
    if terms is None:
        return Response(name, relative, (), 0, k)
    found, unmoved = branches(terms)
    laws = [law for branch in found if (law := _confirmed(at, name, branch))]
    if unmoved and not _stays(at, name, found, unmoved):
        unmoved = 0
    left = k - unmoved - sum(law.branches.roots for law in laws)
    return Response(name, relative, tuple(laws), unmoved, left)


def _terms(at: Meeting, name: str) -> list[list[complex]] | None:
    """terms[m][j] of ε^m t^j, t in the root's unit; 0 is what the doubt of the parameters contains. None where unknown.

    With g independent eigenvectors, p is to leading order the determinant of a g × g matrix that vanishes at the root:
    terms below order g in both are 0.
    """
    k, g = at.multiplicity, at.geometric
    series = at.changed(name, flint.arb_series([0, at.step(name)], prec=2 * k + 1), doubt=True)
    rows = [at.taylor(order(series, m), doubt=True)[: k + 1] for m in range(2 * k + 1)]
    if not all(x.is_finite() for row in rows for x in row) or rows[0][k].contains(0):
        return None
    rows[0][:k] = [flint.acb(0)] * k
    return [
        [0j if m + j < g or x.contains(0) else middle(x / rows[0][k].mid()) for j, x in enumerate(row)]
        for m, row in enumerate(rows)
    ]


def _confirmed(at: Meeting, name: str, branch: Branches) -> Law | None:
    """The law with its ends, if the roots are where it has them at changes of both signs and of two sizes."""
    ends = [_ends(at, name, branch, sign) for sign in (-1, 1)]
    if any(high < 10**_SCALES * max(low, 10.0 ** _DECADES[0]) for low, high in ends):
        return None
    of_s = replace(branch, constants=tuple(c * at.unit**branch.denominator for c in branch.constants))
    return Law(of_s, ends[0][1], ends[1][1], max(low for low, _ in ends))


def _ends(at: Meeting, name: str, branch: Branches, sign: int) -> tuple[float, float]:
    """The least and the largest sampled change between which the roots are where the law has them; (0, 0) if none."""

    def holds(eps: float) -> bool:
        predicted = branch.shifts(sign * eps)
        scale = max(map(abs, predicted))
        shifted = _about(at, name, sign * eps, scale)
        # Of 1/t, so that those sought are the largest roots: companion eigenvalues have these to all digits.
        row = np.array([middle(c / shifted[at.multiplicity].abs_upper()) for c in shifted])
        row[np.cumsum(np.abs(row)) <= _SLOWER * np.abs(row).sum()] = 0  # of roots that stay far behind
        return _deviation(predicted, scale, row) <= DEVIATION

    seen = _CLEAR * _scatter(at)
    decades = [m for m in _DECADES if max(map(abs, branch.shifts(sign * 10.0**m))) > seen]
    low = next((m for m in decades if holds(10.0**m)), None)
    if low is None:
        return 0.0, 0.0
    least = 10.0**low if low > _DECADES[0] else 0.0
    first = next((m for m in decades if m > low and not holds(10.0**m)), None)
    if first is None:
        return least, 10.0 ** _DECADES[-1]
    reached = (10.0 ** (first - 1 + share) for share in _WITHIN)
    return least, next(filter(holds, reached), 10.0 ** (first - 1))


def _stays(at: Meeting, name: str, moved: Sequence[Branches], unmoved: int) -> bool:
    """Whether so many roots stay as a parameter changes, by Rouché's theorem at each of a few changes."""

    def within(eps: float, radius: float) -> int | None:
        """How many roots are within a radius; None where one term does not outweigh all others there."""
        terms = [abs(x) for x in _about(at, name, eps, radius)]
        return next((u for u, x in enumerate(terms) if 2 * x > sum(terms, flint.arb(0))), None)

    def radii(eps: float) -> list[float]:
        """In the root's unit, within which only roots that stay should be."""
        if not moved:
            return [max(small, _SCATTER * _scatter(at)) for small in _SMALL]
        least = min(abs(t) for branch in moved for t in branch.shifts(eps))
        return [small * least for small in (*_SMALL, *_BESIDE)]

    changes = [(eps, sign) for eps in _STILL for sign in (-1, 1)]
    return all(any(within(sign * eps, radius) == unmoved for radius in radii(eps)) for eps, sign in changes)


def _about(at: Meeting, name: str, eps: float, scale: float) -> list[Any]:
    """Coefficients in t of a changed polynomial, less what keeps the root from being met where nothing is changed."""
    changed = at.taylor(at.changed(name, eps * at.step(name)), scale)
    own = at.own(scale)
    return [a - b if j < at.multiplicity else a for j, (a, b) in enumerate(zip(changed, own, strict=True))]


def _scatter(at: Meeting) -> float:
    """How far apart the roots are, in their unit, that nearly meet."""
    k = at.multiplicity
    terms = [middle(x) for x in at.own()[: k + 1]]
    return float(max(abs(x / terms[k]) ** (1 / (k - j)) for j, x in enumerate(terms[:k])))


def _deviation(predicted: Sequence[complex], scale: float, row: NDArray[np.complex128]) -> float:
    """The largest distance of a predicted shift from the nearest true one left, relative; inf where there is none.

    Args:
        row: coefficients of the polynomial in scale/t, descending.
    """
    inverse = np.roots(row) if np.all(np.isfinite(row)) else np.zeros(0)
    left, worst = list(scale / inverse[inverse != 0]), 0.0
    for t in predicted:
        nearest = min(range(len(left)), key=lambda i: abs(left[i] - t), default=None)
        if nearest is None:
            return np.inf
        worst = max(worst, abs(left.pop(nearest) - t) / abs(t))
    return float(worst)
