"""Motion: what a design does after a push, a lean or noise, exactly, and the shapes of its modes.

In: a design and what sets it moving. Out: a `Simulation`: columns over time, peaks, settling times, mode shapes. Open
`simulate` first; `system` has the matrices, `flow` the matrix exponentials.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
