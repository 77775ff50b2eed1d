from .certify import certify as certify, check_installed as check_installed
from .interlacing import (
    interlace as interlace,
    interlacing as interlacing,
    squares_of as squares_of,
    unknowns as unknowns,
)
from .question import Question as Question
from .race import Crew as Crew
from .scip import (
    FOUND as FOUND,
    INFEASIBLE as INFEASIBLE,
    Decision as Decision,
    available as available,
    decide as decide,
    task as task,
)
