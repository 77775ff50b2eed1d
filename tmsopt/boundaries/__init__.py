"""How far a design is from weave, capsize, infinity and heavy damping: the robustness radius.

For a design with weighted parameters, `nearest` finds the nearest point of one boundary, and `robustness` the nearest
point of each boundary.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
