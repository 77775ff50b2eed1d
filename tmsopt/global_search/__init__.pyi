from .interlacing import (
    interlace as interlace, interlacing as interlacing, squares_of as squares_of, unknowns as unknowns,
)
from .question import Question as Question
from .race import SolverPool as SolverPool
from .scip import SCIP as SCIP
from .stability import Stability as Stability, any_stable as any_stable
from .tasks import (
    FOUND as FOUND, INFEASIBLE as INFEASIBLE, UNDECIDED as UNDECIDED, Decision as Decision, Failed as Failed,
    GlobalSolver as GlobalSolver, Task as Task, task as task,
)
from .complete import Completeness as Completeness, Undecided as Undecided, completeness as completeness
from .pruning import Puzzle as Puzzle, prune as prune
