"""Components of patterns: multiple roots of one kind and order, or roots on the imaginary axis."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from tmsopt.roots.patterns.pattern import Roots, quadratic

_PART = re.compile(r"(?P<count>[1-9]\d*)?(?P<kind>C?EP)(?P<order>[1-9]\d*)")
_MAX_LISTED = 12  # higher multiplicities are not listed, except the highest
_MAX_NUMBER = 100  # largest multiplicity, and largest number of multiple roots of one kind

AXIS_ROOT_COUNTS = {"weave": 2, "resonance": 4, "capsize": 1}
"""Patterns on the imaginary axis → number of their roots."""

_WORDS = {
    "weave": "a pair on the imaginary axis",
    "resonance": "a double imaginary pair (1:1 resonance)",
    "capsize": "a root at 0",
}

END_EVENTS = {"weave": "the pair meets in a double root 0", "resonance": "both pairs meet in a 4-fold root 0"}
"""Pattern → name of the event at which W of its factor s² + W reaches 0."""

NUMBER_WORDS = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"]
"""Numbers in words up to the highest degree."""


def count_in_words(count: int, noun: str) -> str:
    """A number of things in words: ``a real root``, ``two real roots``."""
    number = NUMBER_WORDS[count] if count < len(NUMBER_WORDS) else count
    return f"a {noun}" if count == 1 else f"{number} {noun}s".replace("ys", "ies")


def multiplicities(largest: int) -> list[int]:
    """The multiplicities whose patterns are listed, the highest first: all, or the lowest and the highest of many."""
    return [k for k in range(largest, 1, -1) if k in (largest, *range(2, _MAX_LISTED + 1))]


def multiplicity_in_words(order: int) -> str:
    """A multiplicity in words: ``double``, ``triple``, ``4-fold``."""
    return {2: "double", 3: "triple"}.get(order, f"{order}-fold")


@dataclass(frozen=True)
class Component:
    """Multiple roots of one kind and order, or a pattern on the imaginary axis.

    Attributes:
        kind: ``EP``, ``CEP``, ``weave``, ``resonance`` or ``capsize``.
        order: multiplicity of each root.
        count: number of such roots or pairs.
    """

    kind: str
    order: int
    count: int

    @property
    def name(self) -> str:
        """Name as in the name of a pattern."""
        if self.kind in AXIS_ROOT_COUNTS:
            return self.kind
        return f"{self.count if self.count > 1 else ''}{self.kind}{self.order}"

    @property
    def meaning(self) -> str:
        """Description in words."""
        if self.kind in _WORDS:
            return _WORDS[self.kind]
        return count_in_words(self.count, f"{self.order}-fold {'real root' if self.kind == 'EP' else 'complex pair'}")

    @property
    def root_count(self) -> int:
        """Number of roots."""
        return sum(len(factor) - 1 for factor in self.factors([0] * len(self.unknowns)))

    @property
    def is_quadratic(self) -> bool:
        """Whether the factors are s² + bs + c, where b² − 4c has a sign: complex pairs, or two real roots."""
        return self.kind == "CEP" or (self.kind == "EP" and self.count == 2)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknown coefficients of the factors."""
        if self.kind in AXIS_ROOT_COUNTS:
            return () if self.kind == "capsize" else ("W",)
        if self.is_quadratic:
            return ("b", "c") * (self.count if self.kind == "CEP" else 1)
        return ("r",) * self.count

    def factors(self, u: Sequence[Any]) -> list[list[Any]]:
        """The monic factors, each as often as its multiplicity, for given unknowns."""
        if self.kind == "capsize":
            return [[1, 0]]
        if self.kind in AXIS_ROOT_COUNTS:
            return [[1, 0, u[0]]] * (AXIS_ROOT_COUNTS[self.kind] // 2)
        if self.is_quadratic:
            return [[1, u[k], u[k + 1]] for k in range(0, len(u), 2)] * self.order
        return [[1, -r] for r in u] * self.order

    def nonnegative(self, u: Sequence[Any]) -> list[Any]:
        """Expressions of the unknowns that must be ≥ 0."""
        if not self.is_quadratic:
            return list(u) if self.kind in AXIS_ROOT_COUNTS else []
        sign = 1 if self.kind == "EP" else -1
        return [sign * (u[k] * u[k] - 4 * u[k + 1]) for k in range(0, len(u), 2)]

    def guesses(self, z: Roots) -> list[list[float]]:
        """Guesses of the unknowns, from the numeric roots z."""
        if self.kind == "capsize":
            return [[]]
        if self.kind in AXIS_ROOT_COUNTS:  # W of s² + W for each pair, the nearest to the imaginary axis first
            near_axis_first = z[np.argsort(np.abs(z.real), kind="stable")]
            return [[c] for _, c in _pair_means(near_axis_first, AXIS_ROOT_COUNTS[self.kind] // 2)]
        if self.kind == "CEP":
            pairs = combinations(_pair_means(z, self.order), self.count)
            return [[x for pair in choice for x in pair] for choice in pairs]
        choices = [list(choice) for choice in combinations(_real_means(z, self.order), self.count)]
        if self.count != 2:
            return choices
        return [quadratic(np.array(choice, dtype=complex)) for choice in choices] + _pair_means(z, self.order)


def parse_components(name: str) -> tuple[Component, ...]:
    """Components of the name of a pattern, each kind and order once; real roots and high multiplicities come first.

    Raises:
        ValueError: if the name is not the name of a pattern.
    """
    counts: Counter[tuple[str, int]] = Counter()
    axis_names = []
    for part in name.split("+"):
        match = _PART.fullmatch(part)
        if part in AXIS_ROOT_COUNTS:
            axis_names.append(part)
        elif match is None or not 2 <= int(match["order"]) <= _MAX_NUMBER or int(match["count"] or 1) > _MAX_NUMBER:
            raise ValueError(f"'{name}' is no pattern")
        else:
            counts[match["kind"], int(match["order"])] += int(match["count"] or 1)
    if len(axis_names) > len(set(axis_names)):
        raise ValueError(f"'{name}' names {axis_names[0]} twice")
    ordered = sorted(counts.items(), key=lambda item: (item[0][0] != "EP", -item[0][1]))
    return (
        *(Component(kind, order, count) for (kind, order), count in ordered),
        *(Component(a, 1, 1) for a in axis_names),
    )


def _real_means(z: Roots, order: int) -> list[float]:
    """For each root, the mean real part of the `order` roots that are nearest to its real part."""
    nearest = (z[np.argsort(np.abs(z - x), kind="stable")[:order]] for x in z.real)
    return _remove_repetitions(sorted(float(roots.real.mean()) for roots in nearest), z)


def _pair_means(z: Roots, order: int) -> list[list[float]]:
    """For each root in the upper half-plane, b and c of s² + bs + c for the mean of the `order` roots nearest to it."""
    upper = z[z.imag >= 0]
    pairs: list[list[float]] = []
    for root in upper:
        mean = upper[np.argsort(np.abs(upper - root), kind="stable")[:order]].mean()
        pair = [float(-2 * mean.real), float(abs(mean) ** 2)]
        if pair not in pairs:
            pairs.append(pair)
    return pairs


def _remove_repetitions(values: list[float], z: Roots) -> list[float]:
    """The distinct values in a sorted list. A single distinct value is returned twice: two roots may coincide there."""
    tolerance = 1e-12 * float(np.abs(z).max())
    distinct = [v for k, v in enumerate(values) if k == 0 or v - values[k - 1] > tolerance]
    return distinct if len(distinct) > 1 else distinct * 2
