"""How large the coefficients of a problem are over its box, so that no unit of time or mass matters."""

import math
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from tmsopt.design.problem import Problem
from tmsopt.design.starts import spread
from tmsopt.roots import rebuilt, roots
from tmsopt.roots.patterns import mean_size

Array = NDArray[np.float64]

_SAMPLE = 32  # designs by which sizes are judged

_EVEN = 12  # coefficients from 2⁻¹² to 2¹² are of one size: equations keep their digits


@dataclass(frozen=True)
class Sizes:
    """Medians over the box.

    Attributes:
        coefficients: |aₖ|; 0 of one that is 0 there.
        terms: size of the terms that aₖ is made of, a power of 2, by which a division rounds nothing.
        rate: likewise of the roots. Where all terms are of one size this and they are 1.
    """

    coefficients: Array
    terms: Array
    rate: float

    def leads(self, a: Array) -> bool:
        """Whether a0 is there at all, beside the others: at a0 = a1 = … = 0 any factors fit."""
        known = self.coefficients > 0
        share = np.abs(a)[known] / self.coefficients[known]
        return bool(abs(a[0]) > _VANISHED * self.coefficients[0] * share.max(initial=0.0))


_VANISHED = 1e-9


def sizes(problem: Problem) -> Sizes:
    """Sizes of the coefficients over the box of the free parameters."""
    n = problem.model.degree
    found = []
    for design in islice(spread(problem, 0), _SAMPLE):
        a = np.array([float(c) for c in problem.values(problem.ordered(design)).coefficients])
        if a[0] and np.all(np.isfinite(a)):
            terms = np.abs(a[0]) * rebuilt(-np.abs(roots(a)).astype(complex))
            found.append([*np.abs(a), *terms, mean_size(a / a[0])])
    middle = np.median(found, axis=0) if found else np.ones(2 * n + 3)
    exponents = [_exponent(x) for x in middle[n + 1 :]]
    if max(abs(e) for e in exponents[:-1]) <= _EVEN:
        exponents = [0] * len(exponents)
    powers = 2.0 ** np.array(exponents)
    return Sizes(np.asarray(middle[: n + 1]), powers[:-1], float(powers[-1]))


def _exponent(x: float) -> int:
    return round(math.log2(x)) if x > 0 else 0
