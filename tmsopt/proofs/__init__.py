"""Proofs that an exceptional point exists (interval Newton in balls) and that no better design does (branch and bound).

The input is a solution. The result is a `Proof`, whose numbers have radii, or the solution with a proved bound. Open
`proof` first, then `certify`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
