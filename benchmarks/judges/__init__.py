"""Judges: what a claimed design is worth, by means that share nothing with the solver.

In: a problem, or a system as text, and a design. Out: its value and violation, and whether a claim holds. Open `grid`
first: eigenvalues over scenarios; `exact` decides at multiple roots, `bands` proves between speeds.
"""

from benchmarks.judges.attempts import EXACT, FEASIBLE, SCALE, SOLVED, Attempt, attempt, started_at
from benchmarks.judges.bands import abscissa_below, highest_abscissa
from benchmarks.judges.designs import Designs, Exactly, exactly
from benchmarks.judges.eigenvalues import Roots, companion, eigenvalues, root_values, worst_roots
from benchmarks.judges.exact import MET, SAME, confirmed, confirmed_system, exact_polynomial, ideals, same, values_of
from benchmarks.judges.grid import Judge, Verdict, verdict
from benchmarks.judges.system import FLOOR, Entries, System
from benchmarks.judges.text import NOWHERE, difference, evaluated

__all__ = [
    "EXACT",
    "FEASIBLE",
    "FLOOR",
    "MET",
    "NOWHERE",
    "SAME",
    "SCALE",
    "SOLVED",
    "Attempt",
    "Designs",
    "Entries",
    "Exactly",
    "Judge",
    "Roots",
    "System",
    "Verdict",
    "abscissa_below",
    "attempt",
    "companion",
    "confirmed",
    "confirmed_system",
    "difference",
    "eigenvalues",
    "evaluated",
    "exact_polynomial",
    "exactly",
    "highest_abscissa",
    "ideals",
    "root_values",
    "same",
    "started_at",
    "values_of",
    "verdict",
    "worst_roots",
]
