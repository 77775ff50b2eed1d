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
_LARGEST = 12  # largest multiplicity, and largest count

AXIS = {"weave": 2, "resonance": 4, "capsize": 1}
"""Patterns on the imaginary axis → number of their roots."""

_WORDS = {
    "weave": "a pair on the imaginary axis",
    "resonance": "a double imaginary pair (1:1 resonance)",
    "capsize": "a root at 0",
}

ENDS = {"weave": "the pair meets in a double root 0", "resonance": "both pairs meet in a 4-fold root 0"}
"""Pattern → event where W of s² + W reaches 0."""

NUMBERS = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"]
"""Numbers in words up to the highest degree."""


def count_in_words(count: int, noun: str) -> str:
    """A number of things in words: ``a real root``, ``two real roots``."""
    return f"a {noun}" if count == 1 else f"{NUMBERS[count]} {noun}s".replace("ys", "ies")


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
        if self.kind in AXIS:
            return self.kind
        return f"{self.count if self.count > 1 else ''}{self.kind}{self.order}"

    @property
    def meaning(self) -> str:
        """Description in words."""
        if self.kind in _WORDS:
            return _WORDS[self.kind]
        return count_in_words(self.count, f"{self.order}-fold {'real root' if self.kind == 'EP' else 'complex pair'}")

    @property
    def roots(self) -> int:
        """Number of roots."""
        return sum(len(factor) - 1 for factor in self.factors([0] * len(self.unknowns)))

    @property
    def is_quadratic(self) -> bool:
        """Whether its factors are s² + bs + c with a sign condition on b² − 4c: complex pairs or two real roots."""
        return self.kind == "CEP" or (self.kind == "EP" and self.count == 2)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknown coefficients of its factors."""
        if self.kind in AXIS:
            return () if self.kind == "capsize" else ("W",)
        if self.is_quadratic:
            return ("b", "c") * (self.count if self.kind == "CEP" else 1)
        return ("r",) * self.count

    def factors(self, u: Sequence[Any]) -> list[list[Any]]:
        """Its monic factors, each repeated by its multiplicity."""
        if self.kind == "capsize":
            return [[1, 0]]
        if self.kind in AXIS:
            return [[1, 0, u[0]]] * (AXIS[self.kind] // 2)
        if self.is_quadratic:
            return [[1, u[k], u[k + 1]] for k in range(0, len(u), 2)] * self.order
        return [[1, -r] for r in u] * self.order

    def nonnegative(self, u: Sequence[Any]) -> list[Any]:
        """Expressions of the unknowns that must be ≥ 0."""
        if not self.is_quadratic:
            return list(u) if self.kind in AXIS else []
        sign = 1 if self.kind == "EP" else -1
        return [sign * (u[k] * u[k] - 4 * u[k + 1]) for k in range(0, len(u), 2)]

    def guesses(self, z: Roots) -> list[list[float]]:
        """Guesses of the unknowns for numeric roots."""
        if self.kind == "capsize":
            return [[]]
        if self.kind in AXIS:  # W of s² + W for each pair, the nearest to the imaginary axis first
            near_axis_first = z[np.argsort(np.abs(z.real), kind="stable")]
            return [[c] for _, c in _pair_means(near_axis_first, AXIS[self.kind] // 2)]
        if self.kind == "CEP":
            pairs = combinations(_pair_means(z, self.order), self.count)
            return [[x for pair in choice for x in pair] for choice in pairs]
        choices = [list(choice) for choice in combinations(_real_means(z, self.order), self.count)]
        if self.count != 2:
            return choices
        return [quadratic(np.array(choice, dtype=complex)) for choice in choices] + _pair_means(z, self.order)


def parse_components(name: str) -> tuple[Component, ...]:
    """Components of the name of a pattern, each kind and order once; real roots and high multiplicities come first."""
    counts: Counter[tuple[str, int]] = Counter()
    axis = []
    for part in name.split("+"):
        match = _PART.fullmatch(part)
        if part in AXIS:
            axis.append(part)
        elif match is None or not 2 <= int(match["order"]) <= _LARGEST or int(match["count"] or 1) > _LARGEST:
            raise ValueError(f"'{name}' is no pattern")
        else:
            counts[match["kind"], int(match["order"])] += int(match["count"] or 1)
    if len(axis) > len(set(axis)):
        raise ValueError(f"'{name}' names {axis[0]} twice")
    ordered = sorted(counts.items(), key=lambda item: (item[0][0] != "EP", -item[0][1]))
    return (*(Component(kind, order, count) for (kind, order), count in ordered), *(Component(a, 1, 1) for a in axis))


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
    """The distinct values; a single value is returned twice, for two roots that coincide."""
    tolerance = 1e-12 * float(np.abs(z).max())
    distinct = [v for k, v in enumerate(values) if k == 0 or v - values[k - 1] > tolerance]
    return distinct if len(distinct) > 1 else distinct * 2
