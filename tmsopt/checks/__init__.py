"""What a design is, from its parameters alone: no solver's word is taken.

In: a problem and a design. Out: its objective and violations, its worst case, bounds that need no search, proofs over
bands, certified digits, the laws it obeys. Open `recheck` first.
"""

from tmsopt.checks.bound import omega0_bound, relation_bound
from tmsopt.checks.law_rows import law_rows
from tmsopt.checks.recheck import realised_abscissa, recheck
from tmsopt.checks.worst_case import cover, worst_cases

__all__ = ["cover", "law_rows", "omega0_bound", "realised_abscissa", "recheck", "relation_bound", "worst_cases"]
