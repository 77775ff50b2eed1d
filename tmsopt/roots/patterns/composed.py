"""Patterns of polynomials of any degree by name: what is said of some roots, beside others of which nothing is.

``EP3+CEP2`` of degree 9 is (s − r)³ (s² + bs + c)² (s² + c₁s + c₂). The others make up one monic factor with unknown
coefficients, so that the equations stay linear in them.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import accumulate, combinations, islice, product
from types import MappingProxyType
from typing import Any

import numpy as np

from tmsopt.roots.numeric import rebuilt
from tmsopt.roots.patterns.components import AXIS, ENDS, Component, parse_components
from tmsopt.roots.patterns.pattern import QUARTIC, Pattern, Roots
from tmsopt.roots.polynomial import evaluate, product as multiplied
from tmsopt.roots.sign_tests import double_root_test, weave_test

_GUESSES = 24  # unknowns to start from, the nearest of all ways to choose the roots
_LOOKED_AT = 512  # ways to choose the roots at most


def pattern_names(degree: int) -> tuple[str, ...]:
    """Names of the patterns of a degree that are not made up of others."""
    real = [f"EP{k}" for k in range(degree, 1, -1)]
    several = [f"2EP{k}" for k in range(degree // 2, 1, -1)]
    pairs = [f"CEP{k}" for k in range(degree // 2, 1, -1)]
    return (*real, *several, *pairs, *(a for a, taken in AXIS.items() if taken <= degree))


def pattern(name: str, degree: int) -> Pattern:
    """The pattern of a name, such as ``EP3``, ``2EP2``, ``EP2+CEP2``, ``weave``, for polynomials of a degree.

    Raises:
        ValueError: for a name that is none, or a pattern of more roots than the degree.

    Example:
        >>> triple = tmsopt.roots.pattern("EP3", 5)
        >>> triple.unknowns, triple.codimension
        (('r', 'c1', 'c2'), 2)

    More: docs/explanation/exceptional_points.md
    """
    return _pattern("".join(name.split()), degree)


def composition(name: str) -> list[tuple[str, int, int]]:
    """What a pattern is made of: (kind, multiplicity, count), of kind ``EP``, ``CEP`` or one of the imaginary axis.

    Example:
        >>> tmsopt.roots.composition("2EP2+CEP2")
        [('EP', 2, 2), ('CEP', 2, 1)]

    More: docs/explanation/exceptional_points.md
    """
    return [(g.kind, g.order, g.count) for g in parse_components("".join(name.split()))]


@cache
def _pattern(name: str, degree: int) -> Pattern:
    groups = parse_components(name)
    others = degree - sum(g.roots for g in groups)
    if others < 0:
        raise ValueError(f"'{name}' takes {degree - others} roots, and the polynomial has {degree}")
    name = _joined(name)
    tied = [u for g in groups for u in g.unknowns]
    names = [f"{u}{tied[: k + 1].count(u)}" if tied.count(u) > 1 else u for k, u in enumerate(tied)]
    rest = [f"{'d' if 'c' in tied else 'c'}{k}" for k in range(1, others + 1)]
    starts = accumulate((len(g.unknowns) for g in groups), initial=0)
    placed = [(g, slice(at, at + len(g.unknowns))) for g, at in zip(groups, starts, strict=False)]

    def factors(u: Sequence[Any], without: Collection[str] = ()) -> list[list[Any]]:
        remainder = [[1, *u[len(tied) :]]] if others else []
        return [f for g, s in placed if g.kind not in without for f in g.factors(u[s])] + remainder

    made = Pattern(
        name=name,
        meaning=" and ".join(g.meaning for g in groups) + (" beside other roots" if others else ""),
        unknowns=(*names, *rest),
        factors=factors,
        guesses=partial(_guesses, groups, others),
        nonnegative=lambda u: [x for g, s in placed for x in g.nonnegative(u[s])],
        abscissa=None if others or len(groups) > 1 else _ABSCISSAE.get((groups[0].kind, groups[0].count)),
        rest=partial(factors, without=AXIS) if any(g.kind in AXIS for g in groups) else None,
        test=_TESTS.get(name),
        marks=_marks(placed, others),
        ends={u: ENDS[g.kind] for g in groups for u in g.unknowns if u == "W"} if "W" in names else {},
        degree=degree,
    )
    return replace(made, **(QUARTIC.get(name, {}) if degree == 4 else {}))


_ABSCISSAE: Mapping[tuple[str, int], Any] = {("EP", 1): lambda u: u[0], ("CEP", 1): lambda u: -u[0] / 2}
"""Largest real part of the roots where parts of one kind, so many, make up all of them."""

_TESTS: Mapping[str, Any] = {"capsize": lambda a: a[-1], "weave": weave_test, "EP2": double_root_test}
"""For patterns of codimension 1: a function of the coefficients that changes sign across the set."""


def _marks(placed: Sequence[tuple[Component, slice]], others: int) -> dict[str, Any]:
    """More special patterns that a curve may pass."""
    marks: dict[str, Any] = {}
    roots = [(g, s.start) for g, s in placed if g.unknowns == ("r",)]
    for (one, j), (other, k) in combinations(roots, 2):
        rest = [g.name for g, _ in placed if g not in (one, other)]
        marks[_joined(f"EP{one.order + other.order}", *rest)] = lambda u, j=j, k=k: u[j] - u[k]
    if len(placed) > 1:
        return marks
    ((alone, own),) = placed
    end = own.stop
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
        marks[name] = lambda u: double_root_test([1, *u[end:]])
    return marks


def _joined(*names: str) -> str:
    """The name of several patterns together."""
    return "+".join(g.name for g in parse_components("+".join(names)))


def _guesses(groups: tuple[Component, ...], others: int, z: Roots) -> list[list[float]]:
    """Unknowns of the tied factors from roots chosen among z, and the rest by least squares; the nearest first."""
    target = rebuilt(z)
    far = np.abs(z).max()
    size = rebuilt(-np.abs(z) - 1e-3 * (far if far ** len(z) > 0 else 1.0))  # all may be 0
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


PATTERNS: Mapping[str, Pattern] = MappingProxyType({name: pattern(name, 4) for name in QUARTIC})
"""Patterns of a quartic that are not made up of others, by name."""
