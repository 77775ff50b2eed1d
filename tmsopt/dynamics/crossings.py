"""Finds all values of y at which roots of a polynomial in s meet or cross the imaginary axis, exactly.

The coefficients are polynomials in y with rational coefficients. A root 0 occurs where aₙ(y) = 0, a root at infinity
where a0(y) = 0, a pair ± iω where the resultant of the even and the odd part is 0, and a multiple root where the
discriminant is 0. Interval arithmetic isolates the roots y of these polynomials. So no y is missed, even if it is very
close to another one. Factors that are present for every y, such as s for a root 0, are split off first.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import flint

from tmsopt.algebra.balls import rational
from tmsopt.roots.exact import exact_roots
from tmsopt.roots.polynomial import Root
from tmsopt.roots.stability import lienard_chipart

Polynomial = Sequence[Any]
"""Coefficients in y, exact fractions, ascending."""

DIGITS = 120
"""Decimal digits of y. The rounding errors of y move a k-fold root by 10^(−120/k)."""

_RING = flint.fmpq_mpoly_ctx.get(["s", "y"], "lex")
_S, _Y = _RING.gens()
_SAME_ROOT = 1e-12  # distance, relative to the largest root, below which two roots count as one
_ZERO_COEFFICIENT = flint.fmpq(1, 10**90)  # largest coefficient, relative to the largest of all, that counts as 0

Stretch = tuple[float, float]
"""The two ends of a band of values."""


@dataclass(frozen=True)
class Crossing:
    """A value of y at which roots meet or cross the imaginary axis.

    Attributes:
        at: the value of y.
        kind: ``capsize`` (a root 0), ``weave`` (a pair ± iω), ``infinity`` (a root at infinity), ``EP2``, ``EP3``, …
            (a real k-fold root) or ``CEP2``, … (a k-fold pair).
        root: the root with its multiplicity, or the upper root of a pair; meaningless for ``infinity``.
        rightmost: whether no other root is farther to the right.
        changes: whether the polynomial is stable, or marginally stable, on exactly one side of y.
    """

    at: float
    kind: str
    root: Root
    rightmost: bool
    changes: bool


@dataclass(frozen=True)
class Crossings:
    """All crossings in a range of y.

    Attributes:
        found: the crossings, in ascending order of y.
        stable: bands with all Re s < 0, cut off at the ends of the range.
        heavily_damped: bands with all s real and negative.
        always: the kinds that are present for every y: ``weave`` (roots mirrored in the axis), ``EP2`` (a multiple root
            other than 0), ``capsize`` (a root 0), ``infinity``.
        marginal: bands with no root right of the axis and simple roots on it, apart from a root 0 that is present for
            every y. Empty if `always` is empty.
        zeros: multiplicity of the root 0 that is present for every y.
    """

    found: tuple[Crossing, ...]
    stable: tuple[Stretch, ...]
    heavily_damped: tuple[Stretch, ...]
    always: tuple[str, ...] = ()
    marginal: tuple[Stretch, ...] = ()
    zeros: int = 0


def find_crossings(coefficients: Sequence[Polynomial], lower: Any, upper: Any, bands_only: bool = False) -> Crossings:
    """All crossings with lower < y < upper, in exact numbers; upper may be inf.

    Args:
        coefficients: coefficients of the polynomial in s, descending, each a polynomial in y.
        bands_only: compute only the bands, because the crossings take most of the time.
    """
    lower, upper = rational(lower), None if upper == math.inf else rational(upper)
    p = _join_rows([flint.fmpq_poly([*map(rational, c)]) for c in reversed(coefficients)])
    a, split = _split_rows(p), _split_factors(p)
    values_by_kind = {
        kind: _isolate_real_roots(q, lower, upper)
        for kind, q in _list_event_polynomials(a, split).items()
        if not q.is_zero()
    }
    critical_values = sorted({y for ys in values_by_kind.values() for y in ys})
    cells = list(_list_cells(critical_values, lower, upper))
    stable, damped = zip(*(_classify(_evaluate_at(a, middle)) for _, _, middle in cells), strict=True)
    is_permanent = {"capsize": split.zeros > 0, "weave": len(split.mirrored) > 1, "EP2": split.has_repeated_factor}
    marginal = [any(is_permanent.values()) and _is_marginal(split, middle) for _, _, middle in cells]
    is_bounded = [is_stable or is_marginal for is_stable, is_marginal in zip(stable, marginal, strict=True)]
    has_change = {float(y): is_bounded[k] != is_bounded[k + 1] for k, y in enumerate(critical_values)}
    found = (
        Crossing(float(y), *event, has_change[float(y)])
        for y in critical_values
        for kind, values in values_by_kind.items()
        if y in values
        for event in _find_events(a, split, kind, y)
    )
    return Crossings(
        () if bands_only else tuple(found),
        merge_bands(cells, stable),
        merge_bands(cells, damped),
        tuple(kind for kind, holds in ({"infinity": len(a) < len(coefficients)} | is_permanent).items() if holds),
        merge_bands(cells, marginal),
        split.zeros,
    )


@dataclass(frozen=True)
class _Split:
    """The factors of p(s, y) = s^zeros · (factors), each a list of coefficients in y, descending in s.

    Attributes:
        zeros: multiplicity of the root 0 for every y.
        mirrored: product of the distinct factors that are even in s, with roots s and −s.
        other_factors: product of the other distinct factors.
        squarefree: p without repeated factors: mirrored times other_factors, times s if s divides p.
        has_repeated_factor: whether a factor other than s is repeated.
        has_repeated_mirrored_factor: whether an even factor is repeated.
    """

    zeros: int
    mirrored: list[Any]
    other_factors: list[Any]
    squarefree: list[Any]
    has_repeated_factor: bool
    has_repeated_mirrored_factor: bool


def _split_factors(p: Any) -> _Split:
    zeros = int(min(power for power, _ in p.monoms()))
    p /= _S**zeros
    factors = [(f, power) for f, power in p.factor_squarefree()[1] if f.degrees()[0] > 0]
    distinct_product = math.prod((f for f, _ in factors), start=_S**0)
    mirrored = distinct_product.gcd(distinct_product.compose(-_S, _Y))
    has_repeated_mirrored_factor = p.gcd(p.compose(-_S, _Y)).degrees()[0] > mirrored.degrees()[0]
    return _Split(
        zeros,
        _split_rows(mirrored),
        _split_rows(distinct_product / mirrored),
        _split_rows(distinct_product * _S if zeros else distinct_product),
        any(power > 1 for _, power in factors),
        has_repeated_mirrored_factor,
    )


def _list_event_polynomials(a: Sequence[Any], split: _Split) -> dict[str, Any]:
    """Polynomials in y whose roots are the crossings of each kind."""
    even, odd = (_join_rows(split.other_factors[::-1][k::2]) for k in (0, 1))
    distinct_product = _join_rows(split.squarefree[::-1])
    return {
        "capsize": split.mirrored[-1] * split.other_factors[-1],
        "infinity": a[0],
        "weave": _split_rows(even.resultant(odd, "s"))[0] if len(split.other_factors) > 1 else flint.fmpq_poly(),
        "EP2": _split_rows(distinct_product.discriminant("s"))[0] if len(split.squarefree) > 1 else flint.fmpq_poly(),
    }


def _join_rows(rows: Sequence[Any]) -> Any:
    """A polynomial in s and y from its coefficients, ascending in s."""
    return _RING.from_dict({(i, j): x for i, row in enumerate(rows) for j, x in enumerate(row.coeffs())})


def _split_rows(p: Any) -> list[Any]:
    """Coefficients of a polynomial in s and y, descending in s, as polynomials in y."""
    rows = [flint.fmpq_poly() for _ in range(p.degrees()[0] + 1)]
    for (i, j), value in p.to_dict().items():
        rows[-1 - i][j] = value
    return rows


def _evaluate_at(rows: Sequence[Any], y: Any) -> list[Any]:
    return [row(y) for row in rows]


def _isolate_real_roots(polynomial: Any, lower: Any, upper: Any | None) -> list[Any]:
    """Distinct real roots between two ends, as fractions correct to `DIGITS`."""
    with flint.ctx.workdps(DIGITS):
        real_roots = [rational(z.real) for z, _ in polynomial.numer().complex_roots() if z.imag == 0]
    return sorted(y for y in real_roots if y > lower and (upper is None or y < upper))


def _is_marginal(split: _Split, y: Any) -> bool:
    """Whether no root is right of the axis and all roots on the axis are simple, apart from roots 0."""
    other_factor, mirrored_factor = _evaluate_at(split.other_factors, y), _evaluate_at(split.mirrored, y)
    is_stable, _ = _classify(other_factor)
    if split.has_repeated_mirrored_factor or not is_stable:
        return False
    return all(w.im == 0 and w.re < 0 for w in exact_roots(mirrored_factor[::2]))  # in w = s²


def _find_events(a: Sequence[Any], split: _Split, kind: str, y: Any) -> Iterator[tuple[str, Root, bool]]:
    """For each crossing at y: kind, root, and whether the root is rightmost. A mirrored real pair is no crossing."""
    if kind == "infinity":
        yield kind, Root(math.nan, 0.0), False
        return
    coefficients = _strip_leading_zeros(_evaluate_at(a, y))
    size = _measure_roots(a, y, coefficients)
    roots = _cluster_roots(coefficients, size)
    rightmost_part = max((r.re for r in roots), default=math.nan)

    def count_roots(part: Sequence[Any], root: Root) -> int:
        """Multiplicity of a root in a factor."""
        part_roots = _cluster_roots(_strip_leading_zeros(_evaluate_at(part, y)), size)
        return sum(
            o.multiplicity for o in part_roots if abs(complex(o.re - root.re, o.im - root.im)) <= _SAME_ROOT * size
        )

    is_crossing: dict[str, Callable[[Root], bool]] = {
        "capsize": lambda r: r.re == r.im == 0,
        "weave": lambda r: r.re == 0 < r.im and count_roots(split.other_factors, r) > 0,
        "EP2": lambda r: r.multiplicity > 1 and r.im >= 0 and count_roots(split.squarefree, r) > 1,
    }
    for root in filter(is_crossing[kind], roots):
        name = f"{'CEP' if root.im else 'EP'}{root.multiplicity}" if kind == "EP2" else kind
        yield name, root, root.re >= rightmost_part - _SAME_ROOT * size


def _strip_leading_zeros(coefficients: Sequence[Any]) -> Sequence[Any]:
    """The coefficients without leading zeros (within the digits of y), whose roots are at infinity."""
    max_zero = _ZERO_COEFFICIENT * max(abs(c) for c in coefficients)
    first_index = next((k for k, c in enumerate(coefficients) if abs(c) > max_zero), len(coefficients) - 1)
    return coefficients[first_index:]


def _measure_roots(a: Sequence[Any], y: Any, coefficients: Sequence[Any]) -> float:
    """A size of the roots: the largest |aₖ/a0|^(1/k). No root is larger than twice this size.

    The absolute values of the terms in y are added, so the size is positive even if all roots are 0.
    """
    terms = [flint.fmpq_poly([*map(abs, c.coeffs())])(abs(y)) for c in a[len(a) - len(coefficients) :]]
    leading_size = abs(coefficients[0])
    ratios = ((k, t / leading_size) for k, t in enumerate(terms) if k and t != 0)
    return max((float((flint.arb(ratio) ** (flint.arb(1) / k)).mid()) for k, ratio in ratios), default=1.0)


def _cluster_roots(coefficients: Sequence[Any], size: float) -> list[Root]:
    """Roots of a polynomial with `DIGITS` digits; roots that rounding separates are merged into a multiple root."""
    remaining_roots = list(exact_roots(coefficients, DIGITS)) if len(coefficients) > 1 else []
    groups: list[Root] = []
    while remaining_roots:
        z = complex(remaining_roots[0].re, remaining_roots[0].im)
        near_roots = [r for r in remaining_roots if abs(complex(r.re, r.im) - z) <= _SAME_ROOT * size]
        remaining_roots = [r for r in remaining_roots if r not in near_roots]
        re, im = (x if abs(x) > _SAME_ROOT * size else 0.0 for x in (z.real, z.imag))
        groups.append(Root(re, im, sum(r.multiplicity for r in near_roots)))
    return groups


def _classify(coefficients: Sequence[Any]) -> tuple[bool, bool]:
    """Whether a polynomial is stable, and whether it is heavily damped, in exact numbers."""
    sign = 1 if coefficients[0] > 0 else -1
    if coefficients[0] == 0 or not all(x > 0 for x in lienard_chipart([sign * c for c in coefficients])):
        return False, False
    return True, all(r.im == 0 for r in exact_roots(coefficients))


def _list_cells(critical_values: Sequence[Any], lower: Any, upper: Any | None) -> Iterator[tuple[float, float, Any]]:
    """The intervals between critical values: the two ends, and a number between them."""
    for low, high in pairwise([lower, *critical_values, upper]):
        if high is None:
            yield float(low), math.inf, low + 1 + abs(low)
        else:
            yield float(low), float(high), (low + high) / 2


def merge_bands(cells: Sequence[tuple[float, float, Any]], is_inside: Sequence[bool]) -> tuple[Stretch, ...]:
    """The intervals that are inside. Adjacent intervals are merged, even if the point between them is not inside."""
    bands: list[Stretch] = []
    for (low, high, _), is_cell_inside in zip(cells, is_inside, strict=True):
        if is_cell_inside and bands and bands[-1][1] == low:
            bands[-1] = (bands[-1][0], high)
        elif is_cell_inside:
            bands.append((low, high))
    return tuple(bands)
