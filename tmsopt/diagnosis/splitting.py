"""How a multiple root splits when a parameter changes, and how far the leading term tells it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from tmsopt.arithmetic.elementary import exact
from tmsopt.diagnosis.puiseux import Branches, branches
from tmsopt.models import Model, ParameterSet
from tmsopt.roots import Root, product

DEVIATION = 0.1
"""Share by which a root may be off the leading term while the law is said to hold."""

_NOTHING = 1e-9  # of its terms: a derivative that vanishes at the exact multiple root, and not quite at the stored one
_FAINT = 1e-13  # of the coefficients' own terms: a derivative that rounding of the design alone may bring about
_ZERO = 1e-12  # of the range of a parameter: a change relative to so little is none
_DECADES = range(-16, 1)  # of the changes at which a law is tried
_WITHIN = (0.75, 0.5, 0.25)  # and, before the first decade at which it fails

Ideal = Sequence[tuple[Root, Any]]
"""Each root of the nearest polynomial with the structure, and as a complex ball without a radius."""


@dataclass(frozen=True)
class Law:
    """Roots that leave the multiple root alike when a parameter changes.

    Attributes:
        branches: tᵠ = C εᵖ for the shift t of each, to leading order.
        below, above: |ε| up to which every sampled shift is within `DEVIATION` of it, for ε < 0 and ε > 0; sampled at
            each decade from 1e-16 to 1, and four times in the last one that is reached; 0 if it holds at none. The
            least decades do not count where the law fails there alone: by the rounding of the design, which parts
            roots that the change leaves together.
    """

    branches: Branches
    below: float
    above: float


@dataclass(frozen=True)
class Response:
    """How a multiple root answers to one parameter.

    Attributes:
        relative: whether ε is relative to the parameter's value; of one that is 0, but for rounding, it is absolute.
        laws: fastest first; empty if no root moves.
        unmoved: roots that stay, to the orders looked at.
    """

    parameter: str
    relative: bool
    laws: tuple[Law, ...]
    unmoved: int


def response(
    model: Model, of: ParameterSet, design: Mapping[str, float], ideal: Ideal, place: int, name: str, width: float = 0.0
) -> Response:
    """How one of the multiple roots of the ideal polynomial answers to a parameter, at the precision of `flint.ctx`.

    Args:
        width: of the range of the parameter, beside which it may be 0 but for rounding; 0 of one that is fixed.
    """
    root, s = ideal[place]
    k = root.multiplicity
    relative = abs(design[name]) > _ZERO * width
    step = exact(design[name]) if relative else exact(1.0)

    def changed(by: Any) -> list[Any]:
        varied: dict[str, Any] = {n: flint.arb(x) for n, x in design.items()}
        varied[name] = varied[name] + flint.arb(step) * by
        return model.coefficients(varied, of)

    own = [_ball(c) for c in changed(flint.arb(0))]
    base = [own[0] * c for c in product(*([1, -z] for r, z in ideal for _ in range(r.multiplicity)))]
    series = changed(flint.arb_series([0, 1], prec=k + 1))
    unit = abs(s) if abs(s) > 0 else abs(max((z for _, z in ideal), key=lambda z: float(abs(z)))) or flint.arb(1)
    size = _taylor([abs(c) for c in base], abs(s), unit, k)
    terms = [[0j] * k + [middle(_taylor(base, s, unit, k)[k])]]
    for m in range(1, k + 1):
        order = [c[m] if isinstance(c, flint.arb_series) else flint.arb(0) for c in series]
        values, sizes = _taylor(order, s, unit, k), _taylor([abs(c) for c in order], abs(s), unit, k)
        pairs = zip(sizes, size, strict=True)
        floors = [_NOTHING * float(abs(a).mid()) + _FAINT * float(abs(b).mid()) for a, b in pairs]
        terms.append([z if abs(z := middle(v)) > f else 0j for v, f in zip(values, floors, strict=True)])
    found, unmoved = branches(terms)
    laws = []
    for branch in found:
        below, above = (_holds(branch, k, base, own, changed, (s, unit), sign) for sign in (-1, 1))
        laws.append(Law(_in_unit(branch, float(unit.mid())), below, above))
    return Response(name, relative, tuple(laws), unmoved)


def _holds(
    branch: Branches, k: int, base: Sequence[Any], own: Sequence[Any], changed: Any, about: tuple[Any, Any], sign: int
) -> float:
    """The largest sampled change up to which the roots are where the leading term has them; about = root, unit."""
    s, unit = about

    def held(changes: Sequence[float]) -> list[bool]:
        """Of each size of a change."""
        rows, predicted = [], [branch.shifts(sign * eps) for eps in changes]
        scales = [max(abs(t) for t in each) for each in predicted]
        for eps, scale in zip(changes, scales, strict=True):
            change = changed(flint.arb(sign) * eps)
            coefficients = [b + _ball(c) - o for b, c, o in zip(base, change, own, strict=True)]
            shifted = _taylor(coefficients, s, unit * scale, len(coefficients) - 1)
            # Of 1/t, so that those sought are the largest roots: companion eigenvalues have these to all digits.
            rows.append([middle(c / shifted[k].abs_upper()) for c in shifted])
        every = zip(predicted, scales, _largest(np.array(rows), k), strict=True)
        return [_deviation(t, scale, inverse) <= DEVIATION for t, scale, inverse in every]

    every = list(zip(_DECADES, held([10.0**m for m in _DECADES]), strict=True))
    while every and not every[0][1]:
        every.pop(0)
    if not every:
        return 0.0
    first = next((m for m, right in every if not right), None)
    if first is None:
        return 10.0 ** _DECADES[-1]
    reached = [10.0 ** (first - 1 + share) for share in _WITHIN]
    return next((eps for eps, right in zip(reached, held(reached), strict=True) if right), 10.0 ** (first - 1))


def _largest(rows: NDArray[np.complex128], k: int) -> list[NDArray[np.complex128]]:
    """Roots other than 0 of polynomials, coefficients descending; none of one without first coefficients."""
    plain = np.isfinite(rows).all(axis=1) & (rows[:, 0] != 0) & (rows[:, -1] != 0)
    companion = np.zeros((int(plain.sum()), rows.shape[1] - 1, rows.shape[1] - 1), dtype=complex)
    companion[:, 1:, :-1] = np.eye(rows.shape[1] - 2)
    companion[:, 0] = -rows[plain, 1:] / rows[plain, :1]
    every = iter(np.linalg.eigvals(companion))
    found = []
    for row, whole in zip(rows, plain, strict=True):
        some = np.all(np.isfinite(row)) and np.any(row[: k + 1])
        roots = next(every) if whole else np.roots(row) if some else np.empty(0, dtype=complex)
        found.append(roots[roots != 0])
    return found


def _deviation(predicted: Sequence[complex], scale: float, inverse: NDArray[np.complex128]) -> float:
    """The largest distance of a predicted shift from the nearest true one, relative; inf where there is none."""
    actual = scale / inverse
    return max(float(np.abs(actual - t).min(initial=np.inf)) / abs(t) for t in predicted)


def _in_unit(branch: Branches, unit: float) -> Branches:
    """With the shift in the unit of s."""
    return replace(branch, constants=tuple(c * unit**branch.denominator for c in branch.constants))


def _taylor(coefficients: Sequence[Any], s: Any, unit: Any, last: int) -> list[Any]:
    """Coefficients in t of p(s + unit t), ascending, up to a power."""
    found = flint.acb_poly(list(coefficients[::-1]))(flint.acb_poly([s, unit]))
    return [found[j] for j in range(last + 1)]


def _ball(x: Any) -> Any:
    return x[0] if isinstance(x, flint.arb_series) else flint.arb(x)


def middle(x: Any) -> complex:
    """The middle of a complex ball."""
    return complex(float(x.real.mid()), float(x.imag.mid()))
