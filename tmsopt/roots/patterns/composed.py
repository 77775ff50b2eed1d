"""Patterns by name for polynomials of any degree. They consist of multiple roots and a factor with free roots.

``EP3+CEP2`` of degree 9 is (s − r)³ (s² + bs + c)² (s² + c₁s + c₂). The free roots form one monic factor with unknown
coefficients, in which the equations are linear.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import accumulate, combinations, islice, product
from types import MappingProxyType
from typing import Any

import numpy as np

from tmsopt.roots.numeric import rebuilt
from tmsopt.roots.patterns.components import AXIS_ROOT_COUNTS, END_EVENTS, Component, multiplicities, parse_components
from tmsopt.roots.patterns.pattern import QUARTIC, Pattern, Roots
from tmsopt.roots.polynomial import evaluate, product as multiply_polynomials
from tmsopt.roots.sign_tests import double_root_test, weave_test

_MAX_GUESSES = 24  # guesses of the unknowns that are returned
_MAX_CHOICES = 512  # choices of roots that are tried; the nearest choices give the guesses


def pattern_names(degree: int) -> tuple[str, ...]:
    """Names of the patterns for a degree that are not composed of other patterns."""
    single_real = [f"EP{k}" for k in multiplicities(degree)]
    double_real = [f"2EP{k}" for k in multiplicities(degree // 2)]
    double_pairs = [f"CEP{k}" for k in multiplicities(degree // 2)]
    return (
        *single_real,
        *double_real,
        *double_pairs,
        *(name for name, roots in AXIS_ROOT_COUNTS.items() if roots <= degree),
    )


def pattern(name: str, degree: int) -> Pattern:
    """The pattern with a name such as ``EP3``, ``2EP2``, ``EP2+CEP2`` or ``weave``, for polynomials of a degree.

    Raises:
        ValueError: for an unknown name, or a pattern with more roots than the degree.

    Example:
        >>> triple = tmsopt.roots.pattern("EP3", 5)
        >>> triple.unknowns, triple.codimension
        (('r', 'c1', 'c2'), 2)

    More: docs/explanation/exceptional_points.md
    """
    return _compose("".join(name.split()), degree)


def composition(name: str) -> list[tuple[str, int, int]]:
    """Components of a pattern as (kind, multiplicity, count). A kind is ``EP``, ``CEP`` or a name such as ``weave``.

    Example:
        >>> tmsopt.roots.composition("2EP2+CEP2")
        [('EP', 2, 2), ('CEP', 2, 1)]

    More: docs/explanation/exceptional_points.md
    """
    return [(c.kind, c.order, c.count) for c in parse_components("".join(name.split()))]


@cache
def _compose(name: str, degree: int) -> Pattern:
    components = parse_components(name)
    free_count = degree - sum(c.root_count for c in components)
    if free_count < 0:
        raise ValueError(f"'{name}' takes {degree - free_count} roots, and the polynomial has {degree}")
    name = _join_names(name)
    symbols = [u for c in components for u in c.unknowns]
    names = [f"{u}{symbols[: k + 1].count(u)}" if symbols.count(u) > 1 else u for k, u in enumerate(symbols)]
    free_names = [f"{'d' if 'c' in symbols else 'c'}{k}" for k in range(1, free_count + 1)]
    starts = accumulate((len(c.unknowns) for c in components), initial=0)
    component_slices = [
        (c, slice(start, start + len(c.unknowns))) for c, start in zip(components, starts, strict=False)
    ]

    def factors(u: Sequence[Any], omitted_kinds: Collection[str] = ()) -> list[list[Any]]:
        remainder = [[1, *u[len(symbols) :]]] if free_count else []
        return [f for c, s in component_slices if c.kind not in omitted_kinds for f in c.factors(u[s])] + remainder

    composed = Pattern(
        name=name,
        meaning=" and ".join(c.meaning for c in components) + (" and other roots" if free_count else ""),
        unknowns=(*names, *free_names),
        factors=factors,
        guesses=partial(_guess_unknowns, components, free_count),
        nonnegative=lambda u: [x for c, s in component_slices for x in c.nonnegative(u[s])],
        abscissa=None
        if free_count or len(components) > 1
        else _ABSCISSAE.get((components[0].kind, components[0].count)),
        rest=partial(factors, omitted_kinds=AXIS_ROOT_COUNTS)
        if any(c.kind in AXIS_ROOT_COUNTS for c in components)
        else None,
        test=_TESTS.get(name),
        marks=_find_marks(component_slices, free_count),
        ends={u: END_EVENTS[c.kind] for c in components for u in c.unknowns if u == "W"} if "W" in names else {},
        degree=degree,
    )
    return replace(composed, **(QUARTIC.get(name, {}) if degree == 4 else {}))


_ABSCISSAE: Mapping[tuple[str, int], Any] = {("EP", 1): lambda u: u[0], ("CEP", 1): lambda u: -u[0] / 2}
"""(Kind, count) of a pattern with one component and no free roots → largest real part of the roots."""

_TESTS: Mapping[str, Any] = {"capsize": lambda a: a[-1], "weave": weave_test, "EP2": double_root_test}
"""Pattern of codimension 1 → a function of the coefficients that changes sign across the set."""


def _find_marks(component_slices: Sequence[tuple[Component, slice]], free_count: int) -> dict[str, Any]:
    """Name of a more special pattern that a curve may pass → an expression of the unknowns that is 0 there."""
    marks: dict[str, Any] = {}
    roots = [(c, s.start) for c, s in component_slices if c.unknowns == ("r",)]
    for (first, j), (second, k) in combinations(roots, 2):
        remaining_names = [c.name for c, _ in component_slices if c not in (first, second)]
        marks[_join_names(f"EP{first.order + second.order}", *remaining_names)] = lambda u, j=j, k=k: u[j] - u[k]
    if len(component_slices) > 1:
        return marks
    ((component, unknown_slice),) = component_slices
    free_start = unknown_slice.stop
    if component.is_quadratic and len(component.unknowns) == 2:
        marks[f"EP{2 * component.order}"] = lambda u: u[0] * u[0] - 4 * u[1]
    if free_count and component.unknowns == ("r",):
        marks[f"EP{component.order + 1}"] = lambda u: evaluate([1, *u[free_start:]], u[0])
        marks["double zero" if component.order == 2 else f"{component.order}-fold zero"] = lambda u: u[0]
    if free_count and component.kind in ("EP", "CEP"):
        marks["capsize"] = lambda u: u[-1]
    if free_count and component.kind == "capsize":
        marks["double zero"] = lambda u: u[-1]
    if free_count > 1 and component.kind not in ("weave", "resonance"):
        name = "EP2" if component.kind == "capsize" else _join_names(component.name, "EP2")
        marks[name] = lambda u: double_root_test([1, *u[free_start:]])
    return marks


def _join_names(*names: str) -> str:
    """The name of several patterns together, in canonical order."""
    return "+".join(c.name for c in parse_components("+".join(names)))


def _guess_unknowns(components: tuple[Component, ...], free_count: int, z: Roots) -> list[list[float]]:
    """Guesses of the unknowns from choices of the roots z, nearest first; the free factor is found by least squares."""
    target = rebuilt(z)
    largest = np.abs(z).max()
    size = rebuilt(-np.abs(z) - 1e-3 * (largest if largest ** len(z) > 0 else 1.0))  # all roots may be 0
    mismatches: dict[tuple[float, ...], float] = {}
    for choice in islice(product(*(c.guesses(z) for c in components)), _MAX_CHOICES):
        factors = (f for c, u in zip(components, choice, strict=True) for f in c.factors(u))
        chosen_product = np.array(multiply_polynomials(*factors), dtype=float)
        columns = (
            np.stack([np.convolve(chosen_product, unit) for unit in np.eye(free_count + 1)], axis=1) / size[:, None]
        )
        free_coefficients = np.linalg.lstsq(columns[:, 1:], target / size - columns[:, 0], rcond=None)[0]
        mismatch = float(np.linalg.norm(columns[:, 0] + columns[:, 1:] @ free_coefficients - target / size))
        mismatches[(*(x for u in choice for x in u), *free_coefficients.tolist())] = mismatch
    return [list(u) for u in sorted(mismatches, key=mismatches.__getitem__)[:_MAX_GUESSES]]


PATTERNS: Mapping[str, Pattern] = MappingProxyType({name: pattern(name, 4) for name in QUARTIC})
"""Name → pattern of a quartic that is not composed of other patterns."""
