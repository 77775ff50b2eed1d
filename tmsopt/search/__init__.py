"""Search for designs: a sample of the box, local solves, rescues, remedies, all designs.

In: a `Problem`. Out: a rechecked `Solution`, or the least change of limits that makes one possible. Open `policy`
first: it holds the loop. Then read `search`, which puts its stages together, and `solve`, which makes the `Solution`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
