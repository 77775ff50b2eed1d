"""No stable design, by signs: a polynomial has all roots left of the axis only where its coefficients have one sign."""

from collections import deque

import numpy as np

from tmsopt.algebra.formula import UnsupportedOperation, formula, symbol
from tmsopt.algebra.intervals import ranges
from tmsopt.problem.problem import Posed
from tmsopt.roots import hurwitz_minors

_BOXES = 300  # looked at, beyond which it is left to others


def none_stable(problem: Posed) -> bool:
    """Whether it is certain, by interval arithmetic alone, that no design of the box is stable, limits or not.

    In each part of the box two coefficients have different signs, or one and a Hurwitz determinant of degree 3 or 4. Of
    a problem with several cases nothing is said.
    """
    if problem.cases or not problem.free:
        return False
    a = problem.model.coefficients(problem.ordered({n: symbol(n) for n in problem.free}), problem.parameter_set)
    n = len(a) - 1
    # Δ2 a0 of degree 3 and Δ3 of degree 4 have the coefficients' sign where all roots are left of the axis.
    minors = [hurwitz_minors(a)[n - 2] * (a[0] if n == 3 else 1)] if n in (3, 4) else []
    tests = formula([*a, *minors], problem.free)
    left = deque([[(lo, hi) for lo, hi in problem.free.values()]])
    widths = np.array([hi - lo for lo, hi in problem.free.values()])
    for _ in range(_BOXES):
        if not left:
            return True
        box = left.popleft()
        try:
            ends = np.array(ranges(tests, box))
        except UnsupportedOperation:
            return False
        if (ends[:, 0] > 0).any() and (ends[:, 1] < 0).any():
            continue
        k = int(np.argmax(np.array([hi - lo for lo, hi in box]) / widths))
        lo, hi = box[k]
        middle = lo + (hi - lo) / 2
        left += [[*box[:k], part, *box[k + 1 :]] for part in ((lo, middle), (middle, hi))]
    return not left
