"""Patterns of polynomials of any degree by name: what is said of some roots, beside others of which nothing is.

``EP3+CEP2`` of degree 9 is (s − r)³ (s² + bs + c)² (s² + c₁s + c₂). The others make up one monic factor with unknown
coefficients, so that the equations stay linear in them.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import combinations, islice, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.roots.meetings import meeting, weave_test
from tmsopt.roots.numeric import rebuilt
from tmsopt.roots.patterns import PATTERNS, Pattern, Roots, quadratic
from tmsopt.roots.polynomial import evaluate
from tmsopt.roots.polynomial import product as multiplied

Array = NDArray[np.float64]

_PART = re.compile(r"(?P<count>[1-9]\d*)?(?P<kind>C?EP)(?P<order>[1-9]\d*)")
_LARGEST = 12
_GUESSES = 24  # unknowns to start from, the nearest of all ways to choose the roots
_LOOKED_AT = 4096  # ways to choose the roots at most

_AXIS = {"weave": 2, "resonance": 4, "capsize": 1}
"""Patterns of the imaginary axis → roots that they take."""

_WORDS = {
    "weave": "a pair on the imaginary axis",
    "resonance": "a double imaginary pair (1:1 resonance)",
    "capsize": "a root at 0",
}


def pattern_names(degree: int) -> tuple[str, ...]:
    """Names of the patterns of a degree that are not made up of others."""
    real = [f"EP{k}" for k in range(degree, 1, -1)]
    several = [f"2EP{k}" for k in range(degree // 2, 1, -1)]
    pairs = [f"CEP{k}" for k in range(degree // 2, 1, -1)]
    return (*real, *several, *pairs, *(a for a, taken in _AXIS.items() if taken <= degree))


def pattern(name: str, degree: int) -> Pattern:
    """The pattern of a name, such as ``EP3``, ``2EP2``, ``EP2+CEP2``, ``weave``, for polynomials of a degree.

    Raises:
        ValueError: for a name that is none, or a pattern of more roots than the degree.
    """
    return _pattern("".join(name.split()), degree)


def composition(name: str) -> list[tuple[str, int, int]]:
    """What a pattern is made of: (kind, multiplicity, count), of kind ``EP``, ``CEP`` or one of the imaginary axis."""
    return [(g.kind, g.order, g.count) for g in _groups("".join(name.split()))]


@cache
def _pattern(name: str, degree: int) -> Pattern:
    groups = _groups(name)
    canonical = _joined(name)
    if degree == PATTERNS["EP4"].degree and canonical in PATTERNS:
        return PATTERNS[canonical]
    taken = sum(g.roots for g in groups)
    if taken > degree:
        raise ValueError(f"'{name}' takes {taken} roots, and the polynomial has {degree}")
    return _composed(canonical, groups, degree)


@dataclass(frozen=True)
class _Group:
    """Multiple roots of one kind and order, or a pattern of the imaginary axis.

    Attributes:
        kind: ``EP``, ``CEP``, ``weave``, ``resonance`` or ``capsize``.
        order: multiplicity of each root.
        count: how many such roots, or pairs.
    """

    kind: str
    order: int
    count: int

    @property
    def name(self) -> str:
        if self.kind in _AXIS:
            return self.kind
        return f"{self.count if self.count > 1 else ''}{self.kind}{self.order}"

    @property
    def roots(self) -> int:
        if self.kind in _AXIS:
            return _AXIS[self.kind]
        return self.count * self.order * (2 if self.kind == "CEP" else 1)

    @property
    def in_quadratics(self) -> bool:
        """Whether s² + bs + c with a sign of b² − 4c states it: complex pairs, and two real roots that may meet."""
        return self.kind == "CEP" or (self.kind == "EP" and self.count == 2)

    @property
    def unknowns(self) -> tuple[str, ...]:
        match self.kind:
            case "capsize":
                return ()
            case "weave" | "resonance":
                return ("W",)
            case "CEP":
                return ("b", "c") * self.count
            case _:
                return ("b", "c") if self.count == 2 else ("r",) * self.count

    def factors(self, u: Sequence[Any]) -> list[list[Any]]:
        match self.kind:
            case "capsize":
                return [[1, 0]]
            case "weave" | "resonance":
                return [[1, 0, u[0]]] * (_AXIS[self.kind] // 2)
        if self.in_quadratics:
            return [[1, u[k], u[k + 1]] for k in range(0, len(u), 2)] * self.order
        return [[1, -r] for r in u] * self.order

    def nonnegative(self, u: Sequence[Any]) -> list[Any]:
        if self.kind in ("weave", "resonance"):
            return [u[0]]
        if not self.in_quadratics:
            return []
        sign = 1 if self.kind == "EP" else -1
        return [sign * (u[k] * u[k] - 4 * u[k + 1]) for k in range(0, len(u), 2)]

    def guesses(self, z: Roots) -> list[list[float]]:
        match self.kind:
            case "capsize":
                return [[]]
            case "weave":
                return [[w] for w in _imaginary(z, 1)]
            case "resonance":
                return [[w] for w in _imaginary(z, 2)]
        real, pairs = _real_means(z, self.order), _pair_means(z, self.order)
        if self.kind == "CEP":
            return [[x for pair in chosen for x in pair] for chosen in combinations(pairs, self.count)]
        if self.count != 2:
            return [list(chosen) for chosen in combinations(real, self.count)]
        return [quadratic(np.array([r, t], dtype=complex)) for r, t in combinations(real, 2)] + pairs


def _groups(name: str) -> tuple[_Group, ...]:
    """The groups of a name, each kind and order once, real roots first and the highest multiplicity first."""
    counted: Counter[tuple[str, int]] = Counter()
    axis = []
    for part in name.split("+"):
        match = _PART.fullmatch(part)
        if part in _AXIS:
            axis.append(part)
        elif match is None or not 2 <= int(match["order"]) <= _LARGEST or int(match["count"] or 1) > _LARGEST:
            raise ValueError(f"'{name}' is no pattern")
        else:
            counted[match["kind"], int(match["order"])] += int(match["count"] or 1)
    if len(axis) > len(set(axis)):
        raise ValueError(f"'{name}' names {axis[0]} twice")
    ordered = sorted(counted.items(), key=lambda item: (item[0][0] != "EP", -item[0][1]))
    return (*(_Group(kind, order, count) for (kind, order), count in ordered), *(_Group(a, 1, 1) for a in axis))


def _composed(name: str, groups: tuple[_Group, ...], degree: int) -> Pattern:
    tied = [u for g in groups for u in g.unknowns]
    often = Counter(tied)
    seen: Counter[str] = Counter()
    names = []
    for u in tied:
        seen[u] += 1
        names.append(f"{u}{seen[u]}" if often[u] > 1 else u)
    others = degree - sum(g.roots for g in groups)
    rest = [f"{'d' if 'c' in tied else 'c'}{k}" for k in range(1, others + 1)]
    slices, at = [], 0
    for g in groups:
        slices.append(slice(at, at + len(g.unknowns)))
        at += len(g.unknowns)

    def each(u: Sequence[Any]) -> list[list[list[Any]]]:
        return [g.factors(u[s]) for g, s in zip(groups, slices, strict=True)]

    def factors(u: Sequence[Any]) -> list[list[Any]]:
        return [f for part in each(u) for f in part] + remainder(u)

    def remainder(u: Sequence[Any]) -> list[list[Any]]:
        return [[1, *u[at:]]] if others else []

    def off_axis(u: Sequence[Any]) -> list[list[Any]]:
        return [f for g, part in zip(groups, each(u), strict=True) if g.kind not in _AXIS for f in part] + remainder(u)

    alone = groups[0] if len(groups) == 1 else None
    whole = alone if not others else None
    return Pattern(
        name=name,
        meaning=" and ".join(_meaning(g) for g in groups) + (" beside other roots" if others else ""),
        unknowns=(*names, *rest),
        factors=factors,
        guesses=partial(_guesses, groups, others),
        nonnegative=lambda u: [x for g, s in zip(groups, slices, strict=True) for x in g.nonnegative(u[s])],
        abscissa=_abscissa(whole),
        rest=off_axis if any(g.kind in _AXIS for g in groups) else None,
        test=_test(alone),
        marks=_marks(groups, slices, others),
        ends={"W": "the pair meets in a double root 0"} if "W" in names else {},
        degree=degree,
    )


def _meaning(group: _Group) -> str:
    if group.kind in _WORDS:
        return _WORDS[group.kind]
    times = {1: "a", 2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}.get(group.count, str(group.count))
    what = "real root" if group.kind == "EP" else "complex pair"
    return f"{times} {group.order}-fold {what}{'s' if group.count > 1 else ''}"


def _abscissa(whole: _Group | None) -> Any:
    """Largest real part of the roots where one group makes up all of them."""
    if whole is not None and whole.kind == "EP" and whole.count == 1:
        return lambda u: u[0]
    if whole is not None and whole.kind == "CEP" and whole.count == 1:
        return lambda u: -u[0] / 2
    return None


def _test(alone: _Group | None) -> Any:
    """For patterns of codimension 1: a function of the coefficients that changes sign across the set."""
    if alone is None:
        return None
    match alone.kind, alone.order, alone.count:
        case "capsize", _, _:
            return lambda a: a[-1]
        case "weave", _, _:
            return weave_test
        case "EP", 2, 1:
            return meeting
    return None


def _marks(groups: Sequence[_Group], slices: Sequence[slice], others: int) -> dict[str, Any]:
    """More special patterns that a curve may pass."""
    marks: dict[str, Any] = {}
    roots = [(g, s.start) for g, s in zip(groups, slices, strict=True) if g.unknowns == ("r",)]
    for (one, j), (other, k) in combinations(roots, 2):
        rest = [g.name for g in groups if g not in (one, other)]
        marks[_joined(f"EP{one.order + other.order}", *rest)] = lambda u, j=j, k=k: u[j] - u[k]
    if len(groups) > 1:
        return marks
    (alone,), end = groups, slices[-1].stop
    if alone.in_quadratics and len(alone.unknowns) == 2:
        marks[f"EP{2 * alone.order}"] = lambda u: u[0] * u[0] - 4 * u[1]
    if others and alone.unknowns == ("r",):
        marks[f"EP{alone.order + 1}"] = lambda u: evaluate([1, *u[end:]], u[0])
        marks["double zero" if alone.order == 2 else f"{alone.order}-fold zero"] = lambda u: u[0]
    if others and alone.kind in ("EP", "CEP"):
        marks["capsize"] = lambda u: u[-1]
    if others and alone.kind == "capsize":
        marks["double zero"] = lambda u: u[-1]
    if others > 1 and alone.kind not in ("weave", "resonance"):
        name = "EP2" if alone.kind == "capsize" else _joined(alone.name, "EP2")
        marks[name] = lambda u: meeting([1, *u[end:]])
    return marks


def _joined(*names: str) -> str:
    """The name of several patterns together."""
    return "+".join(g.name for g in _groups("+".join(names)))


def _real_means(z: Roots, order: int) -> list[float]:
    """Mean real parts of `order` roots near each other, about each root, closed under conjugation where that can be."""
    found = []
    for anchor in z.real:
        nearest = z[np.argsort(np.abs(z - anchor), kind="stable")[:order]]
        found.append(float(nearest.real.mean()))
    return _apart(sorted(found), z)


def _pair_means(z: Roots, order: int) -> list[list[float]]:
    """b and c of s² + bs + c for the mean of `order` roots near each other in the upper half-plane."""
    upper = z[z.imag >= 0]
    found: list[list[float]] = []
    for anchor in upper:
        nearest = upper[np.argsort(np.abs(upper - anchor), kind="stable")[:order]]
        mean = nearest.mean()
        pair = [float(-2 * mean.real), float(abs(mean) ** 2)]
        if pair not in found:
            found.append(pair)
    return found


def _imaginary(z: Roots, order: int) -> list[float]:
    """W of s² + W for pairs, the nearest to the imaginary axis first."""
    means = _pair_means(z[np.argsort(np.abs(z.real), kind="stable")], order)
    return [c for _, c in means]


def _apart(values: list[float], z: Roots) -> list[float]:
    """Without repetitions; twice the only one, for two roots that meet."""
    near = 1e-12 * float(np.abs(z).max())
    kept = [v for k, v in enumerate(values) if k == 0 or v - values[k - 1] > near]
    return kept if len(kept) > 1 else kept * 2


def _guesses(groups: tuple[_Group, ...], others: int, z: Roots) -> list[list[float]]:
    """Unknowns of the tied factors from roots chosen among z, and the rest by least squares; the nearest first."""
    target = rebuilt(z)
    size = rebuilt(-np.abs(z).astype(complex) - 1e-3 * np.abs(z).max() - 1e-300)
    found: dict[tuple[float, ...], float] = {}
    for choice in islice(product(*(g.guesses(z) for g in groups)), _LOOKED_AT):
        tied = np.array(
            multiplied(*(f for g, u in zip(groups, choice, strict=True) for f in g.factors(u))), dtype=float
        )
        columns = np.stack([np.convolve(tied, unit) for unit in np.eye(others + 1)], axis=1) / size[:, None]
        rest = np.linalg.lstsq(columns[:, 1:], target / size - columns[:, 0], rcond=None)[0]
        mismatch = float(np.linalg.norm(columns[:, 0] + columns[:, 1:] @ rest - target / size))
        found[(*(x for u in choice for x in u), *rest.tolist())] = mismatch
    return [list(u) for u in sorted(found, key=found.__getitem__)[:_GUESSES]]
