"""Polynomials with certain multiple roots, certain roots on one vertical line, and others free, as factored forms."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tmsopt.roots.patterns.components import NUMBERS
from tmsopt.roots.polynomial import product


@dataclass(frozen=True)
class Group:
    """A real root or a complex pair with its multiplicity.

    Attributes:
        tied: whether it stands on the vertical line that all tied ones share.
    """

    multiplicity: int
    real: bool
    tied: bool = False

    @property
    def degree(self) -> int:
        """Number of roots."""
        return self.multiplicity * (1 if self.real else 2)


def with_simple(names: Iterable[str], groups: Iterable[Group]) -> str:
    """Names of multiple roots joined, with those of the simple pairs and the simple real roots among groups."""
    simple = [g.real for g in groups if g.multiplicity == 1]
    pairs = simple.count(False)
    several = ["pair"] if pairs == 1 else [f"{NUMBERS[pairs]} pairs"] if pairs else []
    return "+".join([*names, *several, *["real"] * simple.count(True)])


_KINDS = {(True, True): "", (True, False): "r", (False, True): "W", (False, False): "bc"}
"""Whether a group is real and tied → its unknowns."""


@dataclass(frozen=True)
class Shape:
    """A set of polynomials: the given groups, and a monic factor of degree `rest` with free coefficients.

    The unknowns are, in order: the real part g of the line if a group is tied; for each group nothing (real, tied), r
    of s − r (real), W of (s − g)² + W (a tied pair) or b, c of s² + b s + c (a pair); the coefficients of the rest.
    """

    groups: tuple[Group, ...]
    rest: int

    @property
    def degree(self) -> int:
        """Of the polynomials."""
        return sum(g.degree for g in self.groups) + self.rest

    @cached_property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns as in other patterns, numbered in groups only where there are several of a kind."""
        each = [(kind, k) for k, g in enumerate(self.groups) for kind in _KINDS[g.real, g.tied]]
        kinds = [kind for kind, _ in each]
        names = (kind if kinds.count(kind) == 1 else f"{kind}{k}" for kind, k in each)
        return (*["g"] * self._tied, *names, *(f"d{k}" for k in range(1, self.rest + 1)))

    @property
    def conditions(self) -> int:
        """Codimension: coefficients less unknowns."""
        return self.degree - len(self.unknowns)

    @property
    def _tied(self) -> bool:
        return True in [g.tied for g in self.groups]

    def group_factors(self, unknowns: Sequence[Any]) -> list[list[Any]]:
        """One monic factor for each group."""
        left = list(unknowns)
        g: Any = left.pop(0) if self._tied else None
        found: list[list[Any]] = []
        for group in self.groups:
            if group.real:
                found.append([1, -(g if group.tied else left.pop(0))])
            elif group.tied:
                found.append([1, -2 * g, g * g + left.pop(0)])
            else:
                found.append([1, left.pop(0), left.pop(0)])
        return found

    def rest_factor(self, unknowns: Sequence[Any]) -> list[Any]:
        """The monic factor with free coefficients."""
        return [1, *list(unknowns)[len(unknowns) - self.rest :]]

    def factors(self, unknowns: Sequence[Any]) -> list[list[Any]]:
        """All factors, each as often as its multiplicity says."""
        each = zip(self.group_factors(unknowns), self.groups, strict=True)
        repeated = [f for f, g in each for _ in range(g.multiplicity)]
        return [*repeated, self.rest_factor(unknowns)] if self.rest else repeated

    def monic(self, unknowns: Sequence[Any]) -> list[Any]:
        """Coefficients of the product of all factors, descending from 1."""
        return product(*self.factors(unknowns))

    def start(self, places: Sequence[complex], rest: Sequence[Any]) -> list[Any]:
        """Unknowns for one root of each group, that of a pair in the upper half-plane, and the rest's coefficients."""
        tied = [z.real for z, g in zip(places, self.groups, strict=True) if g.tied for _ in range(g.degree)]
        found: list[Any] = [sum(tied) / len(tied)] if tied else []
        for z, group in zip(places, self.groups, strict=True):
            if group.tied:
                found += [] if group.real else [z.imag**2]
            else:
                found += [z.real] if group.real else [-2 * z.real, abs(z) ** 2]
        return [*found, *list(rest)[1:]]

    def gaps(self, unknowns: Sequence[Any]) -> list[Any]:
        """The squared imaginary part of each pair: positive where the pair is complex."""
        factors = zip(self.group_factors(unknowns), self.groups, strict=True)
        return [f[2] - f[1] * f[1] / 4 for f, g in factors if not g.real]
