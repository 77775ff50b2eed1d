"""Estimates how many optima a search from many starts has missed.

In: the number of searches and of different optima found. Out: statistical estimates. Open `starts`.
"""

from tmsopt.problem.searches.starts import Starts, expected_unseen, expects_few_better

__all__ = ["Starts", "expected_unseen", "expects_few_better"]
