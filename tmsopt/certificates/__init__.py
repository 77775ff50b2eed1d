"""Certify: no better design exists in the box, by spatial branch and bound (SCIP).

In: a solution. Out: the solution with a proved bound. Open `certify` first; `tasks` is what a global solver is asked,
`scip` is one, `race` runs it apart.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
