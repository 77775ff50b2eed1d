"""Suites: the problems that everything is measured on, and the best values known of them.

In: a number and a seed. Out: the same problem for ever, and what is known of it. Open `random_designs` first; the
JSON files beside the suites hold the values.
"""

from benchmarks.suites.bands import SPEEDS, band_problems
from benchmarks.suites.best_known import (
    HARD,
    OSCILLATORS,
    REFERENCES,
    Known,
    Reference,
    Target,
    known,
    read,
    references,
    targets,
    write,
)
from benchmarks.suites.conflicts import Conflict, conflict, conflicts, moved
from benchmarks.suites.hard_designs import HARD_COUNT, HARD_SEED, hard_family, hard_problem
from benchmarks.suites.paper import EP_SET, HEIGHTS, PLANE, POINTS, PROBLEMS, Point
from benchmarks.suites.random_designs import SEED, TEMPLATES, random_problem
from benchmarks.suites.random_systems import COUNT, random_system, random_systems
from benchmarks.suites.varied_designs import varied_problem

__all__ = [
    "COUNT",
    "EP_SET",
    "HARD",
    "HARD_COUNT",
    "HARD_SEED",
    "HEIGHTS",
    "OSCILLATORS",
    "PLANE",
    "POINTS",
    "PROBLEMS",
    "REFERENCES",
    "SEED",
    "SPEEDS",
    "TEMPLATES",
    "Conflict",
    "Known",
    "Point",
    "Reference",
    "Target",
    "band_problems",
    "conflict",
    "conflicts",
    "hard_family",
    "hard_problem",
    "known",
    "moved",
    "random_problem",
    "random_system",
    "random_systems",
    "read",
    "references",
    "targets",
    "varied_problem",
    "write",
]
