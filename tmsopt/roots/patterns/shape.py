"""Factored forms of polynomials with given multiple roots, given roots on one vertical line, and free roots."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tmsopt.roots.patterns.components import NUMBER_WORDS
from tmsopt.roots.polynomial import product


@dataclass(frozen=True)
class Group:
    """A real root or a complex pair with its multiplicity.

    Attributes:
        is_real: whether it is a real root.
        is_tied: whether it lies on the vertical line that all tied groups share.
    """

    multiplicity: int
    is_real: bool
    is_tied: bool = False

    @property
    def degree(self) -> int:
        """Number of roots."""
        return self.multiplicity * (1 if self.is_real else 2)


def join_group_names(names: Iterable[str], groups: Iterable[Group]) -> str:
    """Join the names of multiple roots and the names of the simple pairs and real roots among the groups."""
    simple_are_real = [g.is_real for g in groups if g.multiplicity == 1]
    count = simple_are_real.count(False)
    number = NUMBER_WORDS[count] if count < len(NUMBER_WORDS) else count
    pairs = ["pair"] if count == 1 else [f"{number} pairs"] if count else []
    return "+".join([*names, *pairs, *["real"] * simple_are_real.count(True)])


_KINDS = {(True, True): "", (True, False): "r", (False, True): "W", (False, False): "bc"}
"""(Whether a group is real, whether it is tied) → letters of its unknowns."""


@dataclass(frozen=True)
class Shape:
    """A set of polynomials: given groups of roots, and a monic factor of degree `rest_degree` with free coefficients.

    The unknowns are, in order:

    - the real part g of the vertical line, if a group is tied to it;
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
        numbered_kinds = [(kind, k) for k, g in enumerate(self.groups) for kind in _KINDS[g.is_real, g.is_tied]]
        kinds = [kind for kind, _ in numbered_kinds]
        names = (kind if kinds.count(kind) == 1 else f"{kind}{k}" for kind, k in numbered_kinds)
        return (*["g"] * self._has_line, *names, *(f"d{k}" for k in range(1, self.rest_degree + 1)))

    @property
    def conditions(self) -> int:
        """Codimension: number of coefficients minus number of unknowns."""
        return self.degree - len(self.unknowns)

    @property
    def _has_line(self) -> bool:
        return True in [g.is_tied for g in self.groups]

    def group_factors(self, unknowns: Sequence[Any]) -> list[list[Any]]:
        """One monic factor for each group."""
        values = iter(unknowns)
        g: Any = next(values) if self._has_line else None
        factors: list[list[Any]] = []
        for group in self.groups:
            if group.is_real:
                factors.append([1, -(g if group.is_tied else next(values))])
            elif group.is_tied:
                factors.append([1, -2 * g, g * g + next(values)])
            else:
                factors.append([1, next(values), next(values)])
        return factors

    def rest_factor(self, unknowns: Sequence[Any]) -> list[Any]:
        """The monic factor with free coefficients."""
        return [1, *list(unknowns)[len(unknowns) - self.rest_degree :]]

    def factors(self, unknowns: Sequence[Any]) -> list[list[Any]]:
        """All factors, each as often as its multiplicity."""
        multiplied = zip(self.group_factors(unknowns), self.groups, strict=True)
        repeated = [f for f, g in multiplied for _ in range(g.multiplicity)]
        return [*repeated, self.rest_factor(unknowns)] if self.rest_degree else repeated

    def monic(self, unknowns: Sequence[Any]) -> list[Any]:
        """Coefficients of the product of all factors, descending from 1."""
        return product(*self.factors(unknowns))

    def initial_unknowns(self, group_roots: Sequence[complex], rest_factor: Sequence[Any]) -> list[Any]:
        """Unknowns for given roots: one root of each group (the upper root of a pair), and the factor of the others."""
        line_parts = [
            z.real for z, g in zip(group_roots, self.groups, strict=True) if g.is_tied for _ in range(g.degree)
        ]
        unknowns: list[Any] = [sum(line_parts) / len(line_parts)] if line_parts else []
        for z, group in zip(group_roots, self.groups, strict=True):
            if group.is_tied:
                unknowns += [] if group.is_real else [z.imag**2]
            else:
                unknowns += [z.real] if group.is_real else [-2 * z.real, abs(z) ** 2]
        return [*unknowns, *list(rest_factor)[1:]]

    def squared_heights(self, unknowns: Sequence[Any]) -> list[Any]:
        """The squared imaginary part of each pair, positive if the pair is complex."""
        factors = zip(self.group_factors(unknowns), self.groups, strict=True)
        return [f[2] - f[1] * f[1] / 4 for f, g in factors if not g.is_real]
