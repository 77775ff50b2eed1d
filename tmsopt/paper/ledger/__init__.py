"""A ledger of every number and every verifiable statement of the source paper; each is recomputed independently.

In: the paper's claims in `claims.toml`. Out: a `Ledger` with a verdict on each claim. Read `claims` first: it explains
how to add a claim.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
