"""Results as figures, drawn with Matplotlib.

Input: a result of `tmsopt`. Each `draw_…` draws the result on given Axes or in a new figure, and returns the Axes; each
`…_figure` returns a figure. `save` writes a complete file or nothing. Read `growth` first; `paper` has the figures of
the paper.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
