from .explain import Explanation as Explanation, explain as explain
from .limits import Lever as Lever, moved as moved
from .optimality import (
    NOT_COVERED as NOT_COVERED, NOT_MINIMAL as NOT_MINIMAL, STRICT as STRICT, UNDECIDED as UNDECIDED,
    Optimality as Optimality, optimality as optimality,
)
from .rounding import rounded as rounded, rounded_designs as rounded_designs
from .summary import faster_than as faster_than, none_of as none_of
from .steps import natural_step as natural_step, step_within as step_within
from .diagnosis import Diagnosis as Diagnosis, diagnose as diagnose, diagnosed as diagnosed
from .puiseux import branches as branches
from .splitting import Response as Response
from .infeasible import infeasible_sentences as infeasible_sentences
from .sentences import bound_lines as bound_lines, proof_line as proof_line, structure_line as structure_line
