"""Solve: parts of the box, starts, outcome, relaxation, all designs.

In: a `Problem`. Out: a `Solution` that was rechecked, or the least that would have to give. Open `policy` first, which
is the loop; then `search`, where its stages are put together, and `solve`, which makes a `Solution` of what it finds.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
