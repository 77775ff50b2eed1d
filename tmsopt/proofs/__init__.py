"""Prove: the exceptional point exists, by interval Newton in ball arithmetic.

In: a solution. Out: a `Proof`: every number with its radius, or the reason why not. Open `proof` first, then
`existence`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
