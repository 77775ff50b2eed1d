"""Certify: no better design exists in the box, by spatial branch and bound (SCIP).

In: a solution. Out: the solution with a proved bound. Open `certify` first; `question` is what SCIP is asked,
`translation` writes it in SCIP's terms, `race` runs it apart.
"""

from tmsopt.certificates.certify import certify, check_installed
from tmsopt.certificates.interlacing import interlace, interlacing, squares_of, unknowns
from tmsopt.certificates.question import Question
from tmsopt.certificates.race import Crew
from tmsopt.certificates.scip import FOUND, INFEASIBLE, Decision, available, decide, task

__all__ = [
    "FOUND", "INFEASIBLE", "Crew", "Decision", "Question", "available", "certify", "check_installed", "decide",
    "interlace", "interlacing", "squares_of", "task", "unknowns",
]  # fmt: skip
