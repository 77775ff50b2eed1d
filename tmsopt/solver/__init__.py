"""Solve: parts of the box, starts, outcome, relaxation, all designs.

In: a `Problem`. Out: a `Solution` that was rechecked, or the least that would have to give. Open `solve` first, then
`search`.
"""

from tmsopt.solver.all_designs import Every, coverage_of, solve_all
from tmsopt.solver.box import sides
from tmsopt.solver.multistart import same
from tmsopt.solver.solve import solve, solved
from tmsopt.solver.workspace import Family

__all__ = [
    "Every",
    "Family",
    "coverage_of",
    "same",
    "sides",
    "solve",
    "solve_all",
    "solved",
]
