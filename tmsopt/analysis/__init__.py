"""Analysis of a solution: local optimality, the value of limits, the effect of rounding, splitting of multiple roots.

In: a solution. Out: an `Explanation`, and a `Diagnosis` of each multiple root, as data; `tmsopt.documents` shows them.
Open `explain` first, then `diagnosis`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
