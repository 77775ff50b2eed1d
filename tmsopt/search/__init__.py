"""Search for designs: a sample of the box, local solves, rescues, remedies, all designs.

The input is a `Problem`. The result is a rechecked `Solution`, or the least change of limits that makes a solution
possible. A *rescue* is an extra stage for hard problems; a *remedy* is a change of limits for an infeasible problem.
Open `policy` first, which holds the loop. Then read `search`, which fills in its stages, and `solve`, which makes the
`Solution`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
