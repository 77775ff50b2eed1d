"""The report of a solution: the answer on one screen, and all the rest on request.

In: a `Solution` and what was found out about it, `Findings`. Out: lines of text. Open `design` first: its parts and
their order; of its rows, `rows`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
