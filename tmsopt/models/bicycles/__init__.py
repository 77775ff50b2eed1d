"""The bicycles: two masses on skates (tms) and Whipple's with wheels, by parameters, matrices and quantities.

In: parameters by name. Out: coefficients and quantities in any arithmetic. Open `tms` first: its parameters and their
units; its matrices are in `tms_equations`, what is derived in `tms_quantities`.
"""

from tmsopt.models.bicycles.tms import GRAVITY, copo, from_si, matrices, tms, to_si
from tmsopt.models.bicycles.whipple import canonical, whipple
from tmsopt.models.bicycles.whipple_quantities import spin

__all__ = ["GRAVITY", "canonical", "copo", "from_si", "matrices", "spin", "tms", "to_si", "whipple"]
