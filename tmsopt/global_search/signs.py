"""Proves by signs that no design is stable: if all roots lie left of the axis, all coefficients have the same sign."""

from collections import deque

import numpy as np

from tmsopt.algebra.formula import UnsupportedOperation, formula, symbol
from tmsopt.algebra.intervals import ranges
from tmsopt.problem.problem import Posed
from tmsopt.roots import hurwitz_minors

_MAX_BOXES = 300  # parts of the box that are tested; if these do not decide, branch and bound must


def has_no_stable_design(problem: Posed) -> bool:
    """Whether interval arithmetic proves that no design of the box is stable, even without the constraints.

    In each part of the box two coefficients differ in sign, or a coefficient and the Hurwitz determinant differ in sign
    (for degree 3 or 4). False for a problem with several cases or nothing free.
    """
    if problem.cases or not problem.free:
        return False
    a = problem.model.coefficients(problem.ordered({n: symbol(n) for n in problem.free}), problem.parameter_set)
    n = len(a) - 1
    # If all roots lie left of the axis, Δ2 a0 (degree 3) or Δ3 (degree 4) has the sign of the coefficients.
    minors = [hurwitz_minors(a)[n - 2] * (a[0] if n == 3 else 1)] if n in (3, 4) else []
    tests = formula([*a, *minors], problem.free)
    open_boxes = deque([[(lo, hi) for lo, hi in problem.free.values()]])
    widths = np.array([hi - lo for lo, hi in problem.free.values()])
    for _ in range(_MAX_BOXES):
        if not open_boxes:
            return True
        box = open_boxes.popleft()
        try:
            ends = np.array(ranges(tests, box))
        except UnsupportedOperation:
            return False
        if (ends[:, 0] > 0).any() and (ends[:, 1] < 0).any():
            continue
        k = int(np.argmax(np.array([hi - lo for lo, hi in box]) / widths))
        lo, hi = box[k]
        middle = lo + (hi - lo) / 2
        open_boxes += [[*box[:k], part, *box[k + 1 :]] for part in ((lo, middle), (middle, hi))]
    return not open_boxes
