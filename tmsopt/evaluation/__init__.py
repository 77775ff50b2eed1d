"""What a design is, from its parameters alone: no solver's word is taken.

In: a problem and a design. Out: its objective and violations, its worst case, bounds that need no search, proofs over
bands, certified digits, the laws it obeys. Open `recheck` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
