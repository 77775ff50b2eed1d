"""Equivalence: what the program said at a fixed commit, and how what it says now compares.

In: a checkout. Out: its answers to some 2,000 cases (`answer_all`), compared with those in ``net.json.xz``
(`compare`). Open `cases` first.
"""

from benchmarks.suites.equivalence.answers import answer_all
from benchmarks.suites.equivalence.cases import CASES, Case
from benchmarks.suites.equivalence.comparison import Difference, compare, read_net, write_net

__all__ = ["CASES", "Case", "Difference", "answer_all", "compare", "read_net", "write_net"]
