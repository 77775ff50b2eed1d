"""How far a design is from weave, capsize, infinity and heavy damping: the robustness radius.

In: a design with weights on its parameters. Out: the nearest point of each boundary, and the radius. Open `nearest`
first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
