"""Analysis of a solution: local optimality, the value of limits, the effect of rounding, splitting of multiple roots.

Input: a solution. Output: an `Explanation`, a `Diagnosis` of each multiple root, and the sensitivity of all
`Eigenvalues`, as data that `tmsopt.documents` shows. Open `explain` first, then `diagnosis`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
