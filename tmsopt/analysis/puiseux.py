"""Computes how a multiple root splits under a small change: leading terms of Puiseux series, by Newton's polygon."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import gcd

import numpy as np
from numpy.typing import NDArray

from tmsopt.deprecated import rename_attribute

_SAME_COEFFICIENT = 1e-9  # relative difference of coefficients up to which a polynomial is a power of a linear one


@dataclass(frozen=True)
class Branches:
    """Roots s0 + t that leave a multiple root s0 by one law: t^denominator = constant · ε^numerator, to leading order.

    Attributes:
        roots: number of roots.
        constants: one constant for each group of `denominator` roots.
    """

    roots: int
    numerator: int
    denominator: int
    constants: tuple[complex, ...]

    @property
    def exponent(self) -> Fraction:
        """Exponent of ε."""
        return Fraction(self.numerator, self.denominator)

    size = rename_attribute("size", "prefactor")

    @property
    def prefactor(self) -> float:
        """The largest |t| divided by |ε| to the exponent."""
        return float(max(abs(c) for c in self.constants) ** (1 / self.denominator))

    def shifts(self, eps: float) -> list[complex]:
        """All t for a real ε, to leading order."""
        shifts: list[complex] = []
        for constant in self.constants:
            one_shift = (complex(constant) * eps**self.numerator) ** (1 / self.denominator)
            shifts += [one_shift * np.exp(2j * np.pi * k / self.denominator) for k in range(self.denominator)]
        return shifts


def find_branches(terms: Sequence[Sequence[complex]]) -> tuple[tuple[Branches, ...], int]:
    """Branches of Σ terms[m][j] ε^m t^j = 0 that start at t = 0, the fastest first, and the number of unmoved roots.

    The largest j is the multiplicity, and terms[0][j] is 0 for all smaller j. Zeros must be exact. Roots that do not
    move in the given orders of ε count as unmoved.
    """
    k = len(terms[0]) - 1
    lowest_orders = {j: next((m for m, row in enumerate(terms) if row[j] != 0), None) for j in range(k + 1)}
    points = [(j, m) for j, m in lowest_orders.items() if m is not None]
    hull: list[tuple[int, int]] = []
    for j, m in points:  # lower convex hull from left to right
        while len(hull) > 1 and _compute_slope(hull[-2], hull[-1]) >= _compute_slope(hull[-2], (j, m)):
            hull.pop()
        hull.append((j, m))
    branches = []
    for (j1, m1), (j2, m2) in pairwise(hull):
        width, drop = j2 - j1, m1 - m2
        q = width // gcd(width, drop)
        polynomial = [complex(terms[m1 - i * q * drop // width][j1 + i * q]) for i in reversed(range(width // q + 1))]
        branches.append(Branches(width, drop * q // width, q, _find_edge_roots(np.array(polynomial))))
    return tuple(sorted(branches, key=lambda b: b.exponent)), hull[0][0] if hull else k


def _find_edge_roots(polynomial: NDArray[np.complex128]) -> tuple[complex, ...]:
    """Roots of the polynomial of an edge; if it is the power of a linear polynomial, the mean of its roots, k times."""
    k = len(polynomial) - 1
    mean = -polynomial[1] / (k * polynomial[0])
    power = polynomial[0] * np.poly(np.full(k, mean))
    terms = np.abs(polynomial[0]) * np.poly(np.full(k, -np.abs(mean)))
    if np.all(np.abs(power - polynomial) <= _SAME_COEFFICIENT * terms):
        return (complex(mean),) * k
    return tuple(complex(z) for z in np.roots(polynomial))


def _compute_slope(a: tuple[int, int], b: tuple[int, int]) -> Fraction:
    return Fraction(b[1] - a[1], b[0] - a[0])
