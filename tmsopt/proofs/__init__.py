"""Proofs: an exceptional point exists (interval Newton in balls), no better design does (branch and bound).

In: a solution. Out: a `Proof`, every number with its radius, or the solution with a proved bound. Open `proof` first,
then `certify`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
