"""Finds laws by which a multiple root splits when a parameter changes, and confirms each law by computed roots."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import flint
import numpy as np

from tmsopt.analysis.puiseux import Branches, find_branches
from tmsopt.analysis.root_point import RootPoint, coefficients_of_order, midpoint
from tmsopt.records import Complex
from tmsopt.roots.chains import Chain

DEVIATION = 0.1
"""Largest relative deviation of a root from the leading term for which the law holds."""

_DECADES = range(-16, 1)  # powers of ten at which a law is tested
_DECADE_SHARES = (0.75, 0.5, 0.25)  # shares of the decade before the first failure that are also tested
_MIN_DECADES = 2  # decades over which a law must hold on both sides to be confirmed
_NEGLIGIBLE_SHARE = 1e-13  # share of coefficients that count as 0, because their roots move far more slowly
_COUNTED_CHANGES = (1e-2, 1e-4)  # changes at which unmoved roots are counted
_SMALL_RADII = (1e-11, 1e-8, 1e-5)  # radii for this count, relative to the smallest shift or to the size of the roots
_WIDE_RADII = (1e-3, 3e-2)  # further radii if other roots move
_MIN_SHIFT = 2  # smallest shift that is tested, relative to the distance of the roots that nearly meet
_SCATTER_RADIUS = 8  # radius for the count if no root moves, relative to the same distance
_NEGLIGIBLE_SLOPE = 1e-10  # share of the sizes of its factors that counts as 0 in doubles, near a design with 12 digits

_Shifts = Callable[[float, float], list[complex]]
"""ε and the size of the predicted shifts → the shifts."""


@dataclass(frozen=True)
class Law:
    """Roots that leave the multiple root by one law when a parameter changes.

    Attributes:
        branches: tᵠ = C εᵖ for the shift t of each root, to leading order.
        below, above: |ε| up to which every sampled shift is within `DEVIATION` of the law, for ε < 0 and ε > 0. Samples
            are at each power of ten from 1e-16 to 1, and at four points of the last decade in which the law holds.
        least: |ε| from which the law holds; 0 if it holds from the first sample. If the root is multiple only up to
            rounding errors, shifts below the distance of the nearby roots are not tested.
    """

    branches: Branches
    below: float
    above: float
    least: float


@dataclass(frozen=True)
class Response:
    """Response of a multiple root to one parameter.

    Attributes:
        relative: whether ε is relative to the parameter's value; it is absolute if the value is 0 up to rounding.
        laws: the laws that computed roots confirm over a factor of 100 of ε; the fastest law comes first.
        unmoved: number of roots that do not move, in the computed orders of ε.
        unresolved: number of roots that follow no confirmed law and for which it is not confirmed that they stay.
    """

    parameter: str
    relative: bool
    laws: tuple[Law, ...]
    unmoved: int
    unresolved: int = 0


def compute_response(point: RootPoint, name: str) -> Response:
    """Response of a multiple root to a parameter, at the precision of `high_precision`."""
    k, relative = point.multiplicity, point.is_relative(name)
    terms = _expand_terms(point, name)
    if terms is None:
        return Response(name, relative, (), 0, k)
    branches, unmoved = find_branches(terms)
    min_shift = _MIN_SHIFT * _measure_scatter(point)

    def find_shifts(eps: float, scale: float) -> list[complex]:
        """The shifts of the nearest roots after a change by ε, divided by the unit."""
        shifted = _expand_locally(point, name, eps, scale)
        # In the variable 1/t the smallest t are the largest roots, which companion eigenvalues give to all digits.
        coefficients = np.array([midpoint(c / shifted[point.multiplicity].abs_upper()) for c in shifted])
        sizes = np.abs(coefficients)
        coefficients[np.cumsum(sizes) <= _NEGLIGIBLE_SHARE * sizes.sum()] = 0  # roots that move far more slowly
        inverse = np.roots(coefficients) if np.all(np.isfinite(coefficients)) else np.zeros(0)
        return list(scale / inverse[inverse != 0])

    laws = [law for branch in branches if (law := _confirm_law(branch, find_shifts, min_shift, point.unit))]
    if unmoved and not _has_fixed_roots(point, name, branches, unmoved):
        unmoved = 0
    unresolved = k - unmoved - sum(law.branches.roots for law in laws)
    return Response(name, relative, tuple(laws), unmoved, unresolved)


def _expand_terms(point: RootPoint, name: str) -> list[list[complex]] | None:
    """terms[m][j] of ε^m t^j, with t in the unit of the root; None if they are undefined.

    A term is 0 if it may be 0 within rounding errors. With g independent eigenvectors, the leading terms of p are the
    determinant of a g × g matrix that is 0 at the root, so terms of total order below g are 0.
    """
    k, g = point.multiplicity, point.geometric
    series = point.perturb(name, flint.arb_series([0, point.step(name)], prec=2 * k + 1), with_errors=True)
    rows = [point.taylor(coefficients_of_order(series, m), with_errors=True)[: k + 1] for m in range(2 * k + 1)]
    if not all(x.is_finite() for row in rows for x in row) or rows[0][k].contains(0):
        return None
    rows[0][:k] = [flint.acb(0)] * k
    return [
        [0j if m + j < g or x.contains(0) else midpoint(x / rows[0][k].mid()) for j, x in enumerate(row)]
        for m, row in enumerate(rows)
    ]


def compute_chain_response(
    chain: Chain, name: str, relative: bool, change: Complex, find_eigenvalues: Callable[[float], Complex]
) -> Response:
    """Response of an eigenvalue with one Jordan chain: tᵏ = −(∂F₀/∂ε) ε/Fₖ, if ∂F₀/∂ε is not 0.

    Args:
        change: derivatives of the matrices with respect to ε.
        find_eigenvalues: function from ε to the eigenvalues.
    """
    k, slope = chain.order, chain.respond(change)[0]
    if abs(slope) <= _NEGLIGIBLE_SLOPE * np.linalg.norm(chain.left[0]) * np.linalg.norm(change) * np.linalg.norm(
        chain.right[0]
    ):
        return Response(name, relative, (), 0 if change.any() else k, k if change.any() else 0)
    scatter = float(np.sort(np.abs(find_eigenvalues(0.0) - chain.s))[k - 1])
    branch = Branches(k, 1, k, (complex(-slope / chain.values[k]),))
    law = _confirm_law(branch, lambda eps, _: list(find_eigenvalues(eps) - chain.s), _MIN_SHIFT * scatter, 1.0)
    return Response(name, relative, (law,) if law else (), 0, 0 if law else k)


def _confirm_law(branch: Branches, find_shifts: _Shifts, min_shift: float, unit: float) -> Law | None:
    """The law with its range of validity; None unless roots obey it for both signs of ε and over two decades."""
    ends = [_find_validity_range(branch, find_shifts, min_shift, sign) for sign in (-1, 1)]
    if any(high < 10**_MIN_DECADES * max(low, 10.0 ** _DECADES[0]) for low, high in ends):
        return None
    scaled_branch = replace(branch, constants=tuple(c * unit**branch.denominator for c in branch.constants))
    return Law(scaled_branch, ends[0][1], ends[1][1], max(low for low, _ in ends))


def _find_validity_range(branch: Branches, find_shifts: _Shifts, min_shift: float, sign: int) -> tuple[float, float]:
    """The smallest and the largest sampled |ε| between which the roots obey the law; (0, 0) if they never do."""

    def is_obeyed(eps: float) -> bool:
        predicted = branch.shifts(sign * eps)
        return _measure_deviation(predicted, find_shifts(sign * eps, max(map(abs, predicted)))) <= DEVIATION

    decades = [m for m in _DECADES if max(map(abs, branch.shifts(sign * 10.0**m))) > min_shift]
    first_decade = next((m for m in decades if is_obeyed(10.0**m)), None)
    if first_decade is None:
        return 0.0, 0.0
    lower_end = 10.0**first_decade if first_decade > _DECADES[0] else 0.0
    first_failure = next((m for m in decades if m > first_decade and not is_obeyed(10.0**m)), None)
    if first_failure is None:
        return lower_end, 10.0 ** _DECADES[-1]
    samples = (10.0 ** (first_failure - 1 + share) for share in _DECADE_SHARES)
    return lower_end, next(filter(is_obeyed, samples), 10.0 ** (first_failure - 1))


def _has_fixed_roots(point: RootPoint, name: str, branches: Sequence[Branches], unmoved: int) -> bool:
    """Whether `unmoved` roots stay when a parameter changes, by Rouché's theorem for a few changes."""

    def count_roots(eps: float, radius: float) -> int | None:
        """Number of roots within a radius; None if no term is larger than the sum of all others."""
        terms = [abs(x) for x in _expand_locally(point, name, eps, radius)]
        return next((count for count, x in enumerate(terms) if 2 * x > sum(terms, flint.arb(0))), None)

    def list_radii(eps: float) -> list[float]:
        """Radii, in the unit of the root, that should contain only the fixed roots."""
        if not branches:
            return [max(radius, _SCATTER_RADIUS * _measure_scatter(point)) for radius in _SMALL_RADII]
        least_shift = min(abs(t) for branch in branches for t in branch.shifts(eps))
        return [radius * least_shift for radius in (*_SMALL_RADII, *_WIDE_RADII)]

    changes = [(eps, sign) for eps in _COUNTED_CHANGES for sign in (-1, 1)]
    return all(any(count_roots(sign * eps, radius) == unmoved for radius in list_radii(eps)) for eps, sign in changes)


def _expand_locally(point: RootPoint, name: str, eps: float, scale: float) -> list[Any]:
    """Coefficients in t of the perturbed polynomial, corrected for the residual of the unperturbed multiple root."""
    perturbed = point.taylor(point.perturb(name, eps * point.step(name)), scale)
    unperturbed = point.expand(scale)
    return [a - b if j < point.multiplicity else a for j, (a, b) in enumerate(zip(perturbed, unperturbed, strict=True))]


def _measure_scatter(point: RootPoint) -> float:
    """Distance between the roots that nearly meet, in the unit of the root."""
    k = point.multiplicity
    terms = [midpoint(x) for x in point.expand()[: k + 1]]
    return float(max(abs(x / terms[k]) ** (1 / (k - j)) for j, x in enumerate(terms[:k])))


def _measure_deviation(predicted: Sequence[complex], true_shifts: list[complex]) -> float:
    """The largest relative distance of a predicted shift from the nearest true shift; inf if there are too few."""
    worst_deviation = 0.0
    for t in predicted:
        nearest_index = min(range(len(true_shifts)), key=lambda i: abs(true_shifts[i] - t), default=None)
        if nearest_index is None:
            return np.inf
        worst_deviation = max(worst_deviation, abs(true_shifts.pop(nearest_index) - t) / abs(t))
    return float(worst_deviation)
