"""Solve: parts of the box, starts, outcome, relaxation, all designs.

In: a `Problem`. Out: a `Solution` that was rechecked, or the least that would have to give. Open `solve` first, then
`search`.
"""

from tmsopt.solver.all_designs import Every, coverage_of, solve_all
from tmsopt.solver.multistart import same
from tmsopt.solver.solve import solve, solved
from tmsopt.solver.workspace import Family, Workspace, workspace

__all__ = ["Every", "Family", "Workspace", "coverage_of", "same", "solve", "solve_all", "solved", "workspace"]
