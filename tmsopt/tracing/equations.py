"""How large the coefficients of a problem are over its box, so that no unit of time or mass matters."""

from dataclasses import dataclass
from itertools import islice

import numpy as np

from tmsopt.design.problem import Problem
from tmsopt.formulation.starts import spread
from tmsopt.records import Array

_SAMPLE = 32  # designs by which sizes are judged

_VANISHED = 1e-9


@dataclass(frozen=True)
class Sizes:
    """Median sizes of the coefficients over the box; 0 of one that is mostly 0 there."""

    of: Array

    def leads(self, a: Array) -> bool:
        """Whether a0 is there at all, beside the others: at a0 = a1 = … = 0 any factors fit."""
        known = self.of > 0
        share = np.abs(a[known]) / self.of[known]
        return bool(abs(a[0]) > _VANISHED * self.of[0] * share.max(initial=0.0))


def sizes(problem: Problem) -> Sizes:
    """Sizes of the coefficients over the box of the free parameters."""
    designs = islice(spread(problem, 0), _SAMPLE)
    a = np.array([[float(c) for c in problem.values(problem.ordered(d)).coefficients] for d in designs])
    a = np.abs(a[np.all(np.isfinite(a), axis=1)])
    return Sizes(np.median(a, axis=0) if len(a) else np.zeros(problem.model.degree + 1))
