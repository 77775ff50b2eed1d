"""Searches from many starts as data: how they ended, and what that tells of optima that were not met.

In: numbers of searches, and of the different optima that they ended in. Out: estimates with a theory. Open `starts`.
"""

from tmsopt.problem.searches.starts import Starts, expected_unseen, expects_few_better

__all__ = ["Starts", "expected_unseen", "expects_few_better"]
