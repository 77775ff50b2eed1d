"""Verdicts: describes a solution in words, from facts only.

In: facts such as an abscissa, Jordan chains, a status. Out: a word or a phrase. Open `stability` first, then `status`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
