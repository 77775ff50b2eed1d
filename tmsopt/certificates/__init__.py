"""Certify: no better design exists in the box, by spatial branch and bound (SCIP).

In: a solution. Out: the solution with a proved bound, or a better one. Open `certify`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
