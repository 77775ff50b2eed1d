"""Explain an optimum: optimality, what each limit costs, what rounding does, warnings.

In: a solution. Out: an `Explanation` as data; `tmsopt.report` has its words. Open `explain` first.
"""

from tmsopt.explanation.explain import Explanation, explain
from tmsopt.explanation.limits import moved
from tmsopt.explanation.optimality import NOT_COVERED, NOT_MINIMAL, STRICT, UNDECIDED, Optimality, optimality
from tmsopt.explanation.rounding import rounded
from tmsopt.explanation.steps import natural_step, step_within

__all__ = [
    "NOT_COVERED", "NOT_MINIMAL", "STRICT", "UNDECIDED", "Explanation", "Optimality", "explain", "moved",
    "natural_step", "optimality", "rounded", "step_within",
]  # fmt: skip
