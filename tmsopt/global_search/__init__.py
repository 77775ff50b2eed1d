"""Searches of a whole box: does any design reach a limit (SCIP), are these all designs with a pattern (intervals).

In: a `Question`, or a problem with as many conditions as free parameters. Out: an `Answer`, or a `Completeness` with
every design. Open `question` first, then `completeness`; `race` runs SCIP in separate processes.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
