"""A design problem as a smooth nonlinear program by factors, and IPOPT on it.

In: a `Problem`. Out: an `NLP` with functions, bounds and units, starting points, runs of IPOPT, and points polished
by Newton. Open `formulate` first: the three forms; `builder` puts them together, `ipopt` alone calls the solver.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
