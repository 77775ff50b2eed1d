from .interlacing import (
    add_interlacing as add_interlacing, frequency_count as frequency_count,
    interlacing_conditions as interlacing_conditions, squared_frequencies as squared_frequencies,
)
from .question import Question as Question
from .race import SolverPool as SolverPool
from .scip import SCIP as SCIP
from .stability import Stability as Stability, find_stable_design as find_stable_design
from .tasks import (
    FOUND as FOUND, INFEASIBLE as INFEASIBLE, UNDECIDED as UNDECIDED, Decision as Decision,
    GlobalSolver as GlobalSolver, SolverFailed as SolverFailed, Task as Task, make_task as make_task,
)
from .completeness import Completeness as Completeness, Undecided as Undecided, prove_completeness as prove_completeness
from .pruning import BoxConditions as BoxConditions, prune as prune
