from .explain import Explanation as Explanation, explain as explain
from .limits import Lever as Lever, move_limit as move_limit
from .optimality import (
    NOT_COVERED as NOT_COVERED, NOT_MINIMAL as NOT_MINIMAL, STRICT as STRICT, UNDECIDED as UNDECIDED,
    Optimality as Optimality, optimality as optimality,
)
from .rounding import round_design as round_design, list_rounded_designs as list_rounded_designs
from .steps import natural_step as natural_step, step_within as step_within
from .diagnosis import Diagnosis as Diagnosis, diagnose as diagnose, diagnose_roots as diagnose_roots
from .sensitivity import Eigenvalue as Eigenvalue, Eigenvalues as Eigenvalues, eigenvalues as eigenvalues
from .splitting import Response as Response
from .infeasible import infeasible_sentences as infeasible_sentences
from .sentences import bound_lines as bound_lines, proof_line as proof_line, structure_line as structure_line
