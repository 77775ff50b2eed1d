"""Evaluates a design from its parameters only, without trusting a solver.

Input: a problem and a design. Output: objective and violations, worst case, bounds that need no search, proofs over
bands, certified digits, and the laws that the design obeys. Open `recheck` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
