"""Diagnose multiple roots: Jordan chains, and how they split when a parameter changes (Puiseux series).

In: a solution. Out: a `Diagnosis` of each multiple root. Open `diagnosis` first.
"""

from tmsopt.diagnosis.diagnosis import Diagnosis, diagnose, diagnosed
from tmsopt.diagnosis.jordan import is_regular, jordan
from tmsopt.diagnosis.puiseux import branches
from tmsopt.diagnosis.splitting import Response

__all__ = ["Diagnosis", "Response", "branches", "diagnose", "diagnosed", "is_regular", "jordan"]
