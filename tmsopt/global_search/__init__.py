"""Questions about whole boxes, is any design as good as a limit (SCIP), are these all (intervals).

In: a `Question`, or a problem that leaves no freedom. Out: an `Answer`, no or a design; every design with its proof, as
`Completeness`. Open `question` first, then `complete`; `race` runs SCIP in a process of its own.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
