"""Millions of quartics at once.

In: arrays of coefficients. Out: factors, abscissae, damping ratios and classes of stability, jointly right beside
exceptional points. Open `quartic` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
