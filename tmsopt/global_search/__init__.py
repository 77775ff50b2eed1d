"""Searches of a whole box: SCIP decides whether any design reaches a limit, intervals find all designs with a pattern.

The input is a `Question`, or a problem with as many conditions as free parameters. The result is an `Answer`, or a
`Completeness` with every design. Open `question` first, then `completeness`; `race` runs SCIP in separate processes.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
