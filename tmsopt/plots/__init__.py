"""Results as figures, drawn with Matplotlib.

In: results of any verb. Out: Axes, each `draw_…` on those given or in a figure of its own; figures, saved whole or not
at all. Open `growth` first; `paper` has the figures of the source.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
