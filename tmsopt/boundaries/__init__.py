"""How far a design is from weave, capsize, infinity and heavy damping: the robustness radius.

`nearest` finds the nearest point of one boundary for a design with weighted parameters, `robustness` the points of all.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
