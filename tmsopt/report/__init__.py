"""Results as text for a reader; nothing is computed here.

In: results of any verb. Out: lines of text. Open `solution.design` first: the report of a solution.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
