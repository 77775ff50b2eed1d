"""Rivals: what one would use without the package, on the same problems.

In: a problem or system. Out: where the rival ended, and after how long it was how good. Open `reduced` first: what a
rival sees; `searches` ends by itself, `seekers` until stopped, `race` compares them at equal accuracy.
"""

from benchmarks.rivals.evolution import POINTS, Evolved, Followed, best_known, evolve, evolve_system, least_violation
from benchmarks.rivals.nonsmooth import NONSMOOTH, Poles, poles
from benchmarks.rivals.race import OWN, TOLERANCES, Heat, Moment, Run, heat, median_ratio, own, run
from benchmarks.rivals.reduced import FEASIBLE, Found, Reduced, Watch
from benchmarks.rivals.searches import EVOLUTION, LOCAL, STARTS, differential, local
from benchmarks.rivals.seekers import SEEKERS, Seeker, slopes

__all__ = [
    "EVOLUTION",
    "FEASIBLE",
    "LOCAL",
    "NONSMOOTH",
    "OWN",
    "POINTS",
    "SEEKERS",
    "STARTS",
    "TOLERANCES",
    "Evolved",
    "Followed",
    "Found",
    "Heat",
    "Moment",
    "Poles",
    "Reduced",
    "Run",
    "Seeker",
    "Watch",
    "best_known",
    "differential",
    "evolve",
    "evolve_system",
    "heat",
    "least_violation",
    "local",
    "median_ratio",
    "own",
    "poles",
    "run",
    "slopes",
]
