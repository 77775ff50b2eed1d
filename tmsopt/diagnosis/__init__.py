"""Diagnose multiple roots: Jordan chains, and how they split when a parameter changes (Puiseux series).

In: a solution. Out: a `Diagnosis` of each multiple root. Open `diagnosis` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
