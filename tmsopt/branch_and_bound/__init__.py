"""Branch and bound: whether any design in the box does as well as a limit, asked of a global solver (SCIP).

In: a `Question`. Out: an `Answer`, no or a design. Open `question` first; `answer` puts it, `tasks` is what a global
solver is asked, `scip` is one, `race` runs it apart, `stability` asks whether any design is stable.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
