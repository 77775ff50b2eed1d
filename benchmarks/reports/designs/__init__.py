"""Reports on designs: how often, how well and how fast problems are solved.

In: a suite of problems. Out: pages of Markdown. Open `random_designs` first, then `solving`; `references` looks for
the best values that the others are measured by.
"""

from benchmarks.reports.designs.references import Settings, best_of, reference, run
from benchmarks.reports.designs.solving import details, overview

__all__ = ["Settings", "best_of", "details", "overview", "reference", "run"]
