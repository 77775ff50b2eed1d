"""What a pattern is made of: multiple roots of one kind and order, or roots tied to the imaginary axis."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from tmsopt.roots.patterns.pattern import Roots, quadratic

_PART = re.compile(r"(?P<count>[1-9]\d*)?(?P<kind>C?EP)(?P<order>[1-9]\d*)")
_LARGEST = 12

AXIS = {"weave": 2, "resonance": 4, "capsize": 1}
"""Patterns of the imaginary axis → roots that they take."""

_WORDS = {
    "weave": "a pair on the imaginary axis",
    "resonance": "a double imaginary pair (1:1 resonance)",
    "capsize": "a root at 0",
}

ENDS = {"weave": "the pair meets in a double root 0", "resonance": "both pairs meet in a 4-fold root 0"}
"""What happens where W of s² + W reaches 0."""

NUMBERS = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"]
"""Numbers up to the highest degree, in words."""


def several(count: int, what: str) -> str:
    """One or more things of a kind: a real root, two real roots."""
    return f"a {what}" if count == 1 else f"{NUMBERS[count]} {what}s".replace("ys", "ies")


def times(order: int) -> str:
    """A multiplicity in words."""
    return {2: "double", 3: "triple"}.get(order, f"{order}-fold")


@dataclass(frozen=True)
class Component:
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
        """As in the name of a pattern."""
        if self.kind in AXIS:
            return self.kind
        return f"{self.count if self.count > 1 else ''}{self.kind}{self.order}"

    @property
    def meaning(self) -> str:
        """In words."""
        if self.kind in _WORDS:
            return _WORDS[self.kind]
        return several(self.count, f"{self.order}-fold {'real root' if self.kind == 'EP' else 'complex pair'}")

    @property
    def roots(self) -> int:
        """How many it takes."""
        if self.kind in AXIS:
            return AXIS[self.kind]
        return self.count * self.order * (2 if self.kind == "CEP" else 1)

    @property
    def in_quadratics(self) -> bool:
        """Whether s² + bs + c with a sign of b² − 4c states it: complex pairs, and two real roots that may meet."""
        return self.kind == "CEP" or (self.kind == "EP" and self.count == 2)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknown coefficients of its factors."""
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
        """Its monic factors, each as often as its multiplicity says."""
        match self.kind:
            case "capsize":
                return [[1, 0]]
            case "weave" | "resonance":
                return [[1, 0, u[0]]] * (AXIS[self.kind] // 2)
        if self.in_quadratics:
            return [[1, u[k], u[k + 1]] for k in range(0, len(u), 2)] * self.order
        return [[1, -r] for r in u] * self.order

    def nonnegative(self, u: Sequence[Any]) -> list[Any]:
        """Expressions of the unknowns that must be ≥ 0."""
        if self.kind in ("weave", "resonance"):
            return [u[0]]
        if not self.in_quadratics:
            return []
        sign = 1 if self.kind == "EP" else -1
        return [sign * (u[k] * u[k] - 4 * u[k + 1]) for k in range(0, len(u), 2)]

    def guesses(self, z: Roots) -> list[list[float]]:
        """Unknowns to start from, for numeric roots."""
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


def parse_components(name: str) -> tuple[Component, ...]:
    """The parts of a name, each kind and order once, real roots first and the highest multiplicity first."""
    counted: Counter[tuple[str, int]] = Counter()
    axis = []
    for part in name.split("+"):
        match = _PART.fullmatch(part)
        if part in AXIS:
            axis.append(part)
        elif match is None or not 2 <= int(match["order"]) <= _LARGEST or int(match["count"] or 1) > _LARGEST:
            raise ValueError(f"'{name}' is no pattern")
        else:
            counted[match["kind"], int(match["order"])] += int(match["count"] or 1)
    if len(axis) > len(set(axis)):
        raise ValueError(f"'{name}' names {axis[0]} twice")
    ordered = sorted(counted.items(), key=lambda item: (item[0][0] != "EP", -item[0][1]))
    return (*(Component(kind, order, count) for (kind, order), count in ordered), *(Component(a, 1, 1) for a in axis))


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
