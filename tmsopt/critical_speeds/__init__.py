"""Speeds: every weave, capsize and meeting speed of a design, exactly; growth rates over speed.

In: a design, and a parameter that varies. Out: `Speeds`, roots of polynomials of which none is missed, and `Growth`
to draw. Open `speeds` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
