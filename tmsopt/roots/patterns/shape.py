"""Factored forms of polynomials with given multiple roots, given roots on one vertical line, and free roots."""

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
        tied: whether it lies on the vertical line that all tied groups share.
    """

    multiplicity: int
    real: bool
    tied: bool = False

    @property
    def degree(self) -> int:
        """Number of roots."""
        return self.multiplicity * (1 if self.real else 2)


def join_group_names(names: Iterable[str], groups: Iterable[Group]) -> str:
    """Join the names of multiple roots and the names of the simple pairs and real roots among the groups."""
    are_real = [g.real for g in groups if g.multiplicity == 1]
    count = are_real.count(False)
    pairs = ["pair"] if count == 1 else [f"{NUMBERS[count]} pairs"] if count else []
    return "+".join([*names, *pairs, *["real"] * are_real.count(True)])


_KINDS = {(True, True): "", (True, False): "r", (False, True): "W", (False, False): "bc"}
"""Whether a group is real and tied → its unknowns."""


@dataclass(frozen=True)
class Shape:
    """A set of polynomials: given groups of roots, and a monic factor of degree `rest_degree` with free coefficients.

    The unknowns are, in order:

    - the real part g of the line, if a group is tied to it;
    - for each group: r of s − r (real, not tied), nothing (real, tied), b and c of s² + b s + c (pair, not tied), or W
      of (s − g)² + W (pair, tied);
    - the coefficients of the factor with free coefficients.
    """

    groups: tuple[Group, ...]
    rest_degree: int

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return sum(g.degree for g in self.groups) + self.rest_degree

    @cached_property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns, with the number of the group if several groups have an unknown of that name."""
        each = [(kind, k) for k, g in enumerate(self.groups) for kind in _KINDS[g.real, g.tied]]
        kinds = [kind for kind, _ in each]
        names = (kind if kinds.count(kind) == 1 else f"{kind}{k}" for kind, k in each)
        return (*["g"] * self._has_line, *names, *(f"d{k}" for k in range(1, self.rest_degree + 1)))

    @property
    def conditions(self) -> int:
        """Codimension: number of coefficients minus number of unknowns."""
        return self.degree - len(self.unknowns)

    @property
    def _has_line(self) -> bool:
        return True in [g.tied for g in self.groups]

    def group_factors(self, unknowns: Sequence[Any]) -> list[list[Any]]:
        """One monic factor for each group."""
        values = iter(unknowns)
        g: Any = next(values) if self._has_line else None
        factors: list[list[Any]] = []
        for group in self.groups:
            if group.real:
                factors.append([1, -(g if group.tied else next(values))])
            elif group.tied:
                factors.append([1, -2 * g, g * g + next(values)])
            else:
                factors.append([1, next(values), next(values)])
        return factors

    def rest_factor(self, unknowns: Sequence[Any]) -> list[Any]:
        """The monic factor with free coefficients."""
        return [1, *list(unknowns)[len(unknowns) - self.rest_degree :]]

    def factors(self, unknowns: Sequence[Any]) -> list[list[Any]]:
        """All factors, each repeated by its multiplicity."""
        each = zip(self.group_factors(unknowns), self.groups, strict=True)
        repeated = [f for f, g in each for _ in range(g.multiplicity)]
        return [*repeated, self.rest_factor(unknowns)] if self.rest_degree else repeated

    def monic(self, unknowns: Sequence[Any]) -> list[Any]:
        """Coefficients of the product of all factors, descending from 1."""
        return product(*self.factors(unknowns))

    def start(self, places: Sequence[complex], rest_factor: Sequence[Any]) -> list[Any]:
        """Unknowns for one root of each group (the upper root of a pair) and the factor with free coefficients."""
        line_parts = [z.real for z, g in zip(places, self.groups, strict=True) if g.tied for _ in range(g.degree)]
        unknowns: list[Any] = [sum(line_parts) / len(line_parts)] if line_parts else []
        for z, group in zip(places, self.groups, strict=True):
            if group.tied:
                unknowns += [] if group.real else [z.imag**2]
            else:
                unknowns += [z.real] if group.real else [-2 * z.real, abs(z) ** 2]
        return [*unknowns, *list(rest_factor)[1:]]

    def gaps(self, unknowns: Sequence[Any]) -> list[Any]:
        """The squared imaginary part of each pair, positive if the pair is complex."""
        factors = zip(self.group_factors(unknowns), self.groups, strict=True)
        return [f[2] - f[1] * f[1] / 4 for f, g in factors if not g.real]
