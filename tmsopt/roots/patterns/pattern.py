"""Root patterns as products of monic factors with unknown coefficients, and the special forms for quartics.

``p(s) = a0 · product(factors(unknowns))`` is a smooth system in the parameters and the unknowns. It is regular even
where the roots are not.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from math import comb
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tmsopt.deprecated import rename_attribute
from tmsopt.roots.polynomial import product
from tmsopt.roots.stability import hurwitz_minors

Roots = NDArray[np.complex128]

_NAME_TYPE = "<U32"

_GENERIC_VALUES = tuple(p**0.5 for p in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37))
"""Values of the unknowns that have no rational relation, so that only identical factors have equal coefficients."""


@dataclass(frozen=True)
class Pattern:
    """A set of polynomials given by a factored form.

    Attributes:
        name: the name in a problem file.
        meaning: a description of one line.
        unknowns: names of the unknown factor coefficients.
        factors: function of the unknowns that gives the monic factors, for numbers of any kind.
        guesses: function of numeric roots that gives starting values of the unknowns.
        nonnegative: function of the unknowns that gives expressions that must be ≥ 0.
        abscissa: function of the unknowns that gives the largest real part of the roots; None if it is not smooth.
        rest: function of the unknowns that gives the factors without fixed roots on the imaginary axis; by default all
            factors.
        test: for codimension 1, a function of the coefficients that changes sign across the set; nan where it has no
            meaning.
        marks: name of a more special pattern → expression of the unknowns that is 0 on it.
        ends: unknown → event where it reaches 0 and the pattern ends.
        degree: degree of the polynomials.
        real_name: for a pattern of a complex matrix, the name of the same pattern of the real system of twice the size.

    Example:
        >>> tmsopt.roots.pattern("EP3", 4).monic([-1, -2])  # (s + 1)³ (s + 2)
        [1, 5, 9, 7, 2]

    More: docs/explanation/factors.md
    """

    name: str
    meaning: str
    unknowns: tuple[str, ...]
    factors: Callable[[Sequence[Any]], list[list[Any]]]
    guesses: Callable[[Roots], list[list[float]]]
    nonnegative: Callable[[Sequence[Any]], list[Any]] = lambda u: []
    abscissa: Callable[[Sequence[Any]], Any] | None = None
    rest: Callable[[Sequence[Any]], list[list[Any]]] | None = None
    test: Callable[[Sequence[Any]], Any] | None = None
    marks: Mapping[str, Callable[[Sequence[Any]], Any]] = field(default_factory=dict)
    ends: Mapping[str, str] = field(default_factory=dict)
    degree: int = 4
    real_name: str = ""

    @property
    def form(self) -> str:
        """Name of the pattern of the real polynomial with these factors."""
        return self.real_name or self.name

    @property
    def codimension(self) -> int:
        """Number of conditions on the parameters: the degree minus the number of unknowns."""
        return self.degree - len(self.unknowns)

    @property
    def powers(self) -> tuple[int, ...]:
        """Dimension of each unknown as a power of a rate, such as 1 for a root or 2 for W."""
        base = self.monic([0] * len(self.unknowns))
        units = ([int(k == j) for j in range(len(self.unknowns))] for k in range(len(self.unknowns)))
        return tuple(next(k for k, (c, d) in enumerate(zip(self.monic(u), base, strict=True)) if c != d) for u in units)

    def scaled_unknowns(self, unknowns: Sequence[Any]) -> list[Any]:
        """The unknowns (arrays or numbers) in units of the size of the roots, independent of the unit of time."""
        size = mean_size(self.monic(unknowns)) + 1e-300
        return [u / size**power for u, power in zip(unknowns, self.powers, strict=True)]

    def monic(self, unknowns: Sequence[Any]) -> list[Any]:
        """Coefficients of the product of the factors, descending from 1."""
        return product(*self.factors(unknowns))

    def distinct_factors(self, unknowns: Sequence[Any]) -> list[tuple[list[Any], int]]:
        """The distinct factors for given unknowns, each with its multiplicity."""
        samples = [tuple(f) for f in self.factors(_GENERIC_VALUES[: len(self.unknowns)])]
        factors = self.factors(unknowns)
        return [(factors[samples.index(s)], samples.count(s)) for s in dict.fromkeys(samples)]

    counted = rename_attribute("counted", "distinct_factors")
    reduced = rename_attribute("reduced", "scaled_unknowns")
    remaining = rename_attribute("remaining", "remaining_factors")

    def remaining_factors(self, unknowns: Sequence[Any]) -> list[list[Any]]:
        """The factors whose roots must lie left of the imaginary axis if the pattern is stable or bounds stability."""
        return (self.rest or self.factors)(unknowns)

    def kind(self, unknowns: Sequence[Any]) -> NDArray[np.str_]:
        """Name of the pattern at each point. 2EP2 and CEP2 form one set; the sign of b² − 4c distinguishes them."""
        base_name = self.name.removeprefix("2").removeprefix("C")
        if self.real_name or self.name not in (f"2{base_name}", f"C{base_name}"):
            return np.full(np.shape(unknowns[0]), self.name, dtype=_NAME_TYPE)
        b, c = unknowns[:2]
        return np.where(b * b - 4 * c >= 0, f"2{base_name}", f"C{base_name}").astype(_NAME_TYPE)


def mean_size(monic: Sequence[Any]) -> NDArray[np.float64]:
    """Mean size of the roots: the largest of Maclaurin's means of the coefficients. For an n-fold root r it is |r|."""
    n = len(monic) - 1
    means = [(np.abs(monic[k]) / comb(n, k)) ** (1 / k) for k in range(1, n + 1)]
    return np.asarray(np.max(np.broadcast_arrays(*means), axis=0), dtype=float)


def quadratic(pair: Roots) -> list[float]:
    """p and q of s² + p s + q from its two roots."""
    return [float(-pair.sum().real), float(pair.prod().real)]


def _choose_two(roots: Roots) -> list[tuple[Roots, Roots]]:
    """Every choice of two roots that are real or conjugate, each with the array of the other roots."""
    indices = range(len(roots))
    choices = [(roots[list(c)], roots[[k for k in indices if k not in c]]) for c in combinations(indices, 2)]
    tolerance = 1e-9 * (np.abs(roots).max() + 1e-300)
    return [
        (a, b)
        for a, b in choices
        if abs(a.sum().imag) <= tolerance and abs(a.prod().imag) <= tolerance * np.abs(a).max()
    ]


def _double_quadratic_guess(roots: Roots) -> list[list[float]]:
    """b and c of (s² + bs + c)², from the sums of the roots and of their squares."""
    mean = roots.mean().real
    square = (roots**2).sum().real
    b = -2 * mean
    return [[b, (b * b - square / 2) / 2]]


def _triple_guesses(roots: Roots) -> list[list[float]]:
    simple_roots = roots[np.abs(roots.imag) <= 1e-2 * np.abs(roots) + 1e-300].real
    return [[(roots.sum().real - t) / 3, float(t)] for t in simple_roots] or [[float(roots.mean().real)] * 2]


def _pair_test(a: Sequence[Any]) -> Any:
    """The Hurwitz determinant Δ3. It is 0 where two roots add up to 0, and nan where these are real: W = a3/a1 ≤ 0."""
    return np.where(a[1] * a[3] > 0, hurwitz_minors(a)[2], np.nan)


QUARTIC: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "EP4": {"meaning": "4-fold real root", "guesses": lambda z: [[float(z.mean().real)]]},
        "EP3": {
            "meaning": "3-fold real root and a simple one",
            "unknowns": ("r", "t"),
            "factors": lambda u: [[1, -u[0]]] * 3 + [[1, -u[1]]],
            "guesses": _triple_guesses,
            "marks": {"EP4": lambda u: u[0] - u[1]},
        },
        "2EP2": {"meaning": "two real double roots", "guesses": _double_quadratic_guess},
        "CEP2": {"meaning": "a complex double pair", "guesses": _double_quadratic_guess},
        "EP2": {
            "meaning": "a real double root: the discriminant surface",
            "unknowns": ("r", "b", "c"),
            "guesses": lambda z: [[float(a.mean().real), *quadratic(b)] for a, b in _choose_two(z)],
            "marks": {
                "EP3": lambda u: u[0] * u[0] + u[1] * u[0] + u[2],
                "2EP2": lambda u: u[1] * u[1] - 4 * u[2],
                "double zero": lambda u: u[0],
                "capsize": lambda u: u[2],
            },
        },
        "weave": {
            "meaning": "a pair on the imaginary axis",
            "unknowns": ("W", "b", "c"),
            "guesses": lambda z: [[abs(float(a.prod().real)), *quadratic(b)] for a, b in _choose_two(z)],
            "test": _pair_test,
        },
        "capsize": {
            "meaning": "a root at 0",
            "unknowns": ("b", "c", "d"),
            "guesses": lambda z: [[float(x) for x in np.poly(z)[1:4].real]],
        },
        "resonance": {"guesses": lambda z: [[float(np.abs(z).mean()) ** 2]]},
    }
)
"""Pattern of a quartic that is not composed of other patterns → fields that differ from those of other degrees: direct
guesses, and shorter words and names."""
